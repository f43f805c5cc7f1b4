// What linking removes because the pipeline's code shows it is not needed.
#include <gtest/gtest.h>

#include "core_test_util.h"
#include "link/bits.h"
#include "rtc/abi.h"

namespace rtc::test {
namespace {

const FactReport* fact(const LinkResult& result, const std::string& name) {
    for (const FactReport& known : result.reflection.facts)
        if (known.name == name) return &known;
    return nullptr;
}

std::vector<uint32_t> tracing(const std::string& flags) {
    return assemble(raygen_text(std::string(kPayload) + "%uint_1 = OpConstant %uint 1\n%uint_3 = OpConstant %uint 3\n",
                                trace_text(flags, "%uint_255", "%uint_0", "%uint_0", "%uint_0"), kPayloadLocation));
}

std::vector<uint32_t> any_hit() {
    StageText parts;
    parts.model = "AnyHitNV";
    return assemble(stage_text(parts));
}

LinkResult with_any_hit(const std::string& flags, LinkOptions options = {}) {
    PipelineInput input = pipeline({{StageKind::RayGen, tracing(flags)}});
    StageInput any;
    any.kind = StageKind::AnyHit;
    any.name = "any";
    any.spirv = any_hit();
    input.stages.push_back(any);
    GroupInput group;
    group.kind = GroupKind::Triangles;
    group.name = "hit";
    group.any_hit = 1;
    input.groups.push_back(group);
    LinkResult result = link_pipeline(input, options);
    EXPECT_TRUE(result.ok) << describe(result);
    return result;
}

TEST(Specialize, AnyHitShadersThatCannotRunAreNotLinked) {
    const LinkResult needed = with_any_hit("%uint_0"), opaque = with_any_hit("%uint_1");
    EXPECT_EQ(fact(needed, "no any-hit")->state, "unknown");
    EXPECT_NE(needed.reflection.groups.back().handle[1], 0u);
    EXPECT_EQ(fact(opaque, "no any-hit")->state, "proven");
    EXPECT_EQ(opaque.reflection.groups.back().handle[1], 0u);
    EXPECT_LT(opaque.reflection.state_count, needed.reflection.state_count);
    EXPECT_LT(opaque.reflection.instruction_count, needed.reflection.instruction_count);

    LinkOptions assume;
    assume.assumptions = RTC_FACT_ALL_OPAQUE;
    EXPECT_EQ(with_any_hit("%uint_0", assume).reflection.groups.back().handle[1], 0u);
    // NoOpaque outranks what geometry says.
    const LinkResult forced = with_any_hit("%uint_3", assume);
    EXPECT_EQ(fact(forced, "no any-hit")->state, "proven") << "Opaque is set as well, and wins";
}

TEST(Specialize, IsLessThanTheWholeAndCanBeSwitchedOff) {
    LinkOptions off;
    off.specialize = false;
    off.assumptions = RTC_FACT_SINGLE_LEVEL;
    const LinkResult whole = link({{StageKind::RayGen, tracing("%uint_0")}}, off);
    const LinkResult less = link({{StageKind::RayGen, tracing("%uint_0")}});
    ASSERT_TRUE(whole.ok && less.ok) << describe(whole) << describe(less);
    EXPECT_LT(less.reflection.instruction_count, whole.reflection.instruction_count * 95 / 100);
    EXPECT_EQ(whole.reflection.assumptions, 0u);
    EXPECT_TRUE(whole.reflection.facts.empty());
    EXPECT_EQ(fact(less, "cull mask")->detail, "constant at every trace: 255");
}

TEST(Specialize, KnownBits) {
    using link::Bits;
    const Bits a = link::exactly(6), b = link::exactly(12);
    EXPECT_TRUE(a.constant(~0u));
    const Bits either = link::both(a, b);  // 0110 or 1100
    EXPECT_EQ(either.ones, 4u);
    EXPECT_EQ(either.zeros, ~14u);
    EXPECT_FALSE(either.constant(~0u));
}

}  // namespace
}  // namespace rtc::test
