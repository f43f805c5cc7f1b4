#version 450
#extension GL_GOOGLE_include_directive : require
// The first clusters: the active primitives in Morton order.
#include "common.glsl"
#include "ploc.glsl"

void main() {
    uint i = lane_index();
    uint n = state[RTR_ST_ACTIVE];
    if (i < n) links[i] = RTR_CHILD_LEAF | pairs_a[i].y;
    if (i == 0u) {
        write_args(iter_word(0u, RTR_ITER_ARGS), iteration_groups(n));
        state[iter_word(0u, RTR_ITER_COUNT)] = n;
        state[iter_word(0u, RTR_ITER_PARITY)] = 0u;
        state[iter_word(0u, RTR_ITER_NODES)] = 0u;
    }
}
