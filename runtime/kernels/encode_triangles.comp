#version 450
#extension GL_GOOGLE_include_directive : require
// The triangles of one geometry into their slots, for one window of slots.
#include "common.glsl"
#include "geometry.glsl"

void main() {
    uint i = lane_index();
    if (i >= p.count) return;
    uint prim = p.first + i;
    if (leaf_box[2u * prim].w == 0.0) return;
    uint slot = state[RTR_ST_ACTIVE] == 1u ? 0u : slot_of[prim];
    if (slot < p.window_first || slot - p.window_first >= p.window_count) return;
    vec3 v0, v1, v2;
    read_triangle(i, v0, v1, v2);
    uint at = (slot - p.window_first) * RTC_TRIANGLE_QUADS;
    dst_slots[at] = uvec4(floatBitsToUint(v0), p.primitive_base + i);
    dst_slots[at + 1u] = uvec4(floatBitsToUint(v1), p.geometry);
    dst_slots[at + 2u] = uvec4(floatBitsToUint(v2), 0u);
}
