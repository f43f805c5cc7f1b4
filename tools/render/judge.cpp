#include "judge.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "exact.h"

namespace rtc::tools {
namespace {

using glm::dmat3;
using glm::dvec3;
constexpr double kUnit = 1.0 / 16777216.0;  // u: half an ulp of floats
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Bounds {
    dvec3 low{kInfinity}, high{-kInfinity};
    void add(const dvec3& p) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
};

// A tree only to find the triangles near a ray; what they mean is decided elsewhere.
struct MeshTree {
    struct Node {
        Bounds bounds;
        uint32_t first = 0, count = 0, right = 0;  // count 0: children at the next node and at `right`
    };
    std::vector<dvec3> corners;  // three a triangle
    std::vector<uint32_t> order;
    std::vector<Node> nodes;
    double magnitude = 0;

    explicit MeshTree(const Mesh& mesh) {
        for (uint32_t index : mesh.indices) corners.emplace_back(mesh.positions[index]);
        for (const dvec3& p : corners) magnitude = std::max(magnitude, glm::length(p));
        order.resize(corners.size() / 3);
        std::iota(order.begin(), order.end(), 0u);
        if (!order.empty()) build(0, uint32_t(order.size()));
    }

    dvec3 middle(uint32_t t) const { return corners[3 * t] + corners[3 * t + 1] + corners[3 * t + 2]; }

    void build(uint32_t first, uint32_t count) {
        const uint32_t self = uint32_t(nodes.size());
        nodes.emplace_back();
        Bounds bounds, middles;
        for (uint32_t i = first; i < first + count; ++i) {
            for (int c = 0; c < 3; ++c) bounds.add(corners[3 * order[i] + c]);
            middles.add(middle(order[i]));
        }
        nodes[self].bounds = bounds;
        if (count <= 4) {
            nodes[self].first = first;
            nodes[self].count = count;
            return;
        }
        const dvec3 size = middles.high - middles.low;
        const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
        const uint32_t half = count / 2;
        std::nth_element(order.begin() + first, order.begin() + first + half, order.begin() + first + count,
                         [&](uint32_t a, uint32_t b) { return middle(a)[axis] < middle(b)[axis]; });
        build(first, half);
        nodes[self].right = uint32_t(nodes.size());
        build(first + half, count - half);
    }
};

struct Place {
    uint32_t mesh = 0;
    dmat3 to_object{1.0}, magnitudes{1.0};  // inverse of the linear part, and its absolute values
    dvec3 offset{0};
    glm::mat4 transform{1.0f};
};

struct LocalRay {
    dvec3 origin, direction;
    double bound = 0;
};

bool meets(const Bounds& box, const LocalRay& ray, double end) {
    double near = 0, far = end;
    for (int i = 0; i < 3; ++i) {
        const double low = box.low[i] - 4 * ray.bound - ray.origin[i];
        const double high = box.high[i] + 4 * ray.bound - ray.origin[i];
        if (ray.direction[i] == 0) {
            if (low > 0 || high < 0) return false;
            continue;
        }
        const double a = low / ray.direction[i], b = high / ray.direction[i];
        near = std::max(near, std::min(a, b));
        far = std::min(far, std::max(a, b));
    }
    // Slack for this test's own rounding and for boxes before the origin.
    return near <= far * (1 + 1e-9) + 4 * ray.bound / glm::length(ray.direction);
}

double line_to_segment(const LocalRay& ray, const dvec3& a, const dvec3& b) {
    // Both seen along the ray.
    const dvec3 w = glm::normalize(ray.direction);
    auto flatten = [&](const dvec3& p) { return p - ray.origin - w * glm::dot(p - ray.origin, w); };
    const dvec3 p = flatten(a), e = flatten(b) - p;
    const double squared = glm::dot(e, e);
    const double s = squared > 0 ? std::clamp(-glm::dot(p, e) / squared, 0.0, 1.0) : 0.0;
    return glm::length(p + e * s);
}

// Weights of the three corners, of either sign; false for a triangle seen edge-on.
bool weights(const LocalRay& ray, const dvec3 v[3], double w[3]) {
    const dvec3 a = v[0] - ray.origin, b = v[1] - ray.origin, c = v[2] - ray.origin;
    w[0] = glm::dot(ray.direction, glm::cross(b, c));
    w[1] = glm::dot(ray.direction, glm::cross(c, a));
    w[2] = glm::dot(ray.direction, glm::cross(a, b));
    const double sum = w[0] + w[1] + w[2];
    if (sum == 0) return false;
    for (int i = 0; i < 3; ++i) w[i] /= sum;
    return true;
}

struct Candidate {
    uint32_t instance = 0, primitive = 0;
    lab::Verdict verdict = lab::Verdict::Miss;
    mpq_class t;  // when it is no miss
    dvec3 v[3];   // in the instance's space
};

struct Crossing {
    double t = 0, slack = 0;
};

// Where a (displaced) ray crosses a candidate, and how far rounding may move that along the ray.
bool cross(const LocalRay& ray, const Candidate& candidate, Crossing& crossing) {
    double w[3];
    if (!weights(ray, candidate.v, w) || w[0] < 0 || w[1] < 0 || w[2] < 0) return false;
    const double length = glm::length(ray.direction);
    const dvec3 unit = ray.direction / length;
    const dvec3 at = candidate.v[0] * w[0] + candidate.v[1] * w[1] + candidate.v[2] * w[2];
    crossing.t = glm::dot(at - ray.origin, unit) / length;
    const dvec3 normal = glm::cross(candidate.v[1] - candidate.v[0], candidate.v[2] - candidate.v[0]);
    const double cosine = std::abs(glm::dot(unit, normal)) / glm::length(normal);
    double low = kInfinity, high = -kInfinity;
    for (const dvec3& p : candidate.v) {
        low = std::min(low, glm::dot(p - ray.origin, unit));
        high = std::max(high, glm::dot(p - ray.origin, unit));
    }
    crossing.slack = std::min(cosine > 0 ? ray.bound / cosine : kInfinity, high - low + ray.bound) / length;
    return true;
}

}  // namespace

struct Judge::Parts {
    std::vector<MeshTree> meshes;
    std::vector<Place> places;

