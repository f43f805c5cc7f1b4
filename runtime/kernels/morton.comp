#version 450
#extension GL_GOOGLE_include_directive : require
// Keys of the sort, and how often the first digit has which value where sort_fused.comp wants that.
#include "common.glsl"
#include "morton.glsl"

void main() {
    uint i = lane_index();
    if (i >= p.total) return;
    uint key = morton_key(i);
    pairs_a[i] = uvec2(key, i);
    if (p.total <= RTR_SORT_FUSED)
        atomicAdd(state[RTR_ST_SUMS + (key & (RTR_SORT_BINS - 1u)) * p.blocks + i / RTR_SORT_BLOCK], 1u);
}
