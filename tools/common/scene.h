// Scenes on the host: what the loaders and the built-in generators make, what
// the acceleration structures and the shaders' tables are built from.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "image_file.h"

namespace rtc::tools {

constexpr uint32_t kNoTexture = ~0u;

struct Material {
    std::string name;
    glm::vec3 base_color{0.8f};
    float metallic = 0.0f;
    glm::vec3 emission{0.0f};
    float roughness = 1.0f;
    uint32_t base_color_texture = kNoTexture;  // index into Scene::textures, linear RGBA
    bool emits_both_sides = false;             // else only the side that sees its vertices counter-clockwise
    bool alpha_tested = false;                 // texels of alpha < 0.5 are holes
};

// Triangles, or boxes for intersection shaders; never both.
struct Mesh {
    std::string name;
    std::vector<glm::vec3> positions;
    std::vector<glm::vec3> normals;   // one a vertex, or empty: flat shading
    std::vector<glm::vec2> uvs;       // one a vertex, or empty
    std::vector<uint32_t> indices;    // three a triangle
    std::vector<uint32_t> materials;  // one a triangle, or empty: `material` for all
    uint32_t material = 0;
    struct Box {
        glm::vec3 min, max;
    };
    std::vector<Box> boxes;  // non-empty: a procedural mesh, positions and indices are empty
    bool opaque = true;
    bool no_duplicate_any_hit = false;

    bool procedural() const { return !boxes.empty(); }
    size_t triangle_count() const { return indices.size() / 3; }
    size_t primitive_count() const { return procedural() ? boxes.size() : triangle_count(); }
    uint32_t triangle_material(size_t t) const { return materials.empty() ? material : materials[t]; }
};

struct Instance {
    uint32_t mesh = 0;
    glm::mat4 transform{1.0f};
    uint32_t custom_index = 0;  // 24 bits; the loaders set it to the instance's position
    uint32_t mask = 0xff;
    uint32_t sbt_offset = 0;  // 24 bits, in records
    uint32_t flags = 0;       // VkGeometryInstanceFlagsNV
};

struct PointLight {
    glm::vec3 position{0.0f};
    glm::vec3 intensity{0.0f};  // radiant intensity, W/sr
};

struct Camera {
    glm::vec3 eye{0.0f, 0.0f, 5.0f};
    glm::vec3 target{0.0f};
    glm::vec3 up{0.0f, 1.0f, 0.0f};
    float fov_y = 0.7f;  // radians
};

struct Scene {
    std::string name;
    std::vector<Mesh> meshes;
    std::vector<Material> materials;  // never empty after finish()
    std::vector<Instance> instances;
    std::vector<PointLight> lights;  // emissive triangles are lights too, see emissive_triangles()
    glm::vec3 sky_low{0.0f};         // radiance of the surroundings: below the horizon,
    glm::vec3 sky_high{0.0f};        // and at the zenith; linear in the direction's y between
    std::vector<Picture> textures;   // linear RGBA
    Camera camera;

    // Adds what may be missing (a material, custom indices, a camera that sees everything, a light if
    // nothing shines) and checks indices; throws Error naming what is wrong.
    void finish(bool has_camera);
    void bounds(glm::vec3& min, glm::vec3& max) const;
    size_t triangle_count() const;  // instances counted each
};

// A triangle of an emissive material in world space, with its place in the scene.
struct EmissiveTriangle {
    glm::vec3 v0, v1, v2;
    glm::vec3 emission;
    float area;
    uint32_t instance, triangle;
};
std::vector<EmissiveTriangle> emissive_triangles(const Scene& scene);

// .gltf, .glb, .obj (with .mtl), .ply by extension, or "builtin:NAME". Throws Error.
Scene load_scene(const std::string& path);
// "cornell", "spheres", "terrain", ... ; the list for help texts and error messages.
Scene builtin_scene(const std::string& name);
std::vector<std::string> builtin_scene_names();

}  // namespace rtc::tools
