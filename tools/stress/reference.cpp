#include "reference.h"

#include <algorithm>
#include <cmath>

#include "exact.h"
#include "rtc/abi.h"

namespace rtc::stress {
namespace {

constexpr double kU = 0x1p-24;

double component(const Vec3& v, int i) { return v[i]; }

// The shear of the watertight test in double. compiler/traversal/glsl/watertight.glsl derives that the float
// test decides exactly for a triangle whose vertices are moved by at most 4u D + 11u r.
bool test_triangle(const ObjectRay& ray, const Triangle& v, double vertex_error, Candidate& c) {
    int kz = 0;
    for (int i = 1; i < 3; ++i)
        if (std::fabs(ray.direction[i]) > std::fabs(ray.direction[kz])) kz = i;
    const int kx = (kz + 1) % 3, ky = (kz + 2) % 3;
    const double dz = ray.direction[kz], sx = ray.direction[kx] / dz, sy = ray.direction[ky] / dz;
    double x[3], y[3], z[3], reach[3] = {0, 0, 0}, size = 0;
    for (int i = 0; i < 3; ++i) {
        z[i] = component(v[i], kz) - component(ray.origin, kz);
        const double dx = component(v[i], kx) - component(ray.origin, kx);
        const double dy = component(v[i], ky) - component(ray.origin, ky);
        x[i] = dx - sx * z[i];
        y[i] = dy - sy * z[i];
        reach[0] = std::max(reach[0], std::fabs(dx));
        reach[1] = std::max(reach[1], std::fabs(dy));
        reach[2] = std::max(reach[2], std::fabs(z[i]));
        for (int k = 0; k < 3; ++k) size = std::max(size, std::fabs(component(v[i], k)));
    }
    const double largest = std::max({reach[0], reach[1], reach[2]});
    const double delta = kU * (4 * largest + 11 * reach[2] + vertex_error * size) + 1e-36;
    // A triangle without area has no edge that tells sides.
    for (const double* axis : {x, y}) {
        if (std::min({axis[0], axis[1], axis[2]}) > delta || std::max({axis[0], axis[1], axis[2]}) < -delta)
            return false;
    }
    double edge[3], error[3], sum = 0, sum_error = 0;
    bool positive = false, negative = false, all_certain = true;
    for (int i = 0; i < 3; ++i) {
        const int b = (i + 1) % 3, d = (i + 2) % 3;
        edge[i] = x[d] * y[b] - y[d] * x[b];
        error[i] = delta * (std::fabs(x[b]) + std::fabs(y[b]) + std::fabs(x[d]) + std::fabs(y[d])) +
                   4 * delta * delta;
        positive = positive || edge[i] > error[i];
        negative = negative || edge[i] < -error[i];
        all_certain = all_certain && std::fabs(edge[i]) > error[i];
        sum += edge[i];
        sum_error += error[i];
    }
    if (positive && negative) return false;
    // The order of axes is cyclic, so only the sign of dz turns the orientation. Seen along -z, a triangle
    // whose corners go round counter-clockwise in x and y (its normal is +z) is a front face.
    c.facing_certain = std::fabs(sum) > sum_error;
    c.front = (sum < 0) == (dz < 0);
    c.certain = all_certain && c.facing_certain;
    const double low = std::min({z[0] / dz, z[1] / dz, z[2] / dz}),
                 high = std::max({z[0] / dz, z[1] / dz, z[2] / dz});
    const double far = std::max(std::fabs(low), std::fabs(high));
    c.t = (low + high) / 2;
    c.t_error = (high - low) / 2;
    c.weight_error = 2;
    if (std::fabs(sum) > 2 * sum_error) {
        c.t = (edge[0] * z[0] + edge[1] * z[1] + edge[2] * z[2]) / sum / dz;
        const double safe = std::fabs(sum) - sum_error;
        double moved = 0;
        for (int i = 0; i < 3; ++i) moved += error[i] * std::fabs(z[i] / dz - c.t);
        c.t_error = std::min(c.t_error, moved / safe);
        c.weights[0] = edge[1] / sum;
        c.weights[1] = edge[2] / sum;
        c.weight_error = 2 * sum_error / safe + 8 * kU;
    }
    c.t_error += 16 * kU * far + (vertex_error + 1) * kU * size / std::fabs(dz);
    return true;
}

// What the intersection shader in shaders.h computes; its candidates come from conservative boxes, so whether
// it is asked is never in question for a box that is clearly hit.
bool test_box(const ObjectRay& ray, const Box& box, Candidate& c) {
    double near = -INFINITY, far = INFINITY, error = 0;
    for (int i = 0; i < 3; ++i) {
        const double d = ray.direction[i], o = ray.origin[i];
        if (d == 0) {
            if (o < box.min[i] || o > box.max[i]) return false;
            continue;
        }
        const double a = (box.min[i] - o) / d, b = (box.max[i] - o) / d;
        near = std::max(near, std::min(a, b));
        far = std::min(far, std::max(a, b));
        // subtraction, division (2.5 ulp): 2u + 5u
        error = std::max(error, 8 * kU * std::max(std::fabs(a), std::fabs(b)));
    }
    if (near - error > far + error || far + error < ray.tmin) return false;
    c.certain = near + error < far - error && far - error > ray.tmin;
    c.t = std::max(near, double(ray.tmin));
    c.t_error = error;
    return true;
}

bool inside(const ObjectRay& ray, const float* min, const float* max) {
    double near = -INFINITY, far = INFINITY;
    for (int i = 0; i < 3; ++i) {
        const double d = ray.direction[i], o = ray.origin[i];
        const double slack =
            1e-5 * (std::fabs(double(min[i])) + std::fabs(double(max[i])) + std::fabs(o)) + 1e-30;
        const double low = min[i] - slack - o, high = max[i] + slack - o;
        if (d == 0) {
            if (low > 0 || high < 0) return false;
            continue;
        }
        const double a = low / d, b = high / d;
        near = std::max(near, std::min(a, b));
        far = std::min(far, std::max(a, b));
    }
    const double wide = 1e-4 * (std::fabs(near) + std::fabs(far));
    return near <= far + wide;
}

// Flags of the ray, VkGeometryInstanceFlagsNV and the geometry, as the specification words them.
struct Verdict {
    bool candidate = true, opaque = false;
};
Verdict flags_verdict(uint32_t ray, uint32_t instance, bool geometry_opaque, bool box, bool front) {
    Verdict v;
    v.opaque = geometry_opaque;
    if (instance & RTC_INSTANCE_FORCE_OPAQUE) v.opaque = true;
    if (instance & RTC_INSTANCE_FORCE_NO_OPAQUE) v.opaque = false;
    if (ray & 1u) v.opaque = true;
    if (ray & 2u) v.opaque = false;
    if ((ray & 64u) && v.opaque) v.candidate = false;
    if ((ray & 128u) && !v.opaque) v.candidate = false;
    if ((ray & 256u) && !box) v.candidate = false;
    if ((ray & 512u) && box) v.candidate = false;
    if (!box && !(instance & RTC_INSTANCE_TRIANGLE_CULL_DISABLE)) {
        if ((ray & 16u) && !front) v.candidate = false;
        if ((ray & 32u) && front) v.candidate = false;
    }
    return v;
}

}  // namespace

BottomReference::BottomReference(const Content& content) : content_(content) {
    for (uint32_t g = 0; g < content.geometries.size(); ++g) {
        const Geometry& geometry = content.geometries[g];
        for (uint32_t p = 0; p < geometry.primitives(); ++p) {
            const float first = geometry.boxes ? geometry.box_list[p].min.x : geometry.triangles[p][0].x;
            if (!std::isnan(first)) slots_.push_back({g, p});
        }
    }
    if (slots_.empty()) return;
    nodes_.emplace_back();
    build(0, 0, uint32_t(slots_.size()));
}

double BottomReference::reach() const {
    double largest = 0;
    if (!nodes_.empty())
        for (int k = 0; k < 3; ++k)
            largest =
                std::max({largest, std::fabs(double(nodes_[0].min[k])), std::fabs(double(nodes_[0].max[k]))});
    return largest;
}

void BottomReference::bounds(const Slot& slot, float* min, float* max) const {
    const Geometry& g = content_.geometries[slot.geometry];
    for (int i = 0; i < 3; ++i) {
        if (g.boxes) {
            min[i] = g.box_list[slot.primitive].min[i];
            max[i] = g.box_list[slot.primitive].max[i];
            continue;
        }
        const Triangle& t = g.triangles[slot.primitive];
        min[i] = std::min({t[0][i], t[1][i], t[2][i]});
        max[i] = std::max({t[0][i], t[1][i], t[2][i]});
    }
}

void BottomReference::build(uint32_t node, uint32_t begin, uint32_t end) {
    float low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (uint32_t i = begin; i < end; ++i) {
        float min[3], max[3];
        bounds(slots_[i], min, max);
        for (int k = 0; k < 3; ++k) low[k] = std::min(low[k], min[k]), high[k] = std::max(high[k], max[k]);
    }
    std::copy(low, low + 3, nodes_[node].min);
    std::copy(high, high + 3, nodes_[node].max);
    if (end - begin <= 4) {
        nodes_[node].first = begin;
        nodes_[node].count = end - begin;
        return;
    }
    int axis = 0;
    for (int k = 1; k < 3; ++k)
        if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
    const uint32_t middle = begin + (end - begin) / 2;
    auto centre = [&](const Slot& slot) {
        float min[3], max[3];
        bounds(slot, min, max);
        return min[axis] + max[axis];
    };
    std::nth_element(slots_.begin() + begin, slots_.begin() + middle, slots_.begin() + end,
                     [&](const Slot& a, const Slot& b) { return centre(a) < centre(b); });
    const uint32_t children = uint32_t(nodes_.size());
    nodes_.resize(nodes_.size() + 2);
    nodes_[node].first = children;
    nodes_[node].count = 0;
    build(children, begin, middle);
    build(children + 1, middle, end);
}

bool BottomReference::test(const ObjectRay& ray, const Slot& slot, Candidate& c) const {
    const Geometry& g = content_.geometries[slot.geometry];
    c = {};
    c.geometry = slot.geometry;
    c.primitive = slot.primitive;
    const bool hit = g.boxes ? test_box(ray, g.box_list[slot.primitive], c)
                             : test_triangle(ray, g.triangles[slot.primitive], g.vertex_error, c);
    if (!hit) return false;
    // Triangles lie strictly between, reported hits of boxes may touch the ends.
    if (c.t + c.t_error < ray.tmin || c.t - c.t_error > ray.tmax) return false;
    const bool starts_inside = g.boxes && c.t == ray.tmin;
    if (!starts_inside && c.t - c.t_error <= ray.tmin) c.certain = false;
    if (c.t + c.t_error >= ray.tmax) c.certain = false;
    return true;
}

void BottomReference::candidates(const ObjectRay& ray, bool brute, std::vector<Candidate>& out,
                                 uint64_t& tests) const {
    if (slots_.empty()) return;
    Candidate c;
    if (brute) {
        for (const Slot& slot : slots_)
            if (test(ray, slot, c)) out.push_back(c);
        tests += slots_.size();
        return;
    }
    std::vector<uint32_t> stack = {0};
    while (!stack.empty()) {
        const Node& node = nodes_[stack.back()];
        stack.pop_back();
        ++tests;
        if (!inside(ray, node.min, node.max)) continue;
        if (node.count == 0) {
            stack.push_back(node.first);
            stack.push_back(node.first + 1);
            continue;
        }
        for (uint32_t i = node.first; i < node.first + node.count; ++i)
            if (test(ray, slots_[i], c)) out.push_back(c);
        tests += node.count;
    }
}

RayReference trace_reference(const Ray& ray, const std::vector<InstanceReference>& instances, bool brute) {
    RayReference result;
    std::vector<Candidate> found;
    for (uint32_t i = 0; i < instances.size(); ++i) {
        const InstanceReference& instance = instances[i];
        if (!instance.bottom || !(instance.mask & ray.mask & 0xffu)) continue;
        const ObjectRay object{lab::transform_point(instance.world_to_object, ray.origin),
                               lab::transform_vector(instance.world_to_object, ray.direction), ray.tmin,
                               ray.tmax};
        found.clear();
        instance.bottom->candidates(object, brute, found, result.tests);
        ++result.tests;
        for (Candidate& c : found) {
            const Geometry& g = instance.bottom->content().geometries[c.geometry];
            if (instance.flags & RTC_INSTANCE_TRIANGLE_FRONT_CCW) c.front = !c.front;
            const bool opaque = g.flags & VK_GEOMETRY_OPAQUE_BIT_NV;
            Verdict v = flags_verdict(ray.flags, instance.flags, opaque, g.boxes, c.front);
            if (!g.boxes && !c.facing_certain) {
                const Verdict other = flags_verdict(ray.flags, instance.flags, opaque, false, !c.front);
                c.certain = c.certain && v.candidate && other.candidate;
                v.candidate = v.candidate || other.candidate;
            }
            if (!v.candidate) continue;
            c.instance = i;
            c.opaque = v.opaque;
            result.candidates.push_back(c);
        }
    }
    return result;
}

bool exactly_hit(const Ray& ray, const InstanceReference& instance, const Candidate& c) {
    const Geometry& g = instance.bottom->content().geometries[c.geometry];
    if (g.boxes) return true;
    const lab::ExactRay exact{lab::transform_point(instance.world_to_object, ray.origin),
                              lab::transform_vector(instance.world_to_object, ray.direction), ray.tmin,
                              ray.tmax};
    mpq_class t;
    if (lab::intersect(exact, g.triangles[c.primitive], &t) == lab::Verdict::Miss) return false;
    return t > double(ray.tmin) && t < double(ray.tmax);
}

}  // namespace rtc::stress
