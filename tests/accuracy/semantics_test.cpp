// What a ray may hit, rule by rule (Vulkan: ray traversal).
#include <cmath>
#include <limits>
#include <random>

#include "lab_fixture.h"
#include "meshes.h"
#include "rtc/abi.h"

namespace rtc::lab {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// In the plane z = 0. Its normal (v1 - v0) x (v2 - v0) is +z: a front face for rays that go down.
const Triangle kTriangle = {Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1, 0}};

Blas triangle_blas(bool opaque = true) { return {{{{kTriangle}, {}, opaque}}}; }
Blas box_blas(bool opaque = true) { return {{{{}, {{{0, 0, -1}, {1, 1, 1}}}, opaque}}}; }

RayResult trace_one(const HostScene& scene, const Ray& ray, Variant variant = Variant::Watertight) {
    DeviceTracer& tracer = shared_tracer(variant);
    tracer.set_scene(scene);
    return tracer.trace({ray})[0];
}

class EachTier : public LabTest, public testing::WithParamInterface<Variant> {
  protected:
    void SetUp() override {
        if (DeviceTracer::needs_float64(GetParam()) && !test_context().features.shaderFloat64)
            GTEST_SKIP() << "the device has no Float64";
    }
};
INSTANTIATE_TEST_SUITE_P(Tiers, EachTier,
                         testing::Values(Variant::Watertight, Variant::Fast, Variant::Exact, Variant::Exact64),
                         [](const auto& info) { return variant_name(info.param); });

TEST_P(EachTier, ReportsEverythingAboutAHit) {
    Blas blas;
    blas.geometries.resize(3);
    blas.geometries[2].triangles = {{Vec3{5, 5, 5}, Vec3{6, 5, 5}, Vec3{5, 6, 5}}, kTriangle};
    Instance far{.blas = 0, .object_to_world = kIdentity};
    far.object_to_world[2][3] = -100;
    const Instance near{.blas = 0, .custom_index = 42, .sbt_offset = 1000};
    Ray ray = make_ray({0.25f, 0.5f, 3}, {0, 0, -2});
    ray.sbt = 3u | 4u << 4;
    const RayResult hit = trace_one(build_scene({blas}, {far, near}), ray, GetParam());
    EXPECT_EQ(hit.instance, 1u);
    EXPECT_EQ(hit.geometry, 2u);
    EXPECT_EQ(hit.primitive, 1u);
    EXPECT_EQ(hit.record, 1000u + 2u * 4u + 3u);
    EXPECT_EQ(hit.kind, 0xfeu);
    EXPECT_FLOAT_EQ(hit.t, 1.5f);
    EXPECT_EQ(hit.attr0, std::bit_cast<uint32_t>(0.25f));
    EXPECT_EQ(hit.attr1, std::bit_cast<uint32_t>(0.5f));
    EXPECT_EQ(hit.mismatches, 0u);
}

// Edges and vertices are what floats leave open: decided after the walk's loop, which then goes on. Two sheets, so that
// every ray meets such a triangle twice; four triangles a leaf.
TEST_F(LabTest, HitsOnEdgesLieWhereTheyAreMet) {
    auto height = [](float px, float py) { return 0.5f * px + 0.25f * py; };
    Blas blas;
    blas.geometries.resize(1);
    std::vector<Triangle>& triangles = blas.geometries[0].triangles;
    for (float sheet : {0.0f, -4.0f})
        for (int x = 0; x < 4; ++x)
            for (int y = 0; y < 4; ++y) {
                auto at = [&](int i, int j) {
                    const float px = float(x + i), py = float(y + j);
                    return Vec3{px, py, height(px, py) + sheet};
                };
                triangles.push_back({at(0, 0), at(1, 0), at(1, 1)});
                triangles.push_back({at(0, 0), at(1, 1), at(0, 1)});
            }
    std::vector<Ray> rays;
    for (int x = 1; x < 16; ++x)
        for (int y = 1; y < 16; ++y)
            for (float direction : {-1.0f, 1.0f})
                rays.push_back(make_ray({0.25f * float(x), 0.25f * float(y), -8 * direction}, {0, 0, direction}));
    for (const Variant variant : {Variant::Watertight, Variant::Exact}) {
        for (const bool opaque : {true, false}) {
            blas.geometries[0].opaque = opaque;
            TracerOptions options;
            options.variant = variant;
            options.aabbs = false;
            options.any_hit = options.resumable = !opaque;
            DeviceTracer tracer(test_context(), options);
            tracer.set_scene(build_scene({blas}, {{}}));
            for (Ray& ray : rays) ray.sbt = opaque ? 0u : uint32_t(kIgnore);
            const std::vector<RayResult> hits = tracer.trace(rays);
            for (size_t i = 0; i < rays.size(); ++i) {
                const Vec3 o = rays[i].origin;
                const RayResult& hit = hits[i];
                SCOPED_TRACE(testing::Message() << variant_name(variant) << " at " << o.x << ' ' << o.y << ' ' << o.z);
                if (!opaque) {
                    EXPECT_EQ(hit.front + hit.back, 2u);
                    continue;
                }
                ASSERT_NE(hit.instance, kNoInstance);
                EXPECT_EQ(hit.t, o.z > 0 ? o.z - height(o.x, o.y) : height(o.x, o.y) - 4 - o.z);
                const Triangle& v = triangles[hit.primitive];
                const float b1 = std::bit_cast<float>(hit.attr0), b2 = std::bit_cast<float>(hit.attr1);
                EXPECT_FLOAT_EQ(v[0].x + b1 * (v[1].x - v[0].x) + b2 * (v[2].x - v[0].x), o.x);
                EXPECT_FLOAT_EQ(v[0].y + b1 * (v[1].y - v[0].y) + b2 * (v[2].y - v[0].y), o.y);
                EXPECT_EQ(hit.kind, o.z > 0 ? 0xfeu : 0xffu);
            }
        }
    }
}

