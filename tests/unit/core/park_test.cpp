// Where values live from state to state: in memory in modules for GPUs (address mode), in variables elsewhere.
#include <gtest/gtest.h>

#include "core_test_util.h"
#include "spirv-tools/libspirv.hpp"

namespace rtc::test {
namespace {

// A raygen that reads %ptr's variable after a trace.
std::string keeps_a_value(const std::string& type) {
    return raygen_text(std::string(kPayload) + "%ptr = OpTypePointer Function " + type + "\n%null = OpConstantNull " +
                           type + "\n%ptr_out = OpTypePointer StorageBuffer " + type + "\n%block = OpTypeStruct " +
                           type + "\n%ptr_block = OpTypePointer StorageBuffer %block\n" +
                           "%out = OpVariable %ptr_block StorageBuffer\n",
                       "%kept = OpVariable %ptr Function\n%at = OpAccessChain %ptr_out %out %uint_0\n%before = OpLoad " + type +
                           " %at\nOpStore %kept %before\n" +
                           trace_text("%uint_0", "%uint_255", "%uint_0", "%uint_0", "%uint_0") + "%again = OpAccessChain %ptr_out %out %uint_0\n%after = OpLoad " +
                           type + " %kept\nOpStore %again %after\n",
                       std::string(kPayloadLocation) +
                           "OpDecorate %block Block\nOpMemberDecorate %block 0 Offset 0\n"
                           "OpDecorate %out DescriptorSet 0\nOpDecorate %out Binding 1\n");
}

std::string text_of(const std::string& type, Addressing addressing, bool resumable) {
    LinkOptions options;
    options.addressing = addressing;
    options.resumable = resumable;
    options.debug_info = true;
    const LinkResult result = link({{StageKind::RayGen, assemble(keeps_a_value(type))}}, options);
    EXPECT_TRUE(result.ok) << describe(result);
    std::string text;
    spvtools::SpirvTools(SPV_ENV_VULKAN_1_2).Disassemble(result.spirv, &text, SPV_BINARY_TO_TEXT_OPTION_FRIENDLY_NAMES);
    return text;
}

TEST(Park, ModulesForAddressesKeepLiveValuesInMemory) {
    for (const char* type : {"%float", "%v3float"})
        for (bool resumable : {false, true}) {
            const std::string text = text_of(type, Addressing::Address, resumable);
            EXPECT_NE(text.find("%rtc_parked = OpVariable"), std::string::npos) << type;
        }
}

TEST(Park, ModulesForHeapsKeepThemInVariables) {
    const std::string text = text_of("%float", Addressing::Heap, true);
    EXPECT_EQ(text.find("rtc_parked"), std::string::npos);
}

TEST(Park, AWalkThatNothingInterruptsIsNotGoneOnWith) {
    EXPECT_NE(text_of("%float", Addressing::Heap, true).find("%rtc_fresh = OpVariable"), std::string::npos);
    EXPECT_EQ(text_of("%float", Addressing::Heap, false).find("OpLoad %bool %rtc_fresh"), std::string::npos);
}

}  // namespace
}  // namespace rtc::test
