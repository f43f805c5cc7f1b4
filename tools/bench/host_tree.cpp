#include "host_tree.h"

#include <rtc/abi.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace rtc::bench {
namespace {

constexpr float kNodeCost = 1.2f, kSlotCost = 1.0f;  // as runtime/kernels/common.glsl weighs them

uint32_t leaf_ref(uint32_t first, uint32_t count) {
    return RTC_REF_LEAF | (count << RTC_REF_COUNT_SHIFT) | first;
}

class Builder {
  public:
    Builder(const std::vector<HostTriangle>& triangles, uint32_t bins) : triangles_(triangles), bins_(bins) {
        for (const HostTriangle& t : triangles) {
            HostBox box;
            for (const glm::vec3& v : t.v) box.add(v);
            boxes_.push_back(box);
            centers_.push_back(0.5f * box.low + 0.5f * box.high);
        }
        order_.resize(triangles.size());
        std::iota(order_.begin(), order_.end(), 0u);
    }

    HostTree build() {
        const uint32_t count = uint32_t(order_.size());
        tree_.nodes.reserve(count);
        tree_.nodes.emplace_back();
        if (count < 2) {
            tree_.nodes[0].box[0] = boxes_[0];
            tree_.nodes[0].child[0] = leaf_ref(0, 1);
            tree_.nodes[0].child[1] = RTC_REF_EMPTY;
            tree_.slots = triangles_;
            return std::move(tree_);
        }
        split_node(0, 0, count, bounds(0, count), true);
        for (uint32_t index : order_) tree_.slots.push_back(triangles_[index]);
        return std::move(tree_);
    }

  private:
    struct Made {
        uint32_t ref;
        double cost;  // not divided by the root's area
    };

    HostBox bounds(uint32_t begin, uint32_t end) const {
        HostBox box;
        for (uint32_t i = begin; i < end; ++i) box.add(boxes_[order_[i]]);
        return box;
    }

    Made make(uint32_t begin, uint32_t end) {
        const HostBox box = bounds(begin, end);
        const uint32_t count = end - begin;
        if (count == 1) return {leaf_ref(begin, 1), double(box.half_area()) * kSlotCost};
        const uint32_t node = uint32_t(tree_.nodes.size());
        tree_.nodes.emplace_back();
        const double split = split_node(node, begin, end, box, false);
        const double leaf = double(box.half_area()) * kSlotCost * count;
        if (count <= RTC_MAX_LEAF_SLOTS && leaf <= split) {
            tree_.nodes.resize(node);  // what was made below comes after it
            return {leaf_ref(begin, count), leaf};
        }
        return {node, split};
    }

    double split_node(uint32_t node, uint32_t begin, uint32_t end, const HostBox& box, bool) {
        const uint32_t middle = choose(begin, end);
        const HostBox left_box = bounds(begin, middle), right_box = bounds(middle, end);
        const Made left = make(begin, middle), right = make(middle, end);
        HostNode& made = tree_.nodes[node];
        made.box[0] = left_box;
        made.box[1] = right_box;
        made.child[0] = left.ref;
        made.child[1] = right.ref;
        return double(box.half_area()) * kNodeCost + left.cost + right.cost;
    }