// A triangle beside a report at nearly its t: the smaller one counts, whichever comes first in the walk.
TEST_F(LabTest, ExactTrianglesAreComparedWithReports) {
    for (const bool triangle_first : {true, false}) {
        const HostScene scene = build_scene({triangle_blas(), box_blas()}, {Instance{.blas = triangle_first ? 0u : 1u},
                                                                           Instance{.blas = triangle_first ? 1u : 0u}});
        for (const float reported : {std::nextafter(2.0f, 0.0f), 2.0f, std::nextafter(2.0f, 3.0f)}) {
            Ray ray = make_ray({0.25f, 0.5f, 2}, {0, 0, -1});
            ray.report_t = reported;
            const RayResult hit = trace_one(scene, ray, Variant::Exact);
            const uint32_t triangle = triangle_first ? 0u : 1u;
            const uint32_t expected = reported < 2 ? 1 - triangle : (reported > 2 ? triangle : 0u);
            EXPECT_EQ(hit.instance, expected) << reported << ' ' << triangle_first;
            EXPECT_EQ(hit.t, std::min(reported, 2.0f));
        }
    }
}

TEST_P(EachTier, MissLeavesTheOperand) {
    const RayResult miss = trace_one(build_scene({triangle_blas()}, {{}}),
                                     make_ray({2, 2, 3}, {0, 0, -1}, 0.5f, 77), GetParam());
    EXPECT_EQ(miss.instance, kNoInstance);
    EXPECT_EQ(miss.t, 77.0f);
}

TEST_P(EachTier, TriangleIntervalIsOpen) {
    const HostScene scene = build_scene({triangle_blas()}, {{}});
    struct Case {
        float tmin, tmax;
        bool hit;
    };
    const float below = std::nextafter(2.0f, 0.0f), above = std::nextafter(2.0f, 3.0f);
    for (const Case& c : {Case{0, 2, false},
                          {0, above, true},
                          {2, 10, false},
                          {below, 10, true},
                          {2, 2, false},
                          {0, kInf, true},
                          {0, std::numeric_limits<float>::max(), true},
                          {3, 1, false}}) {
        const RayResult r =
            trace_one(scene, make_ray({0.25f, 0.25f, 2}, {0, 0, -1}, c.tmin, c.tmax), GetParam());
        EXPECT_EQ(r.instance != kNoInstance, c.hit) << c.tmin << " .. " << c.tmax;
    }
}

