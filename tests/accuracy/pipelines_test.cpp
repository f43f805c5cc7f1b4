// Scenes that the runtime builds on the device, traced through pipelines that rtc links, against brute force on the
// host and against the balance of closed meshes.
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <random>

#include "cases.h"
#include "denormals.h"
#include "exact.h"
#include "lab_fixture.h"
#include "leaks.h"
#include "oracle.h"
#include "pipeline_tracer.h"
#include "transform_error.h"

namespace rtc::lab {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();
const Triangle kTriangle = {Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1, 0}};

std::map<std::string, std::unique_ptr<PipelineTracer>> tracers;

// They must end before the device does.
class EndTracers : public testing::Environment {
    void TearDown() override { tracers.clear(); }
};
const testing::Environment* const end_tracers = testing::AddGlobalTestEnvironment(new EndTracers);

// Compiling takes longer than tracing: one a tier for all tests.
PipelineTracer& pipeline(const std::string& tier) {
    auto& entry = tracers[tier];
    if (!entry) {
        PipelineTracerOptions options;
        options.tier = tier;
        options.any_hit = tier != "exact";
        options.lanes = 4096;
        entry = make_pipeline_tracer(test_context(), options);
    }
    entry->allow_update = entry->fast_build = false;
    return *entry;
}

class Pipelines : public LabTest, public testing::WithParamInterface<const char*> {
  protected:
    static PipelineTracer& tracer() { return pipeline(GetParam()); }
    static bool exact() { return std::string(GetParam()) == "exact"; }
};
INSTANTIATE_TEST_SUITE_P(Tiers, Pipelines, testing::Values("watertight", "exact"),
                         [](const auto& info) { return info.param; });

HostScene one_mesh(std::vector<Triangle> triangles, const Transform& transform = kIdentity) {
    Instance instance;
    instance.object_to_world = transform;
    return build_scene({Blas{{{std::move(triangles), {}, true}}}}, {instance});
}

std::vector<Ray> rays_into(double reach, int count) {
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> unit(-1, 1);
    auto any = [&](double by) { return Vec3{float(by * unit(random)), float(by * unit(random)), float(by * unit(random))}; };
    std::vector<Ray> rays;
    for (int i = 0; i < count; ++i) {
        const Vec3 from = any(3 * reach), to = any(reach);
        rays.push_back(make_ray(from, {to.x - from.x, to.y - from.y, to.z - from.z}, 0, kInf));
    }
    return rays;
}

using Hits = std::vector<std::optional<ExactHit>>;

// First hits of all triangles one after the other.
Hits brute_force(const std::vector<Triangle>& triangles, const std::vector<Ray>& rays) {
    Hits hits;
    for (const Ray& ray : rays) hits.push_back(nearest({ray.origin, ray.direction, ray.tmin, ray.tmax}, triangles));
    return hits;
}

// Returns how many rays hit.
uint32_t expect_hits(PipelineTracer& tracer, const Hits& hits_due, const std::vector<Ray>& rays, bool exact,
                     const std::string& what) {
    const auto results = tracer.trace(rays);
    uint32_t hits = 0;
    for (size_t i = 0; i < rays.size(); ++i) {
        const auto& expected = hits_due[i];
        const RayResult& r = results[i];
        if (expected && expected->boundary && !exact) continue;
        EXPECT_EQ(r.instance != kNoInstance, expected.has_value()) << what << ", ray " << i;
        if (!expected || r.instance == kNoInstance) continue;
        ++hits;
        if (expected->boundary) continue;  // a rule picks the triangle
        // Rounded tests may take one of two that are as near for the other.
        EXPECT_NEAR(r.t, expected->t, std::fabs(expected->t) * (exact ? 1.2e-7 : 1e-5)) << what << ", ray " << i;
        if (exact) {
            EXPECT_EQ(r.primitive, expected->triangle) << what << ", ray " << i;
        }
    }
    return hits;
}