    // Reorders the range and returns where its right half begins.
    uint32_t choose(uint32_t begin, uint32_t end) {
        const uint32_t count = end - begin;
        if (count <= 2) return begin + 1;
        HostBox centers;
        for (uint32_t i = begin; i < end; ++i) centers.add(centers_[order_[i]]);
        double best = std::numeric_limits<double>::max();
        int best_axis = -1;
        uint32_t best_bin = 0;
        std::vector<HostBox> bin_box(bins_);
        std::vector<uint32_t> bin_count(bins_);
        std::vector<double> right_cost(bins_);
        for (int axis = 0; axis < 3; ++axis) {
            const float low = centers.low[axis], extent = centers.high[axis] - low;
            if (!(extent > 0)) continue;
            std::fill(bin_box.begin(), bin_box.end(), HostBox());
            std::fill(bin_count.begin(), bin_count.end(), 0u);
            for (uint32_t i = begin; i < end; ++i) {
                const uint32_t b = bin(centers_[order_[i]][axis], low, extent);
                bin_box[b].add(boxes_[order_[i]]);
                ++bin_count[b];
            }
            HostBox box;
            uint32_t sum = 0;
            for (uint32_t b = bins_; b-- > 1;) {
                box.add(bin_box[b]);
                sum += bin_count[b];
                right_cost[b] = double(box.half_area()) * sum;
            }
            box = HostBox();
            sum = 0;
            for (uint32_t b = 0; b + 1 < bins_; ++b) {
                box.add(bin_box[b]);
                sum += bin_count[b];
                const double cost = double(box.half_area()) * sum + right_cost[b + 1];
                if (sum != 0 && sum != count && cost < best) {
                    best = cost;
                    best_axis = axis;
                    best_bin = b;
                }
            }
        }
        if (best_axis < 0) return begin + count / 2;  // all centres in one place
        const float low = centers.low[best_axis], extent = centers.high[best_axis] - low;
        const auto at = std::stable_partition(order_.begin() + begin, order_.begin() + end, [&](uint32_t index) {
            return bin(centers_[index][best_axis], low, extent) <= best_bin;
        });
        return uint32_t(at - order_.begin());
    }

    uint32_t bin(float center, float low, float extent) const {
        return std::min(bins_ - 1, uint32_t((center - low) / extent * float(bins_)));
    }

    const std::vector<HostTriangle>& triangles_;
    const uint32_t bins_;
    std::vector<HostBox> boxes_;
    std::vector<glm::vec3> centers_;
    std::vector<uint32_t> order_;
    HostTree tree_;
};

// Entry distance of a box, or a negative number.
float enter(const HostBox& box, const HostRay& ray, const glm::vec3& inverse, float longest) {
    const glm::vec3 a = (box.low - ray.origin) * inverse, b = (box.high - ray.origin) * inverse;
    const glm::vec3 near = glm::min(a, b), far = glm::max(a, b);
    const float t0 = std::max({near.x, near.y, near.z, 0.0f}), t1 = std::min({far.x, far.y, far.z, longest});
    return t0 <= t1 ? t0 : -1.0f;
}

float intersect(const HostTriangle& t, const HostRay& ray, float longest) {
    const glm::vec3 e1 = t.v[1] - t.v[0], e2 = t.v[2] - t.v[0], p = glm::cross(ray.direction, e2);
    const float det = glm::dot(e1, p);
    if (det == 0) return longest;
    const glm::vec3 s = ray.origin - t.v[0], q = glm::cross(s, e1);
    const float u = glm::dot(s, p) / det, v = glm::dot(ray.direction, q) / det, d = glm::dot(e2, q) / det;
    return u >= 0 && v >= 0 && u + v <= 1 && d > 0 && d < longest ? d : longest;
}

struct Walk {
    size_t nodes = 0, triangles = 0;
    float hit = -1;
};

Walk walk(const HostTree& tree, const HostRay& ray) {
    Walk result;
    float longest = ray.longest;
    glm::vec3 inverse;
    for (int k = 0; k < 3; ++k)
        inverse[k] = 1.0f / (std::abs(ray.direction[k]) < 1e-20f ? std::copysign(1e-20f, ray.direction[k])
                                                                  : ray.direction[k]);
    uint32_t stack[256];
    int top = 0;
    stack[top++] = 0;
    while (top) {
        const uint32_t ref = stack[--top];
        if (ref & RTC_REF_LEAF) {
            const uint32_t count = (ref >> RTC_REF_COUNT_SHIFT) & RTC_REF_COUNT_MASK;
            for (uint32_t s = 0; s < count; ++s) {
                ++result.triangles;
                const float t = intersect(tree.slots[(ref & RTC_REF_INDEX_MASK) + s], ray, longest);
                if (t < longest) {
                    longest = result.hit = t;
                    if (ray.any_hit) return result;
                }
            }
            continue;
        }
        ++result.nodes;
        const HostNode& node = tree.nodes[ref];
        float t[2];
        for (int c = 0; c < 2; ++c)
            t[c] = node.child[c] == RTC_REF_EMPTY ? -1.0f : enter(node.box[c], ray, inverse, longest);
        const int far = t[0] <= t[1] ? 1 : 0;
        if (t[far] >= 0) stack[top++] = node.child[far];
        if (t[1 - far] >= 0) stack[top++] = node.child[1 - far];
    }
    return result;
}

}  // namespace

