#version 450
#extension GL_GOOGLE_include_directive : require
// A pass of the sort in one dispatch: what sort_count, sort_scan and sort_scatter do for more
// than RTR_SORT_FUSED pairs. Histograms of blocks by digit, one a pass, wait in the sums: morton.comp
// filled the first, and whoever writes a pair counts it for the pass after. Every workgroup sums up
// for itself what lies before its own pairs. A dispatch with its barrier is what sorting some
// ten thousand pairs is made of.
#include "common.glsl"
#include "sort.glsl"

const uint MOST_WORDS = RTR_SORT_BINS * (RTR_SORT_FUSED / RTR_SORT_BLOCK);
const uint RUN = MOST_WORDS / 64u;

shared uint counts[(RTR_SORT_BINS / 2u) * 256u]; // see sort_scatter.comp
shared uint runs[256];
shared uint words[MOST_WORDS];
shared uint word_runs[64];
shared uint starts[RTR_SORT_BINS];

uint histogram(uint pass) { return RTR_ST_SUMS + pass * RTR_SORT_BINS * p.blocks; }

void main() {
    uint lane = gl_LocalInvocationIndex;
    uint block = group_index();
    uint first = block * RTR_SORT_BLOCK + lane * RTR_SORT_ITEMS;
    uint pass = p.step / RTR_SORT_BITS;
    for (uint i = lane; i < MOST_WORDS; i += RTR_GROUP)
        words[i] = i < RTR_SORT_BINS * p.blocks ? state[histogram(pass) + i] : 0u;
    for (uint w = 0u; w < RTR_SORT_BINS / 2u; w++) counts[w * 256u + lane] = 0u;
    for (uint k = 0u; k < RTR_SORT_ITEMS; k++) {
        if (first + k < p.total) {
            uint d = sort_digit(sort_read(first + k));
            counts[(d >> 1) * 256u + lane] += 1u << (16u * (d & 1u));
        }
    }
    barrier();
    // Exclusive scan over the lanes of each word, see sort_scatter.comp.
    uint at = (lane >> 5) * 256u + (lane & 31u) * 8u;
    uint sum = 0u;
    for (uint j = 0u; j < 8u; j++) sum += counts[at + j];
    runs[lane] = sum;
    if (lane < 64u) {
        uint total = 0u;
        for (uint j = 0u; j < RUN; j++) total += words[lane * RUN + j];
        word_runs[lane] = total;
    }
    barrier();
    if (lane < RTR_SORT_BINS / 2u) {
        uint before = 0u;
        for (uint j = 0u; j < 32u; j++) {
            uint v = runs[lane * 32u + j];
            runs[lane * 32u + j] = before;
            before += v;
        }
    } else if (lane >= 32u && lane < 32u + RTR_SORT_BINS) {
        uint to = (lane - 32u) * p.blocks + block, before = 0u;
        for (uint j = 0u; j < to / RUN; j++) before += word_runs[j];
        for (uint j = to / RUN * RUN; j < to; j++) before += words[j];
        starts[lane - 32u] = before;
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
            uint to = starts[d] + ((counts[(d >> 1) * 256u + lane] >> shift) & 0xffffu);
            counts[(d >> 1) * 256u + lane] += 1u << shift;
            sort_write(to, v);
            if (pass + 1u < 32u / RTR_SORT_BITS) {
                uint next = (v.x >> (p.step + RTR_SORT_BITS)) & (RTR_SORT_BINS - 1u);
                atomicAdd(state[histogram(pass + 1u) + next * p.blocks + to / RTR_SORT_BLOCK], 1u);
            }
        }
    }
}
