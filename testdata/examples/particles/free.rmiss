#version 460
#extension GL_NV_ray_tracing : require

struct Collision {
    vec3 normal;
    float time;
};
layout(location = 0) rayPayloadInNV Collision collision;

void main() {
    collision.normal = vec3(0.0);
    collision.time = gl_RayTmaxNV;
}
