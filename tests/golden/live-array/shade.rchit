#version 460
#extension GL_NV_ray_tracing : require
layout(set = 0, binding = 0) uniform accelerationStructureNV scene;
layout(set = 0, binding = 1, std430) readonly buffer Input { float data[]; };
layout(location = 0) rayPayloadInNV float payload;
layout(location = 1) rayPayloadNV float inner;

void main() {
    float a[4];
    for (int i = 0; i < 4; ++i) a[i] = data[i];
    inner = 0.0;
    traceNV(scene, 0u, 0xffu, 0u, 0u, 0u, vec3(0.0), 0.001, vec3(0.0, 1.0, 0.0), 10.0, 1);
    payload = a[gl_PrimitiveID & 3] * inner;
}
