#version 450
#extension GL_GOOGLE_include_directive : require
// Boxes and costs (fit.glsl), bottom up: the second lane to reach a node knows that both children
// are finished and goes on; the first one leaves. Nobody waits. Each pass adds two
// arrivals to a node, so passes can follow each other without a reset.
//
// Lanes start at the leaves, or (RTR_FIT_LISTED) at the nodes that the last level of lbvh_fit_level
// listed.
#define RTR_COHERENT coherent
#include "common.glsl"
#include "fit.glsl"
#include "fit_list.glsl"

void main() {
    uint i = lane_index();
    uint n = state[RTR_ST_ACTIVE];
    uint node = 0xffffffffu;
    bool ready = false;
    if (p.step == 2u && state[RTR_ST_DEEP] == 0u) return;
    if ((p.flags & RTR_FIT_LISTED) != 0u) {
        ready = i < listed();
        if (ready) node = list[p.window_first + i];
    } else if (i < n && n >= 2u) {
        node = links[p.total + i];
    }
    // A Morton tree has at most 30 + 26 levels, and only nodes up to RTR_HEIGHT_FREE grow:
    // fewer than 128 in all. The bound also ends a lane if the links were damaged.
    for (uint turn = 0u; turn < 128u && node != 0xffffffffu; turn++) {
        if (!ready) {
            device_fence();
            uint arrived = atomicAdd(marks[node], 1u);
            device_fence();
            ready = (arrived & 1u) != 0u;
        }
        node = ready ? finish_node(node) : 0xffffffffu;
        ready = false;
    }
}
