#version 460
#extension GL_NV_ray_tracing : require
layout(location = 0) rayPayloadInNV vec2 p;

void main() {
    p.x = gl_HitTNV;
}
