#version 460
#extension GL_NV_ray_tracing : require
layout(location = 3) rayPayloadInNV vec4 shade;
void main() { shade = vec4(gl_WorldRayDirectionNV.z * gl_HitTNV, gl_ObjectRayOriginNV); }
