#version 460
#extension GL_NV_ray_tracing : require
hitAttributeNV vec3 where; // triangles give two: the third reads 0
layout(location = 0) rayPayloadInNV vec4 payload;

void main() { payload = vec4(where, gl_HitTNV); }
