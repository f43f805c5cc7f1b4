#version 460
#extension GL_NV_ray_tracing : require
// A wall mirrors the ray and keeps a share of its energy: what it absorbs stands in its shader record.

layout(shaderRecordNV) buffer Wall {
    vec4 normal; // into the room
    float reflects;
} wall;

struct Sound {
    vec3 origin, direction;
    float way;
    float energy;
    uint heard;
};
layout(location = 0) rayPayloadInNV Sound sound;

void main() {
    sound.origin += gl_HitTNV * sound.direction;
    sound.way += gl_HitTNV;
    sound.energy *= wall.reflects;
    sound.direction = reflect(sound.direction, wall.normal.xyz);
}
