// Integer random numbers: the same sequence on every device and driver.
#ifndef RANDOM_GLSL
#define RANDOM_GLSL

// PCG-RXS-M-XS 32, M. O'Neill 2014; as a hash: Jarzynski and Olano, JCGT 2020.
uint pcg(uint state) {
    uint word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

uint random_seed(uvec2 pixel, uint sample_index, uint purpose) {
    return pcg(pixel.x * 0x9e3779b9u + pcg(pixel.y * 0x85ebca6bu + pcg(sample_index * 4u + purpose)));
}

// In [0, 1): 24 bits, exact.
float random(inout uint state) {
    state = state * 747796405u + 2891336453u;
    return float(pcg(state) >> 8u) * (1.0 / 16777216.0);
}

vec2 random2(inout uint state) {
    float first = random(state);
    return vec2(first, random(state));
}

// The pixel's sub-position; the primary pass and those that follow it must agree.
vec2 pixel_jitter(uvec2 pixel, uint sample_index) {
    uint state = random_seed(pixel, sample_index, 0u);
    return random2(state);
}

#endif
