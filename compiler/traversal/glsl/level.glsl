// Entering a level: the ray in the level's space and all that traversal
// derives from it once instead of at every step. One copy serves the top
// level, instances, and rays that resume.

bool rtc_holds_aabbs(uint facts) {
    return RTC_LINK_MIXED ? (facts & RTC_FACT_AABBS) != 0u : !RTC_LINK_TRIANGLES;
}

// Opacity and facing: instance flags, then ray flags (Vulkan: ray opacity
// culling, ray face culling).
uint rtc_level_bits(uint facts, uint instance_flags) {
    uint bits = rtc_holds_aabbs(facts) ? RTC_LEVEL_AABBS : 0u;
    instance_flags = RTC_LINK_INSTANCE_FLAGS ? instance_flags : 0u;
    if ((instance_flags & RTC_INSTANCE_FORCE_OPAQUE) != 0u) {
        bits |= RTC_LEVEL_FORCE | RTC_LEVEL_OPAQUE;
    } else if ((instance_flags & RTC_INSTANCE_FORCE_NO_OPAQUE) != 0u) {
        bits |= RTC_LEVEL_FORCE;
    }
    if ((rtc_ray_flags & RTC_RAY_OPAQUE) != 0u) {
        bits |= RTC_LEVEL_FORCE | RTC_LEVEL_OPAQUE;
    } else if ((rtc_ray_flags & RTC_RAY_NO_OPAQUE) != 0u) {
        bits = (bits & ~RTC_LEVEL_OPAQUE) | RTC_LEVEL_FORCE;
    }
    if ((instance_flags & RTC_INSTANCE_TRIANGLE_FRONT_CCW) != 0u) {
        bits |= RTC_LEVEL_FLIP;
    }
    if ((instance_flags & RTC_INSTANCE_TRIANGLE_CULL_DISABLE) == 0u) {
        bits |= (rtc_ray_flags & RTC_RAY_CULL_FRONT) != 0u ? RTC_LEVEL_CULL_FRONT : 0u;
        bits |= (rtc_ray_flags & RTC_RAY_CULL_BACK) != 0u ? RTC_LEVEL_CULL_BACK : 0u;
    }
    return bits;
}

void rtc_level_setup() {
    bool root = rtc_trav_cur == RTC_REF_ENTER;
    bool top = RTC_LINK_LEVELS && rtc_trav_instance == RTC_NONE;
    bool enter = true;
    RtcBase base = rtc_ray_root;
    uint bits = 0u;
    vec3 o = rtc_ray_origin;
    vec3 d = rtc_ray_direction * rtc_t_down();
#ifdef RTC_CHECKED
    bool there = top || rtc_check_instance(rtc_trav_instance);
    rtc_level_visits = root && !top ? 0u : rtc_level_visits;
#endif
    if (!top) {
#ifdef RTC_CHECKED
        RtcBase record = there ? rtc_instance_record(rtc_ray_root, rtc_trav_instance) : rtc_ray_root;
#else
        RtcBase record = rtc_instance_record(rtc_ray_root, rtc_trav_instance);
#endif
        uvec4 ids = rtc_quad(record, 6u);
        uint facts = rtc_quad(record, 7u).x;
        base = rtc_base(ids.x, ids.y);
        bits = rtc_level_bits(facts, ids.w >> 24u);
        bool aabbs = (bits & RTC_LEVEL_AABBS) != 0u;
        uint skip = aabbs ? RTC_RAY_SKIP_AABBS : RTC_RAY_SKIP_TRIANGLES;
        uint mask = RTC_LINK_MASKS ? ids.z >> 24u : 0xffu;
        enter = !rtc_is_null(base) && (mask & rtc_ray_mask) != 0u && (rtc_ray_flags & skip) == 0u &&
                (aabbs ? RTC_LINK_AABBS : RTC_LINK_TRIANGLES);
        if (RTC_LINK_TRANSFORMS && (facts & RTC_FACT_IDENTITY_TRANSFORMS) == 0u) {
            vec4 r0 = uintBitsToFloat(rtc_quad(record, 0u));
            vec4 r1 = uintBitsToFloat(rtc_quad(record, 1u));
            vec4 r2 = uintBitsToFloat(rtc_quad(record, 2u));
            o = rtc_transform_point(r0, r1, r2, o);
            d = rtc_transform_vector(r0, r1, r2, d);
            // A singular or overflowing transform leaves no ray to follow.
            float largest = rtc_largest(d);
            enter = enter && largest > 0.0 && rtc_finite(largest);
        }
    }
#ifdef RTC_CHECKED
    enter = enter && there;
    if (enter) {
        enter = rtc_check_header(base, top ? RTC_AS_KIND_TOP : RTC_AS_KIND_BOTTOM);
        // The instance's record says how large slots are.
        enter = enter && (top || ((rtc_quad(base, RTC_HDR_FACTS / 4u)[RTC_HDR_FACTS & 3u] & RTC_FACT_AABBS) != 0u) ==
                                     ((bits & RTC_LEVEL_AABBS) != 0u));
        if (!enter) {
            rtc_bad_memory(RTC_BAD_HEADER, rtc_trav_instance);
        }
    }
#endif
    if (enter) {
        uvec4 header = rtc_quad(base, RTC_HDR_NODES / 4u); // nodes, slots, node count, slot count
        rtc_trav_base = base;
        rtc_trav_slots = header.y;
        uint all_bits = (1u << RTC_WORD_AXIS_SHIFT) - (1u << RTC_WORD_BITS_SHIFT);
        rtc_trav_word = (rtc_trav_word & ~all_bits) | bits;
        rtc_trav_origin = o;
        rtc_trav_direction = d;
        rtc_level_numbers(base, o, d, top);
        rtc_trav_cur = root ? (header.z == 0u ? RTC_REF_EMPTY : 0u) : RTC_REF_POP;
    } else {
        // Nothing of the top level's data was touched: carry on there.
        rtc_trav_instance = RTC_NONE;
        rtc_set_floor(0u);
        rtc_trav_cur = RTC_REF_POP;
    }
    RTC_CHECK(rtc_trav_cur = rtc_bad != 0u ? RTC_REF_DONE : rtc_trav_cur;)
}
