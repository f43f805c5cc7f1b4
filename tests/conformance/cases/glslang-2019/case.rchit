#version 460
#extension GL_NV_ray_tracing : require
layout(location = 0) rayPayloadInNV uint p;
hitAttributeNV vec2 at;
layout(shaderRecordNV) buffer Record { uint add; };
void main() { p = p * 100u + uint(at.x * 8.0) * 10u + add + uint(gl_PrimitiveID) + uint(gl_HitTNV); }
