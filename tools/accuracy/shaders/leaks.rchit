#version 460
#extension GL_EXT_ray_tracing : require
// Rays that ask for the closest hit only.
layout(location = 0) rayPayloadInEXT uvec2 seen;

void main() {
    if (gl_HitKindEXT == gl_HitKindFrontFacingTriangleEXT) {
        seen.x++;
    } else {
        seen.y++;
    }
}
