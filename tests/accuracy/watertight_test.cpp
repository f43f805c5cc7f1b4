// No cracks and no double hits where triangles meet, and the right triangle
// elsewhere. Small counts: rtc-accuracy repeats all of it with millions.
#include <cmath>
#include <limits>

#include "exact.h"
#include "lab_fixture.h"
#include "leaks.h"

namespace rtc::lab {
namespace {

constexpr uint64_t kRays = 1 << 14;

Transform rotated() {
    const double a = 0.7, b = 0.3;
    return {{{float(std::cos(a)), float(-std::sin(a)), 0, 3},
             {float(std::sin(a) * std::cos(b)), float(std::cos(a) * std::cos(b)), float(-std::sin(b)), -2},
             {float(std::sin(a) * std::sin(b)), float(std::cos(a) * std::sin(b)), float(std::cos(b)), 5}}};
}

Transform sheared() { return {{{1, 0.7f, -0.4f, 1}, {0, 0.5f, 0.9f, 2}, {0.2f, 0, 3, -4}}}; }

Transform mirrored() { return {{{-1.5f, 0, 0, 10}, {0, 1.25f, 0, 0}, {0, 0, 0.75f, -10}}}; }

struct Place {
    const char* name;
    Transform transform;
    double offset;
};

class Watertight : public LabTest, public testing::WithParamInterface<Place> {};
INSTANTIATE_TEST_SUITE_P(Places, Watertight,
                         testing::Values(Place{"origin", kIdentity, 0}, Place{"offset_1e2", kIdentity, 1e2},
                                         Place{"offset_1e4", kIdentity, 1e4}, Place{"rotated", rotated(), 0},
                                         Place{"sheared", sheared(), 0}, Place{"mirrored", mirrored(), 0},
                                         Place{"sheared_offset_1e3", sheared(), 1e3}),
                         [](const auto& info) { return info.param.name; });

TEST_P(Watertight, ClosedMeshesBalance) {
    const Place& place = GetParam();
    const std::array<double, 3> offset = {place.offset, -place.offset, 0.5 * place.offset};
    DeviceTracer& tracer = shared_tracer();
    for (const IndexedMesh& base :
         {make_icosphere(4), make_torus_knot(200, 16), make_slivers(64, 1e-3), make_slivers(64, 1e-6)}) {
        const IndexedMesh mesh = moved(base, 1, offset);
        LeakCase c;
        c.mesh = &mesh;
        c.instance.object_to_world = place.transform;
        c.centre = {float(offset[0]), float(offset[1]), float(offset[2])};
        c.size = 1.6;
        tracer.set_scene(leak_scene(c));
        for (bool inside : {false, true}) {
            if (inside && base.name != "icosphere") continue;
            c.from_inside = inside;
            for (Aim aim : {Aim::Interior, Aim::Edge, Aim::Vertex}) {
                c.aim = aim;
                const LeakCounts counts = count_leaks(tracer, c, kRays);
                EXPECT_EQ(counts.unbalanced, 0u)
                    << base.name << ' ' << aim_name(aim) << (inside ? " inside" : "");
                // Aimed rays do meet the mesh: the test sees something. (Needles thinner than an ulp of
                // their offset are gone.)
                if (base.name != "slivers" || place.offset == 0) {
                    EXPECT_LT(counts.missed, kRays / 2) << base.name;
                }
            }
        }
    }
}

TEST_F(LabTest, AxisParallelRaysThroughEdgesAndVertices) {
    const IndexedMesh cube = make_cube_grid(16);
    LeakCase c;
    c.mesh = &cube;
    DeviceTracer& tracer = shared_tracer();
    tracer.set_scene(leak_scene(c));
    for (int axis = 0; axis < 3; ++axis) {
        c.axis_parallel = axis;
        for (Aim aim : {Aim::Edge, Aim::Vertex}) {
            c.aim = aim;
            const LeakCounts counts = count_leaks(tracer, c, kRays);
            EXPECT_EQ(counts.unbalanced, 0u) << axis << ' ' << aim_name(aim);
            // Rays along the cube's silhouette may belong to either side; the others hit.
            EXPECT_LT(counts.missed, kRays / 2);
        }
    }
}

TEST_F(LabTest, ExtremeSizes) {
    const IndexedMesh sphere = make_icosphere(3);
    DeviceTracer& tracer = shared_tracer();
    for (int exponent : {-18, -12, -6, 6, 12, 18}) {
        const double scale = std::pow(10.0, exponent);
        const IndexedMesh mesh = moved(sphere, scale, {0, 0, 0});
        LeakCase c;
        c.mesh = &mesh;
        c.size = scale;
        tracer.set_scene(leak_scene(c));
        for (Aim aim : {Aim::Interior, Aim::Edge, Aim::Vertex}) {
            for (bool inside : {false, true}) {
                c.aim = aim;
                c.from_inside = inside;
                const LeakCounts counts = count_leaks(tracer, c, 4096);
                EXPECT_EQ(counts.unbalanced, 0u) << "1e" << exponent << ' ' << aim_name(aim);
                EXPECT_LT(counts.missed, 2048u) << "1e" << exponent;
            }
        }
    }
}

TEST_F(LabTest, FarOriginsStillHit) {
    const IndexedMesh sphere = make_icosphere(3);
    DeviceTracer& tracer = shared_tracer();
    LeakCase c;
    c.mesh = &sphere;
    tracer.set_scene(leak_scene(c));
    for (double distance : {1e2, 1e4, 1e5}) {
        c.distance = distance;
        for (Aim aim : {Aim::Interior, Aim::Edge, Aim::Vertex}) {
            c.aim = aim;
            const LeakCounts counts = count_leaks(tracer, c, 4096);
            EXPECT_EQ(counts.unbalanced, 0u) << distance << ' ' << aim_name(aim);
            EXPECT_LT(counts.missed, 2048u) << distance;
        }
    }
}

// Boxes must contain all that the triangle test can hit, also the boxes of
// thin instances whose rays were rounded on the way into their space.
TEST_F(LabTest, NoBoxHidesAHit) {
    const IndexedMesh plane = make_plane(16), far_plane = moved(plane, 1, {1e4, -1e4, 5e3});
    Instance turned;  // 90 degrees about x, far away
    turned.object_to_world = {{{1, 0, 0, 1e4f}, {0, 0, -1, -5e3f}, {0, 1, 0, 7e3f}}};
    LeakCase cases[4];
    cases[0].mesh = &plane;
    cases[1].mesh = &far_plane;
    cases[1].centre = {1e4f, -1e4f, 5e3f};
    cases[2].mesh = &plane;
    cases[2].instance = turned;
    cases[3].mesh = &plane;
    cases[3].distance = 1e5;
    for (const LeakCase& c : cases) {
        EXPECT_EQ(count_false_culls(shared_tracer(), c, kRays), 0u);
        EXPECT_GT(count_false_culls(shared_tracer(Variant::Fast), c, kRays), 0u) << "the test is blind";
    }
}

// The laboratory must be able to fail: with products and sums contracted, as
// compilers do without NoContraction, the same test leaks. (Rays at vertices
// do not: contraction that treats all vertices alike only moves the edges'
// signs. Möller-Trumbore leaks at both.)
TEST_F(LabTest, NegativeControlLeaks) {
    if (!test_context().features.shaderFloat64)
        GTEST_SKIP() << "the control computes fused operations in Float64";
    const IndexedMesh sphere = make_icosphere(4);
    LeakCase c;
    c.mesh = &sphere;
    for (Variant variant : {Variant::Contracted, Variant::Fast}) {
        DeviceTracer& tracer = shared_tracer(variant);
        tracer.set_scene(leak_scene(c));
        c.aim = Aim::Edge;
        const LeakCounts edges = count_leaks(tracer, c, kRays);
        c.aim = Aim::Vertex;
        const LeakCounts vertices = count_leaks(tracer, c, kRays);
        EXPECT_GT(edges.unbalanced, kRays / 1000) << variant_name(variant);
        if (variant == Variant::Fast) {
            EXPECT_GT(vertices.unbalanced, kRays / 1000);
        }
    }
}

// First hits against exact arithmetic. Watertight is not exact: a ray that
// passes an edge by less than rounding may get the neighbour, so a difference
// must be that close.
void compare_with_exact(const IndexedMesh& mesh, Variant variant, uint32_t rays, double tolerance,
                        uint64_t seed) {
    const std::vector<Triangle> triangles = mesh.soup();
    DeviceTracer& tracer = shared_tracer(variant);
    tracer.set_scene(build_scene({Blas{{{triangles, {}, true}}}}, {{}}));
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<float> unit(-1, 1);
    std::vector<Ray> batch;
    for (uint32_t i = 0; i < rays; ++i) {
        const Vec3 target = {1.3f * unit(random), 1.3f * unit(random), 1.3f * unit(random)};
        const Vec3 origin = {3 * unit(random), 3 * unit(random), 3 * unit(random)};
        batch.push_back(
            make_ray(origin, {target.x - origin.x, target.y - origin.y, target.z - origin.z}, 0, 1e30f));
    }
    const auto results = tracer.trace(batch);
    uint32_t differences = 0, hits = 0;
    for (uint32_t i = 0; i < rays; ++i) {
        const ExactRay ray{batch[i].origin, batch[i].direction, 0, 1e30f};
        const auto expected = nearest(ray, triangles);
        const RayResult& got = results[i];
        if (!expected && got.instance == kNoInstance) continue;
        hits += expected.has_value();
        if (expected && got.instance != kNoInstance && expected->triangle == got.primitive) {
            EXPECT_NEAR(got.t, expected->t, 4e-6 * (1 + std::fabs(expected->t)));
            continue;
        }
        ++differences;
        if (got.instance != kNoInstance) {
            EXPECT_GT(inside_margin(ray, triangles[got.primitive]), -tolerance) << i;
        }
        if (expected) {
            EXPECT_LT(inside_margin(ray, triangles[expected->triangle]), tolerance) << i;
        }
    }
    EXPECT_GT(hits, rays / 20);
    EXPECT_LE(differences, 2u + rays / 10000);
}

TEST_F(LabTest, RandomRaysAgreeWithExactArithmetic) {
    compare_with_exact(make_icosphere(3), Variant::Watertight, 20000, 1e-4, 7);
    compare_with_exact(make_torus_knot(60, 10), Variant::Watertight, 20000, 1e-4, 8);
}

TEST_F(LabTest, ExactOracleKnowsEdges) {
    const std::vector<Triangle> two = {{Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1, 0}},
                                       {Vec3{1, 0, 0}, Vec3{1, 1, 0}, Vec3{0, 1, 0}}};
    const ExactRay edge{{0.5f, 0.5f, 1}, {0, 0, -1}, 0, 10};
    mpq_class t;
    EXPECT_EQ(intersect(edge, two[0], &t), Verdict::Boundary);
    EXPECT_EQ(t, 1);
    EXPECT_TRUE(nearest(edge, two)->boundary);
    const ExactRay inside{{0.5f, std::nextafter(0.5f, 1.0f), 1}, {0, 0, -1}, 0, 10};
    EXPECT_EQ(intersect(inside, two[0], nullptr), Verdict::Miss);
    EXPECT_EQ(nearest(inside, two)->triangle, 1u);
    EXPECT_FALSE(nearest(inside, two)->boundary);
    const ExactRay limit{{0.25f, 0.25f, 1}, {0, 0, -1}, 0, 1};
    EXPECT_FALSE(nearest(limit, two).has_value()) << "t = tmax";
}

}  // namespace
}  // namespace rtc::lab
