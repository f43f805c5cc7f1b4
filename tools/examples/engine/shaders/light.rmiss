#version 460
#extension GL_NV_ray_tracing : require
#extension GL_GOOGLE_include_directive : require
#include "common.glsl"

layout(location = 1) rayPayloadInNV Shadow shadow;

void main() {
    shadow.light = 1.0;
}
