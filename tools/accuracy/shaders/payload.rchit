#version 460
#extension GL_EXT_ray_tracing : require
#extension GL_GOOGLE_include_directive : require
#include "payload.glsl"
layout(binding = 1, std430) readonly buffer Corners { float corners[]; };
layout(location = 0) rayPayloadInEXT Payload found;

vec3 corner(uint i) {
    uint at = 9u * uint(gl_PrimitiveID) + 3u * i;
    return vec3(corners[at], corners[at + 1u], corners[at + 2u]);
}

void main() {
    vec3 a = corner(0u), normal = normalize(cross(corner(1u) - a, corner(2u) - a));
    uint id = uint(gl_PrimitiveID) * 2654435769u;
    payload_set(found, faceforward(normal, gl_WorldRayDirectionEXT, normal),
                0.5 + 0.4 * vec3(float(id >> 24u), float((id >> 16u) & 255u), float((id >> 8u) & 255u)) / 255.0);
    found.t = gl_HitTEXT;
}
