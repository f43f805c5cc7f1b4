// The payload of recursive reflections.
#ifndef REFLECTIONS_GLSL
#define REFLECTIONS_GLSL

struct Radiance {
    vec3 color;
    uint depth;   // reflections that led here
    uint rng;
    float rays;   // traced so far
};

const uint kMaxReflections = 8u;

#endif
