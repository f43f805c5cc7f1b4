#version 460
#extension GL_NV_ray_tracing : require

layout(location = 0) rayPayloadInNV uvec4 hit;

void main() { hit = uvec4(0xffffffffu); }
