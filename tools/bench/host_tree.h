// Trees on the host: the reference that the device's builders are measured against, and the measures. A tree is kept
// as include/rtc/abi.h lays nodes out, so that one read back from the device is walked by the same code.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace rtc::bench {

struct HostTriangle {
    glm::vec3 v[3];
};

struct HostBox {
    glm::vec3 low{3.402823466e38f}, high{-3.402823466e38f};
    void add(const glm::vec3& p) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    void add(const HostBox& b) {
        low = glm::min(low, b.low);
        high = glm::max(high, b.high);
    }
    float half_area() const {
        const glm::vec3 e = high - low;
        return e.x < 0 ? 0.0f : e.x * e.y + e.y * e.z + e.z * e.x;
    }
};

struct HostNode {
    HostBox box[2];
    uint32_t child[2];  // RTC_REF_*
};

struct HostTree {
    std::vector<HostNode> nodes;      // 0 is the root
    std::vector<HostTriangle> slots;  // what leaves name
};

// Top down, `bins` bins on the widest axis of the centres and on the others, surface area heuristic (Wald 2007), then
// leaves of at most four triangles where that is cheaper. One triangle at least.
HostTree build_binned_sah(const std::vector<HostTriangle>& triangles, uint32_t bins = 32);

struct TreeMeasure {
    double sah_cost = 0;  // 1.2 a node and 1 a triangle, by area against the root's
    uint32_t depth = 0;   // inner nodes on the longest path
    size_t nodes = 0;
    double nodes_per_ray = 0, triangles_per_ray = 0;  // of the rays given
};

struct HostRay {
    glm::vec3 origin, direction;
    float longest = 1e30f;
    bool any_hit = false;  // stop at the first
};

// The nearest child first, boxes beyond the hit skipped, as the traversal does.
TreeMeasure measure_tree(const HostTree& tree, const std::vector<HostRay>& rays);

// Distance to the first hit, or a negative number.
float first_hit(const HostTree& tree, const HostRay& ray);

// Rays of a camera that sees the whole box, and `bounces` of them from where they hit, in cosine-weighted directions.
std::vector<HostRay> make_rays(const HostTree& tree, const glm::vec3& eye, const glm::vec3& target, float fov,
                               uint32_t side);

}  // namespace rtc::bench
