#version 460
#extension GL_NV_ray_tracing : require

layout(set = 6, binding = 0, std430) readonly buffer Sky { vec3 sky; };
layout(set = 7, binding = 0, std140) uniform Blue { float blue; };
layout(location = 0) rayPayloadInNV vec3 color;

void main() { color = sky + vec3(0.0, 0.0, blue); }
