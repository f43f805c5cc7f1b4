// Nothing stood between the surface and the light.
#version 460
#extension GL_NV_ray_tracing : require

layout(location = 1) rayPayloadInNV float visibility;

void main() { visibility = 1.0; }
