#version 450
#extension GL_GOOGLE_include_directive : require
// Boxes of the radix tree, bottom up: the second lane to reach a node knows that both
// children are finished and goes on; the first one leaves. Nobody waits.
#define RTR_COHERENT coherent
#include "common.glsl"
#include "tree.glsl"

void main() {
    uint i = lane_index();
    uint n = state[RTR_ST_ACTIVE];
    uint node = 0xffffffffu;
    if (i < n && n >= 2u) node = links[p.total + i];
    // At most RTC_MAX_DEPTH turns; the bound also ends a lane if the links were damaged.
    for (uint turn = 0u; turn < 64u && node != 0xffffffffu; turn++) {
        device_fence();
        uint arrived = atomicAdd(marks[node], 1u);
        device_fence();
        uint next = 0xffffffffu;
        if (arrived != 0u) {
            uvec4 v = info[node];
            info[node].w = store_node(node, subtree_of(v.x), subtree_of(v.y), node == 0u);
            next = links[node];
        }
        node = next;
    }
}
