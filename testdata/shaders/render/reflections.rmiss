#version 460
#extension GL_NV_ray_tracing : require
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "reflections.glsl"

layout(location = 0) rayPayloadInNV Radiance incoming;

void main() { incoming.color = sky(gl_WorldRayDirectionNV); }
