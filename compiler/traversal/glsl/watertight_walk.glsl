// Tier `watertight`: what the walk's loop does with a triangle, and what it leaves for later.
//
// The loop asks floats (rtc_verdict). What they leave open waits until all lanes of a group have left the loop
// (RTC_STEP_UNDECIDED): it is rare, and what it needs is not kept in registers while rays walk.
#define RTC_TIER_DEFERS

uint rtc_test_triangle(uint slot) {
    RTC_CHECK(slot = rtc_checked_slot(slot);)
    RtcBase at = rtc_advance(rtc_trav_base, rtc_trav_slots + slot * RTC_TRIANGLE_QUADS);
    uvec4 q0 = rtc_quad(at, 0u);
    uvec4 q1 = rtc_quad(at, 1u);
    uvec4 q2 = rtc_quad(at, 2u);
    vec3 a = rtc_sheared(uintBitsToFloat(q0.xyz));
    vec3 b = rtc_sheared(uintBitsToFloat(q1.xyz));
    vec3 c = rtc_sheared(uintBitsToFloat(q2.xyz));
    float e0 = c.x * b.y - c.y * b.x;
    float e1 = a.x * c.y - a.y * c.x;
    float e2 = b.x * a.y - b.y * a.x;
    float det = (e0 + e1) + e2;
    uint verdict = rtc_verdict(e0, e1, e2, det);
    uint result = verdict == RTC_VERDICT_UNDECIDED ? RTC_STEP_UNDECIDED : RTC_STEP_RUNNING;
    if (verdict == RTC_VERDICT_HIT) {
        float t, b1, b2;
        bool front;
        rtc_triangle_hit(vec3(a.z, b.z, c.z), e1, e2, det, t, b1, b2, front);
        result = rtc_meet_triangle(slot, q0.w, q1.w, t, b1, b2, front);
    }
    return result;
}

// The same, exactly, for a triangle that was undecided. One vertex a turn, and the edge between it and the one before:
// code in one place is what drivers that run it with all lanes off (lavapipe 22.3) get done soonest, and three edges at
// once would take more registers. Turns 1 to 3 decide what is hit, edge by edge. Turns 4 to 6 find where, which is not
// more exact than floats; their vertices have one scale, that of the largest.
uint rtc_settle_triangle(uint slot) {
    RtcBase at = rtc_advance(rtc_trav_base, rtc_trav_slots + slot * RTC_TRIANGLE_QUADS);
    vec3 v = vec3(0.0);
    float z1 = 0.0, z2 = 0.0; // of the vertices of one and two turns before
    int top = 0;
    float e = 0.0, e2 = 0.0, det = 0.0;
    bool hit = true, positive = false, area = false;
    uint turns = 0u;
    [[dont_unroll]] do {
        vec2 before = v.xy;
        z2 = z1;
        z1 = v.z;
        v = rtc_sheared(uintBitsToFloat(rtc_quad(at, turns % 3u).xyz));
        bool decides = turns < 4u;
        int exponent = decides ? rtc_vertex_exponent(v.x, v.y) : top;
        float p = rtc_power(304 - exponent);
        float q = rtc_power(304 - (decides ? rtc_vertex_exponent(before.x, before.y) : top));
        top = max(top, exponent);
        e = rtc_exact_edge(v.x * p, v.y * p, before.x * q, before.y * q);
        if (turns != 0u && decides) {
            float s = rtc_edge_side(e, v.x, v.y, before.x, before.y);
            hit = s != 0.0 && (turns == 1u || (s > 0.0) == positive);
            area = area || e != 0.0;
            positive = s > 0.0;
        }
        det += decides ? 0.0 : e;
        e2 = turns == 4u ? e : e2;
        turns++;
        rtc_turns++;
    } while (turns < 7u && hit);
    uint result = RTC_STEP_RUNNING;
    if (hit && area) { // v is the first vertex again, before it came the third and the second; e is e1
        // Where all three edges vanish any point of the triangle will do.
        det = abs(det) > 7.888609e-31 ? det : (positive ? 1.0 : -1.0); // 2^-100
        float t, b1, b2;
        bool front;
        rtc_triangle_hit(vec3(v.z, z2, z1), e, e2, det, t, b1, b2, front);
        // Flags are read again rather than kept meanwhile.
        result = rtc_meet_triangle(slot, rtc_quad(at, turns - 7u).w, rtc_quad(at, turns - 6u).w, t, b1, b2, front);
    }
    return result;
}