TEST_P(Pipelines, GarbageIsBuiltAndTraced) {
    std::mt19937_64 random(19);
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float special[] = {nan, kInf, -kInf, 0.0f, -0.0f, 3e38f, -3e38f, 1e-40f, 1, -1};
    auto any = [&] {
        const uint64_t kind = random() % 4;
        if (kind == 0) return std::bit_cast<float>(uint32_t(random()));
        if (kind == 1) return special[random() % std::size(special)];
        return float(int(random() % 2001) - 1000) / 500;
    };
    uint32_t hits = 0;
    for (int round = 0; round < 3; ++round) {
        Blas blas;
        blas.geometries.resize(2);
        for (int i = 0; i < 64; ++i) {
            Triangle t;
            for (Vec3& v : t) v = {any(), any(), any()};
            if (i % 8 == 0) t = {Vec3{any(), 0, 0}, Vec3{0, any(), 0}, Vec3{0, 0, any()}};
            blas.geometries[i % 2].triangles.push_back(t);
        }
        blas.geometries[0].triangles.push_back({Vec3{nan, nan, nan}, Vec3{nan, nan, nan}, Vec3{nan, nan, nan}});
        // The identity; any; NaN, infinite, singular.
        std::vector<Instance> instances(12);
        for (size_t i = 1; i < instances.size(); ++i) {
            Transform& m = instances[i].object_to_world;
            if (i < 8)
                for (auto& row : m)
                    for (float& entry : row) entry = any();
            if (i == 8) m[1][3] = nan;
            if (i == 9) m[0][0] = kInf;
            if (i == 10) m[2] = {0, 0, 0, 1};
            if (i == 11) m[1] = m[0];
        }
        const HostScene scene = build_scene({blas}, instances);
        tracer().set_scene(scene);
        std::vector<Ray> rays = rays_into(2, 96);
        for (int i = 0; i < 64; ++i) rays.push_back(make_ray({any(), any(), any()}, {any(), any(), any()}, any(), any()));
        const auto results = tracer().trace(rays);  // throws for a launch error
        for (size_t i = 0; i < rays.size(); ++i) {
            const RayResult& r = results[i];
            if (r.instance == kNoInstance) continue;
            ++hits;
            EXPECT_LT(r.instance, 8u) << "of those that are no transform none can be hit";
            ASSERT_LT(r.geometry, 2u);
            ASSERT_LT(r.primitive, blas.geometries[r.geometry].triangles.size());
            for (const Vec3& v : blas.geometries[r.geometry].triangles[r.primitive])
                EXPECT_FALSE(std::isnan(v.x)) << "a NaN in x makes a triangle inactive";
            EXPECT_TRUE(std::isfinite(r.t));
            EXPECT_GT(std::bit_cast<uint32_t>(r.t), 0u);
            EXPECT_GE(r.t, rays[i].tmin);
            if (rays[i].tmax > 0x1p-126f) {
                EXPECT_LE(r.t, rays[i].tmax);
            }
        }
    }
    EXPECT_GT(hits, 30u) << "this test sees nothing";
}

TEST_P(Pipelines, AHundredThousandOnOneSpot) {
    constexpr uint32_t kCount = 100'000;
    tracer().set_scene(one_mesh(std::vector<Triangle>(kCount, kTriangle)));
    const auto results = tracer().trace({make_ray({0.25f, 0.25f, 2}, {0, 0, -1}, 0, kInf), make_ray({0.6f, 0.1f, -1}, {0, 0, 2}, 0, kInf),
                                         make_ray({2, 2, 2}, {0, 0, -1}, 0, kInf), make_ray({0.25f, 0.25f, 2}, {0, 0, -1}, 0, 1)});
    EXPECT_EQ(results[0].t, 2.0f);
    EXPECT_EQ(results[1].t, 0.5f);
    for (const int i : {0, 1}) {
        EXPECT_EQ(results[i].instance, 0u);
        EXPECT_LT(results[i].primitive, kCount);
        if (exact()) {
            EXPECT_EQ(results[i].primitive, 0u) << "of all that are as near the lowest number";
        }
    }
    EXPECT_EQ(results[2].instance, kNoInstance);
    EXPECT_EQ(results[3].instance, kNoInstance);
}

