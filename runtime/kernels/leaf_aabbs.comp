#version 450
#extension GL_GOOGLE_include_directive : require
// Boxes of the AABBs of one geometry. Inactive: NaN. An inverted box (an error of the
// application) still gets a box that covers both corners.
#include "common.glsl"
#include "geometry.glsl"
#include "leaf.glsl"

void main() {
    uint i = lane_index();
    bool in_range = i < p.count;
    vec3 lo = vec3(0.0), hi = vec3(0.0);
    bool active_ = false;
    if (in_range && in_range_of_geometry(i)) {
        read_aabb(i, lo, hi);
        active_ = !any_nan(lo) && !any_nan(hi);
    }
    store_leaf(in_range, p.first + i, active_, min(lo, hi), max(lo, hi));
}