    LocalRay local(const JudgedRay& ray, uint32_t instance) const {
        const Place& place = places[instance];
        const MeshTree& mesh = meshes[place.mesh];
        const dvec3 origin(ray.origin), direction(ray.direction);
        LocalRay result;
        result.origin = place.to_object * (origin - place.offset);
        result.direction = place.to_object * direction;
        const double length = glm::length(result.direction);
        const double reach = mesh.magnitude + glm::length(result.origin);  // of the hit, from the origin
        result.bound =
            16 * kUnit *
            (glm::length(place.magnitudes * (glm::abs(origin) + glm::abs(place.offset))) +
             glm::length(place.magnitudes * glm::abs(direction)) * (length > 0 ? reach / length : 0.0) + reach);
        return result;
    }

    std::vector<Candidate> candidates(const JudgedRay& ray) const {
        std::vector<Candidate> found;
        std::vector<uint32_t> stack;
        for (uint32_t i = 0; i < places.size(); ++i) {
            const MeshTree& mesh = meshes[places[i].mesh];
            if (mesh.nodes.empty()) continue;
            const LocalRay here = local(ray, i);
            stack.assign(1, 0);
            while (!stack.empty()) {
                const uint32_t at = stack.back();
                stack.pop_back();
                const MeshTree::Node& node = mesh.nodes[at];
                if (!meets(node.bounds, here, double(ray.end))) continue;
                if (!node.count) {
                    stack.push_back(at + 1);
                    stack.push_back(node.right);
                }
                for (uint32_t k = node.first; k < node.first + node.count; ++k)
                    consider(ray, here, i, mesh.order[k], found);
            }
        }
        return found;
    }

