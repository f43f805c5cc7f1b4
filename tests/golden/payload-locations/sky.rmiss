#version 460
#extension GL_NV_ray_tracing : require
rayPayloadInNV vec2 p;

void main() {
    p.y = 1.0;
}
