// Made from ../miss.rmiss by tools/render/make-ext-twins; edit that one.
#version 460
#extension GL_EXT_ray_tracing : require

layout(location = 0) rayPayloadInEXT uvec4 hit;

void main() { hit = uvec4(0xffffffffu); }
