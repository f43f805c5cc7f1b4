#version 460
#extension GL_EXT_ray_tracing : require
#extension GL_GOOGLE_include_directive : require
#include "rtc/spawn.glsl"
#include "spawn.glsl"
layout(location = 0) rayPayloadInEXT Spawned spawned;

void main() {}
