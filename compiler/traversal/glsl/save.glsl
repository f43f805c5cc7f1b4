// A ray that waits: RTC_TRACE_STATE_WORDS words of lane storage, used stack
// entries last. Only words that are needed are written.
const uint RTC_TRACE_STATE_HEADER = 32u;
#ifdef RTC_TIER_EXACT
#define RTC_KEEPS_SLOT true
#else
#define RTC_KEEPS_SLOT RTC_LINK_POSITIONS
#endif

void rtc_trace_save(uint first_word) {
    uint w = first_word;
    rtc_scratch_store(w, rtc_trav_cur);
    rtc_scratch_store(w + 1u, rtc_trav_word);
    rtc_scratch_store(w + 3u, rtc_trav_instance);
#ifdef RTC_ADDRESS_MODE
    rtc_scratch_store(w + 4u, rtc_ray_root.x);
    rtc_scratch_store(w + 30u, rtc_ray_root.y);
#else
    rtc_scratch_store(w + 4u, rtc_ray_root);
#endif
    rtc_scratch_store(w + 5u, rtc_ray_flags);
    rtc_scratch_store(w + 6u, rtc_ray_mask);
    uint operands = (rtc_ray_sbt_offset & 15u) | (rtc_ray_sbt_stride & 15u) << 4u | rtc_ray_miss << 8u;
    rtc_scratch_store(w + 7u, operands);
    rtc_scratch_store(w + 8u, floatBitsToUint(rtc_ray_origin.x));
    rtc_scratch_store(w + 9u, floatBitsToUint(rtc_ray_origin.y));
    rtc_scratch_store(w + 10u, floatBitsToUint(rtc_ray_origin.z));
    rtc_scratch_store(w + 11u, floatBitsToUint(rtc_ray_tmin));
    rtc_scratch_store(w + 12u, floatBitsToUint(rtc_ray_direction.x));
    rtc_scratch_store(w + 13u, floatBitsToUint(rtc_ray_direction.y));
    rtc_scratch_store(w + 14u, floatBitsToUint(rtc_ray_direction.z));
    rtc_scratch_store(w + 15u, floatBitsToUint(rtc_ray_tmax));
    rtc_scratch_store(w + 16u, floatBitsToUint(rtc_trav_tmax));
    rtc_scratch_store(w + 20u, floatBitsToUint(rtc_hit_t));
    rtc_scratch_store(w + 21u, floatBitsToUint(rtc_trav_tmin));
    rtc_scratch_store(w + 17u, rtc_hit_packed);
    rtc_scratch_store(w + 18u, rtc_hit_instance);
    rtc_scratch_store(w + 19u, rtc_hit_primitive);
    rtc_scratch_store(w + 22u, rtc_hit_attr0);
    rtc_scratch_store(w + 23u, rtc_hit_attr1);
    if (RTC_LINK_AABBS) {
        rtc_scratch_store(w + 24u, rtc_hit_attr2);
        rtc_scratch_store(w + 25u, rtc_hit_attr3);
        rtc_scratch_store(w + 26u, rtc_hit_attr4);
        rtc_scratch_store(w + 27u, rtc_hit_attr5);
        rtc_scratch_store(w + 28u, rtc_hit_attr6);
        rtc_scratch_store(w + 29u, rtc_hit_attr7);
    }
    if (RTC_KEEPS_SLOT) {
        rtc_scratch_store(w + 31u, rtc_hit_slot);
    }
#ifdef RTC_TIER_EXACT
    rtc_scratch_store(w + 2u, floatBitsToUint(rtc_trav_low));
#endif
    w += RTC_TRACE_STATE_HEADER;
    for (uint i = 0u; i < rtc_sp(); ++i) {
        rtc_scratch_store(w + i, rtc_stack_get(i));
        rtc_turns++;
    }
}

void rtc_trace_restore(uint first_word) {
    RTC_CHECK(rtc_check_begin();)
    uint w = first_word;
    rtc_trav_cur = rtc_scratch_load(w);
    rtc_trav_word = rtc_scratch_load(w + 1u);
    rtc_trav_instance = rtc_scratch_load(w + 3u);
#ifdef RTC_ADDRESS_MODE
    rtc_ray_root = uvec2(rtc_scratch_load(w + 4u), rtc_scratch_load(w + 30u));
#else
    rtc_ray_root = rtc_scratch_load(w + 4u);
#endif
    rtc_ray_flags = rtc_scratch_load(w + 5u);
    rtc_ray_mask = rtc_scratch_load(w + 6u);
    uint operands = rtc_scratch_load(w + 7u);
    rtc_ray_sbt_offset = operands & 15u;
    rtc_ray_sbt_stride = (operands >> 4u) & 15u;
    rtc_ray_miss = operands >> 8u;
    rtc_ray_origin.x = uintBitsToFloat(rtc_scratch_load(w + 8u));
    rtc_ray_origin.y = uintBitsToFloat(rtc_scratch_load(w + 9u));
    rtc_ray_origin.z = uintBitsToFloat(rtc_scratch_load(w + 10u));
    rtc_ray_tmin = uintBitsToFloat(rtc_scratch_load(w + 11u));
    rtc_ray_direction.x = uintBitsToFloat(rtc_scratch_load(w + 12u));
    rtc_ray_direction.y = uintBitsToFloat(rtc_scratch_load(w + 13u));
    rtc_ray_direction.z = uintBitsToFloat(rtc_scratch_load(w + 14u));
    rtc_ray_tmax = uintBitsToFloat(rtc_scratch_load(w + 15u));
    rtc_trav_tmax = uintBitsToFloat(rtc_scratch_load(w + 16u));
    rtc_hit_t = uintBitsToFloat(rtc_scratch_load(w + 20u));
    rtc_trav_tmin = uintBitsToFloat(rtc_scratch_load(w + 21u));
    rtc_hit_packed = rtc_scratch_load(w + 17u);
    rtc_hit_instance = rtc_scratch_load(w + 18u);
    rtc_hit_unpack(); // a lane may have stopped between the walk's end and the hit shader
    rtc_hit_primitive = rtc_scratch_load(w + 19u);
    rtc_hit_attr0 = rtc_scratch_load(w + 22u);
    rtc_hit_attr1 = rtc_scratch_load(w + 23u);
    if (RTC_LINK_AABBS) {
        rtc_hit_attr2 = rtc_scratch_load(w + 24u);
        rtc_hit_attr3 = rtc_scratch_load(w + 25u);
        rtc_hit_attr4 = rtc_scratch_load(w + 26u);
        rtc_hit_attr5 = rtc_scratch_load(w + 27u);
        rtc_hit_attr6 = rtc_scratch_load(w + 28u);
        rtc_hit_attr7 = rtc_scratch_load(w + 29u);
    }
    if (RTC_KEEPS_SLOT) {
        rtc_hit_slot = rtc_scratch_load(w + 31u);
    }
#ifdef RTC_TIER_EXACT
    rtc_trav_low = uintBitsToFloat(rtc_scratch_load(w + 2u));
#endif
    w += RTC_TRACE_STATE_HEADER;
    for (uint i = 0u; i < min(rtc_sp(), RTC_TRAVERSAL_STACK); ++i) {
        rtc_stack_set(i, rtc_scratch_load(w + i));
        rtc_turns++;
    }
    rtc_make_level_again(); // a finished ray has none
}
