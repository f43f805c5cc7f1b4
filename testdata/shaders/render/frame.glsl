// What changes from launch to launch, and the picture. Set 1.
#ifndef FRAME_GLSL
#define FRAME_GLSL

layout(set = 1, binding = 0, std140) uniform Frame {
    vec4 eye;      // w: ambient occlusion radius
    vec4 right;    // scaled by tan(half the horizontal field of view)
    vec4 up;       // scaled by tan(half the vertical field of view)
    vec4 forward;  // unit
    vec4 sky_low;
    vec4 sky_high;
    uint max_bounces;
    uint shadow_samples;  // per light and launch
    uint ao_samples;      // per launch
    uint emitter_count;
    uint point_light_count;
    float emitter_chance;     // probability that next-event estimation picks an emitter, not a point light
    float emitter_pdf_scale;  // emitter_chance / sum of luminance * area
    float reserved;
} frame;

layout(push_constant) uniform Launch {
    uint sample_index;
} launch;

// Sum over samples of the colour; w counts the rays traced.
layout(set = 1, binding = 1, rgba32f) uniform image2D accumulation;
// First hits: instance, primitive, bits of the two barycentrics. instance ~0: the sky.
layout(set = 1, binding = 2, rgba32ui) uniform uimage2D gbuffer;

const uint kNoHit = 0xffffffffu;
const float kRayMax = 1e30;

vec3 camera_direction(uvec2 pixel, uvec2 size, vec2 jitter) {
    // Contracted nowhere, so that every driver makes the same rays.
    precise vec2 ndc = (vec2(pixel) + jitter) / vec2(size) * 2.0 - 1.0;
    precise vec3 d = frame.forward.xyz + ndc.x * frame.right.xyz - ndc.y * frame.up.xyz;
    precise float squared = d.x * d.x + d.y * d.y + d.z * d.z;
    precise vec3 unit = d * inversesqrt(squared);
    return unit;
}

vec3 sky(vec3 direction) { return mix(frame.sky_low.rgb, frame.sky_high.rgb, max(direction.y, 0.0)); }

#endif
