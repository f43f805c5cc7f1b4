#version 450
#extension GL_GOOGLE_include_directive : require
// Keys of the sort.
#include "common.glsl"
#include "morton.glsl"

void main() {
    uint i = lane_index();
    if (i < p.total) pairs_a[i] = uvec2(morton_key(i), i);
}
