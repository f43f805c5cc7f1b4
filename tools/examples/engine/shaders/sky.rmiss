#version 460
#extension GL_NV_ray_tracing : require
#extension GL_GOOGLE_include_directive : require
#include "common.glsl"

layout(shaderRecordNV) buffer SkyRecord { vec4 low, high; } record;
layout(location = 0) rayPayloadInNV Reflection reflection;

void main() {
    reflection.color = mix(record.low.rgb, record.high.rgb, clamp(gl_WorldRayDirectionNV.y, 0.0, 1.0));
}
