#version 450
#extension GL_GOOGLE_include_directive : require
#include "gbuffer.glsl"

layout(location = 0) in vec4 position_u;
layout(location = 1) in vec4 normal_v;
layout(location = 0) out vec3 world;
layout(location = 1) out vec3 normal;
layout(location = 2) out vec2 uv;

void main() {
    vec4 p = vec4(position_u.xyz, 1.0), n = vec4(normal_v.xyz, 0.0);
    world = vec3(dot(push.transform[0], p), dot(push.transform[1], p), dot(push.transform[2], p));
    normal = vec3(dot(push.transform[0], n), dot(push.transform[1], n), dot(push.transform[2], n));
    uv = vec2(position_u.w, normal_v.w);
    vec3 view = world - push.eye.xyz;
    float ahead = dot(view, push.forward.xyz);
    float across = dot(view, push.right.xyz) / dot(push.right.xyz, push.right.xyz);
    float above = dot(view, push.up.xyz) / dot(push.up.xyz, push.up.xyz);
    const float near = 0.1, far = 100.0;
    gl_Position = vec4(across, -above, far * (ahead - near) / (far - near), ahead);
}