TEST_P(EachTier, BoxIntervalIsClosedAndInsideHits) {
    const HostScene scene = build_scene({box_blas()}, {{}});
    auto seen = [&](Ray ray) {
        ray.sbt = kNoReport;
        return trace_one(scene, ray, GetParam()).boxes;
    };
    EXPECT_EQ(seen(make_ray({0.5f, 0.5f, 3}, {0, 0, -1}, 0, 2)), 1u) << "entered exactly at tmax";
    EXPECT_EQ(seen(make_ray({0.5f, 0.5f, 3}, {0, 0, -1}, 0, 1.9f)), 0u);
    EXPECT_EQ(seen(make_ray({0.5f, 0.5f, 3}, {0, 0, -1}, 4, 9)), 1u) << "left exactly at tmin";
    EXPECT_EQ(seen(make_ray({0.5f, 0.5f, 3}, {0, 0, -1}, 4.1f, 9)), 0u);
    EXPECT_EQ(seen(make_ray({0.5f, 0.5f, 0}, {0, 0, -1}, 0, 0)), 1u) << "inside, empty interval";
    EXPECT_EQ(seen(make_ray({0.5f, 0.5f, 0}, {0, 0, -1}, 0.1f, 0.2f)), 1u) << "wholly inside";
    if (GetParam() != Variant::Fast) {
        EXPECT_EQ(seen(make_ray({1, 0.5f, 3}, {0, 0, -1})), 1u) << "along a face";
        EXPECT_EQ(seen(make_ray({1, 1, 3}, {0, -0.0f, -1})), 1u) << "along an edge, with -0";
    }
    EXPECT_EQ(seen(make_ray({1.001f, 0.5f, 3}, {0, 0, -1})), 0u);
}

TEST_P(EachTier, ReportsObeyTheIntervalAndCommitAttributes) {
    const HostScene scene = build_scene({box_blas()}, {{}});
    auto reported = [&](float t, float tmin, float tmax) {
        Ray ray = make_ray({0.5f, 0.5f, 3}, {0, 0, -1}, tmin, tmax);
        ray.report_t = t;
        return trace_one(scene, ray, GetParam());
    };
    const RayResult hit = reported(2.5f, 0, 10);
    EXPECT_EQ(hit.t, 2.5f);
    EXPECT_EQ(hit.kind, 5u);
    EXPECT_EQ(hit.attr0, 100u);
    EXPECT_EQ(hit.attr7, 77u);
    EXPECT_EQ(reported(10, 0, 10).t, 10.0f);
    EXPECT_EQ(reported(1, 1, 10).t, 1.0f);
    const RayResult late = reported(std::nextafter(10.0f, 11.0f), 0, 10);
    EXPECT_EQ(late.instance, kNoInstance);
    EXPECT_EQ(late.attr7, 0u);
    EXPECT_EQ(reported(0.5f, 1, 10).instance, kNoInstance);
    EXPECT_EQ(reported(kNan, 0, 10).instance, kNoInstance);
}

TEST_P(EachTier, MasksSelectInstances) {
    Instance a{.mask = 0x12}, b{.mask = 0xff};
    b.object_to_world[2][3] = -5;
    const HostScene scene = build_scene({triangle_blas()}, {a, b});
    for (uint32_t mask : {0x00u, 0x01u, 0x02u, 0x10u, 0xedu, 0xffu, 0x102u, 0x100u}) {
        Ray ray = make_ray({0.25f, 0.25f, 2}, {0, 0, -1});
        ray.mask = mask;
        const uint32_t expected = (mask & 0x12) ? 0u : ((mask & 0xff) ? 1u : kNoInstance);
        EXPECT_EQ(trace_one(scene, ray, GetParam()).instance, expected) << mask;
    }
}

// The rules of ray opacity, face and primitive culling, written down a second time.
struct Expected {
    bool candidate = true;
    bool opaque = false;
};

Expected rules(bool box, bool geometry_opaque, bool front, uint32_t instance_flags, uint32_t ray_flags) {
    Expected e;
    e.opaque = geometry_opaque;
    if (instance_flags & RTC_INSTANCE_FORCE_OPAQUE) e.opaque = true;
    if (instance_flags & RTC_INSTANCE_FORCE_NO_OPAQUE) e.opaque = false;
    if (ray_flags & 1) e.opaque = true;
    if (ray_flags & 2) e.opaque = false;
    if ((ray_flags & 64) && e.opaque) e.candidate = false;
    if ((ray_flags & 128) && !e.opaque) e.candidate = false;
    if ((ray_flags & 256) && !box) e.candidate = false;
    if ((ray_flags & 512) && box) e.candidate = false;
    if (!box && !(instance_flags & RTC_INSTANCE_TRIANGLE_CULL_DISABLE)) {
        if ((ray_flags & 16) && !front) e.candidate = false;
        if ((ray_flags & 32) && front) e.candidate = false;
    }
    return e;
}

