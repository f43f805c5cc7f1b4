#include "oracle.h"

#include <gmpxx.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <mutex>
#include <thread>

#include "integers.h"
#include "rtc/abi.h"

namespace rtc::lab {
namespace {

using V = std::array<double, 3>;
using Q = std::array<mpq_class, 3>;

V as_double(const Vec3& v) { return {v.x, v.y, v.z}; }

Q rational(const V& v) { return {mpq_class(v[0]), mpq_class(v[1]), mpq_class(v[2])}; }

template <typename T>
std::array<T, 3> minus(const std::array<T, 3>& a, const std::array<T, 3>& b) {
    return {T(a[0] - b[0]), T(a[1] - b[1]), T(a[2] - b[2])};
}

mpq_class determinant(const Q& x, const Q& y, const Q& z) {
    return x[0] * (y[1] * z[2] - y[2] * z[1]) + x[1] * (y[2] * z[0] - y[0] * z[2]) +
           x[2] * (y[0] * z[1] - y[1] * z[0]);
}

// A ray in one space, axes turned so that it moves fastest along the last one.
struct LocalRay {
    V o, d;
    int axis = 2;
    V turned_o, turned_d, inverse;
    double tmin = 0, tmax = 0;  // in units of the scaled direction

    static V turn(const V& v, int axis) { return {v[(axis + 1) % 3], v[(axis + 2) % 3], v[axis]}; }
    void prepare() {
        const double x = std::fabs(d[0]), y = std::fabs(d[1]), z = std::fabs(d[2]);
        axis = x > y ? (x > z ? 0 : 2) : (y > z ? 1 : 2);
        turned_o = turn(o, axis);
        turned_d = turn(d, axis);
        for (int i = 0; i < 3; ++i) inverse[i] = 1 / d[i];
    }
};

// The power of two of rtc_t_up.
int direction_exponent(const Vec3& d) {
    const float largest = std::max({std::fabs(d.x), std::fabs(d.y), std::fabs(d.z)});
    if (largest >= 0x1p-30f && largest <= 0x1p30f) return 0;
    return std::clamp(int(std::bit_cast<uint32_t>(largest) >> 23) - 127, -126, 126);
}

int exact_edge(const LocalRay& ray, const V& b, const V& c, bool* on_edge, OracleCounts& counts) {
    if (const auto known = integer_edge(ray.turned_o, ray.turned_d, b, c, on_edge))
        return ray.turned_d[2] < 0 ? -*known : *known;
    ++counts.rationals;
    const Q d = rational(ray.turned_d), o = rational(ray.turned_o), qb = rational(b), qc = rational(c);
    int side = sgn(determinant(d, minus(qc, o), minus(qb, o)));
    if (side == 0) {
        *on_edge = true;
        const Q w = minus(qc, qb);
        side = -sgn(mpq_class(d[1] * w[2] - d[2] * w[1]));
        if (side == 0) side = -sgn(mpq_class(d[2] * w[0] - d[0] * w[2]));
    }
    return ray.turned_d[2] < 0 ? -side : side;
}

mpq_class exact_t(const LocalRay& ray, const std::array<V, 3>& v) {
    const Q o = rational(ray.o), a = rational(v[0]), b = rational(v[1]), c = rational(v[2]);
    return determinant(minus(a, o), minus(b, o), minus(c, o)) /
           determinant(rational(ray.d), minus(b, a), minus(c, a));
}

struct Hit {
    double t = 0;  // scaled units; relative error below 1e-10
    std::array<V, 3> vertices;
    const LocalRay* ray = nullptr;
};

constexpr double kTie = 1e-9;

bool close(double a, double b) { return std::fabs(a - b) <= kTie * std::max(std::fabs(a), std::fabs(b)); }

// Does the ray pass through the triangle, and at which t?
bool meets(const LocalRay& ray, const std::array<V, 3>& v, Hit& hit, bool* on_edge, OracleCounts& counts) {
    ++counts.tests;
    double x[3], y[3], l[3], size = 0;
    std::array<V, 3> p;
    const V &o = ray.turned_o, &d = ray.turned_d;
    for (int i = 0; i < 3; ++i) {
        p[i] = LocalRay::turn(v[i], ray.axis);
        const V a = minus(p[i], o);
        for (double component : a) size = std::max(size, std::fabs(component));
        x[i] = a[0] * d[2] - d[0] * a[2];
        y[i] = a[1] * d[2] - d[1] * a[2];
        l[i] = std::fabs(x[i]) + std::fabs(y[i]);
    }
    // As derived in exact.glsl for doubles.
    const double w = 2 * size * std::fabs(d[2]), unit = 0x1p-48 * w;
    int side[3];
    bool positive = false, negative = false;
    for (int i = 0; i < 3; ++i) {
        const int b = (i + 1) % 3, c = (i + 2) % 3;
        const double e = x[c] * y[b] - y[c] * x[b], limit = unit * (l[b] + l[c] + unit) + 1e-300;
        side[i] = e > limit ? 1 : (e < -limit ? -1 : 0);
        positive = positive || side[i] > 0;
        negative = negative || side[i] < 0;
    }
    if (positive && negative) return false;
    for (int i = 0; i < 3; ++i) {
        if (side[i] != 0) continue;
        ++counts.edges;
        side[i] = exact_edge(ray, p[(i + 1) % 3], p[(i + 2) % 3], on_edge, counts);
        if (side[i] == 0) return false;
    }
    if (side[0] != side[1] || side[1] != side[2]) return false;
    const V a = minus(v[0], ray.o), f = minus(v[1], v[0]), g = minus(v[2], v[0]);
    double above = 0, below = 0, above_size = 0, below_size = 0;
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const double n = f[j] * g[k] - f[k] * g[j];
        const double u = std::fabs(f[j] * g[k]) + std::fabs(f[k] * g[j]);
        above += n * a[i];
        below += n * ray.d[i];
        above_size += u * std::fabs(a[i]);
        below_size += u * std::fabs(ray.d[i]);
    }
    hit.vertices = v;
    hit.ray = &ray;
    // 2^-49 of the sizes, to 11 digits.
    if (std::fabs(above) > 3e-4 * above_size && std::fabs(below) > 3e-4 * below_size &&
        std::fabs(below) > 1e-250 && std::fabs(above) > 1e-250) {
        hit.t = above / below;
    } else {
        ++counts.orders;
        if (const auto t = integer_t(ray.o, ray.d, v)) {
            hit.t = t->value();
        } else {
            ++counts.rationals;
            hit.t = exact_t(ray, v).get_d();
        }
    }
    return true;
}

// Sign of a's t less `other`.
int order(const Hit& a, double other, OracleCounts& counts) {
    if (!close(a.t, other) || !std::isfinite(other)) return a.t < other ? -1 : 1;
    ++counts.orders;
    if (const auto t = integer_t(a.ray->o, a.ray->d, a.vertices))
        if (const auto known = compare(*t, ratio_of(other))) return *known;
    ++counts.rationals;
    return cmp(exact_t(*a.ray, a.vertices), mpq_class(other));
}

int order(const Hit& a, const Hit& b, OracleCounts& counts) {
    if (!close(a.t, b.t)) return a.t < b.t ? -1 : 1;
    if (a.ray == b.ray && a.vertices == b.vertices) return 0;
    ++counts.orders;
    const auto s = integer_t(a.ray->o, a.ray->d, a.vertices), t = integer_t(b.ray->o, b.ray->d, b.vertices);
    if (s && t)
        if (const auto known = compare(*s, *t)) return *known;
    ++counts.rationals;
    return cmp(exact_t(*a.ray, a.vertices), exact_t(*b.ray, b.vertices));
}

// The t at which the ray enters the box, or infinity: it does not, or not before `nearest`.
double box_entry(const LocalRay& ray, const uint32_t* box, double nearest) {
    double near = -INFINITY, far = INFINITY;
    for (int i = 0; i < 3; ++i) {
        const double low = std::bit_cast<float>(box[i]), high = std::bit_cast<float>(box[4 + i]);
        if (ray.d[i] == 0) {
            if (ray.o[i] < low || ray.o[i] > high) return INFINITY;
            continue;
        }
        const double a = (low - ray.o[i]) * ray.inverse[i], b = (high - ray.o[i]) * ray.inverse[i];
        near = std::max(near, std::min(a, b));
        far = std::min(far, std::max(a, b));
    }
    // Three roundings of 2^-53 an entry, and what reciprocals of denormals may overflow to (NaN: enter).
    const double slack = 1e-12 * (std::fabs(near) + std::fabs(far)) + 1e-300;
    const bool missed = near > far + slack || near - slack > std::min(nearest, ray.tmax) * (1 + kTie) ||
                        far + slack < ray.tmin;
    return missed ? INFINITY : (near < INFINITY ? near : std::numeric_limits<double>::max());
}

}  // namespace