    void consider(const JudgedRay& ray, const LocalRay& here, uint32_t instance, uint32_t primitive,
                  std::vector<Candidate>& found) const {
        Candidate candidate;
        candidate.instance = instance;
        candidate.primitive = primitive;
        const MeshTree& mesh = meshes[places[instance].mesh];
        for (int c = 0; c < 3; ++c) candidate.v[c] = mesh.corners[3 * primitive + c];
        double w[3];
        const bool inside = weights(here, candidate.v, w) && w[0] > 0 && w[1] > 0 && w[2] > 0;
        if (!inside) {
            double distance = kInfinity;
            for (int c = 0; c < 3; ++c)
                distance =
                    std::min(distance, line_to_segment(here, candidate.v[c], candidate.v[(c + 1) % 3]));
            if (distance > 4 * here.bound) return;
        }
        const lab::ExactRay exact_ray{{ray.origin.x, ray.origin.y, ray.origin.z},
                                      {ray.direction.x, ray.direction.y, ray.direction.z},
                                      0,
                                      ray.end};
        const glm::mat4& m = places[instance].transform;
        std::array<lab::ExactPoint, 3> corners;
        for (int c = 0; c < 3; ++c) {
            mpq_class* rows[] = {&corners[c].x, &corners[c].y, &corners[c].z};
            for (int row = 0; row < 3; ++row) {
                *rows[row] = mpq_class(double(m[3][row]));
                for (int k = 0; k < 3; ++k)
                    *rows[row] += mpq_class(double(m[k][row])) * mpq_class(candidate.v[c][k]);
            }
        }
        candidate.verdict = lab::intersect(exact_ray, corners, &candidate.t);
        if (candidate.verdict != lab::Verdict::Miss &&
            (candidate.t <= 0 || candidate.t >= mpq_class(double(ray.end))))
            candidate.verdict = lab::Verdict::Miss;
        found.push_back(std::move(candidate));
    }

