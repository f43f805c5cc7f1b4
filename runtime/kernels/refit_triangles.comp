#version 450
#extension GL_GOOGLE_include_directive : require
// Update, second part: a lane a slot; those of the dispatch's geometry fetch their
// triangle again. An update may not change which primitives are active; one that turned
// NaN keeps its place with an empty box.
#include "common.glsl"
#include "geometry.glsl"
#include "refit.glsl"

void main() {
    uint slot, at;
    if (!window_slot(lane_index(), RTC_TRIANGLE_QUADS, slot, at)) return;
    if (((dst_slots[at + 1u].w ^ p.geometry) & RTC_SLOT_GEOMETRY_MASK) != 0u) return;
    uint prim = dst_slots[at].w - p.primitive_base;
    if (prim >= p.count) return;
    if (!in_range_of_geometry(prim)) {
        changed_activity(p.first + prim);
        return;
    }
    vec3 v0, v1, v2;
    read_triangle(prim, v0, v1, v2);
    dst_slots[at].xyz = floatBitsToUint(v0);
    dst_slots[at + 1u].xyz = floatBitsToUint(v1);
    dst_slots[at + 2u].xyz = floatBitsToUint(v2);
    if (!triangle_active(v0, v1, v2)) {
        changed_activity(p.first + prim);
        return;
    }
    leaf_box[2u * slot] = vec4(clamp(min(v0, min(v1, v2)), vec3(-RTR_FLT_MAX), vec3(RTR_FLT_MAX)), 1.0);
    leaf_box[2u * slot + 1u] = vec4(clamp(max(v0, max(v1, v2)), vec3(-RTR_FLT_MAX), vec3(RTR_FLT_MAX)), 0.0);
}
