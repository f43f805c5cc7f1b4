#version 450
#extension GL_GOOGLE_include_directive : require
// First dispatch of a build: the state words.
#include "common.glsl"

void main() {
    uint lane = gl_LocalInvocationIndex;
    for (uint i = lane; i < RTR_ST_SUMS; i += RTR_GROUP) state[i] = 0u;
    barrier();
    if (lane < 3u) {
        state[RTR_ST_CENTER_MIN + lane] = 0xffffffffu;
        state[RTR_ST_CENTER_MAX + lane] = 0u;
    }
    if (lane == 3u) state[RTR_ST_OFFENDER] = 0xffffffffu;
    if (lane == 4u) state[RTR_ST_BAD_INSTANCE] = 0xffffffffu;
    if (lane == 5u) state[RTR_ST_BAD_UPDATE] = 0xffffffffu;
    if (lane >= RTR_ST_OFFENDERS && lane < RTR_ST_OFFENDERS + 12u) state[lane] = 0xffffffffu;
}
