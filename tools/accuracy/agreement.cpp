#include "agreement.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <future>
#include <limits>
#include <optional>

#include "cases.h"
#include "denormals.h"
#include "exact.h"

namespace rtc::lab {
namespace {

using Clock = std::chrono::steady_clock;
constexpr uint64_t kBatch = 1 << 18;

double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

double ulp(double t) {
    const float f = std::fabs(float(t));
    return double(std::nextafter(f, std::numeric_limits<float>::infinity())) - double(f);
}

// Errors counted in steps.
class Steps {
  public:
    explicit Steps(size_t steps) : steps_(steps) {}
    void add(const Steps& more) {
        for (size_t i = 0; i < steps_.size(); ++i) steps_[i] += more.steps_[i];
        count_ += more.count_;
    }

  protected:
    void count(size_t step) {
        ++steps_[std::min(step, steps_.size() - 1)];
        ++count_;
    }
    // The first step with that share of all at or below it; nothing when nothing was counted.
    std::optional<size_t> reached(double p) const {
        uint64_t seen = 0;
        for (size_t i = 0; i < steps_.size(); ++i) {
            seen += steps_[i];
            if (seen > 0 && double(seen) >= p * double(count_)) return i;
        }
        return std::nullopt;
    }

  private:
    std::vector<uint64_t> steps_;
    uint64_t count_ = 0;
};

// Errors in steps of 1/64 ulp; more than 64 ulps share the last step but for the maximum.
class Histogram : public Steps {
  public:
    Histogram() : Steps(64 * 64 + 1) {}
    using Steps::add;
    void add(double error) { count(size_t(error * 64)); }
    double percentile(double p) const {
        const auto step = reached(p);
        return step ? double(*step + 1) / 64 : 0;
    }
};

// Absolute errors in eight steps an octave, 2^-40 to 1.
class FineHistogram : public Steps {
  public:
    FineHistogram() : Steps(8 * 40 + 1) {}
    using Steps::add;
    void add(double error) {
        count(size_t(error > 0 ? std::clamp(std::ceil(8 * (std::log2(error) + 40)), 0.0, 8 * 40.0) : 0));
    }
    double percentile(double p) const {
        const auto step = reached(p);
        return step && *step ? std::exp2(double(*step) / 8 - 40) : 0;
    }
};

// The object-space ray as traversal has it.
ExactRay object_ray(const HostScene& scene, const Ray& ray, uint32_t instance) {
    ExactRay object{ray.origin, ray.direction, ray.tmin, ray.tmax};
    if (scene.instances[instance].object_to_world != kIdentity) {
        object.origin = transform_point(scene.world_to_object[instance], ray.origin);
        object.direction = transform_vector(scene.world_to_object[instance], ray.direction);
    }
    return object;
}

// How far (b1, b2) is from the weights of the second and third vertex; nothing where long doubles do not tell.
std::optional<double> weights_off(const ExactRay& ray, const Triangle& triangle, float b1, float b2) {
    long double v[3][3], s[3], size = 0, sum = 0;
    for (int k = 0; k < 3; ++k)
        for (int i = 0; i < 3; ++i) v[k][i] = static_cast<long double>(triangle[k][i]) - ray.origin[i];
    for (int k = 0; k < 3; ++k) {
        const long double *a = v[(k + 1) % 3], *b = v[(k + 2) % 3];
        s[k] = 0;
        for (int i = 0; i < 3; ++i) {
            const int j = (i + 1) % 3, l = (i + 2) % 3;
            const long double p = a[j] * b[l] * ray.direction[i], q = a[l] * b[j] * ray.direction[i];
            s[k] += p - q;
            size += std::fabs(p) + std::fabs(q);
        }
        sum += s[k];
    }
    if (!(std::fabs(sum) * 0x1p-30L > size * 0x1p-60L)) return {};
    return std::max(std::fabs(double(s[1] / sum - b1)), std::fabs(double(s[2] / sum - b2)));
}

struct Errors {
    Histogram t;
    FineHistogram weights;
};

// Whether a triangle that only the device hits is touched at an edge or vertex: there a rule decides.
bool touches_edge(const HostScene& scene, const Ray& ray, const RayResult& hit) {
    const Instance& instance = scene.instances.at(hit.instance);
    const auto& geometries = scene.blases.at(instance.blas).geometries;
    if (hit.geometry >= geometries.size() || hit.primitive >= geometries[hit.geometry].triangles.size()) return false;
    mpq_class t;
    return intersect(object_ray(scene, ray, hit.instance), geometries[hit.geometry].triangles[hit.primitive], &t) == Verdict::Boundary;
}

void compare(const ExactCase& c, const HostScene& scene, const std::vector<Ray>& rays, const std::vector<RayResult>& got,
             const std::vector<std::optional<OracleHit>>& expected, AgreementRow& row, Errors& errors) {
    row.rays += rays.size();
    for (size_t i = 0; i < rays.size(); ++i) {
        const auto& e = expected[i];
        const RayResult& g = got[i];
        const bool hit = g.instance != kNoInstance;
        row.hits += e.has_value();
        row.ties += e && e->tied;
        row.on_edge += e && e->on_edge;
        const bool denormal = denormals_at_stake(scene, rays[i], e, g);
        row.with_denormals += denormal;
        if (!e && !hit) continue;
        if (e && hit && g.instance == e->instance && g.geometry == e->geometry && g.primitive == e->primitive) {
            if (denormal || std::fabs(e->t) < std::numeric_limits<float>::min()) continue;  // a t that devices flush
            const double error = std::fabs(double(g.t) - e->t) / ulp(e->t);
            row.t_max = std::max(row.t_max, error);
            errors.t.add(error);
            const Triangle& triangle = scene.blases[scene.instances[e->instance].blas].geometries[e->geometry].triangles[e->primitive];
            if (const auto off = weights_off(object_ray(scene, rays[i], e->instance), triangle, std::bit_cast<float>(g.attr0),
                                             std::bit_cast<float>(g.attr1))) {
                errors.weights.add(*off);
                row.b_max = std::max(row.b_max, *off);
            }
            continue;
        }
        row.missed += e && !hit;
        row.invented += !e && hit;
        row.inverted += e && hit;
        row.denormal += denormal;
        const bool rule =
            !denormal && (e ? e->tied || e->on_edge : g.instance < scene.instances.size() && touches_edge(scene, rays[i], g));
        row.by_rule += rule;
        row.missed_plainly += !denormal && !rule && e && !hit;
        row.invented_plainly += !denormal && !rule && !e && hit;
        row.later += !denormal && !rule && e && hit && double(g.t) > e->t;
        if (!denormal && !rule && e) {
            const Triangle& triangle = scene.blases[scene.instances[e->instance].blas].geometries[e->geometry].triangles[e->primitive];
            const double margin = std::fabs(inside_margin(object_ray(scene, rays[i], e->instance), triangle));
            if (std::isfinite(margin)) row.margin = std::max(row.margin, margin);
        }
        if (denormal || !row.first.empty()) continue;
        char text[400];
        std::snprintf(text, sizeof text, "%s: o %a %a %a d %a %a %a t %a to %a", c.value.c_str(), rays[i].origin.x,
                      rays[i].origin.y, rays[i].origin.z, rays[i].direction.x, rays[i].direction.y,
                      rays[i].direction.z, rays[i].tmin, rays[i].tmax);
        row.first = text;
    }
}

// One case; `allowed` seconds at most, roughly.
void measure_case(RayTracer& tracer, const ExactCase& c, uint64_t share, double allowed, unsigned threads,
                  AgreementRow& row, Errors& errors) {
    const Clock::time_point start = Clock::now();
    HostScene scene = build_scene(c.blases, c.instances, c.build);
    tracer.set_scene(scene);
    // The oracle keeps its own trees, and takes instances one by one; only the object-space rays are the tracer's.
    for (uint32_t i = 0; i < scene.instances.size(); ++i)
        if (const auto inverse = tracer.world_to_object(i)) scene.world_to_object[i] = *inverse;
    const Oracle oracle(scene);
    std::vector<Ray> rays;
    for (uint64_t first = 0; first < share; first += kBatch) {
        rays.resize(std::min(kBatch, share - first));
        in_parallel(
            rays.size(),
            [&](size_t begin, size_t end) {
                const std::vector<Ray> part = c.rays(first + begin, end - begin);
                std::copy(part.begin(), part.end(), rays.begin() + std::ptrdiff_t(begin));
            },
            threads);
        // The device works while the oracle does.
        auto tracing = std::async(std::launch::async, [&] {
            const Clock::time_point begin = Clock::now();
            auto results = tracer.trace(rays);
            row.device_seconds += seconds_since(begin);
            return results;
        });
        const Clock::time_point begin = Clock::now();
        const auto expected = first_hits(oracle, rays, &row.oracle, threads);
        row.oracle_seconds += seconds_since(begin);
        compare(c, scene, rays, tracing.get(), expected, row, errors);
        if (seconds_since(start) > allowed) break;
    }
}

}  // namespace

void AgreementRow::add(const AgreementRow& more) {
    cases += more.cases;
    rays += more.rays;
    hits += more.hits;
    ties += more.ties;
    on_edge += more.on_edge;
    missed += more.missed;
    invented += more.invented;
    inverted += more.inverted;
    denormal += more.denormal;
    with_denormals += more.with_denormals;
    by_rule += more.by_rule;
    missed_plainly += more.missed_plainly;
    invented_plainly += more.invented_plainly;
    later += more.later;
    oracle.add(more.oracle);
    device_seconds += more.device_seconds;
    oracle_seconds += more.oracle_seconds;
    t_max = std::max(t_max, more.t_max);
    b_max = std::max(b_max, more.b_max);
    margin = std::max(margin, more.margin);
}

std::vector<AgreementRow> measure_agreement(RayTracer& tracer, const AgreementSettings& settings, AgreementRow* total) {
    const std::vector<std::string>& names = settings.axes.empty() ? exact_axis_names() : settings.axes;
    const Clock::time_point start = Clock::now();
    std::vector<AgreementRow> rows;
    AgreementRow all{.axis = "all"};
    Errors all_errors;
    auto percentiles = [](AgreementRow& row, const Errors& errors) {
        row.t_p50 = errors.t.percentile(0.5);
        row.t_p99 = errors.t.percentile(0.99);
        row.t_p999 = errors.t.percentile(0.999);
        row.b_p50 = errors.weights.percentile(0.5);
        row.b_p999 = errors.weights.percentile(0.999);
    };
    double said = 0;
    for (size_t n = 0; n < names.size(); ++n) {
        const std::vector<ExactCase> cases = exact_cases(names[n]);
        AgreementRow row{.axis = names[n], .cases = cases.size()};
        Errors errors;
        const uint64_t axis_share = settings.rays / names.size();
        const uint64_t share = (axis_share + cases.size() - 1) / cases.size();
        for (size_t i = 0; i < cases.size(); ++i) {
            const double left = settings.seconds - seconds_since(start);
            const double axis_parts = 1 - double(i) / double(cases.size()) + double(names.size() - n - 1);
            const double allowed =
                settings.seconds > 0 ? std::max(0.0, left) / axis_parts / double(cases.size()) : 1e30;
            measure_case(tracer, cases[i], share, allowed, settings.threads, row, errors);
            const double now = seconds_since(start);
            if (!settings.quiet && now > said + 10) {
                std::fprintf(stderr, "%s, case %zu of %zu: %.1f million rays of this axis, %llu differ, %.0f s\n",
                             names[n].c_str(), i + 1, cases.size(), double(row.rays) * 1e-6,
                             (unsigned long long)row.different(), now);
                said = now;
            }
        }
        percentiles(row, errors);
        all_errors.t.add(errors.t);
        all_errors.weights.add(errors.weights);
        all.add(row);
        rows.push_back(row);
    }
    percentiles(all, all_errors);
    if (total) *total = all;
    return rows;
}

}  // namespace rtc::lab
