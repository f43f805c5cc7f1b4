/* The scene: a mirroring floor, a waving cloth, two boxes that circle, two cutout leaves. */
#include "engine.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define CLOTH 16 /* quads along an edge */

static Vertex vertex(float x, float y, float z, float nx, float ny, float nz, float u, float v) {
    return (Vertex){{x, y, z}, u, {nx, ny, nz}, v};
}

static void allocate(Mesh* mesh, uint32_t vertices, uint32_t indices) {
    mesh->vertexCount = vertices;
    mesh->indexCount = indices;
    mesh->vertices = calloc(vertices, sizeof *mesh->vertices);
    mesh->indices = calloc(indices, sizeof *mesh->indices);
    if (!mesh->vertices || !mesh->indices) abort();
}

static void quad(Mesh* mesh, uint32_t face, Vertex a, Vertex b, Vertex c, Vertex d) {
    const Vertex corners[4] = {a, b, c, d};
    const uint32_t pattern[6] = {0, 1, 2, 0, 2, 3};
    memcpy(mesh->vertices + 4 * face, corners, sizeof corners);
    for (uint32_t i = 0; i < 6; ++i) mesh->indices[6 * face + i] = 4 * face + pattern[i];
}

static void make_floor(Mesh* mesh) {
    allocate(mesh, 4, 6);
    quad(mesh, 0, vertex(-4, 0, -4, 0, 1, 0, 0, 0), vertex(-4, 0, 4, 0, 1, 0, 0, 4),
         vertex(4, 0, 4, 0, 1, 0, 4, 4), vertex(4, 0, -4, 0, 1, 0, 4, 0));
    mesh->material = MATERIAL_TILES;
    mesh->mirror = 0.4f;
}

static void make_box(Mesh* mesh) {
    allocate(mesh, 24, 36);
    for (uint32_t face = 0; face < 6; ++face) {
        const uint32_t axis = face / 2, next = (axis + 1) % 3, last = (axis + 2) % 3;
        const float side = face % 2 ? 1.0f : -1.0f;
        Vertex corners[4];
        for (uint32_t i = 0; i < 4; ++i) {
            const float s = i == 1 || i == 2 ? 1.0f : -1.0f, t = i >= 2 ? 1.0f : -1.0f;
            Vertex* v = &corners[i];
            memset(v, 0, sizeof *v);
            v->position[axis] = 0.4f * side;
            v->position[next] = 0.4f * s;
            v->position[last] = 0.4f * t;
            v->normal[axis] = side;
            v->u = 0.5f + 0.5f * s;
            v->v = 0.5f + 0.5f * t;
        }
        quad(mesh, face, corners[0], corners[1], corners[2], corners[3]);
    }
    mesh->material = MATERIAL_BOX;
}

static void make_leaves(Mesh* mesh) { /* two crossed quads */
    allocate(mesh, 8, 12);
    quad(mesh, 0, vertex(-0.7f, 0, 0, 0, 0, 1, 0, 1), vertex(0.7f, 0, 0, 0, 0, 1, 1, 1),
         vertex(0.7f, 1.4f, 0, 0, 0, 1, 1, 0), vertex(-0.7f, 1.4f, 0, 0, 0, 1, 0, 0));
    quad(mesh, 1, vertex(0, 0, -0.7f, 1, 0, 0, 0, 1), vertex(0, 0, 0.7f, 1, 0, 0, 1, 1),
         vertex(0, 1.4f, 0.7f, 1, 0, 0, 1, 0), vertex(0, 1.4f, -0.7f, 1, 0, 0, 0, 0));
    mesh->material = MATERIAL_LEAVES;
    mesh->cutout = true;
    mesh->texture = TEXTURE_LEAVES;
}

static void make_cloth(Mesh* mesh) {
    allocate(mesh, (CLOTH + 1) * (CLOTH + 1), CLOTH * CLOTH * 6);
    for (uint32_t y = 0; y < CLOTH; ++y) {
        for (uint32_t x = 0; x < CLOTH; ++x) {
            const uint32_t corner = y * (CLOTH + 1) + x, above = corner + CLOTH + 1;
            const uint32_t two[6] = {corner, corner + 1, above + 1, corner, above + 1, above};
            memcpy(mesh->indices + 6 * (y * CLOTH + x), two, sizeof two);
        }
    }
    mesh->material = MATERIAL_CLOTH;
}

static void wave_cloth(Mesh* mesh, float time) {
    for (uint32_t y = 0; y <= CLOTH; ++y) {
        for (uint32_t x = 0; x <= CLOTH; ++x) {
            const float u = (float)x / CLOTH, v = (float)y / CLOTH;
            const float phase = 7.0f * u + 3.0f * v + 2.5f * time, depth = 0.25f * u;
            /* z = depth sin(phase): its slopes give the normal */
            const float dx = (0.25f * sinf(phase) + depth * 7.0f * cosf(phase)) / 2.4f;
            const float dy = depth * 3.0f * cosf(phase) / 1.6f;
            const float length = sqrtf(dx * dx + dy * dy + 1.0f);
            mesh->vertices[y * (CLOTH + 1) + x] = vertex(2.4f * u - 1.2f, 1.6f * v, depth * sinf(phase),
                                                         -dx / length, -dy / length, 1.0f / length, u, v);
        }
    }
}

