#version 460
#extension GL_EXT_ray_tracing : require
#extension GL_GOOGLE_include_directive : require
#include "common.glsl"

layout(location = 1) rayPayloadInEXT Surface surface;
hitAttributeEXT vec2 barycentrics;

void main() {
    surface.color = vec3(1.0 - barycentrics.x - barycentrics.y, barycentrics);
    surface.distance = gl_HitTEXT;
}
