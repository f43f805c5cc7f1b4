// Shared by the kernels of updates that go up the tree (refit_nodes.comp, refit_boxes.comp, refit_store.comp).
#include "facts.glsl"

// A node is finished by the last to arrive there: its own lane, which has seen to its leaves, and those that come up
// from its inner children. A link says how many of these the parent has, so that nothing need be read for that.
uint link_children(uint link) { return (link & RTR_LINK_TWO) != 0u ? 2u : 1u; }

bool last_arrival(uint node, uint children) {
    device_fence();
    uint before = atomicAdd(marks[node], 1u);
    device_fence();
    return before == children;
}

// The box of a leaf's slots; false for an empty child.
bool slots_box(uint ref, out vec3 lo, out vec3 hi) {
    uint count = (ref >> RTC_REF_COUNT_SHIFT) & RTC_REF_COUNT_MASK;
    uint first = ref & RTC_REF_INDEX_MASK;
    lo = vec3(RTR_FLT_MAX);
    hi = vec3(-RTR_FLT_MAX);
    for (uint s = 0u; s < count; s++) {
        lo = min(lo, leaf_box[2u * (first + s)].xyz);
        hi = max(hi, leaf_box[2u * (first + s) + 1u].xyz);
    }
    return count != 0u;
}

// By the lane that has finished the root, whose box this is.
void finish_header(vec3 lo, vec3 hi) {
    for (uint k = 0u; k < 3u; k++) {
        dst_header[RTC_HDR_BOUNDS_MIN + k] = floatBitsToUint(lo[k]);
        dst_header[RTC_HDR_BOUNDS_MAX + k] = floatBitsToUint(hi[k]);
    }
    bool recounted = (p.flags & RTR_BUILD_COUNTED) != 0u && state[RTR_ST_ACTIVE] != dst_header[RTC_HDR_ACTIVE_COUNT];
    dst_header[RTC_HDR_BAD_UPDATE] = state[RTR_ST_BAD_UPDATE] != 0xffffffffu ? state[RTR_ST_BAD_UPDATE] + 1u :
                                     recounted ? RTC_BAD_UPDATE_ACTIVE : 0u;
    if ((p.flags & RTR_BUILD_TOP) != 0u) {
        uint n = dst_header[RTC_HDR_ACTIVE_COUNT];
        dst_header[RTC_HDR_FACTS] = top_facts(n);
        for (uint bit = 0u; bit < RTC_HDR_OFFENDERS_END - RTC_HDR_OFFENDERS; bit++)
            dst_header[RTC_HDR_OFFENDERS + bit] = offender(bit, n);
        dst_header[RTC_HDR_FIRST_OFFENDER] = state[RTR_ST_OFFENDER];
        dst_header[RTC_HDR_BAD_INSTANCE] = state[RTR_ST_BAD_INSTANCE] + 1u;
    }
}

// By one lane of an update that does not fit.
void refuse_update() {
    if (dst_header[RTC_HDR_MAGIC] == RTC_AS_MAGIC) dst_header[RTC_HDR_BAD_UPDATE] = RTC_BAD_UPDATE_COUNTS;
}
