#include <gtest/gtest.h>

#include <bit>
#include <spirv-tools/libspirv.hpp>

#include "frontend/frontend.h"

namespace {

std::vector<uint32_t> assembled(const std::string& text) {
    std::vector<uint32_t> words;
    EXPECT_TRUE(spvtools::SpirvTools(SPV_ENV_UNIVERSAL_1_5).Assemble(text, &words));
    return words;
}

const std::string kTwoStages = R"(
    OpCapability RayTracingKHR
    OpExtension "SPV_KHR_ray_tracing"
    OpMemoryModel Logical GLSL450
    OpEntryPoint MissKHR %main "sky"
    OpEntryPoint RayGenerationKHR %main "camera with a long name"
    OpDecorate %b SpecId 4
    OpDecorate %f SpecId 9
    OpDecorate %d SpecId 2
    OpDecorate %i SpecId 3
    OpDecorate %u SpecId 11
    %void = OpTypeVoid
    %fn = OpTypeFunction %void
    %bool = OpTypeBool
    %int = OpTypeInt 32 1
    %uint16 = OpTypeInt 16 0
    %float = OpTypeFloat 32
    %double = OpTypeFloat 64
    %b = OpSpecConstantTrue %bool
    %f = OpSpecConstant %float 1
    %d = OpSpecConstant %double 1
    %i = OpSpecConstant %int 1
    %u = OpSpecConstant %uint16 1
    %main = OpFunction %void None %fn
    %label = OpLabel
    OpReturn
    OpFunctionEnd
)";

TEST(SpirvInfo, ListsEntryPointsAndConstants) {
    const rtc::SpirvInfo info = rtc::inspect_spirv(assembled(kTwoStages));
    ASSERT_EQ(info.error, "");
    ASSERT_EQ(info.entry_points.size(), 2u);
    EXPECT_EQ(info.entry_points[0].kind, rtc::StageKind::Miss);
    EXPECT_EQ(info.entry_points[0].name, "sky");
    EXPECT_EQ(info.entry_points[1].kind, rtc::StageKind::RayGen);
    EXPECT_EQ(info.entry_points[1].name, "camera with a long name");
    ASSERT_EQ(info.spec_constants.size(), 5u);
    using Type = rtc::SpecConstantInfo::Type;
    EXPECT_EQ(info.spec_constants[0].type, Type::Bool);
    EXPECT_EQ(info.spec_constants[0].spec_id, 4u);
    EXPECT_EQ(info.spec_constants[1].type, Type::Float);
    EXPECT_EQ(info.spec_constants[2].width, 64u);
    EXPECT_EQ(info.spec_constants[3].type, Type::Int);
    EXPECT_EQ(info.spec_constants[4].type, Type::Uint);
    EXPECT_EQ(info.spec_constants[4].width, 16u);
}

TEST(SpirvInfo, EveryTruncationIsSurvived) {
    const std::vector<uint32_t> whole = assembled(kTwoStages);
    for (size_t size = 0; size < whole.size(); ++size)
        rtc::inspect_spirv({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)});
    EXPECT_NE(rtc::inspect_spirv({}).error, "");
    EXPECT_NE(rtc::inspect_spirv({whole.begin(), whole.begin() + 4}).error, "");
    EXPECT_NE(rtc::inspect_spirv({whole.begin(), whole.begin() + 6}).error, "");
}

TEST(SpirvInfo, DamageIsNamed) {
    std::vector<uint32_t> words = assembled(kTwoStages);
    words[5] = 0;
    EXPECT_NE(rtc::inspect_spirv(words).error.find("word 5 claims 0 words"), std::string::npos);
    words[5] = 0xffff0011;
    EXPECT_NE(rtc::inspect_spirv(words).error.find("claims 65535 words"), std::string::npos);
    words[0] = 1;
    EXPECT_NE(rtc::inspect_spirv(words).error.find("magic"), std::string::npos);
}

TEST(SpirvInfo, AnEntryPointNameThatNeverEnds) {
    std::vector<uint32_t> words = {0x07230203,    0x10300, 0, 10,         0,
                                   5u << 16 | 15, 5313,    1, 0x61616161, 0x61616161};
    EXPECT_NE(rtc::inspect_spirv(words).error, "");
}

uint64_t value(rtc::SpecConstantInfo::Type type, uint32_t width, const std::string& text,
               bool expect_ok = true) {
    rtc::SpecConstantInfo constant;
    constant.type = type;
    constant.width = width;
    uint64_t bits = 0;
    std::string error;
    EXPECT_EQ(rtc::spec_value_from_text(constant, text, bits, error), expect_ok) << text << ": " << error;
    EXPECT_EQ(error.empty(), expect_ok) << text;
    return bits;
}

TEST(SpecValue, IsReadByType) {
    using Type = rtc::SpecConstantInfo::Type;
    EXPECT_EQ(value(Type::Bool, 32, "true"), 1u);
    EXPECT_EQ(value(Type::Bool, 32, "0"), 0u);
    EXPECT_EQ(value(Type::Int, 32, "-1"), 0xffffffffu);
    EXPECT_EQ(value(Type::Int, 16, "-32768"), 0x8000u);
    EXPECT_EQ(value(Type::Int, 64, "-9223372036854775808"), 1ull << 63);
    EXPECT_EQ(value(Type::Uint, 32, "0xFFFFFFFF"), 0xffffffffu);
    EXPECT_EQ(value(Type::Uint, 64, "18446744073709551615"), ~0ull);
    EXPECT_EQ(value(Type::Uint, 8, "255u"), 255u);
    EXPECT_EQ(value(Type::Float, 32, "1.5"), std::bit_cast<uint32_t>(1.5f));
    EXPECT_EQ(value(Type::Float, 32, "-2.5e3f"), std::bit_cast<uint32_t>(-2500.0f));
    EXPECT_EQ(value(Type::Float, 32, "0.1"), std::bit_cast<uint32_t>(0.1f));
    EXPECT_EQ(value(Type::Float, 64, "0.1"), std::bit_cast<uint64_t>(0.1));
    EXPECT_EQ(value(Type::Float, 32, "3"), std::bit_cast<uint32_t>(3.0f));
}

TEST(SpecValue, WhatDoesNotFitIsAnError) {
    using Type = rtc::SpecConstantInfo::Type;
    for (const char* bad : {"", "x", "1x", "1.5", "4294967296", "-2147483649", "--1", "0x", "-", "true"})
        value(Type::Int, 32, bad, false);
    for (const char* bad : {"-1", "65536"}) value(Type::Uint, 16, bad, false);
    for (const char* bad : {"", "yes", "2"}) value(Type::Bool, 32, bad, false);
    for (const char* bad : {"", "x", "1.5x", "f", "."}) value(Type::Float, 32, bad, false);
    value(Type::Float, 16, "1.0", false);
}

}  // namespace
