// Made from ../shadow.rmiss by tools/render/make-ext-twins; edit that one.
// Nothing stood between the surface and the light.
#version 460
#extension GL_EXT_ray_tracing : require

layout(location = 1) rayPayloadInEXT float visibility;

void main() { visibility = 1.0; }
