#version 460
#extension GL_NV_ray_tracing : require
layout(location = 1) rayPayloadInNV float shadow;

void main() { shadow = 1.0; }
