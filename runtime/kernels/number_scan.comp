#version 450
#extension GL_GOOGLE_include_directive : require
#include "common.glsl"
#include "sums.glsl"

void main() {
    uint total = scan_words(RTR_ST_SUMS, p.blocks);
    scan_words(RTR_ST_SUMS + p.blocks, p.blocks);
    if (gl_LocalInvocationIndex == 0u) state[RTR_ST_NODES] = total;
}
