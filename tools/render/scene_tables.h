// The scene as testdata/shaders/render reads it: the C++ side of surface.glsl,
// lights.glsl and frame.glsl.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "scene.h"

namespace rtc::tools {

struct InstanceEntry {
    glm::vec4 to_world[3], to_normal[3];
    glm::vec4 mesh;  // numbers as floats: below 2^24
};
struct VertexEntry {
    glm::vec4 position_u, normal_v;
};
struct MaterialEntry {
    glm::vec4 color_metallic, emission_roughness;
    glm::vec4 texture_flags;
};
struct FrameBlock {
    glm::vec4 eye, right, up, forward, sky_low, sky_high;
    uint32_t max_bounces, shadow_samples, ao_samples, emitter_count, point_light_count;
    float emitter_chance, emitter_pdf_scale, reserved;
};

struct SceneTables {
    std::vector<InstanceEntry> instances;  // by custom index
    std::vector<VertexEntry> vertices;
    std::vector<glm::uvec4> triangles;
    std::vector<MaterialEntry> materials;
    std::vector<glm::vec4> lights;
    FrameBlock frame{};  // lights, camera and sky; the settings are the caller's
};

SceneTables make_tables(const Scene& scene, float aspect);

}  // namespace rtc::tools
