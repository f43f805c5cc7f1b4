#version 450
#extension GL_GOOGLE_include_directive : require
// LBVH: which inner nodes survive the collapse, counted by block of RTR_SCAN_BLOCK.
#include "common.glsl"
#include "survive.glsl"

shared uint sum;

void main() {
    uint lane = gl_LocalInvocationIndex;
    if (lane == 0u) sum = 0u;
    barrier();
    uint first = group_index() * RTR_SCAN_BLOCK + lane * RTR_SCAN_ITEMS;
    uint own = 0u;
    for (uint k = 0u; k < RTR_SCAN_ITEMS; k++) own += survives(first + k) ? 1u : 0u;
    atomicAdd(sum, own);
    barrier();
    if (lane == 0u && group_index() < p.blocks) state[RTR_ST_SUMS + group_index()] = sum;
}
