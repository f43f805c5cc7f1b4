#version 450
#extension GL_GOOGLE_include_directive : require
#include "gbuffer.glsl"

layout(set = 0, binding = 0) uniform sampler2D textures[2];
layout(location = 0) in vec3 world;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 uv;
layout(location = 0) out vec4 outPosition;
layout(location = 1) out vec4 outNormal;
layout(location = 2) out vec4 outSurface;

void main() {
    // Only leaves have holes; every other mesh has cutout 0.
    ivec2 texel = ivec2(floor(fract(uv) * vec2(textureSize(textures[1], 0))));
    if (push.cutout != 0.0 && texelFetch(textures[1], texel, 0).a < 0.5) discard;
    outPosition = vec4(world, push.instance);
    outNormal = vec4(normalize(normal), 0.0);
    outSurface = vec4(uv, push.material, push.mirror);
}
