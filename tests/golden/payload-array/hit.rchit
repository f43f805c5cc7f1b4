#version 460
#extension GL_NV_ray_tracing : require
layout(location = 0) rayPayloadInNV float p[5];

void main() {
    p[gl_PrimitiveID % 5] = gl_HitTNV;
}
