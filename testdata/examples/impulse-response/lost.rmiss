#version 460
#extension GL_NV_ray_tracing : require

struct Sound {
    vec3 origin, direction;
    float way;
    float energy;
    uint heard;
};
layout(location = 0) rayPayloadInNV Sound sound;

void main() { sound.heard = 2u; } // the room has a hole
