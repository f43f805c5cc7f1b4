#include "scene_tables.h"

#include <cmath>

#include "error.h"

namespace rtc::tools {
namespace {

float luminance(const glm::vec3& color) { return glm::dot(color, glm::vec3(0.2126f, 0.7152f, 0.0722f)); }

// Vose's construction (1991) of Walker's alias table.
void make_alias_table(const std::vector<double>& weights, std::vector<float>& threshold,
                      std::vector<uint32_t>& alias) {
    const size_t count = weights.size();
    double sum = 0;
    for (double weight : weights) sum += weight;
    threshold.assign(count, 1.0f);
    alias.resize(count);
    std::vector<double> scaled(count);
    std::vector<uint32_t> small, large;
    for (uint32_t i = 0; i < count; ++i) {
        alias[i] = i;
        scaled[i] = weights[i] / sum * double(count);
        (scaled[i] < 1.0 ? small : large).push_back(i);
    }
    while (!small.empty() && !large.empty()) {
        const uint32_t low = small.back(), high = large.back();
        small.pop_back();
        threshold[low] = float(scaled[low]);
        alias[low] = high;
        scaled[high] -= 1.0 - scaled[low];
        if (scaled[high] < 1.0) {
            large.pop_back();
            small.push_back(high);
        }
    }
}

void add_lights(const Scene& scene, SceneTables& tables) {
    const std::vector<EmissiveTriangle> emitters = emissive_triangles(scene);
    // The alias index travels as a float.
    if (emitters.size() >= 1u << 24) throw Error("more than 2^24 emissive triangles");
    std::vector<double> powers;
    double total = 0;
    for (const EmissiveTriangle& emitter : emitters) {
        powers.push_back(double(luminance(emitter.emission)) * double(emitter.area));
        total += powers.back();
    }
    std::vector<float> threshold;
    std::vector<uint32_t> alias;
    make_alias_table(powers, threshold, alias);
    for (size_t i = 0; i < emitters.size(); ++i) {
        const EmissiveTriangle& emitter = emitters[i];
        const Mesh& mesh = scene.meshes[scene.instances[emitter.instance].mesh];
        const bool both = scene.materials[mesh.triangle_material(emitter.triangle)].emits_both_sides;
        tables.lights.emplace_back(emitter.v0, threshold[i]);
        tables.lights.emplace_back(emitter.v1 - emitter.v0, float(alias[i]));
        tables.lights.emplace_back(emitter.v2 - emitter.v0, luminance(emitter.emission));
        tables.lights.emplace_back(emitter.emission, both ? 1.0f : 0.0f);
    }
    for (const PointLight& light : scene.lights) {
        tables.lights.emplace_back(light.position, 0.0f);
        tables.lights.emplace_back(light.intensity, 0.0f);
    }
    if (scene.lights.empty()) tables.lights.resize(tables.lights.size() + 2, glm::vec4(0.0f));
    FrameBlock& frame = tables.frame;
    frame.emitter_count = uint32_t(emitters.size());
    frame.point_light_count = uint32_t(scene.lights.size());
    frame.emitter_chance = emitters.empty() ? 0.0f : scene.lights.empty() ? 1.0f : 0.5f;
    frame.emitter_pdf_scale = total > 0 ? float(double(frame.emitter_chance) / total) : 0.0f;
}

void add_camera(const Scene& scene, float aspect, FrameBlock& frame) {
    const Camera& camera = scene.camera;
    const glm::vec3 forward = glm::normalize(camera.target - camera.eye);
    if (!(glm::length(forward) > 0.5f)) throw Error("the camera's eye and target are the same point");
    // Straight up or down: any side will do.
    const bool upright = glm::length(glm::cross(forward, glm::normalize(camera.up))) > 1e-4f;
    const glm::vec3 up_hint = upright ? camera.up : glm::vec3(0, 0, -1);
    const glm::vec3 right = glm::normalize(glm::cross(forward, up_hint));
    const glm::vec3 up = glm::cross(right, forward);
    const float height = std::tan(0.5f * camera.fov_y);
    frame.eye = glm::vec4(camera.eye, 0.0f);
    frame.forward = glm::vec4(forward, 0.0f);
    frame.right = glm::vec4(right * (height * aspect), 0.0f);
    frame.up = glm::vec4(up * height, 0.0f);
    frame.sky_low = glm::vec4(scene.sky_low, 0.0f);
    frame.sky_high = glm::vec4(scene.sky_high, 0.0f);
}

}  // namespace

SceneTables make_tables(const Scene& scene, float aspect) {
    SceneTables tables;
    std::vector<uint32_t> first_triangle;
    for (const Mesh& mesh : scene.meshes) {
        const uint32_t first_vertex = uint32_t(tables.vertices.size());
        first_triangle.push_back(uint32_t(tables.triangles.size()));
        for (size_t v = 0; v < mesh.positions.size(); ++v) {
            const glm::vec2 uv = mesh.uvs.empty() ? glm::vec2(0) : mesh.uvs[v];
            const glm::vec3 normal = mesh.normals.empty() ? glm::vec3(0) : mesh.normals[v];
            tables.vertices.push_back({glm::vec4(mesh.positions[v], uv.x), glm::vec4(normal, uv.y)});
        }
        for (size_t t = 0; t < mesh.triangle_count(); ++t)
            tables.triangles.emplace_back(first_vertex + mesh.indices[3 * t],
                                          first_vertex + mesh.indices[3 * t + 1],
                                          first_vertex + mesh.indices[3 * t + 2], mesh.triangle_material(t));
    }
    if (tables.triangles.size() >= 1u << 24)
        throw Error("the scene has 2^24 triangles or more; the shaders' tables count them in floats");
    for (const Material& material : scene.materials)
        tables.materials.push_back(
            {glm::vec4(material.base_color, material.metallic),
             glm::vec4(material.emission, material.roughness),
             {material.base_color_texture, material.emits_both_sides ? 1u : 0u, 0, 0}});
    for (const Instance& instance : scene.instances) {
        InstanceEntry entry;
        const glm::mat4 rows = glm::transpose(instance.transform);
        // Rows of the inverse transpose are the columns of the inverse.
        const glm::mat3 inverse = glm::inverse(glm::mat3(instance.transform));
        for (int row = 0; row < 3; ++row) {
            entry.to_world[row] = rows[row];
            entry.to_normal[row] = glm::vec4(inverse[row], 0.0f);
        }
        entry.mesh = {first_triangle[instance.mesh], scene.meshes[instance.mesh].normals.empty() ? 0u : 1u, 0,
                      0};
        tables.instances.push_back(entry);
    }
    add_lights(scene, tables);
    add_camera(scene, aspect, tables.frame);
    return tables;
}

}  // namespace rtc::tools
