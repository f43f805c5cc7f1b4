// Points beside the tiers: what the laboratory measures of them is what their names say.
#include <bit>
#include <cmath>

#include "cases.h"
#include "error.h"
#include "lab_fixture.h"
#include "leaks.h"
#include "payloads.h"
#include "rtc/abi.h"
#include "scene_knobs.h"

namespace rtc::lab {
namespace {

std::vector<RayResult> traced(Variant variant, const HostScene& scene, const std::vector<Ray>& rays) {
    DeviceTracer& tracer = shared_tracer(variant);
    tracer.set_scene(scene);
    return tracer.trace(rays);
}

LeakCase sphere_case(const IndexedMesh& mesh, const Transform& transform) {
    LeakCase c;
    c.mesh = &mesh;
    c.aim = Aim::Edge;
    c.instance.object_to_world = transform;
    return c;
}

class SmallBoxes : public LabTest, public testing::WithParamInterface<int> {};
INSTANTIATE_TEST_SUITE_P(Bits, SmallBoxes, testing::Values(16, 8));

// As the shader decodes them.
void decode(const uint32_t* node, int bits, int child, const uint32_t* grid, float (&low)[3], float (&high)[3]) {
    for (int i = 0; i < 6; ++i) {
        uint32_t n;
        if (bits == 16) {
            n = node[child * 4 + i / 2] >> (i % 2 * 16) & 0xffff;
        } else {
            const int byte = child * 6 + i;
            const uint32_t origin = i % 3 == 0 ? node[4] & 0xffff : (i % 3 == 1 ? node[4] >> 16 : node[5] & 0xffff);
            n = origin + ((node[byte / 4] >> (byte % 4 * 8) & 0xff) << (node[5] >> (16 + i % 3 * 4) & 15));
        }
        const volatile float way = float(n) * std::bit_cast<float>(grid[4 + i % 3]);
        (i < 3 ? low : high)[i % 3] = std::bit_cast<float>(grid[i % 3]) + way;
    }
}

TEST_P(SmallBoxes, ContainWhatTheyStandFor) {
    for (const double size : {1.0, 1e-37, 1e37, 1e-6})
        for (const double offset : {0.0, 1e4, 1e7}) {
            if (size * offset > 1e37) continue;  // no floats
            const IndexedMesh mesh = moved(make_torus_knot(60, 12), size, {offset * size / 10, -offset * size / 10, 0});
            const HostScene scene = build_scene({Blas{{{mesh.soup(), {}, true}}}}, {{}});
            const HostScene small = with_small_boxes(scene, GetParam());
            // The bottom level comes first in both heaps.
            const uint32_t* old = &scene.heap[RTC_AS_ALIGNMENT / 4];
            const uint32_t* now = &small.heap[RTC_AS_ALIGNMENT / 4];
            ASSERT_EQ(old[RTC_HDR_MAGIC], RTC_AS_MAGIC);
            ASSERT_EQ(now[RTC_HDR_NODE_COUNT], old[RTC_HDR_NODE_COUNT]);
            EXPECT_LT(now[RTC_HDR_SIZE_QUADS], old[RTC_HDR_SIZE_QUADS]);
            const uint32_t* grid = now + RTC_AS_HEADER_QUADS * 4;
            double more = 0, all = 0;
            for (uint32_t n = 0; n < old[RTC_HDR_NODE_COUNT]; ++n) {
                const uint32_t* before = old + (RTC_AS_HEADER_QUADS + n * RTC_NODE_QUADS) * 4;
                const uint32_t* after = grid + 8 + n * 8;
                for (int c = 0; c < 2; ++c) {
                    float low[3], high[3];
                    decode(after, GetParam(), c, grid, low, high);
                    for (int i = 0; i < 3; ++i) {
                        const float from = std::bit_cast<float>(before[c * 8 + i]);
                        const float to = std::bit_cast<float>(before[c * 8 + 4 + i]);
                        ASSERT_LE(low[i], from) << size << ' ' << offset << " node " << n << " axis " << i;
                        ASSERT_GE(high[i], to) << size << ' ' << offset << " node " << n << " axis " << i;
                        more += (double(high[i]) - low[i]) / size;
                        all += (double(to) - from) / size;
                    }
                    EXPECT_EQ(after[c * 4 + 3], before[c * 4 + 3]) << "reference";
                }
            }
            if (size == 1.0 && offset == 0) {
                EXPECT_LT(more, all * (GetParam() == 16 ? 1.001 : 1.1)) << "not far larger either";
            }
        }
    const IndexedMesh infinite = moved(make_icosphere(1), 1e39, {0, 0, 0});
    Blas blas{{{infinite.soup(), {}, true}}};
    EXPECT_THROW(with_small_boxes(build_scene({blas}, {{}}), GetParam()), tools::Error);
}

TEST_P(SmallBoxes, TraceAsLargeOnesDo) {
    const Variant variant = GetParam() == 16 ? Variant::Box16 : Variant::Box8;
    const IndexedMesh mesh = make_torus_knot(200, 16);
    for (const auto& [name, transform] : lab_transforms()) {
        if (name != "identity" && name != "rotated" && name != "mirrored") continue;
        LeakCase c = sphere_case(mesh, transform);
        const HostScene scene = leak_scene(c);
        const std::vector<Ray> rays = leak_rays(c, 4096, 1);
        const auto large = traced(Variant::Watertight, scene, rays), small = traced(variant, scene, rays);
        uint64_t turns[2] = {0, 0};
        for (size_t i = 0; i < rays.size(); ++i) {
            ASSERT_EQ(large[i].front, small[i].front) << name << i;
            ASSERT_EQ(large[i].back, small[i].back) << name << i;
            turns[0] += large[i].turns;
            turns[1] += small[i].turns;
        }
        EXPECT_GT(turns[1], turns[0]) << name << ": larger boxes are met more often";
        EXPECT_LT(double(turns[1]), 1.1 * double(turns[0])) << name;
    }
}

TEST_F(LabTest, InverseInFloatsIsRoundedWorse) {
    const IndexedMesh mesh = make_icosphere(2);
    for (const auto& [name, transform] : lab_transforms()) {
        const HostScene scene = leak_scene(sphere_case(mesh, transform));
        const HostScene rough = with_float_inverse(scene);
        ASSERT_EQ(rough.heap.size(), scene.heap.size());
        const uint32_t* header = &scene.heap[size_t(scene.root) * 4];
        const size_t record = size_t(scene.root) * 4 + header[RTC_HDR_SLOTS] * 4;
        double off = 0, largest = 0;
        for (size_t i = 0; i < 12; ++i) {
            const double exact = std::bit_cast<float>(scene.heap[record + i]);
            off = std::max(off, std::fabs(exact - std::bit_cast<float>(rough.heap[record + i])));
            largest = std::max(largest, std::fabs(exact));
        }
        if (name == "identity") {
            EXPECT_EQ(off, 0);
        } else if (name == "rotated") {
            EXPECT_GT(off, 0);
            EXPECT_LT(off, 1e-5 * largest);
        }
        EXPECT_EQ(rough.world_to_object, scene.world_to_object) << "exact arithmetic is asked about the better one";
    }
}

TEST_F(LabTest, TInDoubleIsRoundedOnce) {
    if (!test_context().features.shaderFloat64) GTEST_SKIP() << "no shaderFloat64";
    const IndexedMesh mesh = make_slivers(64, 1e-3);
    LeakCase c = sphere_case(mesh, kIdentity);
    c.aim = Aim::Interior;
    const HostScene scene = leak_scene(c);
    std::vector<Ray> rays = leak_rays(c, 4096, 1);
    for (Ray& ray : rays) ray.flags = 1;  // opaque
    const auto in_double = traced(Variant::T64, scene, rays), exact = traced(Variant::Exact, scene, rays),
               in_float = traced(Variant::Watertight, scene, rays);
    uint32_t hits = 0, off = 0, off_in_float = 0;
    for (size_t i = 0; i < rays.size(); ++i) {
        if (exact[i].instance == kNoInstance || in_double[i].primitive != exact[i].primitive) continue;
        ++hits;
        off += in_double[i].t != exact[i].t;
        off_in_float += in_float[i].t != exact[i].t;
    }
    EXPECT_GT(hits, 1000u);
    EXPECT_LT(off, hits / 100);
    EXPECT_GT(off_in_float, hits / 4);
}

TEST_F(LabTest, PackedPayloadsPaintNearlyTheSame) {
    const std::vector<PayloadRow> rows = measure_payloads(test_context(), 64, 1);
    ASSERT_EQ(rows.size(), 2u);
    EXPECT_EQ(rows[0].colour_error_mean, 0);
    EXPECT_LT(rows[1].bytes, rows[0].bytes);
    EXPECT_GT(rows[1].colour_error_mean, 0) << "halves are rounded";
    EXPECT_LT(rows[1].colour_error_mean, 0.01);
    EXPECT_LE(rows[1].colour_error_max, 1);
}

}  // namespace
}  // namespace rtc::lab
