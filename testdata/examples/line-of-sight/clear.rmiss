#version 460
#extension GL_NV_ray_tracing : require

layout(location = 0) rayPayloadInNV uint clear;

void main() { clear = 1u; }
