#version 450
#extension GL_GOOGLE_include_directive : require
// Update, second part, for AABBs; see refit_triangles.comp.
#include "common.glsl"
#include "geometry.glsl"
#include "refit.glsl"

void main() {
    uint slot, at;
    if (!window_slot(lane_index(), RTC_AABB_QUADS, slot, at)) return;
    if (((dst_slots[at + 1u].w ^ p.geometry) & RTC_SLOT_GEOMETRY_MASK) != 0u) return;
    uint prim = dst_slots[at].w - p.primitive_base;
    if (prim >= p.count) return;
    if (!in_range_of_geometry(prim)) {
        changed_activity(p.first + prim);
        return;
    }
    vec3 lo, hi;
    read_aabb(prim, lo, hi);
    dst_slots[at].xyz = floatBitsToUint(lo);
    dst_slots[at + 1u].xyz = floatBitsToUint(hi);
    if (any_nan(lo) || any_nan(hi)) {
        changed_activity(p.first + prim);
        return;
    }
    leaf_box[2u * slot] = vec4(clamp(min(lo, hi), vec3(-RTR_FLT_MAX), vec3(RTR_FLT_MAX)), 1.0);
    leaf_box[2u * slot + 1u] = vec4(clamp(max(lo, hi), vec3(-RTR_FLT_MAX), vec3(RTR_FLT_MAX)), 0.0);
}
