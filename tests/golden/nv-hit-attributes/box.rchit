#version 460
#extension GL_NV_ray_tracing : require
struct Attribute { vec3 normal; uint face; };
hitAttributeNV Attribute surface;
layout(location = 0) rayPayloadInNV vec4 payload;

void main() { payload = vec4(surface.normal, float(surface.face)); }
