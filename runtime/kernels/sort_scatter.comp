#version 450
#extension GL_GOOGLE_include_directive : require
#include "common.glsl"
#include "sort.glsl"

// Per lane and digit: how many the lane holds, two 16-bit counts a word (a block has
// 2048 pairs, so sums stay below 2^16).
shared uint counts[(RTR_SORT_BINS / 2u) * 256u];

void main() {
    uint lane = gl_LocalInvocationIndex;
    uint block = group_index();
    uint first = block * RTR_SORT_BLOCK + lane * RTR_SORT_ITEMS;
    for (uint w = 0u; w < RTR_SORT_BINS / 2u; w++) counts[w * 256u + lane] = 0u;
    for (uint k = 0u; k < RTR_SORT_ITEMS; k++) {
        if (first + k < p.total) {
            uint d = sort_digit(sort_read(first + k));
            counts[(d >> 1) * 256u + lane] += 1u << (16u * (d & 1u));
        }
    }
    uint own[RTR_SORT_BINS / 2u];
    for (uint w = 0u; w < RTR_SORT_BINS / 2u; w++) own[w] = counts[w * 256u + lane];
    for (uint d = 1u; d < RTR_GROUP; d <<= 1u) {
        barrier();
        uint v[RTR_SORT_BINS / 2u];
        for (uint w = 0u; w < RTR_SORT_BINS / 2u; w++) v[w] = lane >= d ? counts[w * 256u + lane - d] : 0u;
        barrier();
        for (uint w = 0u; w < RTR_SORT_BINS / 2u; w++) counts[w * 256u + lane] += v[w];
    }
    // From inclusive to exclusive; then each lane only touches its own column.
    for (uint w = 0u; w < RTR_SORT_BINS / 2u; w++) counts[w * 256u + lane] -= own[w];
    barrier();
    for (uint k = 0u; k < RTR_SORT_ITEMS; k++) {
        if (first + k < p.total) {
            uvec2 v = sort_read(first + k);
            uint d = sort_digit(v);
            uint shift = 16u * (d & 1u);
            uint before = (counts[(d >> 1) * 256u + lane] >> shift) & 0xffffu;
            counts[(d >> 1) * 256u + lane] += 1u << shift;
            sort_write(state[RTR_ST_SUMS + d * p.blocks + block] + before, v);
        }
    }
}
