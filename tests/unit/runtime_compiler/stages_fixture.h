// Stages as SPIR-V words, an application's set, and pipelines made of them.
#pragma once

#include <algorithm>

#include "rtc/runtime_compiler.h"

#include "scene_util.h"

inline const char* const kRaygen = R"(#version 460
#extension GL_NV_ray_tracing : require
layout(set = 0, binding = 0) uniform accelerationStructureNV scene;
layout(set = 0, binding = 1) buffer Result { uint result[]; };
layout(constant_id = 4) const uint BASE = 1000u;
layout(location = 0) rayPayloadNV uint value;
void main() {
    value = 0u;
    traceNV(scene, 0u, 0xffu, 0u, 0u, 0u, vec3(0.1 + 2.0 * gl_LaunchIDNV.x, 0.1, 1.0), 0.0, vec3(0.0, 0.0, -1.0), 100.0, 0);
    result[gl_LaunchIDNV.x] = BASE + value;
})";
inline const char* const kMiss = R"(#version 460
#extension GL_NV_ray_tracing : require
layout(location = 0) rayPayloadInNV uint value;
void main() { value = 7u; })";
inline const char* const kHit = R"(#version 460
#extension GL_NV_ray_tracing : require
layout(location = 0) rayPayloadInNV uint value;
void main() { value = 50u + uint(gl_PrimitiveID); })";

class StagesTest : public RuntimeTest {
  protected:
    void SetUp() override {
        RuntimeTest::SetUp();
        if (!vk) return;
        compiler = rtcc_compiler_create();
        add(VK_SHADER_STAGE_RAYGEN_BIT_NV, RTCC_STAGE_RAYGEN, kRaygen);
        add(VK_SHADER_STAGE_MISS_BIT_NV, RTCC_STAGE_MISS, kMiss);
        add(VK_SHADER_STAGE_CLOSEST_HIT_BIT_NV, RTCC_STAGE_CLOSEST_HIT, kHit);
        for (uint32_t i = 0; i < 3; i++) {
            VkRayTracingShaderGroupCreateInfoNV g{VK_STRUCTURE_TYPE_RAY_TRACING_SHADER_GROUP_CREATE_INFO_NV};
            g.type = i < 2 ? VK_RAY_TRACING_SHADER_GROUP_TYPE_GENERAL_NV
                           : VK_RAY_TRACING_SHADER_GROUP_TYPE_TRIANGLES_HIT_GROUP_NV;
            g.generalShader = i < 2 ? i : VK_SHADER_UNUSED_NV;
            g.closestHitShader = i == 2 ? i : VK_SHADER_UNUSED_NV;
            g.anyHitShader = g.intersectionShader = VK_SHADER_UNUSED_NV;
            groups.push_back(g);
        }
        // The application's layout, in the extension's own enums.
        VkDescriptorSetLayoutBinding bindings[2] = {
            {0, VK_DESCRIPTOR_TYPE_ACCELERATION_STRUCTURE_NV, 1, VK_SHADER_STAGE_RAYGEN_BIT_NV, nullptr},
            {1, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_RAYGEN_BIT_NV, nullptr}};
        rtrTranslateLayoutBindings(2, bindings, bindings);
        VkDescriptorSetLayoutCreateInfo info{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO};
        info.bindingCount = 2;
        info.pBindings = bindings;
        ASSERT_EQ(vk->CreateDescriptorSetLayout(vk->device, &info, nullptr, &layout), VK_SUCCESS);
        VkDescriptorPoolSize sizes[2] = {{VK_DESCRIPTOR_TYPE_ACCELERATION_STRUCTURE_NV, 1},
                                         {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1}};
        rtrTranslatePoolSizes(2, sizes, sizes);
        VkDescriptorPoolCreateInfo pool_info{VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO};
        pool_info.maxSets = 1;
        pool_info.poolSizeCount = 2;
        pool_info.pPoolSizes = sizes;
        vk->CreateDescriptorPool(vk->device, &pool_info, nullptr, &pool);
        VkDescriptorSetAllocateInfo allocate{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO};
        allocate.descriptorPool = pool;
        allocate.descriptorSetCount = 1;
        allocate.pSetLayouts = &layout;
        ASSERT_EQ(vk->AllocateDescriptorSets(vk->device, &allocate, &set), VK_SUCCESS);
    }
    void TearDown() override {
        if (vk) {
            rtrDestroyPipeline(rtr, pipeline, nullptr);
            vk->DestroyDescriptorPool(vk->device, pool, nullptr);
            vk->DestroyDescriptorSetLayout(vk->device, layout, nullptr);
            for (auto r : results) rtcc_result_release(r);
            rtcc_compiler_release(compiler);
        }
        RuntimeTest::TearDown();
    }

    void add(VkShaderStageFlagBits bit, rtcc_stage stage, const char* source) {
        auto r = rtcc_compile_stage(compiler, stage, "stage", source, strlen(source), nullptr);
        ASSERT_EQ(rtcc_result_status(r), RTCC_STATUS_SUCCESS) << rtcc_result_messages(r);
        results.push_back(r);
        auto code = std::make_unique<VkShaderModuleCreateInfo>();
        code->sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO;
        code->pCode = rtcc_result_words(r);
        code->codeSize = 4 * rtcc_result_word_count(r);
        VkPipelineShaderStageCreateInfo info{VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO};
        info.pNext = code.get();
        info.stage = bit;
        info.pName = "main";
        stages.push_back(info);
        codes.push_back(std::move(code));
    }

