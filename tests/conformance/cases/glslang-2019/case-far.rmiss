#version 460
#extension GL_NV_ray_tracing : require
layout(location = 3) rayPayloadInNV vec4 shade;
void main() { shade.x = gl_RayTmaxNV * 2.0; }
