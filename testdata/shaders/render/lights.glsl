// Emissive triangles and point lights, and choosing one. Set 0, binding 5.
#ifndef LIGHTS_GLSL
#define LIGHTS_GLSL

#include "random.glsl"
#include "surface.glsl"
#include "frame.glsl"

// Emitter i: 4 texels from 4 i: v0 and the alias table's threshold; edge 1 and alias index; edge 2 and
// luminance; emission and 1.0 when both sides emit. Then 2 texels a point light: position, intensity.
layout(set = 0, binding = 5) uniform textureBuffer lights;

struct LightSample {
    vec3 direction;  // unit, from the surface to the light
    float distance;
    vec3 radiance;  // to be multiplied by the BRDF and cosine: emission / pdf, or intensity / distance^2
    float pdf;      // solid angle; 0 for point lights, which nothing else can find
};

LightSample sample_emitter(vec3 from, uint index, vec2 u, float chance) {
    vec4 q0 = texelFetch(lights, int(4u * index)), q1 = texelFetch(lights, int(4u * index + 1u));
    vec4 q2 = texelFetch(lights, int(4u * index + 2u)), q3 = texelFetch(lights, int(4u * index + 3u));
    // Uniform on the triangle: Osada et al. 2002.
    float root = sqrt(u.x);
    vec3 point = q0.xyz + q1.xyz * (root * (1.0 - u.y)) + q2.xyz * (root * u.y);
    LightSample result;
    vec3 way = point - from;
    float squared = max(dot(way, way), 1e-20);
    result.distance = sqrt(squared);
    result.direction = way / result.distance;
    vec3 normal = cross(q1.xyz, q2.xyz);
    float double_area = length(normal);
    float cosine = -dot(normal, result.direction) / double_area;
    if (q3.w != 0.0) cosine = abs(cosine);
    result.pdf = cosine > 0.0 ? chance / (0.5 * double_area) * squared / cosine : 0.0;
    result.radiance = cosine > 0.0 ? q3.rgb / result.pdf : vec3(0.0);
    return result;
}

LightSample sample_point_light(vec3 from, uint index, float chance) {
    uint place = 4u * frame.emitter_count + 2u * index;
    vec3 way = texelFetch(lights, int(place)).xyz - from;
    float squared = max(dot(way, way), 1e-20);
    LightSample result;
    result.distance = sqrt(squared);
    result.direction = way / result.distance;
    result.radiance = texelFetch(lights, int(place + 1u)).rgb / (squared * chance);
    result.pdf = 0.0;
    return result;
}

// One light, emitters in proportion to their power (alias method, Walker 1977).
LightSample sample_lights(vec3 from, inout uint rng) {
    float kind = random(rng), pick = random(rng), toss = random(rng);
    vec2 u = random2(rng);
    if (kind < frame.emitter_chance) {
        uint index = min(uint(pick * float(frame.emitter_count)), frame.emitter_count - 1u);
        vec4 entry = texelFetch(lights, int(4u * index));
        if (toss >= entry.w) index = uint(texelFetch(lights, int(4u * index + 1u)).w);
        float area = 0.5 * length(cross(texelFetch(lights, int(4u * index + 1u)).xyz, texelFetch(lights, int(4u * index + 2u)).xyz));
        return sample_emitter(from, index, u, texelFetch(lights, int(4u * index + 2u)).w * area * frame.emitter_pdf_scale);
    }
    // Branches on uniforms alone are avoided: lavapipe compiles such a shader anew for every launch. The
    // table always holds one point light, black if the scene has none.
    uint count = max(frame.point_light_count, 1u);
    uint index = min(uint(pick * float(count)), count - 1u);
    return sample_point_light(from, index, (1.0 - frame.emitter_chance) / float(count));
}

// The solid-angle density with which sample_lights would have found this emitting surface.
float emitter_pdf(Surface surface, vec3 from, vec3 direction) {
    vec3 way = surface.position - from;
    float cosine = max(abs(dot(surface.ng, direction)), 1e-6);
    return luminance(surface.emission) * frame.emitter_pdf_scale * dot(way, way) / cosine;
}

#endif
