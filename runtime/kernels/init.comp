#version 450
#extension GL_GOOGLE_include_directive : require
// First dispatch of a build: the state words.
#include "common.glsl"
#include "init.glsl"

void main() {
    uint lane = gl_LocalInvocationIndex;
    for (uint i = lane; i < RTR_ST_SUMS; i += RTR_GROUP) state[i] = first_state(i);
    if (p.total > RTR_SORT_SMALL && p.total <= RTR_SORT_FUSED) {
        uint words = (p.total + RTR_SORT_BLOCK - 1u) / RTR_SORT_BLOCK * RTR_SORT_BINS * (32u / RTR_SORT_BITS);
        if ((p.flags & RTR_BUILD_UPDATE) == 0u)
            for (uint i = lane; i < words; i += RTR_GROUP) state[RTR_ST_SUMS + i] = 0u;
    }
}
