#version 460
#extension GL_NV_ray_tracing : require
layout(set = 0, binding = 0) uniform accelerationStructureNV scene;
layout(location = 0) rayPayloadInNV float payload;
layout(location = 1) rayPayloadNV float farther;

void main() {
    farther = 0.0;
    traceNV(scene, 0u, 0xffu, 0u, 0u, 1u, gl_WorldRayOriginNV, gl_RayTmaxNV, gl_WorldRayDirectionNV, 1000.0, 1);
    payload = farther + 1.0;
}
