// The pipeline of rtc-stress: it reports everything a hit shader can know.
#pragma once

namespace rtc::stress {

// In front of every stage.
constexpr const char* kCommon = R"(#version 460
#extension GL_EXT_ray_tracing : require
struct Payload {
    float t;
    uint instance, custom, geometry, primitive, kind, record;
    vec2 attributes;
    uint candidates, hash; // of the any-hit shader
    uint mode;
};
uint candidate_hash(uint instance, uint geometry, uint primitive, uint kind) {
    uint h = instance * 0x9e3779b1u + geometry * 0x85ebca6bu + primitive * 0xc2b2ae35u + kind;
    h = (h ^ (h >> 15)) * 0x2c1b3c6du;
    return h ^ (h >> 12);
}
)";

constexpr const char* kRaygen = R"(
struct Ray { vec3 origin; float tmin; vec3 direction; float tmax; uint flags, mask, sbt_offset, mode; };
struct Hit { float t; uint instance, custom, geometry, primitive, kind, record; float b1, b2; uint candidates, hash, pad; };
layout(set = 0, binding = 0) uniform accelerationStructureEXT scene;
layout(set = 0, binding = 1, std430) readonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = 2, std430) writeonly buffer Hits { Hit hits[]; };
layout(location = 0) rayPayloadEXT Payload p;
void main() {
    uint i = gl_LaunchIDEXT.x;
    Ray r = rays[i];
    p = Payload(-1.0, 0u, 0u, 0u, 0u, 0u, 0u, vec2(0.0), 0u, 0u, r.mode);
    traceRayEXT(scene, r.flags, r.mask, r.sbt_offset, 2u, 0u, r.origin, r.tmin, r.direction, r.tmax, 0);
    hits[i] = Hit(p.t, p.instance, p.custom, p.geometry, p.primitive, p.kind, p.record, p.attributes.x,
                  p.attributes.y, p.candidates, p.hash, 0u);
}
)";

constexpr const char* kMiss = R"(
layout(location = 0) rayPayloadInEXT Payload p;
void main() {
    p.instance = 0xffffffffu;
    p.t = gl_RayTmaxEXT;
}
)";

// The record of a hit group: its own number, and where its boxes start.
constexpr const char* kHitCommon = R"(
layout(shaderRecordEXT) buffer Record { uint id, first_box; } record;
hitAttributeEXT vec2 attributes;
)";

constexpr const char* kClosestHit = R"(
layout(location = 0) rayPayloadInEXT Payload p;
void main() {
    p.t = gl_HitTEXT;
    p.instance = gl_InstanceID;
    p.custom = gl_InstanceCustomIndexEXT;
    p.geometry = gl_GeometryIndexEXT;
    p.primitive = gl_PrimitiveID;
    p.kind = gl_HitKindEXT;
    p.record = record.id;
    p.attributes = attributes;
}
)";

constexpr const char* kAnyHit = R"(
layout(location = 0) rayPayloadInEXT Payload p;
void main() {
    p.candidates++;
    p.hash += candidate_hash(gl_InstanceID, gl_GeometryIndexEXT, gl_PrimitiveID, gl_HitKindEXT);
    if (p.mode == 1u) ignoreIntersectionEXT;
    if (p.mode == 2u) terminateRayEXT;
}
)";

constexpr const char* kIntersection = R"(
layout(set = 0, binding = 3, std430) readonly buffer Boxes { float boxes[]; };
void main() {
    uint at = record.first_box + 6u * gl_PrimitiveID;
    float near = gl_RayTminEXT, far = 3.0e38;
    float entry = -3.0e38;
    bool outside = false;
    for (uint k = 0u; k < 3u; k++) {
        float low = boxes[at + k], high = boxes[at + 3u + k];
        float o = gl_ObjectRayOriginEXT[k], d = gl_ObjectRayDirectionEXT[k];
        if (d == 0.0) {
            outside = outside || o < low || o > high;
        } else {
            float a = (low - o) / d, b = (high - o) / d;
            entry = max(entry, min(a, b));
            far = min(far, max(a, b));
        }
    }
    attributes = vec2(float(gl_PrimitiveID & 0xffff), 3.0);
    if (!outside && entry <= far && far >= near) reportIntersectionEXT(max(entry, near), 7u);
}
)";

constexpr uint32_t kBoxKind = 7;

}  // namespace rtc::stress
