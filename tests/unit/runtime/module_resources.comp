#version 450
// Declares more of every kind of resource than a limit that a test makes up. Never launched.
layout(local_size_x = 32) in;
layout(set = 0, binding = 0, std430) buffer Storage { uint words[]; } storage[20];
layout(set = 0, binding = 1, std140) uniform Uniform { uvec4 words; } uniforms[14];
layout(set = 0, binding = 2) uniform texture2D sampled[6];
layout(set = 0, binding = 3) uniform sampler samplers[5];
layout(set = 0, binding = 4, rgba8) uniform image2D images[4];
layout(set = 0, binding = 5) uniform sampler2D combined[3];

void main() {
    uint i = gl_GlobalInvocationID.x;
    vec4 c = texture(sampler2D(sampled[1], samplers[1]), vec2(0)) + texture(combined[0], vec2(0));
    imageStore(images[1], ivec2(0), c);
    storage[3].words[i] = uniforms[2].words.x;
}
