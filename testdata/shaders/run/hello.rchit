#version 460
#extension GL_NV_ray_tracing : require
layout(location = 0) rayPayloadInNV vec3 color;
hitAttributeNV vec2 weights;
void main() { color = vec3(1.0 - weights.x - weights.y, weights); }
