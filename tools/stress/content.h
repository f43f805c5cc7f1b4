// Random geometry, once as the bytes a build reads and once as what they mean.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <random>
#include <vector>

#include "host_scene.h"

namespace rtc::stress {

using lab::Box;
using lab::Transform;
using lab::Triangle;
using lab::Vec3;
using Random = std::mt19937_64;

// Uniform in [0, n), [low, high); log_uniform favours small numbers and can be 0.
uint64_t below(Random& random, uint64_t n);
double between(Random& random, double low, double high);
uint64_t log_uniform(Random& random, uint64_t most);
bool chance(Random& random, double probability);

struct Geometry {
    // As given to the build. Offsets are those of VkGeometryTrianglesNV and VkGeometryAABBNV.
    bool boxes = false;
    VkGeometryFlagsNV flags = 0;
    VkFormat format = VK_FORMAT_R32G32B32_SFLOAT;
    uint32_t stride = 12, offset = 0, vertex_count = 0;
    std::vector<uint8_t> data;  // vertices or boxes
    VkIndexType index_type = VK_INDEX_TYPE_NONE_NV;
    uint32_t index_offset = 0, index_count = 0;
    std::vector<uint8_t> indices;
    bool transformed = false;
    uint32_t transform_offset = 0;
    Transform transform = lab::kIdentity;

    // What it means: a triangle or box a primitive, inactive ones with a NaN in their first number.
    std::vector<Triangle> triangles;
    std::vector<Box> box_list;
    // Vertices are known to this many units of 2^-24 of their size (SNORM: division rounds as it likes).
    double vertex_error = 0;

    size_t primitives() const { return boxes ? box_list.size() : triangles.size(); }
};

struct Content {
    bool boxes = false;
    std::vector<Geometry> geometries;
    size_t primitives() const;
};

// Up to `most` primitives in 0 to 6 geometries of one kind; `large`: more than half of them in one of triangles.
Content make_content(Random& random, uint64_t most, bool large = false);
// Other vertices or boxes, with all that an update must leave as it is: counts, formats, flags, indices and
// which primitives are inactive.
void move_content(Content& content, Random& random);

}  // namespace rtc::stress
