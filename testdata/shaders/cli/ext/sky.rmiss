#version 460
#extension GL_EXT_ray_tracing : require
#extension GL_GOOGLE_include_directive : require
#include "common.glsl"

layout(location = 1) rayPayloadInEXT Surface surface;

void main() {
    surface.color = SKY * max(gl_WorldRayDirectionEXT.y, 0.0);
    surface.distance = -1.0;
}
