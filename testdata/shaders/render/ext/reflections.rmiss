// Made from ../reflections.rmiss by tools/render/make-ext-twins; edit that one.
#version 460
#extension GL_EXT_ray_tracing : require
#extension GL_GOOGLE_include_directive : require
#include "../frame.glsl"
#include "../reflections.glsl"
#include "../trace_log.glsl"

layout(location = 0) rayPayloadInEXT Radiance incoming;

void main() {
    LOG_RAY(gl_LaunchIDEXT.xy, gl_LaunchSizeEXT.x, 2u * incoming.depth, kLogClosest, gl_WorldRayOriginEXT, gl_WorldRayDirectionEXT, kRayMax, uvec4(kNoHit));
    incoming.color = sky(gl_WorldRayDirectionEXT);
}
