#include "scene.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "error.h"

namespace rtc::tools {
namespace {

void check_mesh(const Scene& scene, const Mesh& mesh) {
    const std::string where = "mesh '" + mesh.name + "': ";
    if (mesh.procedural() && !mesh.indices.empty()) throw Error(where + "has both boxes and triangles");
    if (mesh.indices.size() % 3) throw Error(where + "its index count is not a multiple of 3");
    for (uint32_t index : mesh.indices)
        if (index >= mesh.positions.size())
            throw Error(where + "index " + std::to_string(index) + " beyond its " +
                        std::to_string(mesh.positions.size()) + " vertices");
    if (!mesh.normals.empty() && mesh.normals.size() != mesh.positions.size())
        throw Error(where + "has normals for some vertices only");
    if (!mesh.uvs.empty() && mesh.uvs.size() != mesh.positions.size())
        throw Error(where + "has texture coordinates for some vertices only");
    if (!mesh.materials.empty() && mesh.materials.size() != mesh.triangle_count())
        throw Error(where + "has materials for some triangles only");
    for (size_t t = 0; t < mesh.triangle_count(); ++t)
        if (mesh.triangle_material(t) >= scene.materials.size())
            throw Error(where + "names material " + std::to_string(mesh.triangle_material(t)) + " of " +
                        std::to_string(scene.materials.size()));
}

Camera camera_around(const Scene& scene) {
    glm::vec3 low, high;
    scene.bounds(low, high);
    const glm::vec3 centre = 0.5f * (low + high);
    const float radius = std::max(0.5f * glm::length(high - low), 1e-6f);
    Camera camera;
    camera.target = centre;
    const float distance = radius / std::sin(0.5f * camera.fov_y);
    camera.eye = centre + distance * glm::normalize(glm::vec3(0.35f, 0.3f, 1.0f));
    return camera;
}

}  // namespace

void Scene::bounds(glm::vec3& low, glm::vec3& high) const {
    low = glm::vec3(std::numeric_limits<float>::max());
    high = -low;
    for (const Instance& instance : instances) {
        const Mesh& mesh = meshes[instance.mesh];
        auto add = [&](const glm::vec3& point) {
            const glm::vec3 world(instance.transform * glm::vec4(point, 1.0f));
            low = glm::min(low, world);
            high = glm::max(high, world);
        };
        for (uint32_t index : mesh.indices) add(mesh.positions[index]);
        for (const Mesh::Box& box : mesh.boxes)
            for (int corner = 0; corner < 8; ++corner)
                add({corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y,
                     corner & 4 ? box.max.z : box.min.z});
    }
    if (low.x > high.x) low = high = glm::vec3(0.0f);
}

size_t Scene::triangle_count() const {
    size_t count = 0;
    for (const Instance& instance : instances) count += meshes[instance.mesh].triangle_count();
    return count;
}

void Scene::finish(bool has_camera) {
    if (materials.empty()) materials.emplace_back();
    for (const Material& material : materials)
        if (material.base_color_texture != kNoTexture && material.base_color_texture >= textures.size())
            throw Error("material '" + material.name + "' names a texture that is not there");
    for (const Mesh& mesh : meshes) check_mesh(*this, mesh);
    for (const Instance& instance : instances)
        if (instance.mesh >= meshes.size()) throw Error("an instance names a mesh that is not there");
    if (instances.empty()) throw Error("the scene is empty");
    for (size_t i = 0; i < instances.size(); ++i) instances[i].custom_index = uint32_t(i);
    if (!has_camera) camera = camera_around(*this);
    if (lights.empty() && sky_low == glm::vec3(0) && sky_high == glm::vec3(0) &&
        emissive_triangles(*this).empty()) {
        sky_low = glm::vec3(0.25f, 0.24f, 0.22f);
        sky_high = glm::vec3(0.55f, 0.7f, 0.95f);
        // A point light near the camera, bright enough for the scene's size.
        const float distance = glm::length(camera.eye - camera.target);
        lights.push_back(
            {camera.eye + glm::vec3(0.5f, 1.0f, 0.2f) * distance, glm::vec3(6.0f * distance * distance)});
    }
}

std::vector<EmissiveTriangle> emissive_triangles(const Scene& scene) {
    std::vector<EmissiveTriangle> found;
    for (uint32_t i = 0; i < scene.instances.size(); ++i) {
        const Instance& instance = scene.instances[i];
        const Mesh& mesh = scene.meshes[instance.mesh];
        for (uint32_t t = 0; t < mesh.triangle_count(); ++t) {
            const Material& material = scene.materials[mesh.triangle_material(t)];
            if (std::max({material.emission.x, material.emission.y, material.emission.z}) <= 0.0f) continue;
            glm::vec3 v[3];
            for (int k = 0; k < 3; ++k)
                v[k] =
                    glm::vec3(instance.transform * glm::vec4(mesh.positions[mesh.indices[3 * t + k]], 1.0f));
            const float area = 0.5f * glm::length(glm::cross(v[1] - v[0], v[2] - v[0]));
            if (area > 0.0f) found.push_back({v[0], v[1], v[2], material.emission, area, i, t});
        }
    }
    return found;
}

}  // namespace rtc::tools
