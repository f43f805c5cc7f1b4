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
    uint children = 0u; // of `node`, inner ones
    if (i < dst_header[RTC_HDR_NODE_COUNT]) {
        uint left = dst_nodes[4u * i].w, right = dst_nodes[4u * i + 1u].w;
        bool left_leaf = (left & RTC_REF_LEAF) != 0u, right_leaf = (right & RTC_REF_LEAF) != 0u;
        if (left_leaf) leaf_child(i, 0u, left);
        if (right_leaf) leaf_child(i, 1u, right);
        node = i;
        children = (left_leaf ? 0u : 1u) + (right_leaf ? 0u : 1u);
    }
    // GPUs wait for memory at each turn, a tree's height times: so nothing is read before the count that could be
    // read after it, all at once.
    for (uint turn = 0u; turn < 64u && node != 0xffffffffu; turn++) {
        uint next = 0xffffffffu;
        if (children == 0u || last_arrival(node, children)) { // 0: nobody else comes here
            uint link = links[node];
            uvec4 q0 = dst_nodes[4u * node], q1 = dst_nodes[4u * node + 1u];
            uvec4 q2 = dst_nodes[4u * node + 2u], q3 = dst_nodes[4u * node + 3u];
            vec3 lo = uintBitsToFloat(q0.xyz), hi = uintBitsToFloat(q1.xyz);
            if (q0.w == RTC_REF_EMPTY) {
                lo = vec3(RTR_FLT_MAX);
                hi = vec3(-RTR_FLT_MAX);
            }
            if (q1.w != RTC_REF_EMPTY) {
                lo = min(lo, uintBitsToFloat(q2.xyz));
                hi = max(hi, uintBitsToFloat(q3.xyz));
            }
            if (link != 0xffffffffu) {
                next = link >> RTR_LINK_SHIFT;
                children = link_children(link);
                uint at = 4u * next + 2u * (link & RTR_LINK_RIGHT);
                dst_nodes[at].xyz = floatBitsToUint(lo);
                dst_nodes[at + 1u].xyz = floatBitsToUint(hi);
            } else {
                finish_header(lo, hi);
            }
        }
        node = next;
    }
}
