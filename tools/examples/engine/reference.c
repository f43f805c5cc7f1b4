/* The picture once more, on the host, by brute force: every triangle for every ray. It shares the scene with
 * the engine, and nothing else: neither shaders nor acceleration structures. */
#include "engine.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define AMBIENT 0.25f
#define OFFSET 2e-3f

typedef struct Hit {
    uint32_t instance, triangle;
    float t, weights[3];
} Hit;

static void cross(const float* a, const float* b, float* out) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}
static float dot(const float* a, const float* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
static void normalise(float* v) {
    const float length = sqrtf(dot(v, v));
    for (int i = 0; i < 3; ++i) v[i] /= length;
}
static float fraction(float x) { return x - floorf(x); }

static const uint8_t* texel(const Scene* scene, uint32_t texture, float u, float v) {
    const int x = (int)floorf(fraction(u) * TEXTURE_SIZE), y = (int)floorf(fraction(v) * TEXTURE_SIZE);
    return scene
        ->textures[texture][y < TEXTURE_SIZE ? y : TEXTURE_SIZE - 1][x < TEXTURE_SIZE ? x : TEXTURE_SIZE - 1];
}

static void surface(const Scene* scene, const Hit* hit, float* normal, float* uv) {
    const Instance* instance = &scene->instances[hit->instance];
    const Mesh* mesh = &scene->meshes[instance->mesh];
    float n[3] = {0, 0, 0};
    uv[0] = uv[1] = 0;
    for (int corner = 0; corner < 3; ++corner) {
        const Vertex* v = &mesh->vertices[mesh->indices[3 * hit->triangle + corner]];
        for (int i = 0; i < 3; ++i) n[i] += hit->weights[corner] * v->normal[i];
        uv[0] += hit->weights[corner] * v->u;
        uv[1] += hit->weights[corner] * v->v;
    }
    for (int row = 0; row < 3; ++row) normal[row] = dot(instance->transform[row], n);
    normalise(normal);
}

static bool is_hole(const Scene* scene, const Hit* hit) {
    const Mesh* mesh = &scene->meshes[scene->instances[hit->instance].mesh];
    float normal[3], uv[2];
    if (!mesh->cutout) return false;
    surface(scene, hit, normal, uv);
    return texel(scene, mesh->texture, uv[0], uv[1])[3] < 128;
}

/* Möller-Trumbore over all triangles. */
static bool trace(const Scene* scene, const float* origin, const float* direction, float tmin, Hit* nearest) {
    bool found = false;
    nearest->t = 100.0f;
    for (uint32_t i = 0; i < INSTANCE_COUNT; ++i) {
        const Instance* instance = &scene->instances[i];
        const Mesh* mesh = &scene->meshes[instance->mesh];
        float o[3], d[3]; /* transforms only rotate and move: their inverse is the transpose */
        for (int c = 0; c < 3; ++c) {
            o[c] = d[c] = 0;
            for (int r = 0; r < 3; ++r) {
                o[c] += instance->transform[r][c] * (origin[r] - instance->transform[r][3]);
                d[c] += instance->transform[r][c] * direction[r];
            }
        }
        for (uint32_t t = 0; t < mesh->indexCount / 3; ++t) {
            const float* v[3];
            for (int c = 0; c < 3; ++c) v[c] = mesh->vertices[mesh->indices[3 * t + c]].position;
            float e1[3], e2[3], s[3], p[3], q[3];
            for (int c = 0; c < 3; ++c)
                e1[c] = v[1][c] - v[0][c], e2[c] = v[2][c] - v[0][c], s[c] = o[c] - v[0][c];
            cross(d, e2, p);
            const float determinant = dot(e1, p);
            if (determinant == 0) continue;
            cross(s, e1, q);
            Hit hit = {i, t, dot(e2, q) / determinant, {0, dot(s, p) / determinant, dot(d, q) / determinant}};
            hit.weights[0] = 1 - hit.weights[1] - hit.weights[2];
            if (hit.weights[0] < 0 || hit.weights[1] < 0 || hit.weights[2] < 0) continue;
            if (hit.t <= tmin || hit.t >= nearest->t || is_hole(scene, &hit)) continue;
            *nearest = hit;
            found = true;
        }
    }
    return found;
}

static void albedo(const Scene* scene, uint32_t material, float u, float v, float* color) {
    const MaterialRecord* record = &scene->materials[material];
    const bool even = ((int)floorf(u * record->scale) & 1) == 0;
    for (int i = 0; i < 3; ++i)
        color[i] = record->scale > 0 ? (even ? record->first[i] : record->second[i])
                                     : (float)texel(scene, record->texture, u, v)[i] / 255.0f;
}

static void sky(const Scene* scene, const float* direction, float* color) {
    const float up = direction[1] < 0 ? 0 : direction[1] > 1 ? 1 : direction[1];
    for (int i = 0; i < 3; ++i) color[i] = scene->sky.low[i] + up * (scene->sky.high[i] - scene->sky.low[i]);
}

/* Light from the lamp at a point; `normal` is turned towards where the ray came from. */
static void shade(const Scene* scene, const float* position, float* normal, const float* incoming,
                  uint32_t material, const float* uv, float* color) {
    Hit hit;
    float origin[3];
    if (dot(normal, incoming) > 0)
        for (int i = 0; i < 3; ++i) normal[i] = -normal[i];
    for (int i = 0; i < 3; ++i) origin[i] = position[i] + OFFSET * normal[i];
    const float light = trace(scene, origin, scene->camera.light, 0, &hit) ? 0.0f : 1.0f;
    const float facing = dot(normal, scene->camera.light);
    albedo(scene, material, uv[0], uv[1], color);
    for (int i = 0; i < 3; ++i) color[i] *= AMBIENT + (1 - AMBIENT) * light * (facing > 0 ? facing : 0);
}

static void reflected(const Scene* scene, const float* position, const float* normal, const float* view,
                      float* color) {
    float origin[3], direction[3], point[3], n[3], uv[2];
    for (int i = 0; i < 3; ++i) {
        origin[i] = position[i] + OFFSET * normal[i];
        direction[i] = view[i] - 2 * dot(normal, view) * normal[i];
    }
    Hit hit;
    if (!trace(scene, origin, direction, 0, &hit)) {
        sky(scene, direction, color);
        return;
    }
    surface(scene, &hit, n, uv);
    for (int i = 0; i < 3; ++i) point[i] = origin[i] + hit.t * direction[i];
    shade(scene, point, n, direction, scene->meshes[scene->instances[hit.instance].mesh].material, uv, color);
}

bool reference_compare(const Scene* scene, uint32_t width, uint32_t height, const float* position,
                       const float* normal, const float* surfaces, const float* picture) {
    const Camera* camera = &scene->camera;
    uint32_t wrongColors = 0, wrongSurfaces = 0, lit = 0, hits = 0;
    for (uint32_t pixel = 0; pixel < width * height; ++pixel) {
        const float x = ((float)(pixel % width) + 0.5f) / (float)width * 2 - 1;
        const float y = ((float)(pixel / width) + 0.5f) / (float)height * 2 - 1;
        float view[3], expected[3];
        for (int i = 0; i < 3; ++i) view[i] = camera->forward[i] + x * camera->right[i] - y * camera->up[i];
        normalise(view);
        const float* p = position + 4 * pixel;
        const float* s = surfaces + 4 * pixel;
        Hit hit;
        const uint32_t seen = trace(scene, camera->eye, view, 0.1f, &hit) ? hit.instance + 1 : 0;
        wrongSurfaces += seen != (uint32_t)p[3];
        if (p[3] == 0) {
            sky(scene, view, expected);
        } else {
            float n[3];
            memcpy(n, normal + 4 * pixel, sizeof n);
            shade(scene, p, n, view, (uint32_t)s[2], s, expected);
            ++hits;
            if (s[3] > 0) {
                float mirror[3];
                reflected(scene, p, n, view, mirror);
                for (int i = 0; i < 3; ++i) expected[i] += s[3] * (mirror[i] - expected[i]);
            }
        }
        bool wrong = false;
        for (int i = 0; i < 3; ++i) wrong = wrong || !(fabsf(expected[i] - picture[4 * pixel + i]) < 0.01f);
        wrongColors += wrong;
        lit += picture[4 * pixel] > 0.3f;
    }
    /* Borders of triangles, texels and shadows may fall to either side by rounding. */
    const uint32_t pixels = width * height;
    printf("%u of %u pixels show another surface than the reference, %u another colour\n", wrongSurfaces,
           pixels, wrongColors);
    return wrongSurfaces * 50 <= pixels && wrongColors * 100 <= pixels && hits * 4 > pixels &&
           lit * 10 > pixels;
}
