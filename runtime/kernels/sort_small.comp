#version 450
#extension GL_GOOGLE_include_directive : require
// Keys and their sort for up to RTR_SORT_SMALL primitives, by one workgroup: what morton and 24
// dispatches of sort_count, sort_scan and sort_scatter do for more. A lane has a run of the pairs,
// as there.
#define RTR_COHERENT coherent
#include "common.glsl"
#include "morton.glsl"

// Per lane and digit: how many the lane holds, two 16-bit counts a word.
shared uint counts[(RTR_SORT_BINS / 2u) * 256u];
shared uint runs[256];
shared uint totals[RTR_SORT_BINS / 2u];
shared uint starts[RTR_SORT_BINS];

uvec2 read_pair(bool odd, uint i) { return odd ? pairs_b[i] : pairs_a[i]; }

void main() {
    uint lane = gl_LocalInvocationIndex;
    uint run = (p.total + RTR_GROUP - 1u) / RTR_GROUP;
    uint first = min(lane * run, p.total), end = min(first + run, p.total);
    for (uint i = first; i < end; i++) pairs_a[i] = uvec2(morton_key(i), i);
    // Scanned in 32 runs of 8 lanes a word, see sort_scatter.comp.
    uint at = (lane >> 5) * 256u + (lane & 31u) * 8u;
    for (uint shift = 0u; shift < 32u; shift += RTR_SORT_BITS) {
        bool odd = ((shift / RTR_SORT_BITS) & 1u) != 0u;
        for (uint w = 0u; w < RTR_SORT_BINS / 2u; w++) counts[w * 256u + lane] = 0u;
        for (uint i = first; i < end; i++) {
            uint d = (read_pair(odd, i).x >> shift) & (RTR_SORT_BINS - 1u);
            counts[(d >> 1) * 256u + lane] += 1u << (16u * (d & 1u));
        }
        barrier();
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
            totals[lane] = before;
        }
        barrier();
        sum = runs[lane];
        for (uint j = 0u; j < 8u; j++) {
            uint v = counts[at + j];
            counts[at + j] = sum;
            sum += v;
        }
        if (lane < RTR_SORT_BINS) {
            uint before = 0u;
            for (uint d = 0u; d < lane; d++) before += (totals[d >> 1] >> (16u * (d & 1u))) & 0xffffu;
            starts[lane] = before;
        }
        barrier();
        for (uint i = first; i < end; i++) {
            uvec2 v = read_pair(odd, i);
            uint d = (v.x >> shift) & (RTR_SORT_BINS - 1u);
            uint half_shift = 16u * (d & 1u);
            uint to = starts[d] + ((counts[(d >> 1) * 256u + lane] >> half_shift) & 0xffffu);
            counts[(d >> 1) * 256u + lane] += 1u << half_shift;
            if (odd) pairs_a[to] = v;
            else pairs_b[to] = v;
        }
        device_fence();
        barrier();
    }
}