    // Tries displaced rays until `accepts` likes what one of them crosses: pairs of candidate and crossing.
    template <typename Accepts>
    bool some_ray_within_bound(const JudgedRay& ray, const std::vector<Candidate>& all,
                               const Accepts& accepts) const {
        // Across the ray; the same direction in every instance's space up to its linear map.
        const dvec3 unit = glm::normalize(dvec3(ray.direction));
        const dvec3 side = glm::normalize(
            glm::cross(unit, std::abs(unit.y) < 0.9 ? dvec3(0, 1, 0) : dvec3(1, 0, 0)));
        const dvec3 up = glm::cross(side, unit);
        std::vector<std::pair<const Candidate*, Crossing>> crossings;
        constexpr int kTries = 4096;
        for (int k = 0; k < kTries; ++k) {
            // Vogel's spiral over the disc, the rim first.
            const double radius = std::sqrt(double(kTries - k) / kTries), angle = 2.39996322972865332 * k;
            const dvec3 shift = (side * std::cos(angle) + up * std::sin(angle)) * radius;
            crossings.clear();
            for (const Candidate& candidate : all) {
                LocalRay here = local(ray, candidate.instance);
                dvec3 across = places[candidate.instance].to_object * shift;
                across -= here.direction * (glm::dot(across, here.direction) / glm::dot(here.direction, here.direction));
                const double length = glm::length(places[candidate.instance].to_object * glm::normalize(shift));
                here.origin += across * (here.bound / length);
                Crossing crossing;
                if (cross(here, candidate, crossing)) crossings.emplace_back(&candidate, crossing);
            }
            if (accepts(crossings)) return true;
        }
        return false;
    }
};

const char* ruling_name(Ruling ruling) {
    const char* names[] = {"exact", "tie", "rounding", "wrong"};
    return names[int(ruling)];
}

Judge::Judge(const Scene& scene) : parts_(std::make_unique<Parts>()) {
    for (const Mesh& mesh : scene.meshes) parts_->meshes.emplace_back(mesh);
    for (const Instance& instance : scene.instances) {
        Place place;
        place.mesh = instance.mesh;
        place.transform = instance.transform;
        place.to_object = glm::inverse(dmat3(instance.transform));
        for (int c = 0; c < 3; ++c) place.magnitudes[c] = glm::abs(place.to_object[c]);
        place.offset = dvec3(instance.transform[3]);
        parts_->places.push_back(place);
    }
}

Judge::~Judge() = default;

double Judge::bound(const JudgedRay& ray, uint32_t instance) const { return parts_->local(ray, instance).bound; }

double Judge::apart(const JudgedRay& ray, const Answer& where, const glm::vec2& a, const glm::vec2& b) const {
    const LocalRay here = parts_->local(ray, where.instance);
    const MeshTree& mesh = parts_->meshes[parts_->places[where.instance].mesh];
    const dvec3* v = &mesh.corners[3 * size_t(where.primitive)];
    const dvec3 way = (v[1] - v[0]) * (double(a.x) - double(b.x)) + (v[2] - v[0]) * (double(a.y) - double(b.y));
    const dvec3 unit = glm::normalize(here.direction);
    return glm::length(way - unit * glm::dot(way, unit)) / here.bound;
}

namespace {

const Candidate* nearest_of(const std::vector<Candidate>& all) {
    const Candidate* best = nullptr;
    for (const Candidate& candidate : all)
        if (candidate.verdict != lab::Verdict::Miss && (!best || candidate.t < best->t)) best = &candidate;
    return best;
}

}  // namespace

Answer Judge::nearest(const JudgedRay& ray) const {
    const std::vector<Candidate> all = parts_->candidates(ray);
    const Candidate* best = nearest_of(all);
    return best ? Answer{best->instance, best->primitive} : Answer{};
}

Ruling Judge::closest(const JudgedRay& ray, const Answer& answer) const {
    const std::vector<Candidate> all = parts_->candidates(ray);
    const Candidate *best = nearest_of(all), *given = nullptr;
    for (const Candidate& candidate : all)
        if (candidate.instance == answer.instance && candidate.primitive == answer.primitive)
            given = &candidate;
    if (answer.instance == kNothing) {
        if (!best) return Ruling::Exact;
    } else if (!given) {
        return Ruling::Wrong;
    }
    const bool hits = given && given->verdict != lab::Verdict::Miss;
    if (hits && given->t == best->t) {
        for (const Candidate& other : all)
            if (&other != given && other.verdict != lab::Verdict::Miss && other.t == given->t)
                return Ruling::Tie;
        return given->verdict == lab::Verdict::Boundary ? Ruling::Tie : Ruling::Exact;
    }
    // Only edges and vertices lie before it. That excuses no leak through a surface: see below.
    bool touched_only = hits || !given;
    for (const Candidate& other : all)
        if (other.verdict == lab::Verdict::Hit && (!given || other.t < given->t)) touched_only = false;
    const double end = double(ray.end);
    const bool near = parts_->some_ray_within_bound(ray, all, [&](const auto& crossings) {
        double here = kInfinity;
        for (const auto& [candidate, crossing] : crossings)
            if (candidate == given && crossing.t + crossing.slack > 0 && crossing.t - crossing.slack < end)
                here = crossing.t - crossing.slack;
        if (given && here == kInfinity) return false;
        for (const auto& [candidate, crossing] : crossings)
            if (candidate != given && crossing.t - crossing.slack > 0 && crossing.t + crossing.slack < end &&
                crossing.t + crossing.slack < here)
                return false;
        return true;  // nothing is clearly before it
    });
    if (!near) return Ruling::Wrong;
    return touched_only ? Ruling::Tie : Ruling::Rounding;
}

Ruling Judge::shadow(const JudgedRay& ray, bool open) const {
    if (open) return closest(ray, Answer{});
    const std::vector<Candidate> all = parts_->candidates(ray);
    const Candidate* best = nearest_of(all);
    if (best) {
        for (const Candidate& candidate : all)
            if (candidate.verdict == lab::Verdict::Hit) return Ruling::Exact;
        return Ruling::Tie;
    }
    const double end = double(ray.end);
    const bool near = parts_->some_ray_within_bound(ray, all, [&](const auto& crossings) {
        for (const auto& [candidate, crossing] : crossings)
            if (crossing.t + crossing.slack > 0 && crossing.t - crossing.slack < end) return true;
        return false;
    });
    return near ? Ruling::Rounding : Ruling::Wrong;
}

}  // namespace rtc::tools
