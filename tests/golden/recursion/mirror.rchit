#version 460
#extension GL_NV_ray_tracing : require
layout(set = 0, binding = 0) uniform accelerationStructureNV scene;
layout(location = 0) rayPayloadInNV float payload;
layout(location = 1) rayPayloadNV float bounced;

void main() {
    float weight = 0.5 * gl_HitTNV;
    bounced = payload + 1.0;
    if (payload < 8.0)
        traceNV(scene, 0u, 0xffu, 0u, 0u, 0u, gl_WorldRayOriginNV, 0.001, -gl_WorldRayDirectionNV, 100.0, 1);
    payload += weight * bounced;
}
