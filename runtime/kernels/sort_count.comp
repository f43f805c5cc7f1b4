#version 450
#extension GL_GOOGLE_include_directive : require
#include "common.glsl"
#include "sort.glsl"

shared uint hist[RTR_SORT_BINS];

void main() {
    uint lane = gl_LocalInvocationIndex;
    uint block = group_index();
    if (lane < RTR_SORT_BINS) hist[lane] = 0u;
    barrier();
    for (uint k = 0u; k < RTR_SORT_ITEMS; k++) {
        uint i = block * RTR_SORT_BLOCK + k * RTR_GROUP + lane;
        if (i < p.total) atomicAdd(hist[sort_digit(sort_read(i))], 1u);
    }
    barrier();
    if (block < p.blocks && lane < RTR_SORT_BINS) state[RTR_ST_SUMS + lane * p.blocks + block] = hist[lane];
}
