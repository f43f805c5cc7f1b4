// Lambert below, GGX above: glTF's metallic-roughness model. Roughness 1 on a non-metal is pure Lambert.
#ifndef BRDF_GLSL
#define BRDF_GLSL

#include "random.glsl"
#include "surface.glsl"

const float kPi = 3.14159265358979;

void basis(vec3 n, out vec3 t, out vec3 b) {
    // Duff et al., JCGT 2017.
    float s = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + n.z);
    float c = n.x * n.y * a;
    t = vec3(1.0 + s * n.x * n.x * a, s * c, -s * n.x);
    b = vec3(c, s + n.y * n.y * a, -n.y);
}

float ggx_alpha(Surface s) { return max(s.roughness * s.roughness, 0.02); }

vec3 ggx_f0(Surface s) {
    vec3 dielectric = vec3(s.roughness < 1.0 ? 0.04 : 0.0);
    return mix(dielectric, s.base_color, s.metallic);
}

vec3 fresnel(vec3 f0, float cosine) {
    float m = clamp(1.0 - cosine, 0.0, 1.0);
    float m2 = m * m;
    vec3 grazing = min(f0 * 25.0, vec3(1.0));  // no Fresnel where there is no specular lobe
    return f0 + (grazing - f0) * (m2 * m2 * m);
}

float ggx_d(float nh, float alpha) {
    float a2 = alpha * alpha;
    float d = nh * nh * (a2 - 1.0) + 1.0;
    return a2 / (kPi * d * d);
}

// Smith's G1.
float ggx_g1(float nv, float alpha) {
    float a2 = alpha * alpha;
    return 2.0 * nv / (nv + sqrt(a2 + (1.0 - a2) * nv * nv));
}

float specular_chance(Surface s, float nv) {
    vec3 f = fresnel(ggx_f0(s), nv);
    float specular = luminance(f), diffuse = luminance(s.base_color) * (1.0 - s.metallic) * (1.0 - specular);
    return specular + diffuse > 0.0 ? specular / (specular + diffuse) : 0.0;
}

// BRDF times cosine, and the density of sample_brdf. `v` and `l` point away from the surface.
vec3 evaluate_brdf(Surface s, vec3 v, vec3 l, out float pdf) {
    float nv = dot(s.ns, v), nl = dot(s.ns, l);
    pdf = 0.0;
    if (nl <= 0.0 || nv <= 0.0 || dot(s.ng, l) <= 0.0) return vec3(0.0);
    vec3 h = normalize(v + l);
    float nh = dot(s.ns, h), vh = dot(v, h), alpha = ggx_alpha(s);
    float chance = specular_chance(s, nv);
    vec3 f = fresnel(ggx_f0(s), vh);
    float d = ggx_d(nh, alpha);
    vec3 specular = f * (d * ggx_g1(nv, alpha) * ggx_g1(nl, alpha) / (4.0 * nv));
    vec3 diffuse = s.base_color * (1.0 - s.metallic) * (vec3(1.0) - f) * (nl / kPi);
    float specular_pdf = d * ggx_g1(nv, alpha) / (4.0 * nv);  // of the visible normals
    pdf = chance * specular_pdf + (1.0 - chance) * nl / kPi;
    return specular + diffuse;
}

// A direction, with throughput = BRDF * cosine / pdf. Throughput 0: absorbed.
vec3 sample_brdf(Surface s, vec3 v, inout uint rng, out vec3 throughput, out float pdf) {
    vec3 t, b;
    basis(s.ns, t, b);
    float lobe = random(rng);
    vec2 u = random2(rng);
    float nv = dot(s.ns, v);
    float phi = 2.0 * kPi * u.y;
    vec3 l;
    if (lobe < specular_chance(s, nv)) {
        // Visible normals by spherical caps: Dupuy and Benyoub, HPG 2023.
        float alpha = ggx_alpha(s);
        vec3 local = vec3(dot(v, t), dot(v, b), nv);
        vec3 stretched = normalize(vec3(alpha * local.xy, local.z));
        float z = (1.0 - u.x) * (1.0 + stretched.z) - stretched.z;
        float r = sqrt(clamp(1.0 - z * z, 0.0, 1.0));
        vec3 cap = vec3(r * cos(phi), r * sin(phi), z) + stretched;
        vec3 h = normalize(vec3(alpha * cap.xy, max(cap.z, 1e-6)));
        l = reflect(-v, t * h.x + b * h.y + s.ns * h.z);
    } else {
        float r = sqrt(u.x);
        l = normalize(t * (r * cos(phi)) + b * (r * sin(phi)) + s.ns * sqrt(1.0 - u.x));
    }
    vec3 value = evaluate_brdf(s, v, l, pdf);
    throughput = pdf > 0.0 ? value / pdf : vec3(0.0);
    return l;
}

#endif
