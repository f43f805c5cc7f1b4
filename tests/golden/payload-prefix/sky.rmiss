#version 460
#extension GL_NV_ray_tracing : require
struct Part { vec3 color; };
layout(location = 0) rayPayloadInNV Part p;

void main() {
    p.color = vec3(1.0);
}
