// Made from ../hit.rchit by tools/render/make-ext-twins; edit that one.
// Says what was hit; the ray generation shader does the rest.
#version 460
#extension GL_EXT_ray_tracing : require

layout(location = 0) rayPayloadInEXT uvec4 hit;
hitAttributeEXT vec2 barycentrics;

void main() { hit = uvec4(gl_InstanceCustomIndexEXT, gl_PrimitiveID, floatBitsToUint(barycentrics)); }
