#version 450
#extension GL_GOOGLE_include_directive : require
// Top-down pass over the nodes of one iteration, from the last iteration to the first.
#include "common.glsl"
#include "ploc.glsl"
#include "ploc_down.glsl"

void main() {
    uint node = state[iter_word(p.step, RTR_ITER_NODES)] + lane_index();
    if (node < state[iter_word(p.step + 1u, RTR_ITER_NODES)]) hand_down(node);
}
