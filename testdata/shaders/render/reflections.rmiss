#version 460
#extension GL_NV_ray_tracing : require
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "reflections.glsl"
#include "trace_log.glsl"

layout(location = 0) rayPayloadInNV Radiance incoming;

void main() {
    LOG_RAY(gl_LaunchIDNV.xy, gl_LaunchSizeNV.x, 2u * incoming.depth, kLogClosest, gl_WorldRayOriginNV, gl_WorldRayDirectionNV, kRayMax, uvec4(kNoHit));
    incoming.color = sky(gl_WorldRayDirectionNV);
}
