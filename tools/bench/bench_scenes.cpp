#include "bench_scenes.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>

#include "error.h"

namespace rtc::bench {
namespace {

using tools::Mesh;
using tools::Scene;

// PCG-RXS-M-XS 32 (M. O'Neill 2014): the same scene everywhere.
class Random {
  public:
    explicit Random(uint32_t seed) : state_(seed) {}
    float next() {  // [0, 1)
        state_ = state_ * 747796405u + 2891336453u;
        uint32_t word = ((state_ >> ((state_ >> 28u) + 4u)) ^ state_) * 277803737u;
        word = (word >> 22u) ^ word;
        return float(word >> 8) * (1.0f / 16777216.0f);
    }
    glm::vec3 in_box() {
        const float x = next(), y = next(), z = next();
        return glm::vec3(x, y, z) * 2.0f - 1.0f;
    }
    glm::vec3 direction() {
        const float z = next() * 2.0f - 1.0f, phi = next() * 2.0f * std::numbers::pi_v<float>;
        const float r = std::sqrt(std::max(0.0f, 1.0f - z * z));
        return {r * std::cos(phi), r * std::sin(phi), z};
    }

  private:
    uint32_t state_;
};

void add_triangle(Mesh& mesh, const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
    const uint32_t first = uint32_t(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), {a, b, c});
    mesh.indices.insert(mesh.indices.end(), {first, first + 1, first + 2});
}

// Light, camera and material that all share, so that the workloads ask the same of each.
Scene staged(Mesh mesh, const char* name, const glm::vec3& eye) {
    Scene scene;
    tools::Material material;
    material.base_color = {0.7f, 0.68f, 0.62f};
    scene.materials.push_back(material);
    mesh.name = name;
    scene.meshes.push_back(std::move(mesh));
    scene.instances.push_back({});
    scene.lights.push_back({{6, 9, 7}, glm::vec3(300.0f)});
    scene.sky_low = {0.35f, 0.33f, 0.3f};
    scene.sky_high = {0.2f, 0.35f, 0.7f};
    scene.camera = {eye, {0, 0, 0}, {0, 1, 0}, 0.7f};
    scene.name = std::string("bench:") + name;
    return scene;
}

Scene instances(double scale) {
    Scene scene = staged(make_blob(5000), "blob", {2.4f, 1.9f, 4.4f});
    scene.name = "bench:instances";
    scene.instances.clear();
    Random random(4);
    const uint32_t count = std::max(1u, uint32_t(2048 * scale));
    const float size = 0.9f / std::cbrt(float(count));
    for (uint32_t i = 0; i < count; ++i) {
        tools::Instance instance;
        glm::mat4 transform = glm::translate(glm::mat4(1), random.in_box() * 1.3f);
        transform = glm::rotate(transform, random.next() * 6.28f, random.direction());
        instance.transform = glm::scale(transform, glm::vec3(size * (0.5f + random.next())));
        scene.instances.push_back(instance);
    }
    return scene;
}

}  // namespace

// A sphere with bumps of several sizes, triangles in rows from pole to pole.
Mesh make_blob(size_t triangles) {
    const uint32_t n = std::max(3u, uint32_t(std::lround(std::sqrt(double(triangles) / 2))));
    Mesh mesh;
    for (uint32_t i = 0; i <= n; ++i)
        for (uint32_t k = 0; k <= n; ++k) {
            const float theta = std::numbers::pi_v<float> * float(i) / float(n);
            const float phi = 2 * std::numbers::pi_v<float> * float(k % n) / float(n);
            const glm::vec3 d(std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi));
            float radius = 1.0f, amplitude = 0.12f, frequency = 3.0f;
            for (int octave = 0; octave < 5; ++octave, amplitude *= 0.5f, frequency *= 2.1f)
                radius += amplitude * std::sin(frequency * d.x + 1.3f * float(octave)) *
                          std::sin(frequency * d.y + 2.1f) * std::sin(frequency * d.z + 0.7f * float(octave));
            mesh.positions.push_back(d * radius);
        }
    for (uint32_t i = 0; i < n; ++i)
        for (uint32_t k = 0; k < n; ++k) {
            const uint32_t a = i * (n + 1) + k, b = a + 1, c = a + n + 1, d = c + 1;
            mesh.indices.insert(mesh.indices.end(), {a, b, c, b, d, c});
        }
    return mesh;
}

// Small triangles anywhere in a cube, in no order.
Mesh make_soup(size_t triangles) {
    Mesh mesh;
    Random random(1);
    const float size = 1.5f / std::cbrt(float(triangles));
    for (size_t t = 0; t < triangles; ++t) {
        const glm::vec3 centre = random.in_box();
        add_triangle(mesh, centre + random.direction() * size, centre + random.direction() * size,
                     centre + random.direction() * size);
    }
    return mesh;
}

// Hairs from a ball outward: ribbons of long thin triangles that cross each other.
Mesh make_strands(size_t triangles) {
    Mesh mesh;
    Random random(2);
    constexpr uint32_t kSegments = 32;
    const size_t strands = std::max<size_t>(1, triangles / (2 * kSegments));
    const float width = 0.6f / std::sqrt(float(strands)) * 0.25f;
    for (size_t s = 0; s < strands; ++s) {
        const glm::vec3 root = random.direction();
        glm::vec3 at = root * 0.35f, heading = glm::normalize(root + random.direction() * 0.7f);
        const glm::vec3 side = glm::normalize(glm::cross(heading, random.direction())) * width;
        const uint32_t first = uint32_t(mesh.positions.size());
        for (uint32_t i = 0; i <= kSegments; ++i) {
            const float taper = 1.0f - 0.8f * float(i) / kSegments;
            mesh.positions.insert(mesh.positions.end(), {at - side * taper, at + side * taper});
            at += heading * (1.3f / kSegments);
            heading = glm::normalize(heading + random.direction() * 0.35f - at * 0.04f);
        }
        for (uint32_t i = 0; i < kSegments; ++i) {
            const uint32_t a = first + 2 * i;
            mesh.indices.insert(mesh.indices.end(), {a, a + 1, a + 2, a + 1, a + 3, a + 2});
        }
    }
    return mesh;
}

std::vector<std::string> bench_scene_names() { return {"blob", "soup", "strands", "instances"}; }

Scene bench_scene(const std::string& name, double scale) {
    auto count = [&](double triangles) { return size_t(std::max(1.0, triangles * scale)); };
    Scene scene;
    if (name == "blob")
        scene = staged(make_blob(count(1e6)), "blob", {0.9f, 0.7f, 2.9f});
    else if (name == "soup")
        scene = staged(make_soup(count(2e5)), "soup", {1.4f, 1.1f, 3.6f});
    else if (name == "strands")
        scene = staged(make_strands(count(5e5)), "strands", {0.9f, 0.7f, 3.4f});
    else if (name == "instances")
        scene = instances(scale);
    else if (name.find('.') != std::string::npos || name.find(':') != std::string::npos)
        return tools::load_scene(name);
    else
        try {
            return tools::builtin_scene(name);
        } catch (const tools::Error&) {
            std::string list;
            for (const std::string& known : bench_scene_names()) list += " " + known;
            for (const std::string& known : tools::builtin_scene_names()) list += " " + known;
            if (name == "bunny") throw;  // known, but its file is missing
            throw tools::Error("no scene '" + name + "'; there are:" + list + ", and .gltf, .glb, .obj files");
        }
    scene.finish(true);
    return scene;
}

}  // namespace rtc::bench
