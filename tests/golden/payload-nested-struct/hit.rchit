#version 460
#extension GL_NV_ray_tracing : require
struct Hit {
    bool found;
    float position[3];
};
struct Path {
    float weight;
    Hit hit;
};
layout(location = 0) rayPayloadInNV Path p;

void main() {
    p.hit.found = true;
    p.hit.position[1] = gl_HitTNV;
    p.weight *= 0.5;
}
