#version 450
#extension GL_GOOGLE_include_directive : require
// Compacted size in bytes, as a 64-bit number at word p.step of RTR_ARR_OUT.
#include "common.glsl"

void main() {
    if (gl_LocalInvocationIndex != 0u) return;
    uint quads = dst_header[RTC_HDR_SIZE_QUADS];
    out_index[p.step] = quads << 4;
    out_index[p.step + 1u] = quads >> 28;
}