static void place(Instance* instance, uint32_t mesh, float angle, float x, float y, float z) {
    const float c = cosf(angle), s = sinf(angle);
    const float rows[3][4] = {{c, 0, s, x}, {0, 1, 0, y}, {-s, 0, c, z}};
    instance->mesh = mesh;
    memcpy(instance->transform, rows, sizeof rows);
}

static void paint_textures(Scene* scene) {
    for (int y = 0; y < TEXTURE_SIZE; ++y) {
        for (int x = 0; x < TEXTURE_SIZE; ++x) {
            const bool light = (x / 8 + y / 8) % 2 == 0;
            const uint8_t tile[4] = {light ? 210 : 60, light ? 205 : 70, light ? 190 : 90, 255};
            memcpy(scene->textures[TEXTURE_TILES][y][x], tile, 4);
            const int dx = 2 * (x % 8) - 7, dy = 2 * (y % 8) - 7;
            const uint8_t leaf[4] = {40, (uint8_t)(120 + 8 * (x % 8)), 50, dx * dx + dy * dy < 45 ? 255 : 0};
            memcpy(scene->textures[TEXTURE_LEAVES][y][x], leaf, 4);
        }
    }
}

static void normalise(float* v) {
    const float length = sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int i = 0; i < 3; ++i) v[i] /= length;
}

static void place_camera(Camera* camera, float aspect) {
    const float eye[3] = {0.6f, 2.2f, 5.2f}, target[3] = {0, 0.7f, 0}, tangent = 0.42f;
    for (int i = 0; i < 3; ++i) camera->forward[i] = target[i] - eye[i], camera->eye[i] = eye[i];
    normalise(camera->forward);
    const float* f = camera->forward; /* right = forward x y, up = right x forward */
    camera->right[0] = -f[2], camera->right[1] = 0, camera->right[2] = f[0];
    normalise(camera->right);
    const float* r = camera->right;
    camera->up[0] = r[1] * f[2] - r[2] * f[1];
    camera->up[1] = r[2] * f[0] - r[0] * f[2];
    camera->up[2] = r[0] * f[1] - r[1] * f[0];
    for (int i = 0; i < 3; ++i) camera->right[i] *= tangent * aspect, camera->up[i] *= tangent;
    const float light[3] = {0.5f, 0.9f, 0.6f};
    memcpy(camera->light, light, sizeof light);
    normalise(camera->light);
}

void scene_create(Scene* scene, float aspect) {
    memset(scene, 0, sizeof *scene);
    make_floor(&scene->meshes[MESH_FLOOR]);
    make_cloth(&scene->meshes[MESH_CLOTH]);
    make_box(&scene->meshes[MESH_BOX]);
    make_leaves(&scene->meshes[MESH_LEAVES]);
    paint_textures(scene);
    place_camera(&scene->camera, aspect);
    scene->materials[MATERIAL_TILES] = (MaterialRecord){.texture = TEXTURE_TILES};
    scene->materials[MATERIAL_LEAVES] = (MaterialRecord){.texture = TEXTURE_LEAVES};
    scene->materials[MATERIAL_CLOTH] =
        (MaterialRecord){.scale = 6, .first = {0.8f, 0.15f, 0.1f, 1}, .second = {0.9f, 0.85f, 0.8f, 1}};
    scene->materials[MATERIAL_BOX] =
        (MaterialRecord){.scale = 2, .first = {0.2f, 0.3f, 0.7f, 1}, .second = {0.7f, 0.7f, 0.3f, 1}};
    scene->sky = (SkyRecord){{0.75f, 0.8f, 0.85f, 1}, {0.2f, 0.4f, 0.8f, 1}};
    scene_animate(scene, 0);
}

void scene_animate(Scene* scene, uint32_t frame) {
    const float time = (float)frame / 10.0f;
    wave_cloth(&scene->meshes[MESH_CLOTH], time);
    place(&scene->instances[0], MESH_FLOOR, 0, 0, 0, 0);
    place(&scene->instances[1], MESH_CLOTH, 0.2f, -0.2f, 0.4f, -0.8f);
    place(&scene->instances[2], MESH_BOX, time, 1.6f * cosf(time), 0.4f, 1.6f * sinf(time));
    place(&scene->instances[3], MESH_BOX, -time, -1.6f * cosf(time), 0.6f, -1.6f * sinf(time));
    place(&scene->instances[4], MESH_LEAVES, 0.5f * time + 0.4f, 1.5f, 0, 0.4f);
    place(&scene->instances[5], MESH_LEAVES, 1.1f - 0.5f * time, -1.4f, 0, 1.0f);
}

void scene_destroy(Scene* scene) {
    for (uint32_t i = 0; i < MESH_COUNT; ++i) {
        free(scene->meshes[i].vertices);
        free(scene->meshes[i].indices);
    }
}
