// Says what was hit; the ray generation shader does the rest.
#version 460
#extension GL_NV_ray_tracing : require

layout(location = 0) rayPayloadInNV uvec4 hit;
hitAttributeNV vec2 barycentrics;

void main() { hit = uvec4(gl_InstanceCustomIndexNV, gl_PrimitiveID, floatBitsToUint(barycentrics)); }