TEST_P(EachTier, FlagsMatrix) {
    DeviceTracer& tracer = shared_tracer(GetParam());
    const uint32_t opacity[] = {0, 1, 2, 64, 128}, facing[] = {0, 16, 32, 256, 512, 256 | 4, 4};
    uint32_t checked = 0;
    for (bool box : {false, true}) {
        for (bool geometry_opaque : {false, true}) {
            for (uint32_t flags : {0u, 1u, 2u, 3u, 4u, 5u, 6u, 7u, 8u, 10u, 11u}) {
                const HostScene scene = build_scene(
                    {box ? box_blas(geometry_opaque) : triangle_blas(geometry_opaque)}, {{.flags = flags}});
                tracer.set_scene(scene);
                std::vector<Ray> rays;
                for (bool down : {false, true}) {
                    for (uint32_t a : opacity) {
                        for (uint32_t b : facing) {
                            Ray ray =
                                make_ray({0.25f, 0.25f, down ? 2.0f : -2.0f}, {0, 0, down ? -1.0f : 1.0f});
                            ray.flags = a | b;
                            ray.report_t = 1;
                            rays.push_back(ray);
                        }
                    }
                }
                const auto results = tracer.trace(rays);
                for (size_t i = 0; i < rays.size(); ++i) {
                    const bool down = rays[i].direction.z < 0;
                    const bool front = down != bool(flags & RTC_INSTANCE_TRIANGLE_FRONT_CCW);
                    const Expected e = rules(box, geometry_opaque, front, flags, rays[i].flags);
                    const RayResult& r = results[i];
                    const std::string what = (box ? "box" : "triangle") + std::string(", instance ") +
                                             std::to_string(flags) + ", ray " +
                                             std::to_string(rays[i].flags) +
                                             (geometry_opaque ? ", opaque" : "") + (down ? ", down" : ", up");
                    EXPECT_EQ(r.instance != kNoInstance, e.candidate) << what;
                    EXPECT_EQ(r.boxes, box && e.candidate ? 1u : 0u) << what;
                    if (e.candidate && !box) {
                        EXPECT_EQ(r.kind, front ? 0xfeu : 0xffu) << what;
                        EXPECT_EQ(r.front + r.back, e.opaque ? 0u : 1u) << what;
                    }
                    if (e.candidate && box) {
                        EXPECT_EQ(r.last_opaque, e.opaque ? 1u : 0u) << what;
                    }
                    ++checked;
                }
            }
        }
    }
    EXPECT_EQ(checked, 2u * 2 * 11 * 70);
}

