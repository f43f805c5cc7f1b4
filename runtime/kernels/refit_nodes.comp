#version 450
#extension GL_GOOGLE_include_directive : require
// Update, last part: boxes, bottom up. A lane starts at each node with the boxes of its
// leaf children, and the last of a node's arrivals (its own lane and its inner children)
// goes on to the parent; see lbvh_fit.comp.
#define RTR_COHERENT coherent
#include "common.glsl"
#include "refit.glsl"
#include "refit_tree.glsl"

void leaf_child(uint node, uint side, uint ref) {
    vec3 lo, hi;
    if (!slots_box(ref, lo, hi)) return;
    dst_nodes[4u * node + 2u * side].xyz = floatBitsToUint(lo);
    dst_nodes[4u * node + 2u * side + 1u].xyz = floatBitsToUint(hi);
}

void main() {
    uint i = lane_index();
    uint node = 0xffffffffu;
    if (!fits()) {
        if (i == 0u) refuse_update();
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
                finish_header(lo, hi);
            }
        }
        node = next;
    }
}
