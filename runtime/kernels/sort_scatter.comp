#version 450
#extension GL_GOOGLE_include_directive : require
#include "common.glsl"
#include "sort.glsl"

// Per lane and digit: how many the lane holds, two 16-bit counts a word (a block has
// 2048 pairs, so sums stay below 2^16).
shared uint counts[(RTR_SORT_BINS / 2u) * 256u];
shared uint runs[256];

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
    barrier();
    // Exclusive scan over the lanes of each word: 8 words in 32 runs of 8 lanes. A lane
    // sums its run, 8 lanes scan the runs of a word, a lane scans its run. Few barriers:
    // they are dear where a workgroup is a loop over vectors (llvmpipe).
    uint at = (lane >> 5) * 256u + (lane & 31u) * 8u;
    uint sum = 0u;
    for (uint j = 0u; j < 8u; j++) sum += counts[at + j];
    runs[lane] = sum;
    barrier();
    if (lane < RTR_SORT_BINS / 2u) {
        uint before = 0u;
        for (uint j = 0u; j < 32u; j++) {
            uint v = runs[lane * 32u + j];
            runs[lane * 32u + j] = before;
            before += v;
        }
    }
    barrier();
    sum = runs[lane];
    for (uint j = 0u; j < 8u; j++) {
        uint v = counts[at + j];
        counts[at + j] = sum;
        sum += v;
    }
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
