#version 460
#extension GL_NV_ray_tracing : require

layout(set = 4, binding = 0, std430) readonly buffer Red { float red; };
layout(set = 5, binding = 0) uniform sampler2D green;
layout(set = 7, binding = 0, std140) uniform Blue { float blue; };
layout(location = 0) rayPayloadInNV vec3 color;
hitAttributeNV vec2 barycentrics;

void main() { color = vec3(red, textureLod(green, barycentrics, 0.0).g, blue); }
