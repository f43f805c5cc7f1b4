#version 460
#extension GL_NV_ray_tracing : require
#extension GL_GOOGLE_include_directive : require
#include "common.glsl"

layout(location = 1) rayPayloadInNV Surface surface;
hitAttributeNV vec2 barycentrics;

void main() {
    surface.color = vec3(1.0 - barycentrics.x - barycentrics.y, barycentrics);
    surface.distance = gl_HitTNV;
}
