// Tier `exact` against exact arithmetic, over the axes of the laboratory. Small
// counts: rtc-accuracy agree repeats them with millions.
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>

#include "cases.h"
#include "denormals.h"
#include "lab_fixture.h"
#include "leaks.h"
#include "meshes.h"
#include "oracle.h"

namespace rtc::lab {
namespace {

constexpr uint64_t kRays = 128;

double ulps(double a, double b) {
    const float f = std::fabs(float(b));
    const double ulp = double(std::nextafter(f, INFINITY)) - double(f);
    return ulp > 0 && std::isfinite(ulp) ? std::fabs(a - b) / ulp : (a == b ? 0 : INFINITY);
}

struct Outcome {
    uint64_t hits = 0, different = 0, excused = 0, ties = 0, edges = 0;
    double worst_t = 0;
    std::string first;
};

Outcome compare(DeviceTracer& tracer, const ExactCase& c, uint64_t count) {
    const HostScene scene = build_scene(c.blases, c.instances, c.build);
    tracer.set_scene(scene);
    const std::vector<Ray> rays = c.rays(0, count);
    const auto got = tracer.trace(rays);
    const Oracle oracle(scene);
    const auto expected = first_hits(oracle, rays);
    Outcome out;
    for (size_t i = 0; i < rays.size(); ++i) {
        const auto& e = expected[i];
        const RayResult& g = got[i];
        const bool hit = g.instance != kNoInstance;
        out.hits += e.has_value();
        out.ties += e && e->tied;
        out.edges += e && e->on_edge;
        const bool same = e ? hit && g.instance == e->instance && g.geometry == e->geometry &&
                                  g.primitive == e->primitive
                            : !hit;
        const bool denormal = denormals_at_stake(scene, rays[i], e, g);
        if (!same && denormal) ++out.excused;
        if (!same && !denormal && out.different++ == 0) {
            char text[512];
            std::snprintf(text, sizeof text,
                          "ray %zu o %a %a %a d %a %a %a t %a..%a: expected %d %d/%d/%d t %.17g, got %d %d/%d/%d t %.9g", i,
                          rays[i].origin.x, rays[i].origin.y, rays[i].origin.z, rays[i].direction.x,
                          rays[i].direction.y, rays[i].direction.z, rays[i].tmin, rays[i].tmax, e.has_value(),
                          e ? int(e->instance) : 0, e ? int(e->geometry) : 0, e ? int(e->primitive) : 0, e ? e->t : 0,
                          hit, int(g.instance), int(g.geometry), int(g.primitive), g.t);
            out.first = text;
        }
        if (same && e && !denormal && e->t > std::numeric_limits<float>::min()) out.worst_t = std::max(out.worst_t, ulps(g.t, e->t));
    }
    return out;
}

// With intersection shaders t is settled for every hit, without them once a ray: both ways.
class Exact : public LabTest, public testing::WithParamInterface<std::pair<Variant, bool>> {
  protected:
    void SetUp() override {
        if (DeviceTracer::needs_float64(GetParam().first) && !test_context().features.shaderFloat64)
            GTEST_SKIP() << "the device has no Float64";
    }
};
INSTANTIATE_TEST_SUITE_P(Tiers, Exact,
                         testing::Values(std::pair(Variant::Exact, true), std::pair(Variant::Exact, false),
                                         std::pair(Variant::Exact64, false)),
                         [](const auto& info) {
                             return std::string(variant_name(info.param.first)) +
                                    (info.param.second ? "_with_aabbs" : "_triangles_only");
                         });

// An origin between 2^-126 and 2^-125 along every axis is no origin of 0, though its exponent is the least there is.
TEST_P(Exact, OriginsOfTheLeastExponentCount) {
    Geometry geometry;
    geometry.triangles.push_back({Vec3{-0x1.33359p-124f, 0x1.178218p-124f, -0x1.6007cap-124f},
                                  Vec3{-0x1.6007cap-124f, 0x1.33359p-124f, -0x1.178218p-124f},
                                  Vec3{-0x1.178218p-124f, 0x1.6007cap-124f, -0x1.33359p-124f}});
    Blas blas;
    blas.geometries.push_back(geometry);
    const HostScene scene = build_scene({blas}, {Instance{}}, {});
    TracerOptions options;
    options.variant = GetParam().first;
    options.aabbs = options.any_hit = GetParam().second;
    DeviceTracer tracer(test_context(), options);
    tracer.set_scene(scene);
    Ray ray{};
    ray.origin = {-0x1.73492ep-126f, 0x1.b2f008p-126f, 0x1.4ab6d8p-126f};
    ray.direction = {-0x1.03357ep-124f, 0x1.8cf31cp-125f, -0x1.6a2fcep-124f};
    ray.tmin = 0;
    ray.tmax = INFINITY;
    ray.mask = 0xff;
    const auto expected = first_hits(Oracle(scene), {ray});
    const auto got = tracer.trace({ray});
    ASSERT_TRUE(expected[0].has_value());
    EXPECT_NE(got[0].instance, kNoInstance);
    EXPECT_NEAR(double(got[0].t), expected[0]->t, 1e-6);
}

TEST_P(Exact, AgreesWithExactArithmeticOnEveryAxis) {
    const auto [variant, aabbs] = GetParam();
    TracerOptions options;
    options.variant = variant;
    options.aabbs = options.any_hit = aabbs;
    options.step_budget = 7000;
    options.pause = true;
    DeviceTracer tracer(test_context(), options);
    uint64_t hits = 0, excused = 0, ties = 0, edges = 0;
    for (const std::string& axis : exact_axis_names()) {
        for (const ExactCase& c : exact_cases(axis)) {
            const Outcome out = compare(tracer, c, kRays);
            // A ray in which denormals are at stake may differ on a device that flushes them (lavapipe 22.3), and
            // only such a ray.
            EXPECT_EQ(out.different, 0u) << axis << ' ' << c.value << ": " << out.first;
            EXPECT_LE(out.worst_t, 1.0) << axis << ' ' << c.value;
            excused += out.excused;
            hits += out.hits;
            ties += out.ties;
            edges += out.edges;
        }
    }
    // The test sees something, and undecided cases are among it.
    EXPECT_GT(hits, 100 * kRays / 4);
    EXPECT_GT(ties, 400u);
    EXPECT_GT(edges, 400u);
    EXPECT_LT(excused, 4 * kRays) << "of the cases of denormal coordinates";
}

// Nothing suspends within a triangle, so lavapipe 22.3 needs a budget that leaves room for its longest decision.
uint32_t turns_reserved() {
    std::ifstream file(RTC_TRAVERSAL_GLSL "/traverse.glsl");
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    const std::string name = "RTC_TURNS_OF_A_TRIANGLE = ";
    const size_t at = text.find(name);
    return at == std::string::npos ? 0 : uint32_t(std::stoul(text.substr(at + name.size())));
}

TEST(ExactTurns, LongestDecisionFitsWhatIsReserved) {
    const uint32_t reserved = turns_reserved();
    ASSERT_GT(reserved, 0u) << "the constant has another name";
    EXPECT_LE(reserved + 1024, 6600u) << "what tools/rtc/report.cpp and docs/resumable.md say of budgets";
    TracerOptions options;
    options.variant = Variant::Exact;
    options.aabbs = options.any_hit = options.resumable = false;
    DeviceTracer tracer(test_context(), options);
    Random random(7);
    uint32_t most = 0;
    for (int scene = 0; scene < 60; ++scene) {
        // Coordinates of all magnitudes make long integers; one vertex is met exactly, between tmin and tmax that
        // are its t's neighbours: zero edges, and two comparisons of t.
        Triangle triangle;
        for (Vec3& v : triangle)
            for (float* x : {&v.x, &v.y, &v.z})
                *x = std::ldexp(1 + float(random() % 8388608) / 8388608, int(random() % 240) - 120) * (random() & 1 ? 1.0f : -1.0f);
        tracer.set_scene(build_scene({Blas{{{{triangle}, {}, true}}}}, {{}}));
        std::vector<Ray> rays;
        for (const Vec3& v : triangle)
            for (const float scale : {1.0f, 0.5f, 3.0f}) {
                Ray ray = make_ray({0, 0, 0}, {v.x * scale, v.y * scale, v.z * scale});
                ray.tmin = std::nextafter(1 / scale, 0.0f);
                ray.tmax = std::nextafter(1 / scale, 2.0f);
                rays.push_back(ray);
            }
        for (const RayResult& r : tracer.trace(rays)) most = std::max(most, r.turns);
    }
    // The walk to the only leaf takes a few turns of its own.
    EXPECT_LE(most, reserved + 16);
    EXPECT_GT(most, 1500u) << "no long decision was met: this test sees nothing";
}

// Lavapipe 22.3 ends all loops of eight lanes once they have spent 65535 turns together, and lanes that decide different
// things take their turns one after another: the budget that the runtime recommends must hold eight longest decisions.
TEST(ExactTurns, LanesThatDecideDifferentThingsEndInTime) {
    TracerOptions options;
    options.variant = Variant::Exact;
    options.aabbs = options.any_hit = false;
    options.step_budget = 65535 / 8 / 8 * 7;
    options.pause = true;
    DeviceTracer tracer(test_context(), options);
    Random random(11);
    std::vector<Triangle> triangles(64);
    std::vector<Ray> rays;
    for (Triangle& triangle : triangles) {
        for (Vec3& v : triangle)
            for (float* x : {&v.x, &v.y, &v.z})
                *x = std::ldexp(1 + float(random() % 8388608) / 8388608, int(random() % 240) - 120) * (random() & 1 ? 1.0f : -1.0f);
        for (const Vec3& v : triangle)
            for (const float scale : {1.0f, 0.5f, 3.0f}) {
                Ray ray = make_ray({0, 0, 0}, {v.x * scale, v.y * scale, v.z * scale});
                ray.tmin = 0.5f / scale;
                ray.tmax = 2 / scale;
                rays.push_back(ray);
            }
    }
    const HostScene scene = build_scene({Blas{{{triangles, {}, true}}}}, {{}});
    tracer.set_scene(scene);
    const auto got = tracer.trace(rays);
    const auto expected = first_hits(Oracle(scene), rays);
    uint32_t long_ones = 0, hits = 0;
    for (size_t i = 0; i < rays.size(); ++i) {
        long_ones += got[i].turns > 1000;
        hits += expected[i].has_value();
        ASSERT_EQ(got[i].instance != kNoInstance, expected[i].has_value()) << i;
        if (expected[i]) {
            ASSERT_EQ(got[i].primitive, expected[i]->primitive) << i;
        }
    }
    EXPECT_GT(long_ones, rays.size() / 8) << "no long decisions side by side";
    EXPECT_GT(hits, 64u);
}

// Pairs and integers do without Float64.
TEST(Exact, NeedsNoFloat64) {
    tools::ContextOptions plain;
    plain.validate = true;
    plain.print_device = false;
    const tools::Context context(plain);
    ASSERT_FALSE(context.features.shaderFloat64);
    TracerOptions options;
    options.variant = Variant::Exact;
    options.aabbs = options.any_hit = false;
    options.step_budget = 7000;
    options.pause = true;
    DeviceTracer tracer(context, options);
    const ExactCase c = exact_cases("aim").at(0);
    const HostScene scene = build_scene(c.blases, c.instances, c.build);
    tracer.set_scene(scene);
    const std::vector<Ray> rays = c.rays(0, 512);
    const auto got = tracer.trace(rays);
    const auto expected = first_hits(Oracle(scene), rays);
    for (size_t i = 0; i < rays.size(); ++i) {
        ASSERT_EQ(got[i].instance != kNoInstance, expected[i].has_value()) << i;
        if (expected[i]) {
            ASSERT_EQ(got[i].primitive, expected[i]->primitive) << i;
        }
    }
    context.require_silent_validation();
}

}  // namespace
}  // namespace rtc::lab
