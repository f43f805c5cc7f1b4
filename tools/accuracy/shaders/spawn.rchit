#version 460
#extension GL_EXT_ray_tracing : require
#extension GL_GOOGLE_include_directive : require
#include "campaign_ray.glsl"
#include "spawn.glsl"
#include "rtc/spawn.glsl"
layout(location = 0) rayPayloadInEXT Spawned spawned;
hitAttributeEXT vec2 barycentrics;

void main() {
    uint p = uint(gl_PrimitiveID);
    RtcSpawn s = rtc_spawn(corner(p, 0u), corner(p, 1u), corner(p, 2u), barycentrics, gl_ObjectToWorldEXT,
                           gl_WorldToObjectEXT);
    spawned.position = s.position;
    spawned.normal = s.normal;
    spawned.offset = s.offset;
    spawned.t = gl_HitTEXT;
    spawned.primitive = p;
}
