// Tier `exact`: what the walk's loop does with a triangle, and what it leaves for later.
//
// In the loop only floats are asked (rtc_filter_triangle). A hit that they prove is committed as an interval of t.
// Pairs and integers wait until all lanes of a group have left the loop: for a triangle that floats do not decide
// (RTC_STEP_UNDECIDED), and once for each ray, for t and the weights of the hit that remained.
#define RTC_TIER_DEFERS

uint rtc_test_triangle(uint slot) {
    RTC_CHECK(slot = rtc_checked_slot(slot);)
    RtcBase at = rtc_advance(rtc_trav_base, rtc_trav_slots + slot * RTC_TRIANGLE_QUADS);
    uvec4 q0 = rtc_quad(at, 0u);
    uvec4 q1 = rtc_quad(at, 1u);
    uvec4 q2 = rtc_quad(at, 2u);
    float low, high;
    bool front;
    uint verdict = rtc_filter_triangle(uintBitsToFloat(q0.xyz), uintBitsToFloat(q1.xyz), uintBitsToFloat(q2.xyz), low,
                                       high, front);
    uint result = verdict == RTC_FILTER_UNDECIDED ? RTC_STEP_UNDECIDED : RTC_STEP_RUNNING;
    // Whatever lies surely out of range is no hit.
    if (verdict == RTC_FILTER_HIT && high > rtc_trav_tmin && low < rtc_trav_tmax) {
        uint opacity = rtc_opacity(q1.w);
        front = front != ((rtc_trav_word & RTC_LEVEL_FLIP) != 0u);
        uint cull = front ? RTC_LEVEL_CULL_FRONT : RTC_LEVEL_CULL_BACK;
        if ((rtc_trav_word & cull) == 0u && opacity != 2u) {
            // Shaders are told t before the walk ends, or are asked: then it is needed now.
            bool wanted = RTC_LINK_AABBS || (RTC_LINK_ANY_HIT && opacity == 0u);
            if (!wanted && low > rtc_trav_tmin && high < rtc_trav_low) {
                rtc_candidate(q0.w, q1.w, opacity);
                rtc_cand_kind = front ? RTC_HIT_KIND_FRONT : RTC_HIT_KIND_BACK;
                rtc_cand_attr0 = 0u;
                rtc_cand_attr1 = 0u;
                rtc_cand_slot = slot;
                rtc_trav_tmax = high;
                rtc_commit();
                rtc_trav_low = low;
            } else {
                result = RTC_STEP_UNDECIDED;
            }
        }
    }
    return result;
}

// Stages 2 and 3, in one place for two purposes, since drivers copy functions to where they are called: the undecided
// triangle under the cursor, and at the end of the walk t and weights of the committed one.
uint rtc_settle(uint result) {
    bool last = result != RTC_STEP_UNDECIDED;
    uint slot = rtc_hit_slot;
    if (last) {
        // The level of the hit.
        RtcBase record = rtc_instance_record(rtc_ray_root, rtc_hit_instance);
        uvec4 ids = rtc_quad(record, 6u);
        rtc_trav_base = rtc_base(ids.x, ids.y);
        rtc_trav_slots = rtc_quad(rtc_trav_base, RTC_HDR_NODES / 4u).y; // nodes, slots, ...
        rtc_trav_origin = rtc_object_ray_origin(rtc_ray_root, rtc_hit_instance, rtc_ray_origin);
        rtc_trav_direction =
            rtc_object_ray_direction(rtc_ray_root, rtc_hit_instance, rtc_ray_direction * rtc_t_down());
        vec3 a = abs(rtc_trav_direction); // as rtc_level_numbers
        rtc_set_axis(a.x > a.y ? (a.x > a.z ? 0u : 2u) : (a.y > a.z ? 1u : 2u));
    } else {
        slot = rtc_next_slot();
    }
    RtcBase at = rtc_advance(rtc_trav_base, rtc_trav_slots + slot * RTC_TRIANGLE_QUADS);
    uvec4 q0 = rtc_quad(at, 0u);
    uvec4 q1 = rtc_quad(at, 1u);
    uvec4 q2 = rtc_quad(at, 2u);
    vec3 v0 = uintBitsToFloat(q0.xyz), v1 = uintBitsToFloat(q1.xyz), v2 = uintBitsToFloat(q2.xyz);
    // Infinite vertices have no exact answer: missed.
    vec3 far = max(max(abs(v0), abs(v1)), abs(v2));
    if (rtc_finite(far.x) && rtc_finite(far.y) && rtc_finite(far.z)) {
        float t, b1, b2;
        bool front;
        bool hit = rtc_exact_triangle(v0, v1, v2, ivec3(last ? 1 : 0), t, b1, b2, front);
        if (last) {
            rtc_trav_tmax = t;
            rtc_trav_low = t;
            rtc_hit_attr0 = floatBitsToUint(b1);
            rtc_hit_attr1 = floatBitsToUint(b2);
        } else if (hit) {
            result = rtc_meet_triangle(slot, q0.w, q1.w, t, b1, b2, front);
        }
    }
    return !last && result == RTC_STEP_UNDECIDED ? RTC_STEP_RUNNING : result;
}

// Whether something is left for rtc_settle when the loop has ended this way.
bool rtc_unsettled(uint result) {
    bool committed = !RTC_LINK_AABBS && rtc_hit_instance != RTC_NONE && rtc_hit_slot != RTC_NONE;
    return RTC_LINK_TRIANGLES && (result == RTC_STEP_UNDECIDED || (result == RTC_STEP_DONE && committed));
}
