// Laboratory only: binary nodes of 32 bytes whose boxes are whole numbers of 16 bits on a grid over the structure
// (RTC_LAB_NODES 16), or of 8 bits on a coarser grid of each node's own within that one (8). small_nodes.cpp writes
// them: what decodes here contains the box of 32 bits.
vec3 rtc_lab_origin, rtc_lab_step; // of the grid of the structure below
uint rtc_lab_grid_of = 0u;

uvec3 rtc_lab_low(uvec3 words) { return uvec3(words.x & 0xffffu, words.x >> 16u, words.y & 0xffffu); }
uvec3 rtc_lab_high(uvec3 words) { return uvec3(words.y >> 16u, words.z & 0xffffu, words.z >> 16u); }

// The product is exact, the step being a power of two; the sum is rounded, as on the host.
vec3 rtc_lab_place(uvec3 cells) { return rtc_lab_origin + vec3(cells) * rtc_lab_step; }

uint rtc_test_node() {
    uint first = rtc_trav_base + RTC_AS_HEADER_QUADS; // two quads of the grid, then nodes
    if (rtc_trav_base != rtc_lab_grid_of) {
        rtc_lab_grid_of = rtc_trav_base;
        rtc_lab_origin = uintBitsToFloat(rtc_quad(first, 0u).xyz);
        rtc_lab_step = uintBitsToFloat(rtc_quad(first, 1u).xyz);
    }
    uint at = first + 2u + rtc_trav_cur * 2u;
    uvec4 q0 = rtc_quad(at, 0u);
    uvec4 q1 = rtc_quad(at, 1u);
#if RTC_LAB_NODES == 16
    uvec3 low0 = rtc_lab_low(q0.xyz), high0 = rtc_lab_high(q0.xyz);
    uvec3 low1 = rtc_lab_low(q1.xyz), high1 = rtc_lab_high(q1.xyz);
#else
    uvec3 origin = uvec3(q1.x & 0xffffu, q1.x >> 16u, q1.y & 0xffffu);
    uvec3 shift = uvec3(q1.y >> 16u, q1.y >> 20u, q1.y >> 24u) & uvec3(15u);
    uvec3 low0 = (uvec3(q0.x, q0.x >> 8u, q0.x >> 16u) & uvec3(255u)) << shift;
    uvec3 high0 = (uvec3(q0.x >> 24u, q0.y, q0.y >> 8u) & uvec3(255u)) << shift;
    uvec3 low1 = (uvec3(q0.y >> 16u, q0.y >> 24u, q0.z) & uvec3(255u)) << shift;
    uvec3 high1 = (uvec3(q0.z >> 8u, q0.z >> 16u, q0.z >> 24u) & uvec3(255u)) << shift;
    low0 += origin;
    high0 += origin;
    low1 += origin;
    high1 += origin;
#endif
    float near0, near1;
    bool hit0 = rtc_slab(rtc_lab_place(low0), rtc_lab_place(high0), near0);
    bool hit1 = rtc_slab(rtc_lab_place(low1), rtc_lab_place(high1), near1);
    hit0 = hit0 && (q0.w >> RTC_REF_COUNT_SHIFT) != (RTC_REF_EMPTY >> RTC_REF_COUNT_SHIFT);
    hit1 = hit1 && (q1.w >> RTC_REF_COUNT_SHIFT) != (RTC_REF_EMPTY >> RTC_REF_COUNT_SHIFT);
    bool second = hit1 && (!hit0 || near1 < near0);
    rtc_trav_cur = mix(mix(RTC_REF_POP, q0.w, hit0), q1.w, second);
    uint result = RTC_STEP_RUNNING;
    if (hit0 && hit1) {
        if (rtc_sp() < RTC_STACK_ENTRIES) {
            rtc_stack_set(rtc_sp(), mix(q1.w, q0.w, second));
            rtc_trav_word++;
        } else {
            result = RTC_STEP_OVERFLOW;
        }
    }
    return result;
}
