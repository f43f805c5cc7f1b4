#version 450
#extension GL_GOOGLE_include_directive : require
// Boxes of the triangles of one geometry.
#include "common.glsl"
#include "geometry.glsl"
#include "leaf.glsl"

void main() {
    uint i = lane_index();
    bool in_range = i < p.count;
    vec3 v0 = vec3(0.0), v1 = vec3(0.0), v2 = vec3(0.0);
    bool active_ = false;
    if (in_range && in_range_of_geometry(i)) {
        read_triangle(i, v0, v1, v2);
        active_ = triangle_active(v0, v1, v2);
    }
    store_leaf(in_range, p.first + i, active_, min(v0, min(v1, v2)), max(v0, max(v1, v2)));
}