HostTree build_binned_sah(const std::vector<HostTriangle>& triangles, uint32_t bins) {
    return Builder(triangles, bins).build();
}

TreeMeasure measure_tree(const HostTree& tree, const std::vector<HostRay>& rays) {
    TreeMeasure measure;
    measure.nodes = tree.nodes.size();
    HostBox root = tree.nodes[0].box[0];
    root.add(tree.nodes[0].box[1]);
    struct Item {
        uint32_t node, depth;
        double area;
    };
    std::vector<Item> stack{{0, 1, double(root.half_area())}};
    double sum = 0;
    while (!stack.empty()) {
        const Item item = stack.back();
        stack.pop_back();
        measure.depth = std::max(measure.depth, item.depth);
        sum += item.area * kNodeCost;
        for (int c = 0; c < 2; ++c) {
            const HostNode& node = tree.nodes[item.node];
            const uint32_t ref = node.child[c];
            const double area = double(node.box[c].half_area());
            if (ref & RTC_REF_LEAF)
                sum += area * kSlotCost * ((ref >> RTC_REF_COUNT_SHIFT) & RTC_REF_COUNT_MASK);
            else
                stack.push_back({ref, item.depth + 1, area});
        }
    }
    measure.sah_cost = sum / std::max(double(root.half_area()), 1e-30);
    for (const HostRay& ray : rays) {
        const Walk walked = walk(tree, ray);
        measure.nodes_per_ray += double(walked.nodes) / double(rays.size());
        measure.triangles_per_ray += double(walked.triangles) / double(rays.size());
    }
    return measure;
}

float first_hit(const HostTree& tree, const HostRay& ray) { return walk(tree, ray).hit; }

std::vector<HostRay> make_rays(const HostTree& tree, const glm::vec3& eye, const glm::vec3& target, float fov,
                               uint32_t side) {
    std::vector<HostRay> rays;
    uint32_t state = 1;
    auto random = [&] {
        state = state * 747796405u + 2891336453u;
        uint32_t word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
        return float(((word >> 22u) ^ word) >> 8) * (1.0f / 16777216.0f);
    };
    const glm::vec3 forward = glm::normalize(target - eye);
    const glm::vec3 right = glm::normalize(glm::cross(forward, glm::vec3(0.0f, 1.0f, 0.0f)));
    const glm::vec3 up = glm::cross(right, forward);
    const float scale = std::tan(0.5f * fov);
    for (uint32_t y = 0; y < side; ++y)
        for (uint32_t x = 0; x < side; ++x) {
            const float px = ((float(x) + random()) / float(side) * 2 - 1) * scale;
            const float py = ((float(y) + random()) / float(side) * 2 - 1) * scale;
            HostRay ray;
            ray.origin = eye;
            ray.direction = glm::normalize(forward + px * right + py * up);
            rays.push_back(ray);
            const float t = first_hit(tree, ray);
            if (t < 0) continue;
            // Anywhere over the half space that the ray came from: no normals here.
            HostRay bounce;
            bounce.origin = ray.origin + ray.direction * (t * 0.9999f);
            const float z = random() * 2 - 1, phi = 6.2831853f * random(), r = std::sqrt(std::max(0.0f, 1 - z * z));
            bounce.direction = glm::vec3(r * std::cos(phi), r * std::sin(phi), z);
            if (glm::dot(bounce.direction, ray.direction) > 0) bounce.direction = -bounce.direction;
            rays.push_back(bounce);
        }
    return rays;
}

}  // namespace rtc::bench