std::optional<OracleHit> Oracle::first_hit(const Ray& ray, OracleCounts* counts_out) const {
    OracleCounts counts;
    const uint32_t* heap = scene_.heap.data();
    const uint32_t* top = heap + size_t(scene_.root) * 4;
    const uint32_t instances = top[RTC_HDR_SLOT_COUNT];
    const int exponent = direction_exponent(ray.direction);
    const float down = std::ldexp(1.0f, -exponent);
    const Vec3 direction = {ray.direction.x * down, ray.direction.y * down, ray.direction.z * down};
    // Addresses of the rays must hold: hits point to theirs.
    std::vector<LocalRay> rays(instances);
    std::optional<OracleHit> best;
    Hit best_hit;
    bool on_edge = false;
    const bool legal = std::isfinite(ray.tmin) && ray.tmin <= ray.tmax;
    auto finite = [](const Vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); };
    if (!legal || !finite(ray.origin) || !finite(ray.direction)) return best;
    for (uint32_t i = 0; i < instances; ++i) {
        const uint32_t* record = top + size_t(top[RTC_HDR_SLOTS]) * 4 + size_t(i) * RTC_INSTANCE_QUADS * 4;
        LocalRay& local = rays[i];
        const Transform& w = scene_.world_to_object[i];
        local.o = as_double(transform_point(w, ray.origin));
        const Vec3 d = transform_vector(w, direction);
        if (!finite(d) || (d.x == 0 && d.y == 0 && d.z == 0)) continue;
        local.d = as_double(d);
        local.tmin = std::ldexp(double(std::max(ray.tmin, 0.0f)), exponent);
        local.tmax = std::ldexp(double(ray.tmax), exponent);
        local.prepare();
        const uint32_t* base = heap + size_t(record[24]) * 4;
        const uint32_t* nodes = base + size_t(base[RTC_HDR_NODES]) * 4;
        const uint32_t* slots = base + size_t(base[RTC_HDR_SLOTS]) * 4;
        if (base[RTC_HDR_NODE_COUNT] == 0) continue;
        uint32_t stack[256];
        int depth = 0;
        stack[depth++] = 0;
        while (depth > 0) {
            const uint32_t reference = stack[--depth];
            if (!(reference & RTC_REF_LEAF)) {
                const uint32_t* node = nodes + size_t(reference) * RTC_NODE_QUADS * 4;
                const double nearest = best ? best_hit.t : INFINITY;
                double entry[2];
                for (int c = 0; c < 2; ++c)
                    entry[c] = node[3 + 4 * c] == RTC_REF_EMPTY ? INFINITY : box_entry(local, node + c * 8, nearest);
                const int first = entry[1] < entry[0];
                if (entry[1 - first] < INFINITY) stack[depth++] = node[3 + 4 * (1 - first)];
                if (entry[first] < INFINITY) stack[depth++] = node[3 + 4 * first];
                continue;
            }
            const uint32_t count = (reference >> RTC_REF_COUNT_SHIFT) & RTC_REF_COUNT_MASK;
            for (uint32_t k = 0; k < count; ++k) {
                const uint32_t* slot =
                    slots + size_t((reference & RTC_REF_INDEX_MASK) + k) * RTC_TRIANGLE_QUADS * 4;
                std::array<V, 3> v;
                bool whole = true;
                for (int r = 0; r < 3; ++r) {
                    for (int a = 0; a < 3; ++a) v[r][a] = std::bit_cast<float>(slot[r * 4 + a]);
                    for (double component : v[r]) whole = whole && std::isfinite(component);
                }
                Hit hit;
                if (!whole || !meets(local, v, hit, &on_edge, counts)) continue;
                if (order(hit, local.tmin, counts) <= 0 || order(hit, local.tmax, counts) >= 0) continue;
                const OracleHit name{i, slot[7] & RTC_SLOT_GEOMETRY_MASK, slot[3], 0, false, false};
                if (best) {
                    const int o = order(hit, best_hit, counts);
                    if (o == 0) best->tied = true;
                    const bool first = std::tie(name.instance, name.geometry, name.primitive) <
                                       std::tie(best->instance, best->geometry, best->primitive);
                    if (o > 0 || (o == 0 && !first)) continue;
                    const bool tied = o == 0;
                    best = name;
                    best->tied = tied;
                } else {
                    best = name;
                }
                best_hit = hit;
            }
        }
    }
    if (best) {
        best->t = std::ldexp(best_hit.t, -exponent);
        best->on_edge = on_edge;
    }
    if (counts_out) counts_out->add(counts);
    return best;
}

