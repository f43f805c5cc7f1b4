#version 460
#extension GL_NV_ray_tracing : require
// The normal of the triangle that was met, from the vertices in a buffer.

struct Collision {
    vec3 normal;
    float time;
};
layout(location = 0) rayPayloadInNV Collision collision;
layout(set = 0, binding = 5, std430) readonly buffer Corners { vec4 corners[]; };

void main() {
    uint first = 3u * gl_PrimitiveID;
    vec3 a = corners[first].xyz, b = corners[first + 1u].xyz, c = corners[first + 2u].xyz;
    collision.normal = normalize(gl_ObjectToWorldNV * vec4(cross(b - a, c - a), 0.0));
    collision.time = gl_HitTNV;
}
