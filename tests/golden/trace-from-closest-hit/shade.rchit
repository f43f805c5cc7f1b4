#version 460
#extension GL_NV_ray_tracing : require
layout(set = 0, binding = 0) uniform accelerationStructureNV scene;
layout(location = 0) rayPayloadInNV float payload;
layout(location = 1) rayPayloadNV float shadow;

void main() {
    vec3 position = gl_WorldRayOriginNV + gl_HitTNV * gl_WorldRayDirectionNV;
    float light = dot(position, vec3(1.0));
    shadow = 0.0;
    traceNV(scene, 12u, 0xffu, 0u, 0u, 1u, position, 0.001, vec3(0.0, 1.0, 0.0), 10.0, 1);
    payload = light * shadow;
}
