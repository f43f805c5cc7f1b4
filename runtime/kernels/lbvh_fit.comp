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
    if (i >= n || n < 2u) return;
    uint node = links[p.total + i];
    // At most RTC_MAX_DEPTH turns; the bound also ends a lane if the links were damaged.
    for (uint turn = 0u; turn < 64u; turn++) {
        memoryBarrierBuffer();
        if (atomicAdd(marks[node], 1u) == 0u) return;
        memoryBarrierBuffer();
        uvec4 v = info[node];
        v.w = store_node(node, subtree_of(v.x), subtree_of(v.y), node == 0u);
        info[node].w = v.w;
        node = links[node];
        if (node == 0xffffffffu) return;
    }
}
