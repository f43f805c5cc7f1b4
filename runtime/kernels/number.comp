#version 450
#extension GL_GOOGLE_include_directive : require
// LBVH: encoded index of each surviving inner node, in Morton order; the root gets 0.
#include "common.glsl"
#include "survive.glsl"

shared uint sums[256];

void main() {
    uint lane = gl_LocalInvocationIndex;
    uint first = group_index() * RTR_SCAN_BLOCK + lane * RTR_SCAN_ITEMS;
    bool alive[RTR_SCAN_ITEMS];
    uint own = 0u;
    for (uint k = 0u; k < RTR_SCAN_ITEMS; k++) {
        alive[k] = survives(first + k);
        own += alive[k] ? 1u : 0u;
    }
    sums[lane] = own;
    barrier();
    for (uint d = 1u; d < RTR_GROUP; d <<= 1u) {
        uint v = lane >= d ? sums[lane - d] : 0u;
        barrier();
        sums[lane] += v;
        barrier();
    }
    if (group_index() >= p.blocks) return;
    uint at = state[RTR_ST_SUMS + group_index()] + sums[lane] - own;
    for (uint k = 0u; k < RTR_SCAN_ITEMS; k++) {
        if (alive[k]) {
            out_index[first + k] = at;
            at++;
        } else if (first + k + 1u < state[RTR_ST_ACTIVE]) {
            out_index[first + k] = 0xffffffffu;
        }
    }
}
