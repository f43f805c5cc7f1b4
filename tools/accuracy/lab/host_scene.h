// Scenes built on the host into abi.h's layout: a plain builder that the
// laboratory understands completely, so that what it measures is traversal.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace rtc::lab {

struct Vec3 {
    float x = 0, y = 0, z = 0;
    float operator[](int i) const { return i == 0 ? x : (i == 1 ? y : z); }
    bool operator==(const Vec3&) const = default;
};

using Triangle = std::array<Vec3, 3>;

struct Box {
    Vec3 min, max;
};

struct Geometry {
    std::vector<Triangle> triangles;  // or
    std::vector<Box> boxes;
    bool opaque = true;
};

struct Blas {
    std::vector<Geometry> geometries;  // all triangles or all boxes
};

// Rows of a 3x4 matrix, object to world.
using Transform = std::array<std::array<float, 4>, 3>;
constexpr Transform kIdentity = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

struct Instance {
    uint32_t blas = 0;
    Transform object_to_world = kIdentity;
    uint32_t custom_index = 0;
    uint32_t mask = 0xff;
    uint32_t sbt_offset = 0;
    uint32_t flags = 0;  // RTC_INSTANCE_*
};

struct BuildOptions {
    uint32_t leaf_size = 4;
    // One primitive split off at each of the first levels. 46 leaves 14 levels for the rest.
    uint32_t chain = 0;
    float inflate = 0;  // boxes grow by this much of the structure's size: a tree that culls nothing near
};

// Heap words of a scene; quad `root` is the top level.
struct HostScene {
    std::vector<uint32_t> heap;
    uint32_t root = 0;
    std::vector<Transform> world_to_object;  // as traversal reads it
    uint32_t max_depth = 0;
    // What it was built from, for tracers that build their own.
    std::vector<Blas> blases;
    std::vector<Instance> instances;
};

HostScene build_scene(const std::vector<Blas>& blases, const std::vector<Instance>& instances,
                      const BuildOptions& options = {});

// Inverse in double, rounded once.
Transform invert(const Transform& m);

// The object-space ray as traversal computes it, float for float.
Vec3 transform_point(const Transform& m, const Vec3& p);
Vec3 transform_vector(const Transform& m, const Vec3& v);

}  // namespace rtc::lab
