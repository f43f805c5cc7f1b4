#version 460
#extension GL_EXT_ray_tracing : require
// The payload says so as it is.
void main() {}
