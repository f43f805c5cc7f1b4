#version 460
#extension GL_NV_ray_tracing : require
layout(location = 0) rayPayloadInNV mat3x2 p;

void main() {
    p[1] = vec2(gl_HitTNV, 2.0);
}
