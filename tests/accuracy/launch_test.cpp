// Lanes, records, lane storage and suspension, against abi.h's formulas.
#include <cstring>
#include <set>
#include <tuple>

#include "lab_fixture.h"
#include "rtc/abi.h"

namespace rtc::lab {
namespace {

constexpr uint32_t kNone = 0xffffffffu;

struct Probe {
    uint32_t inside, lane, x, y, z, width, miss, hit, callable, miss_word, hit_word, callable_word,
        raygen_word, loaded, scratch, unused;
};

struct Launch {
    uint32_t width = 1, height = 1, depth = 1, flags = 0, lane_base = 0, lane_count = 0;
};

std::vector<uint32_t> parameters(const Launch& l) {
    std::vector<uint32_t> p(RTC_PARAM_QUADS * 4);
    p[RTC_PARAM_WIDTH] = l.width;
    p[RTC_PARAM_HEIGHT] = l.height;
    p[RTC_PARAM_DEPTH] = l.depth;
    p[RTC_PARAM_FLAGS] = l.flags;
    p[RTC_PARAM_LANE_BASE] = l.lane_base;
    p[RTC_PARAM_LANE_COUNT] = l.lane_count;
    return p;
}

std::vector<Probe> probe(const std::vector<uint32_t>& params, const std::vector<uint32_t>& sbt,
                         std::vector<uint32_t> indices, uint32_t groups_y = 1) {
    indices.resize((indices.size() + 63) / 64 * 64);
    const uint32_t groups = uint32_t(indices.size() / 64);
    const auto words = shared_tracer(Variant::Probe).probe(params, sbt, indices, groups, groups_y);
    std::vector<Probe> probes(indices.size());
    static_assert(sizeof(Probe) == 64);
    std::memcpy(probes.data(), words.data(), words.size() * 4);
    return probes;
}

TEST_F(LabTest, LanesCoverTheGridOnce) {
    for (const Launch& shape :
         {Launch{1, 1, 1}, Launch{8, 4, 1}, Launch{13, 7, 1}, Launch{33, 2, 3}, Launch{5, 9, 4}}) {
        for (uint32_t flags : {0u, uint32_t(RTC_LAUNCH_TILE_8X4)}) {
            Launch launch = shape;
            launch.flags = flags;
            const uint32_t lanes = flags ? (shape.width + 7) / 8 * ((shape.height + 3) / 4) * shape.depth * 32
                                         : (shape.width + 31) / 32 * 32 * shape.height * shape.depth;
            // In two dispatches, as a tiled launch has it.
            std::set<std::tuple<uint32_t, uint32_t, uint32_t>> seen;
            const uint32_t half = (lanes / 2 + 31) / 32 * 32;
            for (uint32_t part = 0; part < 2; ++part) {
                launch.lane_base = part ? half : 0;
                launch.lane_count = part ? lanes - half : half;
                if (launch.lane_count == 0) continue;
                const auto probes =
                    probe(parameters(launch), {0, 0}, std::vector<uint32_t>(launch.lane_count));
                for (uint32_t i = 0; i < probes.size(); ++i) {
                    const Probe& p = probes[i];
                    EXPECT_EQ(p.lane, launch.lane_base + i);
                    EXPECT_EQ(p.width, shape.width);
                    if (!p.inside) continue;
                    EXPECT_LT(i, launch.lane_count);
                    EXPECT_TRUE(p.x < shape.width && p.y < shape.height && p.z < shape.depth);
                    EXPECT_TRUE(seen.insert({p.x, p.y, p.z}).second) << p.x << ' ' << p.y << ' ' << p.z;
                    if (flags) {
                        EXPECT_EQ(p.x % 8, p.lane % 8);
                        EXPECT_EQ(p.y % 4, p.lane / 8 % 4);
                    } else {
                        EXPECT_EQ(p.x % 32, p.lane % 32);
                    }
                }
            }
            EXPECT_EQ(seen.size(), size_t(shape.width) * shape.height * shape.depth);
        }
    }
    for (const Launch& empty : {Launch{0, 4, 1}, Launch{4, 0, 1}, Launch{4, 4, 0}}) {
        for (uint32_t flags : {0u, 1u}) {
            Launch launch = empty;
            launch.flags = flags;
            launch.lane_count = 64;
            for (const Probe& p : probe(parameters(launch), {0, 0}, std::vector<uint32_t>(64)))
                EXPECT_EQ(p.inside, 0u);
        }
    }
}

TEST_F(LabTest, RecordsStayInTheirRegions) {
    std::vector<uint32_t> sbt(4096);
    for (uint32_t i = 0; i < sbt.size(); ++i) sbt[i] = i;
    Launch launch{64, 1, 1, 0, 0, 64};
    auto params = parameters(launch);
    params[RTC_PARAM_RAYGEN_OFFSET] = 512;
    params[RTC_PARAM_MISS_OFFSET] = 1024;
    params[RTC_PARAM_MISS_SIZE] = 3 * 64 + 32;  // three and a half records: the half holds a handle
    params[RTC_PARAM_MISS_STRIDE] = 64;
    params[RTC_PARAM_HIT_OFFSET] = 2048;
    params[RTC_PARAM_HIT_SIZE] = 3 * 96 + 31;
    params[RTC_PARAM_HIT_STRIDE] = 96;
    params[RTC_PARAM_CALLABLE_OFFSET] = 4096;
    params[RTC_PARAM_CALLABLE_SIZE] = 32;
    params[RTC_PARAM_CALLABLE_STRIDE] = 0;  // every index is the one record
    const std::vector<uint32_t> indices = {0, 1,           2,           3,           4,
                                           5, 0x04000000u, 0x10000000u, 0x7fffffffu, 0xffffffffu};
    auto probes = probe(params, sbt, indices);
    for (size_t i = 0; i < indices.size(); ++i) {
        const uint32_t index = indices[i];
        const Probe& p = probes[i];
        EXPECT_EQ(p.miss, index < 4 ? index * 16 : kNone) << index;
        EXPECT_EQ(p.hit, index < 3 ? index * 24 : kNone) << index;
        EXPECT_EQ(p.callable, 0u) << index;
        if (p.miss != kNone) {
            EXPECT_EQ(p.miss_word, 256 + p.miss);
        }
        if (p.hit != kNone) {
            EXPECT_EQ(p.hit_word, 512 + p.hit);
        }
        EXPECT_EQ(p.callable_word, 1024u);
        EXPECT_EQ(p.raygen_word, 129u);
    }
    params[RTC_PARAM_MISS_SIZE] = 0;
    params[RTC_PARAM_HIT_SIZE] = 31;
    params[RTC_PARAM_CALLABLE_SIZE] = 0;
    probes = probe(params, sbt, {0});
    EXPECT_EQ(probes[0].miss, kNone);
    EXPECT_EQ(probes[0].hit, kNone);
    EXPECT_EQ(probes[0].callable, kNone);
}

TEST_F(LabTest, SuspendedLanesAskForAnotherRound) {
    Launch launch{16, 12, 1, RTC_LAUNCH_TILE_8X4, 0, 192};
    auto params = parameters(launch);
    params[RTC_PARAM_ROUND] = 2;
    params[RTC_PARAM_CONTROL_WORD] = 4;
    params[RTC_PARAM_SCRATCH_WORD] = 64;
    const auto probes = probe(params, {0, 0}, std::vector<uint32_t>(192));
    const auto control = shared_tracer(Variant::Probe).control();
    EXPECT_EQ(control[4 + RTC_CTRL_SUSPENDED], 12u);  // one lane a row
    const uint32_t arguments = 4 + RTC_CTRL_ARGS + 4 * 3;
    EXPECT_EQ(control[arguments], 3u);
    EXPECT_EQ(control[arguments + 1], 1u);
    EXPECT_EQ(control[arguments + 2], 1u);
    EXPECT_EQ(control[4 + RTC_CTRL_ARGS + 4 * 2], 0u);
    EXPECT_EQ(control[4 + RTC_CTRL_ERROR_COUNT], 0u);
    for (uint32_t i = 0; i < probes.size(); ++i) {
        EXPECT_EQ(probes[i].scratch, 64 + i);
        EXPECT_EQ(probes[i].loaded, 7 + i);
    }
}

}  // namespace
}  // namespace rtc::lab
