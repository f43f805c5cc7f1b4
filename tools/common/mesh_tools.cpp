#include "mesh_tools.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <unordered_map>

namespace rtc::tools {
namespace {

struct Vec3Hash {
    size_t operator()(const glm::vec3& v) const {
        uint32_t bits[3];
        std::memcpy(bits, &v, sizeof bits);
        size_t hash = 1469598103934665603ull;
        for (uint32_t word : bits) hash = (hash ^ word) * 1099511628211ull;
        return hash;
    }
};

}  // namespace

void add_smooth_normals(Mesh& mesh, float crease_degrees) {
    const size_t triangles = mesh.triangle_count();
    const float crease = std::cos(glm::radians(crease_degrees));
    std::vector<glm::vec3> areas(triangles);  // normal times twice the area: the usual weight
    std::unordered_map<glm::vec3, std::vector<uint32_t>, Vec3Hash> around;
    for (size_t t = 0; t < triangles; ++t) {
        const glm::vec3& a = mesh.positions[mesh.indices[3 * t]];
        const glm::vec3& b = mesh.positions[mesh.indices[3 * t + 1]];
        const glm::vec3& c = mesh.positions[mesh.indices[3 * t + 2]];
        areas[t] = glm::cross(b - a, c - a);
        for (const glm::vec3& corner : {a, b, c}) around[corner].push_back(uint32_t(t));
    }
    Mesh smooth;
    std::map<std::pair<uint32_t, std::array<float, 3>>, uint32_t> known;
    for (size_t t = 0; t < triangles; ++t)
        for (int k = 0; k < 3; ++k) {
            const uint32_t index = mesh.indices[3 * t + k];
            const float length = glm::length(areas[t]);
            glm::vec3 sum(0.0f);
            for (uint32_t other : around[mesh.positions[index]]) {
                const float product = length * glm::length(areas[other]);
                if (other == t || glm::dot(areas[t], areas[other]) >= crease * product) sum += areas[other];
            }
            const float norm = glm::length(sum);
            const glm::vec3 normal = norm > 0 ? sum / norm : glm::vec3(0, 1, 0);
            auto [place, fresh] =
                known.try_emplace({index, {normal.x, normal.y, normal.z}}, uint32_t(smooth.positions.size()));
            if (fresh) {
                smooth.positions.push_back(mesh.positions[index]);
                smooth.normals.push_back(normal);
                if (!mesh.uvs.empty()) smooth.uvs.push_back(mesh.uvs[index]);
            }
            smooth.indices.push_back(place->second);
        }
    mesh.positions = std::move(smooth.positions);
    mesh.normals = std::move(smooth.normals);
    mesh.uvs = std::move(smooth.uvs);
    mesh.indices = std::move(smooth.indices);
}

Mesh make_quad(const glm::vec3& corner, const glm::vec3& edge_u, const glm::vec3& edge_v, uint32_t material) {
    Mesh mesh;
    mesh.positions = {corner, corner + edge_u, corner + edge_u + edge_v, corner + edge_v};
    mesh.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    mesh.indices = {0, 1, 2, 0, 2, 3};
    mesh.material = material;
    return mesh;
}

Mesh make_box(const glm::vec3& low, const glm::vec3& high, uint32_t material) {
    const glm::vec3 x(high.x - low.x, 0, 0), y(0, high.y - low.y, 0), z(0, 0, high.z - low.z);
    Mesh mesh = make_quad(low, y, x, material);
    append(mesh, make_quad(low + z, x, y, material));
    append(mesh, make_quad(low, z, y, material));
    append(mesh, make_quad(low + x, y, z, material));
    append(mesh, make_quad(low, x, z, material));
    append(mesh, make_quad(low + y, z, x, material));
    return mesh;
}

Mesh make_icosphere(float radius, uint32_t subdivisions, uint32_t material) {
    const float g = 0.5f * (1.0f + std::sqrt(5.0f));
    std::vector<glm::vec3> points = {{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0},
                                     {0, -1, g}, {0, 1, g}, {0, -1, -g}, {0, 1, -g},
                                     {g, 0, -1}, {g, 0, 1}, {-g, 0, -1}, {-g, 0, 1}};
    for (glm::vec3& point : points) point = glm::normalize(point);
    std::vector<uint32_t> indices = {0, 11, 5,  0, 5,  1, 0, 1, 7, 0, 7,  10, 0, 10, 11, 1, 5, 9, 5, 11,
                                     4, 11, 10, 2, 10, 7, 6, 7, 1, 8, 3,  9,  4, 3,  4,  2, 3, 2, 6, 3,
                                     6, 8,  3,  8, 9,  4, 9, 5, 2, 4, 11, 6,  2, 10, 8,  6, 7, 9, 8, 1};
    for (uint32_t level = 0; level < subdivisions; ++level) {
        std::map<std::pair<uint32_t, uint32_t>, uint32_t> middles;
        auto middle = [&](uint32_t a, uint32_t b) {
            auto [place, fresh] = middles.try_emplace(std::minmax(a, b), uint32_t(points.size()));
            if (fresh) points.push_back(glm::normalize(points[a] + points[b]));
            return place->second;
        };
        std::vector<uint32_t> finer;
        for (size_t t = 0; t < indices.size(); t += 3) {
            const uint32_t a = indices[t], b = indices[t + 1], c = indices[t + 2];
            const uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            finer.insert(finer.end(), {a, ab, ca, b, bc, ab, c, ca, bc, ab, bc, ca});
        }
        indices = std::move(finer);
    }
    Mesh mesh;
    mesh.normals = points;
    for (const glm::vec3& point : points) mesh.positions.push_back(radius * point);
    mesh.indices = std::move(indices);
    mesh.material = material;
    return mesh;
}

void append(Mesh& mesh, const Mesh& more) {
    if (mesh.materials.empty()) mesh.materials.assign(mesh.triangle_count(), mesh.material);
    // Flat and smooth meshes, with and without coordinates, can meet only by dropping what one lacks.
    if (mesh.normals.size() != mesh.positions.size() || more.normals.empty()) mesh.normals.clear();
    if (mesh.uvs.size() != mesh.positions.size() || more.uvs.empty()) mesh.uvs.clear();
    const bool normals = !more.normals.empty() && (mesh.positions.empty() || !mesh.normals.empty());
    const bool uvs = !more.uvs.empty() && (mesh.positions.empty() || !mesh.uvs.empty());
    const uint32_t first = uint32_t(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), more.positions.begin(), more.positions.end());
    if (normals) mesh.normals.insert(mesh.normals.end(), more.normals.begin(), more.normals.end());
    if (uvs) mesh.uvs.insert(mesh.uvs.end(), more.uvs.begin(), more.uvs.end());
    for (uint32_t index : more.indices) mesh.indices.push_back(first + index);
    for (size_t t = 0; t < more.triangle_count(); ++t) mesh.materials.push_back(more.triangle_material(t));
}

}  // namespace rtc::tools
