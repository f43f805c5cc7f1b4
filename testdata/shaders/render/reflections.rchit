// Light that arrives directly, through a shadow ray; then the mirror direction, through a ray that comes
// back to this shader.
#version 460
#extension GL_NV_ray_tracing : require
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "surface.glsl"
#include "lights.glsl"
#include "brdf.glsl"
#include "reflections.glsl"
#include "trace_log.glsl"

layout(set = 0, binding = 0) uniform accelerationStructureNV scene;
layout(location = 0) rayPayloadInNV Radiance incoming;
layout(location = 1) rayPayloadNV float visibility;
layout(location = 2) rayPayloadNV Radiance reflected;
hitAttributeNV vec2 barycentrics;

void main() {
    vec3 direction = gl_WorldRayDirectionNV;
    uvec4 hit = uvec4(gl_InstanceCustomIndexNV, gl_PrimitiveID, floatBitsToUint(barycentrics));
    LOG_RAY(gl_LaunchIDNV.xy, gl_LaunchSizeNV.x, 2u * incoming.depth, kLogClosest, gl_WorldRayOriginNV, direction, kRayMax, hit);
    Surface surface = fetch_surface(hit, gl_WorldRayOriginNV, direction);
    vec3 ambient = 0.15 * mix(frame.sky_low.rgb, frame.sky_high.rgb, 0.5 + 0.5 * surface.ns.y);
    vec3 color = surface.emission + surface.base_color * ambient * (1.0 - surface.metallic);

    LightSample light = sample_lights(surface.position, incoming.rng);
    float pdf;
    vec3 value = evaluate_brdf(surface, -direction, light.direction, pdf) * light.radiance;
    if (max(value.r, max(value.g, value.b)) > 0.0) {
        visibility = 0.0;
        vec3 start = spawn_point(surface, light.direction);
        float end = light.distance * 0.9999;
        traceNV(scene, gl_RayFlagsTerminateOnFirstHitNV | gl_RayFlagsSkipClosestHitShaderNV, 0xff, 0, 0, 1,
                start, 0.0, light.direction, end, 1);
        LOG_RAY(gl_LaunchIDNV.xy, gl_LaunchSizeNV.x, 2u * incoming.depth + 1u, kLogShadow, start, light.direction, end, uvec4(visibility != 0.0));
        incoming.rays += 1.0;
        color += value * visibility;
    }

    vec3 share = fresnel(ggx_f0(surface), -dot(surface.ns, direction));
    if (incoming.depth < kMaxReflections && max(share.r, max(share.g, share.b)) > 0.01) {
        vec3 mirrored = exact_reflect(direction, surface.ns);
        // Smooth normals can mirror a ray into the triangle; keep it outside.
        if (exact_dot(mirrored, surface.ng) <= 0.0) mirrored = exact_reflect(direction, surface.ng);
        reflected.color = vec3(0.0);
        reflected.depth = incoming.depth + 1u;
        reflected.rng = incoming.rng;
        reflected.rays = incoming.rays + 1.0;
        traceNV(scene, gl_RayFlagsNoneNV, 0xff, 0, 0, 0, spawn_point(surface, mirrored), 0.0, mirrored, kRayMax, 2);
        incoming.rng = reflected.rng;
        incoming.rays = reflected.rays;
        color += share * reflected.color;
    }
    incoming.color = color;
}
