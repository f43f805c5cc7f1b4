#version 460
#extension GL_EXT_ray_tracing : require
#extension GL_GOOGLE_include_directive : require
#include "payload.glsl"
layout(location = 0) rayPayloadInEXT Payload found;

void main() { found.t = -1.0; }
