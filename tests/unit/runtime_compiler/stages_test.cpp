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
    // A depth of none: no shader may trace.
    recursion = 0;
    refused("recursion-limit");
    recursion = 1;
    // Every structure is the one it says it is, with nothing behind it but a stage's words.
    VkMemoryAllocateInfo stranger{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO};
    auto refused_chain = [&](const char* owner) {
        EXPECT_EQ(create(), VK_ERROR_VALIDATION_FAILED_EXT);
        ASSERT_EQ(vk->runtime_messages.size(), 1u);
        const std::string said = vk->runtime_messages[0];
        EXPECT_NE(said.find(std::string(owner) + "::pNext leads to a structure of type 5"), std::string::npos) << said;
        expect_runtime_error("pNext");
    };
    chain = &stranger;
    refused_chain("VkRayTracingPipelineCreateInfoNV");
    chain = nullptr;
    groups[1].pNext = &stranger;
    refused_chain("VkRayTracingShaderGroupCreateInfoNV");
    groups[1].pNext = nullptr;
    codes[2]->pNext = &stranger;  // behind the words
    refused_chain("VkPipelineShaderStageCreateInfo");
    codes[2]->pNext = nullptr;
    stranger.pNext = codes[2].get();  // before them
    stages[2].pNext = &stranger;
    refused_chain("VkPipelineShaderStageCreateInfo");
    stages[2].pNext = codes[2].get();
    groups[0].sType = VK_STRUCTURE_TYPE_RAY_TRACING_SHADER_GROUP_CREATE_INFO_KHR;
    refused("sType");
    groups[0].sType = VK_STRUCTURE_TYPE_RAY_TRACING_SHADER_GROUP_CREATE_INFO_NV;
    stages[0].sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
    refused("sType");
    stages[0].sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
    stages[0].flags = VK_PIPELINE_SHADER_STAGE_CREATE_REQUIRE_FULL_SUBGROUPS_BIT;
    refused("stage");
    stages[0].flags = 0;
    // What the linker says arrives under its own name.
    groups[1].generalShader = 2;
    EXPECT_EQ(create(), VK_ERROR_VALIDATION_FAILED_EXT);
    expect_runtime_error("group-stage-kind");
}

// Flags of ray tracing pipelines never reach the compute pipeline, whose rules the layers know.
TEST_F(StagesTest, FlagsOfRayTracing) {
    for (VkPipelineCreateFlags refused :
         {VkPipelineCreateFlags(VK_PIPELINE_CREATE_LIBRARY_BIT_KHR),
          VkPipelineCreateFlags(VK_PIPELINE_CREATE_RAY_TRACING_SKIP_TRIANGLES_BIT_KHR),
          VkPipelineCreateFlags(VK_PIPELINE_CREATE_RAY_TRACING_SKIP_AABBS_BIT_KHR),
          VkPipelineCreateFlags(VK_PIPELINE_CREATE_RAY_TRACING_SHADER_GROUP_HANDLE_CAPTURE_REPLAY_BIT_KHR)}) {
        flags = refused | VK_PIPELINE_CREATE_DISABLE_OPTIMIZATION_BIT;
        EXPECT_EQ(create(), VK_ERROR_VALIDATION_FAILED_EXT);
        expect_runtime_error("pipeline-flags");
    }
    flags = VK_PIPELINE_CREATE_DISABLE_OPTIMIZATION_BIT | VK_PIPELINE_CREATE_DERIVATIVE_BIT |
            VK_PIPELINE_CREATE_RAY_TRACING_NO_NULL_ANY_HIT_SHADERS_BIT_KHR |
            VK_PIPELINE_CREATE_RAY_TRACING_NO_NULL_CLOSEST_HIT_SHADERS_BIT_KHR |
            VK_PIPELINE_CREATE_RAY_TRACING_NO_NULL_MISS_SHADERS_BIT_KHR |
            VK_PIPELINE_CREATE_RAY_TRACING_NO_NULL_INTERSECTION_SHADERS_BIT_KHR;
    ASSERT_EQ(create(), VK_SUCCESS);
    launch(false);
}

// A pipeline in which nothing traces may have a depth of none.
TEST_F(StagesTest, NoDepthForShadersThatDoNotTrace) {
    stages.clear();
    codes.clear();
    groups.resize(1);
    add(VK_SHADER_STAGE_RAYGEN_BIT_NV, RTCC_STAGE_RAYGEN, R"(#version 460
#extension GL_NV_ray_tracing : require
layout(set = 0, binding = 1) buffer Result { uint result[]; };
void main() { result[gl_LaunchIDNV.x] = 1u; })");
    recursion = 0;
    EXPECT_EQ(create(), VK_SUCCESS);
}

}  // namespace