TEST_P(Pipelines, GeometricChainOfTenThousand) {
    std::vector<Triangle> chain;
    for (int i = 0; i < 10'000; ++i) {
        const float s = float(std::exp2(-double(i) / 200));  // down to 2^-50
        chain.push_back({Vec3{0, 0, s}, Vec3{s, 0, s}, Vec3{0, s, s}});
    }
    std::vector<Ray> rays;
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> unit(0, 1);
    const int count = exact() ? 12 : 24;
    PipelineTracer& built = tracer();
    for (int i = 0; i < count; ++i) {
        const double at = std::exp2(-50 * unit(random));
        // From 3 below, most triangles lie closer to one another than floats tell: thousands of exact decisions a ray,
        // more than lavapipe 22.3 has rounds for.
        const float below = exact() ? float(-3 * at) : -3.0f;
        const Vec3 origin = {float(at * unit(random)), float(at * unit(random)), i % 2 ? 3.0f : below};
        const float slope = i % 3 ? 0.0f : float(at * 0.1);
        rays.push_back(make_ray(origin, {slope, -slope, i % 2 ? -1.0f : 1.0f}, 0, kInf));
    }
    const Hits due = brute_force(chain, rays);
    for (const bool fast : {false, true}) {
        built.fast_build = fast;
        built.set_scene(one_mesh(chain));
        EXPECT_GT(expect_hits(built, due, rays, exact(), fast ? "fast build" : "fast trace"), uint32_t(count) / 3);
    }
}

TEST_P(Pipelines, RefitFarFromTheBuiltShape) {
    for (const bool fast : {false, true}) {
        PipelineTracer& tracer = Pipelines::tracer();
        tracer.allow_update = true;
        tracer.fast_build = fast;
        const IndexedMesh knot = make_torus_knot(60, 10);
        const std::vector<Triangle> built = knot.soup();
        tracer.set_scene(one_mesh(built));
        const std::vector<Ray> before = rays_into(1.2, 300);
        EXPECT_GT(expect_hits(tracer, brute_force(built, before), before, exact(), "as built"), 60u);
        std::mt19937_64 random(8);
        for (const double extent : {10.0, 0.1, 1.0}) {
            // Another shape of that extent: the tree was made for neighbours that are none now.
            for (const bool torn : {false, true}) {
                IndexedMesh mesh = moved(knot, extent, {0, 0, 0});
                if (torn) std::shuffle(mesh.vertices.begin(), mesh.vertices.end(), random);
                const std::vector<Triangle> now = mesh.soup();
                tracer.refit(one_mesh(now));
                char what[64];
                std::snprintf(what, sizeof what, "%s x%g%s", fast ? "fast build" : "fast trace", extent, torn ? " torn" : "");
                const std::vector<Ray> rays = rays_into(1.2 * extent, torn ? 60 : 300);
                EXPECT_GT(expect_hits(tracer, brute_force(now, rays), rays, exact(), what), torn ? 30u : 60u);
            }
        }
    }
}

// With the runtime's own instance boxes and inverses.
TEST_F(LabTest, ClosedMeshesOfTheRuntimeBalanceUnderAllTransforms) {
    PipelineTracer& tracer = pipeline("watertight");
    const IndexedMesh ball = make_icosphere(3);
    for (const auto& [name, transform] : lab_transforms()) {
        if (name == "near-singular" || name == "stretch 1e6:1" || name == "oblique 1e4:1" || name == "rotated + 1e8") continue;
        LeakCase c;
        c.mesh = &ball;
        c.instance.object_to_world = transform;
        tracer.set_scene(leak_scene(c));
        for (const Aim aim : {Aim::Edge, Aim::Vertex}) {
            c.aim = aim;
            const LeakCounts counts = count_leaks(tracer, c, 4096);
            EXPECT_EQ(counts.unbalanced, 0u) << name << ' ' << aim_name(aim);
            EXPECT_LT(counts.missed, counts.rays / 2) << name;
        }
    }
}

TEST_F(LabTest, ObjectRaysStayWithinTheirBound) {
    for (const TransformError& e : measure_transform_errors(pipeline("watertight"), 200)) {
        EXPECT_LE(e.origin, kTransformBound) << e.name;
        EXPECT_LE(e.direction, kTransformBound) << e.name;
        EXPECT_LE(e.of_padding, 1) << e.name << ": the instance's box does not hold it";
        if (e.name == "identity") {
            EXPECT_EQ(e.origin, 0) << "nothing is rounded";
        }
    }
}

}  // namespace
}  // namespace rtc::lab
