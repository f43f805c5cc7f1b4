// Pipelines made at run time of ray tracing stages as SPIR-V words.
#include "stages_fixture.h"

namespace {

TEST_F(StagesTest, TracesInHeapMode) {
    uint32_t value = base = 2000;
    VkSpecializationMapEntry entry{4, 0, 4};
    VkSpecializationInfo constants{1, &entry, 4, &value};
    stages[0].pSpecializationInfo = &constants;
    ASSERT_EQ(create(), VK_SUCCESS);
    launch(false);
}

TEST_F(StagesTest, TracesInAddressMode) {
    if (!vk->GetBufferDeviceAddress) GTEST_SKIP() << "the device has no bufferDeviceAddress";
    auto options = rtcc_options_create();
    ASSERT_EQ(rtcc_options_set_addressing(options, RTCC_ADDRESSING_ADDRESS), RTCC_STATUS_SUCCESS);
    VkResult r = create(options);
    rtcc_options_release(options);
    ASSERT_EQ(r, VK_SUCCESS);
    launch(true);
}

TEST_F(StagesTest, WrongUsesAreNamed) {
    auto refused = [&](const char* id) {
        EXPECT_EQ(create(), VK_ERROR_VALIDATION_FAILED_EXT);
        EXPECT_EQ(pipeline, nullptr);
        expect_runtime_error(id);
    };
    stages[1].pNext = nullptr;
    refused("stage");
    stages[1].pNext = codes[1].get();
    stages[1].stage = VK_SHADER_STAGE_FRAGMENT_BIT;
    refused("stage");
    stages[1].stage = VK_SHADER_STAGE_MISS_BIT_NV;
    groups[0].generalShader = 3;
    refused("group");
    groups[0].generalShader = 0;
    groups[2].intersectionShader = 1;
    refused("group");
    groups[2].intersectionShader = VK_SHADER_UNUSED_NV;
    groups[1].closestHitShader = 2;
    refused("group");
    groups[1].closestHitShader = VK_SHADER_UNUSED_NV;
    recursion = 32;
    refused("recursion-limit");
    recursion = 1;
    uint32_t value = 0;
    VkSpecializationMapEntry entry{4, 2, 4};
    VkSpecializationInfo constants{1, &entry, 4, &value};
    stages[0].pSpecializationInfo = &constants;
    refused("specialization");
    stages[0].pSpecializationInfo = nullptr;
    // What the linker says arrives under its own name.
    groups[1].generalShader = 2;
    EXPECT_EQ(create(), VK_ERROR_VALIDATION_FAILED_EXT);
    expect_runtime_error("group-stage-kind");
}

}  // namespace