TEST_P(EachTier, MirroringDoesNotFlipFacing) {
    Instance mirrored;
    mirrored.object_to_world = {{{-1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
    const RayResult r = trace_one(build_scene({triangle_blas()}, {mirrored}),
                                  make_ray({-0.25f, 0.25f, 2}, {0, 0, -1}), GetParam());
    EXPECT_EQ(r.kind, 0xfeu);
    EXPECT_EQ(r.t, 2.0f);
}

TEST_P(EachTier, AnyHitDecides) {
    std::vector<Instance> stack(5);
    for (int i = 0; i < 5; ++i) stack[i].object_to_world[2][3] = float(-i);
    const HostScene scene = build_scene({triangle_blas(false)}, stack);
    Ray ray = make_ray({0.25f, 0.25f, 1}, {0, 0, -1});
    EXPECT_EQ(trace_one(scene, ray, GetParam()).instance, 0u);
    ray.sbt = kIgnore;
    const RayResult ignored = trace_one(scene, ray, GetParam());
    EXPECT_EQ(ignored.instance, kNoInstance);
    EXPECT_EQ(ignored.front, 5u);
    EXPECT_EQ(ignored.t, 1e30f);
    ray.sbt = kTerminate;
    EXPECT_EQ(trace_one(scene, ray, GetParam()).front, 1u);
    ray.sbt = 0;
    ray.flags = 4;
    const RayResult first = trace_one(scene, ray, GetParam());
    EXPECT_EQ(first.front, 1u);
    EXPECT_NE(first.instance, kNoInstance);
}

TEST_P(EachTier, UndefinedRaysMiss) {
    const HostScene scene = build_scene({triangle_blas()}, {{}});
    const Ray good = make_ray({0.25f, 0.25f, 2}, {0, 0, -1});
    std::vector<Ray> rays;
    for (float bad : {kNan, kInf, -kInf}) {
        for (int i = 0; i < 6; ++i) {
            Ray ray = good;
            (&(i < 3 ? ray.origin : ray.direction).x)[i % 3] = bad;
            rays.push_back(ray);
        }
    }
    rays.push_back(make_ray(good.origin, {0, 0, 0}));
    rays.push_back(make_ray(good.origin, good.direction, kNan, 10));
    rays.push_back(make_ray(good.origin, good.direction, 0, kNan));
    rays.push_back(make_ray(good.origin, good.direction, 0, -kInf));
    Ray null_root = good;
    null_root.sbt = kNullRoot;
    rays.push_back(null_root);
    DeviceTracer& tracer = shared_tracer(GetParam());
    tracer.set_scene(scene);
    for (const RayResult& r : tracer.trace(rays)) EXPECT_EQ(r.instance, kNoInstance);
    EXPECT_EQ(tracer.error, RTC_LAUNCH_ERROR_NONE);
    EXPECT_EQ(tracer.trace({good})[0].instance, 0u);
}

TEST_P(EachTier, WrongRootIsALaunchError) {
    Ray ray = make_ray({0.25f, 0.25f, 2}, {0, 0, -1});
    ray.sbt = kBottomRoot;
    DeviceTracer& tracer = shared_tracer(GetParam());
    tracer.set_scene(build_scene({triangle_blas()}, {{}}));
    const auto results = tracer.trace({ray, ray});
    EXPECT_EQ(results[1].instance, kNoInstance);
    EXPECT_EQ(tracer.error, RTC_LAUNCH_ERROR_ABI);
    EXPECT_EQ(tracer.error_count, 2u);
    EXPECT_EQ(tracer.error_detail, RTC_AS_MAGIC);
}

TEST_P(EachTier, DegenerateTrianglesAndEmptyStructures) {
    Blas blas = triangle_blas();
    auto& triangles = blas.geometries[0].triangles;
    triangles.clear();
    const Vec3 p{0.25f, 0.25f, 0};
    triangles.push_back({p, p, p});
    triangles.push_back({Vec3{0, 0, 0}, Vec3{0.25f, 0.25f, 0}, Vec3{0.5f, 0.5f, 0}});
    triangles.push_back({Vec3{0, 0, 0}, Vec3{1, 1, 0}, Vec3{1, 1, 0}});
    triangles.push_back({Vec3{kNan, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1, 0}});
    triangles.push_back({Vec3{0, 0, 0}, Vec3{kInf, 0, 0}, Vec3{0, 1, 0}});
    const Ray ray = make_ray({0.25f, 0.25f, 2}, {0, 0, -1});
    EXPECT_EQ(trace_one(build_scene({blas}, {{}}), ray, GetParam()).instance, kNoInstance);
    EXPECT_EQ(trace_one(build_scene({Blas{}}, {{}}), ray, GetParam()).instance, kNoInstance);
    EXPECT_EQ(trace_one(build_scene({}, {}), ray, GetParam()).instance, kNoInstance);
    // Singular instance transforms leave no object ray.
    Instance flat;
    flat.object_to_world[0][0] = 0;
    EXPECT_EQ(trace_one(build_scene({triangle_blas()}, {flat}), ray, GetParam()).instance, kNoInstance);
}

// t in the ray's own units may lie outside the range of floats, or round to an end of the interval.
TEST_P(EachTier, DistanceStaysWithinTheInterval) {
    DeviceTracer& tracer = shared_tracer(GetParam());
    for (const bool opaque : {true, false}) {  // shaders are told t by two ways
        tracer.set_scene(build_scene({triangle_blas(opaque)}, {{}}));
        // t = 2^-168 and 2^-130 and 2^130: what a device can hold of it is its own affair.
        const Ray small = make_ray({0.25f, 0.25f, 0x1p-50f}, {0, 0, -0x1p118f}, 0, kInf);
        const Ray denormal = make_ray({0.25f, 0.25f, 0x1p-12f}, {0, 0, -0x1p118f}, 0, kInf);
        const Ray large = make_ray({0.25f, 0.25f, 0x1p20f}, {0, 0, -0x1p-110f}, 0, kInf);
        const auto results = tracer.trace({small, denormal, large});
        for (const RayResult& r : results) EXPECT_EQ(r.instance, 0u);
        EXPECT_GT(std::bit_cast<uint32_t>(results[0].t), 0u) << "0 < t, denormal or not";
        EXPECT_LE(results[0].t, 0x1p-126f);
        EXPECT_GT(std::bit_cast<uint32_t>(results[1].t), 0u);
        EXPECT_LE(results[1].t, 0x1p-126f);
        EXPECT_EQ(results[2].t, std::numeric_limits<float>::max());
    }
}

// What is hit between two neighbouring floats is told as lying inside the interval where there is room.
TEST_F(LabTest, ExactDistancesDoNotTouchTheEnds) {
    for (const Variant variant : {Variant::Exact, Variant::Exact64}) {
        if (DeviceTracer::needs_float64(variant) && !test_context().features.shaderFloat64) continue;
        DeviceTracer& tracer = shared_tracer(variant);
        tracer.set_scene(build_scene({triangle_blas()}, {{}}));
        const float nearest = float(1.0 / 3), above = std::nextafter(nearest, 1.0f), below = std::nextafter(nearest, 0.0f);
        ASSERT_GT(double(nearest), 1.0 / 3);
        auto t = [&](float tmin, float tmax) {
            const RayResult r = tracer.trace({make_ray({0.25f, 0.25f, 1}, {0, 0, -3}, tmin, tmax)})[0];
            return r.instance == 0 ? r.t : -1.0f;
        };
        EXPECT_EQ(t(0, 1), nearest);
        EXPECT_EQ(t(0, nearest), below) << "the exact t is below tmax, what it rounds to is tmax";
        EXPECT_EQ(t(below, above), nearest);
        EXPECT_EQ(t(below, nearest), nearest) << "no float between: tmax";
        EXPECT_EQ(t(nearest, 1), -1.0f) << "the exact t is below tmin";
    }
}

// Coordinates, transforms and rays of any bits: a miss or a hit of something that is there, in bounded time.
TEST_P(EachTier, GarbageEndsAndNamesWhatIsThere) {
    std::mt19937_64 random(11);
    const float special[] = {kNan, kInf, -kInf, 0.0f, -0.0f, 1e38f, -3e38f, 1e-40f, 1, -1};
    auto any = [&] {
        const uint64_t kind = random() % 4;
        if (kind == 0) return std::bit_cast<float>(uint32_t(random()));
        if (kind == 1) return special[random() % std::size(special)];
        return float(int(random() % 2001) - 1000) / 500;
    };
    DeviceTracer& tracer = shared_tracer(GetParam());
    uint32_t hits = 0;
    // Infinite boxes hide much (this builder looks at x only for NaN): vertices and transforms are finite first.
    for (const bool finite : {true, false}) {
        auto number = [&] {
            float v = any();
            while (finite && !std::isfinite(v)) v = any();
            return v;
        };
        Blas blas;
        blas.geometries.resize(2);
        for (int i = 0; i < 120; ++i) {
            Triangle t;
            for (Vec3& v : t) v = {number(), number(), number()};
            blas.geometries[i % 2].triangles.push_back(t);
        }
        std::vector<Instance> instances(finite ? 2 : 6);
        if (finite) instances[1].object_to_world = {{{0, -2, 0, 1e-30f}, {1e-10f, 0, 0, 0}, {0, 0, 1e10f, 3}}};
        for (size_t i = 1; i < instances.size() && !finite; ++i)
            for (auto& row : instances[i].object_to_world)
                for (float& m : row) m = any();
        tracer.set_scene(build_scene({blas}, instances));
        std::vector<Ray> rays;
        for (int i = 0; i < 512; ++i) {
            Ray ray = make_ray({number(), number(), number()}, {number(), number(), number()}, 0, kInf);
            if (i % 4 == 0) ray.tmin = any();
            if (i % 4 == 1) ray.tmax = any();
            rays.push_back(ray);
        }
        uint32_t most = 0;
        const auto results = tracer.trace(rays);
        for (size_t i = 0; i < rays.size(); ++i) {
            const RayResult& r = results[i];
            most = std::max(most, r.turns);
            if (r.instance == kNoInstance) continue;
            ++hits;
            EXPECT_LT(r.instance, instances.size());
            EXPECT_LT(r.geometry, 2u);
            EXPECT_LT(r.primitive, 60u);
            EXPECT_TRUE(std::isfinite(r.t)) << i;
            EXPECT_GT(std::bit_cast<uint32_t>(r.t) & 0x7fffffffu, 0u) << i;
            EXPECT_GE(r.t, std::max(rays[i].tmin, 0.0f)) << i;
            if (rays[i].tmax > 0x1p-126f) {
                EXPECT_LE(r.t, rays[i].tmax) << i;
            }
        }
        // Each triangle once in each instance, each with the longest decision; the walk takes a few turns a node.
        const bool decides = GetParam() == Variant::Exact || GetParam() == Variant::Exact64;
        EXPECT_LT(most, 120 * instances.size() * (decides ? 5400u : 16u));
        EXPECT_EQ(tracer.error, RTC_LAUNCH_ERROR_NONE);
    }
    EXPECT_GT(hits, 20u) << "this test sees nothing";
}

TEST_F(LabTest, DirectionLengthDoesNotMatter) {
    const HostScene scene = build_scene({triangle_blas(false)}, {{}});
    DeviceTracer& tracer = shared_tracer();
    tracer.set_scene(scene);
    for (int e = -99; e <= 99; e += 3) {
        const float s = std::ldexp(1.0f, e);
        const RayResult r = tracer.trace({make_ray({0.25f, 0.5f, 2}, {0, 0, -s}, 0, kInf)})[0];
        EXPECT_EQ(r.instance, 0u) << e;
        EXPECT_EQ(r.t, 2 / s) << e;
        EXPECT_EQ(r.mismatches, 0u) << e;
    }
}

TEST_F(LabTest, EveryConfigurationFindsTheSame) {
    Blas sphere{{{make_icosphere(3).soup(), {}, false}}};
    Blas knot{{{make_torus_knot(80, 12).soup(), {}, true}}};
    Blas boxes{{{{},
                 {{{-0.3f, -0.3f, -0.3f}, {0.3f, 0.3f, 0.3f}}, {{0.5f, 0.5f, 0.5f}, {0.6f, 0.9f, 0.7f}}},
                 true}}};
    std::vector<Instance> instances;
    std::mt19937_64 random(1);
    std::uniform_real_distribution<float> unit(-1, 1);
    for (uint32_t i = 0; i < 40; ++i) {
        Instance instance{.blas = i % 3, .mask = i % 2 ? 0x0fu : 0xffu};
        for (auto& row : instance.object_to_world) {
            for (float& m : row) m += 0.4f * unit(random);
            row[3] = 6 * unit(random);
        }
        instances.push_back(instance);
    }
    const HostScene scene = build_scene({sphere, knot, boxes}, instances);
    std::vector<Ray> rays;
    for (int i = 0; i < 2000; ++i) {
        Ray ray = make_ray({8 * unit(random), 8 * unit(random), 8 * unit(random)},
                           {unit(random), unit(random), unit(random)});
        ray.sbt = i % 3 ? 0u : uint32_t(kIgnore);
        ray.report_t = 5;
        ray.mask = i % 4 ? 0xffu : 0xf0u;  // some instances are chosen and not entered
        rays.push_back(ray);
    }
    DeviceTracer& reference = shared_tracer();
    reference.set_scene(scene);
    auto expected = reference.trace(rays);
    auto strip = [](std::vector<RayResult>& results) {
        for (RayResult& r : results) r.turns = r.suspensions = 0;
    };
    uint32_t hits = 0;
    for (const RayResult& r : expected) hits += r.instance != kNoInstance;
    EXPECT_GT(hits, 200u);
    strip(expected);
    TracerOptions variants[7];
    variants[0].storage_fetch = true;
    variants[1].while_while = true;
    variants[2].shared_stack = 3;
    variants[3].shared_stack = 24;
    variants[3].while_while = true;
    variants[4].step_budget = 7;
    variants[5].step_budget = 1;
    variants[5].while_while = true;
    variants[6].step_budget = 3;
    variants[6].resumable = false;
    for (int v = 0; v < 7; ++v) {
        DeviceTracer tracer(test_context(), variants[v]);
        tracer.set_scene(scene);
        auto results = tracer.trace(rays);
        uint32_t suspensions = 0;
        for (const RayResult& r : results) suspensions += r.suspensions;
        EXPECT_EQ(suspensions > 0, v == 4 || v == 5) << v;
        strip(results);
        EXPECT_EQ(results, expected) << v;
        EXPECT_EQ(tracer.error, RTC_LAUNCH_ERROR_NONE) << v;
    }
}

TEST_F(LabTest, LinkConstantsRemoveWhatAPipelineLacks) {
    Blas both_kinds = triangle_blas(false);
    Instance box_instance{.blas = 1};
    box_instance.object_to_world[2][3] = 10;
    const HostScene scene = build_scene({both_kinds, box_blas()}, {{}, box_instance});
    Ray ray = make_ray({0.25f, 0.25f, 20}, {0, 0, -1});
    ray.report_t = 10;
    TracerOptions no_any_hit;
    no_any_hit.any_hit = false;
    no_any_hit.aabbs = false;
    DeviceTracer triangles_only(test_context(), no_any_hit);
    triangles_only.set_scene(scene);
    const RayResult a = triangles_only.trace({ray})[0];
    EXPECT_EQ(a.instance, 0u);
    EXPECT_EQ(a.front, 0u);
    EXPECT_EQ(a.boxes, 0u);
    TracerOptions no_triangles;
    no_triangles.triangles = false;
    DeviceTracer boxes_only(test_context(), no_triangles);
    boxes_only.set_scene(scene);
    const RayResult b = boxes_only.trace({ray})[0];
    EXPECT_EQ(b.instance, 1u);
    EXPECT_EQ(b.front, 0u);
}

TEST_F(LabTest, DeepChainsFitTheStack) {
    // 10^4 triangles, sizes in geometric progression, split one by one as deep as builders may.
    Blas blas;
    blas.geometries.resize(1);
    for (int i = 0; i < 10000; ++i) {
        const float s = std::ldexp(1.0f + float(i % 7) / 8, -(i / 100));
        blas.geometries[0].triangles.push_back({Vec3{0, 0, s}, Vec3{s, 0, s}, Vec3{0, s, s}});
    }
    BuildOptions options;
    options.chain = 45;
    options.leaf_size = 1;
    std::vector<Instance> instances(200);
    const HostScene scene = build_scene({blas}, instances, options);
    EXPECT_GT(scene.max_depth, 50u);
    EXPECT_LE(scene.max_depth, RTC_MAX_DEPTH);
    DeviceTracer& tracer = shared_tracer();
    tracer.set_scene(scene);
    std::vector<Ray> rays;
    std::mt19937_64 random(5);
    std::uniform_real_distribution<float> unit(0, 1);
    for (int i = 0; i < 64; ++i) {
        rays.push_back(make_ray({unit(random) * 1e-3f, unit(random) * 1e-3f, i % 2 ? 3.0f : -3.0f},
                                {0, 0, i % 2 ? -1.0f : 1.0f}));
    }
    for (const RayResult& r : tracer.trace(rays)) EXPECT_NE(r.instance, kNoInstance);
    EXPECT_EQ(tracer.error, RTC_LAUNCH_ERROR_NONE);
}

TEST_F(LabTest, TreesDeeperThanLegalAreALaunchError) {
    Blas blas;
    blas.geometries.resize(1);
    // The far one is split off at each level, so that descending fills the stack.
    for (int i = 0; i < 400; ++i) {
        const float z = 0.001f * float(i);
        blas.geometries[0].triangles.push_back({Vec3{0, 0, z}, Vec3{1, 0, z}, Vec3{0, 1, z}});
    }
    BuildOptions options;
    options.chain = 390;
    options.leaf_size = 1;
    DeviceTracer& tracer = shared_tracer();
    tracer.set_scene(build_scene({blas}, {{}}, options));
    tracer.trace({make_ray({0.25f, 0.25f, 2}, {0, 0, -1})});
    EXPECT_EQ(tracer.error, RTC_LAUNCH_ERROR_STACK);
    EXPECT_EQ(tracer.trace({make_ray({5, 5, 2}, {0, 0, -1})})[0].instance, kNoInstance);
    EXPECT_EQ(tracer.error, RTC_LAUNCH_ERROR_NONE);
}

TEST_F(LabTest, ManyPrimitivesOnOneSpot) {
    Blas blas;
    blas.geometries.resize(1);
    blas.geometries[0].triangles.assign(20000, kTriangle);
    DeviceTracer& tracer = shared_tracer();
    tracer.set_scene(build_scene({blas}, {{}}));
    const RayResult r = tracer.trace({make_ray({0.25f, 0.25f, 2}, {0, 0, -1})})[0];
    EXPECT_EQ(r.t, 2.0f);
    EXPECT_LT(r.primitive, 20000u);
    EXPECT_EQ(tracer.error, RTC_LAUNCH_ERROR_NONE);
}

}  // namespace
}  // namespace rtc::lab
