#version 460
#extension GL_NV_ray_tracing : require
layout(set = 0, binding = 0) uniform accelerationStructureNV scene;
layout(set = 0, binding = 1, std430) readonly buffer Input { float data[]; };
layout(location = 0) rayPayloadInNV float payload;
layout(location = 1) rayPayloadNV float inner;

void main() {
    uint index = gl_LaunchIDNV.x * 4u + 1u;
    float scale = 2.0;
    inner = 0.0;
    traceNV(scene, 0u, 0xffu, 0u, 0u, 0u, vec3(0.0), 0.001, vec3(0.0, 1.0, 0.0), 10.0, 1);
    payload = inner * scale + float(index);
}