    VkResult create(rtcc_options_t options = nullptr) {
        VkRayTracingPipelineCreateInfoNV info{VK_STRUCTURE_TYPE_RAY_TRACING_PIPELINE_CREATE_INFO_NV};
        info.stageCount = static_cast<uint32_t>(stages.size());
        info.pStages = stages.data();
        info.groupCount = static_cast<uint32_t>(groups.size());
        info.pGroups = groups.data();
        info.maxRecursionDepth = recursion;
        info.pNext = chain;
        info.flags = flags;
        RtrStagesInfo more{};
        more.compiler = compiler;
        more.options = options;
        more.setLayoutCount = 1;
        more.pSetLayouts = &layout;
        return rtrCreateRayTracingPipelineFromStages(rtr, VK_NULL_HANDLE, &info, &more, nullptr, &pipeline);
    }

    // Three rays: onto triangle 0, onto triangle 1, past both.
    void launch(bool address_mode) {
        Scene scene(*vk, rtr, 1 << 20, address_mode);
        auto bottom = scene.build_bottom(
            {scene.triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 0, 0}, {3, 0, 0}, {2, 1, 0}})});
        EXPECT_EQ(trace(scene, scene.heap, scene.build_top({scene.instance(bottom)})).code, RTC_LAUNCH_ERROR_NONE);
        EXPECT_EQ(said[0], base + 50);
        EXPECT_EQ(said[1], base + 51);
        EXPECT_EQ(said[2], base + 7);
    }

    // Rays at x = 0.1, 2.1 and 4.1 into a top level, with this heap set; what they say is in `said`.
    RtrLaunchError trace(Scene& scene, RtrHeap heap, RtrAccelerationStructure top) {
        RtrLaunchError error{};
        const std::vector<uint32_t> words = trace(scene, heap, top, 3, error);
        std::copy(words.begin(), words.end(), said);
        return error;
    }

    // As many rays, and what each says.
    std::vector<uint32_t> trace(Scene& scene, RtrHeap heap, RtrAccelerationStructure top, uint32_t rays,
                                RtrLaunchError& error) {
        Buffer result = scene.upload(nullptr, 4 * rays);
        memset(result.data, 0, 4 * rays);
        EXPECT_EQ(rtrUpdateAccelerationStructureDescriptors(rtr, set, 0, 0, 1, &top, null_heap), VK_SUCCESS);
        VkDescriptorBufferInfo info{result.handle, 0, VK_WHOLE_SIZE};
        VkWriteDescriptorSet w{VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
        w.dstSet = set;
        w.dstBinding = 1;
        w.descriptorCount = 1;
        w.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
        w.pBufferInfo = &info;
        vk->UpdateDescriptorSets(vk->device, 1, &w, 0, nullptr);
        RtrSbtRecord raygen{0, 0, nullptr}, miss{1, 0, nullptr}, hit{2, 0, nullptr};
        RtrSbtInfo sbt_info{1, &raygen, 1, &miss, 1, &hit, 0, nullptr};
        RtrSbtLayout table;
        EXPECT_EQ(rtrGetSbtLayout(rtr, &sbt_info, &table), VK_SUCCESS);
        Buffer sbt = scene.upload(nullptr, table.size);
        EXPECT_EQ(rtrWriteSbt(rtr, pipeline, &sbt_info, &table, sbt.data), VK_SUCCESS);
        VkDeviceSize scratch_size = rtrGetLaunchScratchSize(rtr, pipeline, rays, 1, 1, nullptr);
        Buffer scratch = scene.upload(nullptr, scratch_size);
        VkDescriptorBufferInfo place{};
        scene.run([&] {
            auto rec = scene.recorder;
            rtrCmdBindPipeline(rec, pipeline);
            rtrCmdBindDescriptorSets(rec, 0, 1, &set, 0, nullptr);
            if (heap) rtrCmdSetHeap(rec, heap);
            if (scratch_size) rtrCmdSetLaunchScratch(rec, scratch.handle, 0, scratch_size);
            EXPECT_EQ(rtrCmdTraceRays(rec, sbt.handle, table.raygen.offset, sbt.handle, table.miss.offset,
                                      table.miss.stride, sbt.handle, table.hit.offset, table.hit.stride,
                                      VK_NULL_HANDLE, 0, 0, rays, 1, 1),
                      VK_SUCCESS);
            EXPECT_EQ(rtrGetLaunchCount(rec), 1u);
            EXPECT_EQ(rtrGetLaunchErrorLocation(rec, 0, &place), VK_SUCCESS);
        });
        rtrDecodeLaunchError(scene.control.as<uint32_t>(place.offset), &error);
        return {result.as<uint32_t>(), result.as<uint32_t>() + rays};
    }

    rtcc_compiler_t compiler = nullptr;
    std::vector<rtcc_result_t> results;
    std::vector<std::unique_ptr<VkShaderModuleCreateInfo>> codes;
    std::vector<VkPipelineShaderStageCreateInfo> stages;
    std::vector<VkRayTracingShaderGroupCreateInfoNV> groups;
    VkDescriptorSetLayout layout = VK_NULL_HANDLE;
    VkDescriptorPool pool = VK_NULL_HANDLE;
    VkDescriptorSet set = VK_NULL_HANDLE;
    RtrPipeline pipeline = nullptr;
    RtrHeap null_heap = nullptr;  // of structures that are NULL
    uint32_t recursion = 1, base = 1000, said[3] = {0, 0, 0};
    const void* chain = nullptr;  // of the pipeline
    VkPipelineCreateFlags flags = 0;
};
