#version 450
#extension GL_GOOGLE_include_directive : require
// Update, last part: boxes, bottom up. A lane starts at each node with the boxes of its
// leaf children, and the last of a node's arrivals (its own lane and its inner children)
// goes on to the parent; see lbvh_fit.comp.
#define RTR_COHERENT coherent
#include "common.glsl"
#include "facts.glsl"
#include "refit.glsl"

void leaf_child(uint node, uint side, uint ref) {
    uint count = (ref >> RTC_REF_COUNT_SHIFT) & RTC_REF_COUNT_MASK;
    uint first = ref & RTC_REF_INDEX_MASK;
    vec3 lo = vec3(RTR_FLT_MAX), hi = vec3(-RTR_FLT_MAX);
    for (uint s = 0u; s < count; s++) {
        lo = min(lo, leaf_box[2u * (first + s)].xyz);
        hi = max(hi, leaf_box[2u * (first + s) + 1u].xyz);
    }
    if (count != 0u) {
        dst_nodes[4u * node + 2u * side].xyz = floatBitsToUint(lo);
        dst_nodes[4u * node + 2u * side + 1u].xyz = floatBitsToUint(hi);
    }
}

void main() {
    uint i = lane_index();
    uint node = 0xffffffffu;
    if (!fits()) {
        if (i == 0u && dst_header[RTC_HDR_MAGIC] == RTC_AS_MAGIC) dst_header[RTC_HDR_BAD_UPDATE] = RTC_BAD_UPDATE_COUNTS;
        return;
    }
    if (i < dst_header[RTC_HDR_NODE_COUNT]) {
        uint left = dst_nodes[4u * i].w, right = dst_nodes[4u * i + 1u].w;
        if ((left & RTC_REF_LEAF) != 0u) leaf_child(i, 0u, left);
        if ((right & RTC_REF_LEAF) != 0u) leaf_child(i, 1u, right);
        node = i;
    }
    for (uint turn = 0u; turn < 64u && node != 0xffffffffu; turn++) {
        uint left = dst_nodes[4u * node].w, right = dst_nodes[4u * node + 1u].w;
        uint wanted = ((left & RTC_REF_LEAF) == 0u ? 1u : 0u) + ((right & RTC_REF_LEAF) == 0u ? 1u : 0u);
        device_fence();
        uint arrived = atomicAdd(marks[node], 1u);
        device_fence();
        uint next = 0xffffffffu;
        if (arrived == wanted) {
            vec3 lo = uintBitsToFloat(dst_nodes[4u * node].xyz), hi = uintBitsToFloat(dst_nodes[4u * node + 1u].xyz);
            if (left == RTC_REF_EMPTY) {
                lo = vec3(RTR_FLT_MAX);
                hi = vec3(-RTR_FLT_MAX);
            }
            if (right != RTC_REF_EMPTY) {
                lo = min(lo, uintBitsToFloat(dst_nodes[4u * node + 2u].xyz));
                hi = max(hi, uintBitsToFloat(dst_nodes[4u * node + 3u].xyz));
            }
            next = links[node];
            if (next != 0xffffffffu) {
                uint side = dst_nodes[4u * next].w == node ? 0u : 1u;
                dst_nodes[4u * next + 2u * side].xyz = floatBitsToUint(lo);
                dst_nodes[4u * next + 2u * side + 1u].xyz = floatBitsToUint(hi);
            } else {
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
        }
        node = next;
    }
}
