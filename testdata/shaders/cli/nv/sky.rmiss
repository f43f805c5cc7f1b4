#version 460
#extension GL_NV_ray_tracing : require
#extension GL_GOOGLE_include_directive : require
#include "common.glsl"

layout(location = 1) rayPayloadInNV Surface surface;

void main() {
    surface.color = SKY * max(gl_WorldRayDirectionNV.y, 0.0);
    surface.distance = -1.0;
}
