#version 450
#extension GL_GOOGLE_include_directive : require
// Indirect builds: the ranges of the geometries, p.data_stride bytes apart from p.data_offset of
// in_data on, into the state words from p.ranges on. A lane a geometry.
#include "common.glsl"

void main() {
    uint i = lane_index();
    if (i >= p.count) return;
    for (uint w = 0u; w < RTR_RANGE_WORDS; w++)
        state[p.ranges + RTR_RANGE_WORDS * i + w] = in_data[((p.data_offset + i * p.data_stride) >> 2) + w];
}
