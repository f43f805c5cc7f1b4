// Made from ../reflections.rmiss by tools/render/make-ext-twins; edit that one.
#version 460
#extension GL_EXT_ray_tracing : require
#extension GL_GOOGLE_include_directive : require
#include "../frame.glsl"
#include "../reflections.glsl"

layout(location = 0) rayPayloadInEXT Radiance incoming;

void main() { incoming.color = sky(gl_WorldRayDirectionEXT); }
