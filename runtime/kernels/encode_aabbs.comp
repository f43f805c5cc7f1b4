#version 450
#extension GL_GOOGLE_include_directive : require
// The AABBs of one geometry into their slots, for one window of slots.
#include "common.glsl"
#include "geometry.glsl"

void main() {
    uint i = lane_index();
    if (i >= p.count) return;
    uint prim = p.first + i;
    if (leaf_box[2u * prim].w == 0.0) return;
    uint slot = state[RTR_ST_ACTIVE] == 1u ? 0u : slot_of[prim];
    if (slot < p.window_first || slot - p.window_first >= p.window_count) return;
    vec3 lo, hi;
    read_aabb(i, lo, hi);
    uint at = (slot - p.window_first) * RTC_AABB_QUADS;
    dst_slots[at] = uvec4(floatBitsToUint(lo), p.primitive_base + i);
    dst_slots[at + 1u] = uvec4(floatBitsToUint(hi), p.geometry);
}
