#version 460
#extension GL_NV_ray_tracing : require
#extension GL_GOOGLE_include_directive : require
#include "common.glsl"
#include "mesh_record.glsl"

layout(location = 0) rayPayloadInNV Reflection reflection;
layout(location = 1) rayPayloadNV Shadow shadow;
layout(location = 0) callableDataNV Material material;

void main() {
    vec3 normal;
    fetch_surface(normal, material.uv);
    normal = dot(normal, gl_WorldRayDirectionNV) > 0.0 ? -normal : normal;
    executeCallableNV(record.material, 0);

    vec3 origin = gl_WorldRayOriginNV + gl_HitTNV * gl_WorldRayDirectionNV + OFFSET * normal;
    shadow.light = 0.0;
    traceNV(scene, SHADOW_FLAGS, 0xffu, RECORD_SHADOW, 0u, MISS_LIGHT, origin, 0.0, camera.light.xyz, 1e2, 1);
    reflection.color = shade(material.albedo, normal, shadow.light);
}
