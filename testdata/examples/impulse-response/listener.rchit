#version 460
#extension GL_NV_ray_tracing : require

struct Sound {
    vec3 origin, direction;
    float way;
    float energy;
    uint heard;
};
layout(location = 0) rayPayloadInNV Sound sound;

void main() {
    sound.way += gl_HitTNV;
    sound.heard = 1u;
}
