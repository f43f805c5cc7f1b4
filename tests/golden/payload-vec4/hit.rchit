#version 460
#extension GL_NV_ray_tracing : require
layout(location = 0) rayPayloadInNV vec4 p;

void main() {
    p.z += gl_HitTNV;
}
