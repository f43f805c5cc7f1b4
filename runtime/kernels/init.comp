#version 450
#extension GL_GOOGLE_include_directive : require
// First dispatch of a build: the state words.
#include "common.glsl"

void main() {
    uint lane = gl_LocalInvocationIndex;
    for (uint i = lane; i < RTR_ST_SUMS; i += RTR_GROUP) state[i] = 0u;
    if (p.total > RTR_SORT_SMALL && p.total <= RTR_SORT_FUSED) {
        uint words = (p.total + RTR_SORT_BLOCK - 1u) / RTR_SORT_BLOCK * RTR_SORT_BINS * (32u / RTR_SORT_BITS);
        if ((p.flags & RTR_BUILD_UPDATE) == 0u)
            for (uint i = lane; i < words; i += RTR_GROUP) state[RTR_ST_SUMS + i] = 0u;
    }
    barrier();
    if (lane < 3u) {
        state[RTR_ST_CENTER_MIN + lane] = 0xffffffffu;
        state[RTR_ST_CENTER_MAX + lane] = 0u;
    }
    if (lane == 3u) state[RTR_ST_OFFENDER] = 0xffffffffu;
    if (lane == 4u) state[RTR_ST_BAD_INSTANCE] = 0xffffffffu;
    if (lane == 5u) state[RTR_ST_BAD_UPDATE] = 0xffffffffu;
    if (lane < RTR_FIT_PASSES * RTR_FIT_LEVELS) state[RTR_ST_LEVELS + RTR_LEVEL_WORDS * lane + 2u] = 1u;
    if (lane >= RTR_ST_OFFENDERS && lane < RTR_ST_OFFENDERS + 12u) state[lane] = 0xffffffffu;
}
