#version 460
#extension GL_NV_ray_tracing : require
layout(set = 0, binding = 0) uniform accelerationStructureNV scene;
layout(location = 0) rayPayloadInNV float payload;

void main() {
    payload += 1.0;
    traceNV(scene, 0u, 0xffu, 0u, 0u, 0u, gl_WorldRayOriginNV, gl_HitTNV, gl_WorldRayDirectionNV, 100.0, 0);
    payload *= 2.0;
}
