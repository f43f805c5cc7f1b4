// Scenes that need no file. All are deterministic.
#include <cmath>
#include <functional>
#include <glm/gtc/matrix_transform.hpp>
#include <map>

#include "error.h"
#include "mesh_tools.h"
#include "scene.h"
#include "scene_files.h"

namespace rtc::tools {
namespace {

uint32_t add_material(Scene& scene, const glm::vec3& color, float metallic = 0.0f, float roughness = 1.0f,
                      const glm::vec3& emission = glm::vec3(0.0f)) {
    Material material;
    material.base_color = color;
    material.metallic = metallic;
    material.roughness = roughness;
    material.emission = emission;
    scene.materials.push_back(material);
    return uint32_t(scene.materials.size() - 1);
}

uint32_t add_mesh(Scene& scene, Mesh mesh, const char* name) {
    mesh.name = name;
    scene.meshes.push_back(std::move(mesh));
    return uint32_t(scene.meshes.size() - 1);
}

void place(Scene& scene, uint32_t mesh, const glm::mat4& transform = glm::mat4(1.0f)) {
    Instance instance;
    instance.mesh = mesh;
    instance.transform = transform;
    scene.instances.push_back(instance);
}

// After the box photographed at Cornell in 1984; side 2, centre at the origin, open to +z.
Scene cornell() {
    Scene scene;
    const uint32_t white = add_material(scene, {0.73f, 0.71f, 0.68f});
    const uint32_t red = add_material(scene, {0.63f, 0.065f, 0.05f});
    const uint32_t green = add_material(scene, {0.14f, 0.45f, 0.091f});
    const uint32_t lamp = add_material(scene, {0.78f, 0.78f, 0.78f}, 0, 1, {24.0f, 18.0f, 10.0f});
    const uint32_t glaze = add_material(scene, {0.2f, 0.32f, 0.62f}, 0.0f, 0.35f);
    Mesh room = make_quad({-1, -1, -1}, {0, 0, 2}, {2, 0, 0}, white);    // floor
    append(room, make_quad({-1, 1, -1}, {2, 0, 0}, {0, 0, 2}, white));   // ceiling
    append(room, make_quad({-1, -1, -1}, {2, 0, 0}, {0, 2, 0}, white));  // back
    append(room, make_quad({-1, -1, -1}, {0, 2, 0}, {0, 0, 2}, red));    // left
    append(room, make_quad({1, -1, -1}, {0, 0, 2}, {0, 2, 0}, green));   // right
    place(scene, add_mesh(scene, room, "room"));
    // Just below the ceiling: coplanar surfaces would make ties of every hit there.
    place(scene,
          add_mesh(scene, make_quad({-0.32f, 0.995f, -0.3f}, {0.64f, 0, 0}, {0, 0, 0.6f}, lamp), "lamp"));
    const uint32_t block = add_mesh(scene, make_box({-0.3f, 0, -0.3f}, {0.3f, 0.6f, 0.3f}, white), "block");
    glm::mat4 tall = glm::translate(glm::mat4(1), {-0.35f, -1, -0.3f});
    tall = glm::scale(glm::rotate(tall, glm::radians(18.0f), {0, 1, 0}), {1, 2, 1});
    place(scene, block, tall);
    glm::mat4 small = glm::translate(glm::mat4(1), {0.35f, -1, 0.35f});
    place(scene, block, glm::rotate(small, glm::radians(-17.0f), {0, 1, 0}));
    const uint32_t ball = add_mesh(scene, make_icosphere(0.22f, 4, glaze), "ball");
    place(scene, ball, glm::translate(glm::mat4(1), {0.35f, -0.18f, 0.35f}));
    scene.camera = {{0, 0, 3.9f}, {0, 0, 0}, {0, 1, 0}, glm::radians(40.0f)};
    scene.finish(true);
    return scene;
}

void checkerboard(Scene& scene, float half, uint32_t tiles, float y, uint32_t even, uint32_t odd) {
    Mesh floor;
    const float size = 2 * half / float(tiles);
    for (uint32_t i = 0; i < tiles; ++i)
        for (uint32_t k = 0; k < tiles; ++k)
            append(floor, make_quad({-half + float(i) * size, y, -half + float(k) * size}, {0, 0, size},
                                    {size, 0, 0}, (i + k) % 2 ? odd : even));
    place(scene, add_mesh(scene, floor, "floor"));
}

// Haines' sphere flake: nine children a third of the size around each sphere.
Scene spheres() {
    Scene scene;
    const uint32_t steel = add_material(scene, {0.9f, 0.9f, 0.92f}, 1.0f, 0.05f);
    const uint32_t dark = add_material(scene, {0.08f, 0.09f, 0.12f}, 0.0f, 0.3f);
    const uint32_t light = add_material(scene, {0.75f, 0.72f, 0.66f}, 0.0f, 0.3f);
    const uint32_t gold = add_material(scene, {1.0f, 0.76f, 0.33f}, 1.0f, 0.1f);
    const uint32_t big = add_mesh(scene, make_icosphere(1.0f, 5, steel), "sphere");
    const uint32_t little = add_mesh(scene, make_icosphere(1.0f, 3, gold), "small sphere");
    const std::function<void(glm::mat4, int)> grow = [&](glm::mat4 frame, int depth) {
        place(scene, depth < 2 ? big : little, frame);
        if (depth == 3) return;
        for (int child = 0; child < 9; ++child) {
            const bool equator = child < 6;
            const float turn = glm::radians(equator ? 60.0f * float(child) : 120.0f * float(child) + 30.0f);
            const float tilt = glm::radians(equator ? 90.0f : 35.0f);
            const glm::vec3 axis(std::sin(tilt) * std::cos(turn), std::cos(tilt),
                                 std::sin(tilt) * std::sin(turn));
            const glm::vec3 side = glm::normalize(
                glm::cross(axis, std::abs(axis.y) < 0.9f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0)));
            glm::mat4 local(1.0f);
            local[0] = glm::vec4(side / 3.0f, 0);
            local[1] = glm::vec4(axis / 3.0f, 0);
            local[2] = glm::vec4(glm::cross(side, axis) / 3.0f, 0);
            local[3] = glm::vec4(axis * (4.0f / 3.0f), 1);
            grow(frame * local, depth + 1);
        }
    };
    grow(glm::mat4(1.0f), 0);
    checkerboard(scene, 12.0f, 24, -1.0f, light, dark);
    scene.lights.push_back({{4, 6, 5}, glm::vec3(220.0f)});
    scene.sky_low = {0.62f, 0.7f, 0.8f};
    scene.sky_high = {0.06f, 0.16f, 0.5f};
    scene.camera = {{2.6f, 2.0f, 4.2f}, {0, 0.25f, 0}, {0, 1, 0}, glm::radians(40.0f)};
    scene.finish(true);
    return scene;
}

float lattice_noise(int x, int z) {
    uint32_t h = uint32_t(x) * 0x8da6b343u ^ uint32_t(z) * 0xd8163841u;
    h = (h ^ (h >> 13)) * 0x85ebca6bu;
    return float((h ^ (h >> 16)) & 0xffffffu) / float(0xffffff);
}

float value_noise(float x, float z) {
    const float fx = std::floor(x), fz = std::floor(z);
    const int ix = int(fx), iz = int(fz);
    auto ease = [](float t) { return t * t * (3 - 2 * t); };
    const float u = ease(x - fx), v = ease(z - fz);
    return glm::mix(glm::mix(lattice_noise(ix, iz), lattice_noise(ix + 1, iz), u),
                    glm::mix(lattice_noise(ix, iz + 1), lattice_noise(ix + 1, iz + 1), u), v);
}

Scene terrain() {
    constexpr int kCells = 256;
    Scene scene;
    const uint32_t rock = add_material(scene, {0.45f, 0.4f, 0.34f});
    const uint32_t grass = add_material(scene, {0.22f, 0.34f, 0.12f});
    const uint32_t snow = add_material(scene, {0.9f, 0.92f, 0.95f});
    Mesh mesh;
    for (int z = 0; z <= kCells; ++z)
        for (int x = 0; x <= kCells; ++x) {
            float height = 0, amplitude = 0.5f, frequency = 4.0f / kCells;
            for (int octave = 0; octave < 7; ++octave, amplitude *= 0.5f, frequency *= 2.0f)
                height += amplitude * value_noise(float(x) * frequency + 7.3f, float(z) * frequency + 1.7f);
            mesh.positions.push_back(
                {10.0f * float(x) / kCells - 5.0f, 3.2f * height * height, 10.0f * float(z) / kCells - 5.0f});
        }
    for (int z = 0; z < kCells; ++z)
        for (int x = 0; x < kCells; ++x) {
            const uint32_t a = uint32_t(z * (kCells + 1) + x), b = a + 1, c = a + kCells + 1, d = c + 1;
            for (const glm::uvec3& t : {glm::uvec3(a, c, b), glm::uvec3(b, c, d)}) {
                mesh.indices.insert(mesh.indices.end(), {t.x, t.y, t.z});
                const glm::vec3 &p = mesh.positions[t.x], &q = mesh.positions[t.y], &r = mesh.positions[t.z];
                const glm::vec3 normal = glm::normalize(glm::cross(q - p, r - p));
                mesh.materials.push_back(normal.y < 0.72f ? rock : p.y > 1.25f ? snow : grass);
            }
        }
    // Smooth shading keeps the vertices' order here, and with it the materials': nothing is creased.
    add_smooth_normals(mesh, 180.0f);
    place(scene, add_mesh(scene, mesh, "terrain"));
    scene.lights.push_back({{-14, 16, 9}, glm::vec3(1700.0f, 1550.0f, 1250.0f)});
    scene.sky_low = {0.5f, 0.55f, 0.62f};
    scene.sky_high = {0.22f, 0.4f, 0.75f};
    scene.camera = {{4.2f, 3.4f, 5.2f}, {-0.4f, 0.5f, -0.6f}, {0, 1, 0}, glm::radians(45.0f)};
    scene.finish(true);
    return scene;
}

// Every surface reflects a part of the light and emits the rest, the surroundings shine with 1: the
// radiance is exactly 1 in every direction, whatever the shape. Next-event estimation, emission by
// chance, their weights and Russian roulette all have to be right for the mean to be 1.
Scene furnace() {
    Scene scene;
    const float reflectances[] = {0.5f, 0.7f, 0.3f};
    uint32_t materials[3];
    for (int i = 0; i < 3; ++i) {
        materials[i] =
            add_material(scene, glm::vec3(reflectances[i]), 0, 1, glm::vec3(1.0f - reflectances[i]));
        scene.materials[materials[i]].emits_both_sides = true;
    }
    place(scene, add_mesh(scene, make_quad({-2, -1, -2}, {0, 0, 4}, {4, 0, 0}, materials[0]), "floor"));
    const uint32_t box = add_mesh(scene, make_box(glm::vec3(-0.5f), glm::vec3(0.5f), materials[1]), "box");
    place(scene, box, glm::rotate(glm::translate(glm::mat4(1), {-0.6f, -0.4f, 0}), 0.6f, {0.3f, 1.0f, 0.1f}));
    place(scene, box, glm::scale(glm::translate(glm::mat4(1), {0.8f, -0.5f, -0.5f}), {0.6f, 1.0f, 0.6f}));
    Mesh faceted = make_icosphere(0.5f, 1, materials[2]);
    faceted.normals.clear();  // interpolated normals do not conserve energy
    place(scene, add_mesh(scene, faceted, "ball"), glm::translate(glm::mat4(1), {0.3f, -0.3f, 0.7f}));
    scene.sky_low = scene.sky_high = glm::vec3(1.0f);
    scene.camera = {{0.4f, 0.8f, 3.2f}, {0, -0.4f, 0}, {0, 1, 0}, glm::radians(45.0f)};
    scene.finish(true);
    return scene;
}

// A white floor, a rectangular lamp above it, and between them a half plane whose edge is parallel to
// the lamp: where the shadow falls has a closed form (tests/unit/render). Seen from straight above
// the floor, between floor and occluder.
Scene penumbra() {
    Scene scene;
    const uint32_t white = add_material(scene, glm::vec3(0.5f));
    const uint32_t black = add_material(scene, glm::vec3(0.0f));
    const uint32_t lamp = add_material(scene, glm::vec3(0.0f), 0, 1, glm::vec3(10.0f));
    place(scene, add_mesh(scene, make_quad({-4, 0, -4}, {0, 0, 8}, {8, 0, 0}, white), "floor"));
    place(scene, add_mesh(scene, make_quad({-0.5f, 4, -0.5f}, {1, 0, 0}, {0, 0, 1}, lamp), "lamp"));
    place(scene, add_mesh(scene, make_quad({-20, 2, -20}, {20, 0, 0}, {0, 0, 40}, black), "half plane"));
    scene.camera = {{0, 1.9f, 0}, {0, 0, 0}, {0, 0, -1}, 2.0f * std::atan(1.0f / 1.9f)};
    scene.finish(true);
    return scene;
}

constexpr const char* kBunnyPath = "/usr/share/glmark2/models/bunny.obj";

Scene bunny() {
    Scene scene;
    try {
        scene = load_obj(kBunnyPath);
    } catch (const Error&) {
        throw Error(std::string("builtin:bunny needs ") + kBunnyPath + " (Debian package glmark2-data)");
    }
    scene.materials.clear();
    scene.lights.clear();
    const uint32_t clay = add_material(scene, {0.62f, 0.24f, 0.11f}, 0.0f, 0.35f);
    const uint32_t stone = add_material(scene, {0.5f, 0.5f, 0.48f});
    const uint32_t lamp = add_material(scene, glm::vec3(0.0f), 0, 1, {30.0f, 26.0f, 20.0f});
    glm::vec3 low, high;
    scene.bounds(low, high);
    const float size = high.y - low.y;
    for (Mesh& mesh : scene.meshes) {
        mesh.materials.clear();
        mesh.material = clay;
    }
    const glm::vec3 foot((low.x + high.x) * 0.5f, low.y, (low.z + high.z) * 0.5f);
    const glm::mat4 frame = glm::translate(glm::scale(glm::mat4(1), glm::vec3(1.0f / size)), -foot);
    for (Instance& instance : scene.instances) instance.transform = frame * instance.transform;
    place(scene, add_mesh(scene, make_quad({-6, 0, -6}, {0, 0, 12}, {12, 0, 0}, stone), "floor"));
    place(scene,
          add_mesh(scene, make_quad({-1.9f, 2.2f, 0.2f}, {0.9f, 0.35f, 0}, {0, 0, 0.9f}, lamp), "lamp"));
    scene.sky_low = {0.2f, 0.27f, 0.4f};
    scene.sky_high = {0.2f, 0.33f, 0.6f};
    scene.camera = {{0.25f, 0.85f, 2.35f}, {-0.02f, 0.46f, 0}, {0, 1, 0}, glm::radians(32.0f)};
    scene.name = "builtin:bunny";
    scene.finish(true);
    return scene;
}

const std::map<std::string, Scene (*)()>& generators() {
    static const std::map<std::string, Scene (*)()> table = {{"cornell", cornell},   {"spheres", spheres},
                                                             {"terrain", terrain},   {"furnace", furnace},
                                                             {"penumbra", penumbra}, {"bunny", bunny}};
    return table;
}

}  // namespace

std::vector<std::string> builtin_scene_names() {
    std::vector<std::string> names;
    for (const auto& [name, generator] : generators()) names.push_back(name);
    return names;
}

Scene builtin_scene(const std::string& name) {
    auto found = generators().find(name);
    if (found == generators().end()) {
        std::string list;
        for (const std::string& known : builtin_scene_names()) list += " " + known;
        throw Error("no built-in scene '" + name + "'; there are:" + list);
    }
    Scene scene = found->second();
    scene.name = "builtin:" + name;
    return scene;
}

Scene load_scene(const std::string& path) {
    constexpr const char* kBuiltin = "builtin:";
    if (path.rfind(kBuiltin, 0) == 0) return builtin_scene(path.substr(8));
    auto ends_with = [&](const char* suffix) {
        const std::string end = suffix;
        return path.size() > end.size() && path.compare(path.size() - end.size(), end.size(), end) == 0;
    };
    if (ends_with(".gltf") || ends_with(".glb")) return load_gltf(path);
    if (ends_with(".obj")) return load_obj(path);
    throw Error(path + ": scenes are .gltf, .glb or .obj files, or builtin:NAME");
}

}  // namespace rtc::tools
