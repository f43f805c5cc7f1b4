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