void in_parallel(size_t count, const std::function<void(size_t, size_t)>& work, unsigned wanted) {
    constexpr size_t kChunk = 1024;
    std::atomic<size_t> next = 0;
    auto loop = [&] {
        for (size_t from; (from = next.fetch_add(kChunk)) < count;) work(from, std::min(count, from + kChunk));
    };
    std::vector<std::thread> threads;
    const unsigned most = wanted ? wanted : std::max(1u, std::thread::hardware_concurrency());
    for (unsigned i = 1; i < most && i * kChunk < count; ++i) threads.emplace_back(loop);
    loop();
    for (std::thread& thread : threads) thread.join();
}

std::vector<std::optional<OracleHit>> first_hits(const Oracle& oracle, const std::vector<Ray>& rays,
                                                 OracleCounts* counts, unsigned threads) {
    std::vector<std::optional<OracleHit>> hits(rays.size());
    std::mutex mutex;
    in_parallel(rays.size(), [&](size_t begin, size_t end) {
        OracleCounts mine;
        for (size_t i = begin; i < end; ++i) hits[i] = oracle.first_hit(rays[i], &mine);
        if (!counts) return;
        const std::lock_guard lock(mutex);
        counts->add(mine);
    }, threads);
    return hits;
}

}  // namespace rtc::lab
