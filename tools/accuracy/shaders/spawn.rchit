#version 460
#extension GL_EXT_ray_tracing : require
#extension GL_GOOGLE_include_directive : require
#include "campaign_ray.glsl"
#include "rtc/spawn.glsl"
#include "spawn.glsl"
layout(location = 0) rayPayloadInEXT Spawned spawned;
hitAttributeEXT vec2 barycentrics;

void main() {
    uint p = uint(gl_PrimitiveID);
    spawned.at = rtc_spawn(corner(p, 0u), corner(p, 1u), corner(p, 2u), barycentrics, gl_ObjectToWorldEXT,
                           gl_WorldToObjectEXT);
    spawned.t = gl_HitTEXT;
    spawned.primitive = p;
}
