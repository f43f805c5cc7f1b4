// A pipeline of one ray a lane, compiled with assumptions, and scenes that meet or break them.
#pragma once

#include <gmock/gmock.h>

#include <memory>
#include <string>

#include "rtc/compiler.h"
#include "scene_util.h"

// What the lane of a launch writes: the payload of its ray, which these shaders set.
constexpr uint32_t kUntouched = 0xdeadbeef, kHit = 1, kMiss = 2;

inline const char* const kRayGen = R"(#version 460
#extension GL_NV_ray_tracing : require
layout(set = 0, binding = 0) uniform accelerationStructureNV scene;
layout(set = 0, binding = 1) buffer Out { uint result[]; };
layout(location = 0) rayPayloadNV uint payload;
void main() {
    payload = 0u;
    traceNV(scene, FLAGS, 0xff, 0, 0, 0, vec3(0.1, 0.2, -5.0), 0.0, vec3(0.0, 0.0, 1.0), 100.0, 0);
    result[gl_LaunchIDNV.x] = payload;
})";
inline const char* const kClosestHit = R"(#version 460
#extension GL_NV_ray_tracing : require
layout(location = 0) rayPayloadInNV uint payload;
void main() { payload = 1u; })";
inline const char* const kMissShader = R"(#version 460
#extension GL_NV_ray_tracing : require
layout(location = 0) rayPayloadInNV uint payload;
void main() { payload = 2u; })";
// Ignores everything: what is not opaque is not there.
inline const char* const kAnyHit = R"(#version 460
#extension GL_NV_ray_tracing : require
void main() { ignoreIntersectionNV(); })";
inline const char* const kIntersection = R"(#version 460
#extension GL_NV_ray_tracing : require
void main() { reportIntersectionNV(5.0, 0u); })";

struct Module {
    std::vector<uint32_t> words;
    std::string json;
};

inline Module compile(const std::string& assume, const std::string& flags = "0u", bool addresses = false) {
    std::unique_ptr<rtcc_compiler, void (*)(rtcc_compiler_t)> compiler(rtcc_compiler_create(), rtcc_compiler_release);
    std::unique_ptr<rtcc_options, void (*)(rtcc_options_t)> options(rtcc_options_create(), rtcc_options_release);
    std::unique_ptr<rtcc_pipeline, void (*)(rtcc_pipeline_t)> pipeline(rtcc_pipeline_create(), rtcc_pipeline_release);
    EXPECT_EQ(rtcc_options_assume(options.get(), assume.c_str()), RTCC_STATUS_SUCCESS) << assume;
    rtcc_options_add_macro(options.get(), "FLAGS", flags.c_str());
    rtcc_options_set_addressing(options.get(), addresses ? RTCC_ADDRESSING_ADDRESS : RTCC_ADDRESSING_HEAP);
    auto add = [&](rtcc_stage stage, const char* name, const char* text) {
        return rtcc_pipeline_add_glsl(pipeline.get(), stage, name, name, text, strlen(text));
    };
    const int32_t gen = add(RTCC_STAGE_RAYGEN, "gen", kRayGen), hit = add(RTCC_STAGE_CLOSEST_HIT, "hit", kClosestHit),
                  miss = add(RTCC_STAGE_MISS, "miss", kMissShader), any = add(RTCC_STAGE_ANY_HIT, "any", kAnyHit),
                  box = add(RTCC_STAGE_INTERSECTION, "box", kIntersection);
    rtcc_pipeline_add_general_group(pipeline.get(), "gen", gen);
    rtcc_pipeline_add_general_group(pipeline.get(), "miss", miss);
    rtcc_pipeline_add_hit_group(pipeline.get(), "hit", hit, any, -1);
    rtcc_pipeline_add_hit_group(pipeline.get(), "box", hit, -1, box);
    std::unique_ptr<rtcc_result, void (*)(rtcc_result_t)> result(
        rtcc_compile_pipeline(compiler.get(), pipeline.get(), options.get()), rtcc_result_release);
    EXPECT_EQ(rtcc_result_status(result.get()), RTCC_STATUS_SUCCESS) << rtcc_result_messages(result.get());
    Module out;
    out.words.assign(rtcc_result_words(result.get()),
                     rtcc_result_words(result.get()) + rtcc_result_word_count(result.get()));
    out.json = rtcc_result_reflection_json(result.get());
    return out;
}

class AssumeTest : public RuntimeTest {
  protected:
    static constexpr uint32_t kLanes = 40;
    bool addresses = false;  // the addressing mode, to be set before SetUp

    void SetUp() override {
        RuntimeTest::SetUp();
        if (!vk || IsSkipped()) return;
        if (addresses && !vk->GetBufferDeviceAddress) GTEST_SKIP() << "the device has no bufferDeviceAddress";
        scene = std::make_unique<Scene>(*vk, rtr, 4 << 20, addresses);
        const std::vector<Vec3> corners = {{-1, -1, 0}, {1, -1, 0}, {0, 2, 0}};
        opaque = scene->build_bottom({scene->triangles(corners, nullptr, VK_GEOMETRY_OPAQUE_BIT_NV)});
        VkGeometryNV solid = scene->triangles({{8, 8, 8}, {9, 8, 8}, {8, 9, 8}}, nullptr, VK_GEOMETRY_OPAQUE_BIT_NV);
        see_through = scene->build_bottom({solid, scene->triangles(corners)});
        boxes = scene->build_bottom({scene->aabbs({{-1, -1, -1, 1, 1, 1}}, VK_GEOMETRY_OPAQUE_BIT_NV)});

        const VkDescriptorSetLayoutBinding bindings[] = {
            {0, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr},
            {1, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr}};
        VkDescriptorSetLayoutCreateInfo info{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO};
        info.bindingCount = 2;
        info.pBindings = bindings;
        ASSERT_EQ(vk->CreateDescriptorSetLayout(vk->device, &info, nullptr, &layout), VK_SUCCESS);
        VkDescriptorPoolSize size = {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 2};
        VkDescriptorPoolCreateInfo pool_info{VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO};
        pool_info.maxSets = 1;
        pool_info.poolSizeCount = 1;
        pool_info.pPoolSizes = &size;
        ASSERT_EQ(vk->CreateDescriptorPool(vk->device, &pool_info, nullptr, &pool), VK_SUCCESS);
        VkDescriptorSetAllocateInfo allocate{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO};
        allocate.descriptorPool = pool;
        allocate.descriptorSetCount = 1;
        allocate.pSetLayouts = &layout;
        ASSERT_EQ(vk->AllocateDescriptorSets(vk->device, &allocate, &set), VK_SUCCESS);
        result = scene->upload(nullptr, kLanes * 4);
        sbt = scene->upload(nullptr, 1024);
        launch_scratch = scene->upload(nullptr, 1 << 20);
    }

    void TearDown() override {
        if (vk) {
            drop_pipeline();
            if (pool) vk->DestroyDescriptorPool(vk->device, pool, nullptr);
            if (layout) vk->DestroyDescriptorSetLayout(vk->device, layout, nullptr);
        }
        scene.reset();
        RuntimeTest::TearDown();
    }

    void drop_pipeline() {
        rtrDestroyPipeline(rtr, pipeline, nullptr);
        pipeline = nullptr;
    }

    // `group`: 2 for triangles, 3 for boxes.
    void use(const std::string& assume, uint32_t group = 2, const std::string& flags = "0u") {
        drop_pipeline();
        const Module module = compile(assume, flags, addresses);
        RtrRayTracingPipelineCreateInfo info{};
        info.pCode = module.words.data();
        info.codeSize = module.words.size() * 4;
        info.setLayoutCount = 1;
        info.pSetLayouts = &layout;
        ASSERT_EQ(rtrCreateRayTracingPipeline(rtr, VK_NULL_HANDLE, &info, nullptr, &pipeline), VK_SUCCESS);
        const RtrSbtRecord gen{0, 0, nullptr}, miss{1, 0, nullptr}, hit{group, 0, nullptr};
        RtrSbtInfo table{};
        table.raygenCount = table.missCount = table.hitCount = 1;
        table.pRaygen = &gen;
        table.pMiss = &miss;
        table.pHit = &hit;
        ASSERT_EQ(rtrGetSbtLayout(rtr, &table, &regions), VK_SUCCESS);
        ASSERT_LE(regions.size, 1024u);
        ASSERT_EQ(rtrWriteSbt(rtr, pipeline, &table, &regions, sbt.data), VK_SUCCESS);
    }

    struct Outcome {
        uint32_t value = 0;  // of every lane; 0xffffffff when they differ
        RtrLaunchError error{};
        std::string text;
        VkResult recorded = VK_SUCCESS;
    };

    Outcome trace(RtrAccelerationStructure top, const std::vector<RtrAccelerationStructure>& declared = {}) {
        VkDescriptorBufferInfo buffers[2] = {{}, {result.handle, 0, VK_WHOLE_SIZE}};
        EXPECT_EQ(rtrGetAccelerationStructureDescriptor(rtr, top, &buffers[0]), VK_SUCCESS);
        VkWriteDescriptorSet write{VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
        write.dstSet = set;
        write.descriptorCount = 2;
        write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
        write.pBufferInfo = buffers;
        vk->UpdateDescriptorSets(vk->device, 1, &write, 0, nullptr);
        for (uint32_t i = 0; i < kLanes; ++i) result.as<uint32_t>()[i] = kUntouched;
        Outcome out;
        vk->begin();
        EXPECT_EQ(rtrBeginRecorder(scene->recorder, vk->cmd), VK_SUCCESS);
        rtrCmdBindPipeline(scene->recorder, pipeline);
        rtrCmdBindDescriptorSets(scene->recorder, 0, 1, &set, 0, nullptr);
        if (scene->heap) rtrCmdSetHeap(scene->recorder, scene->heap);
        rtrCmdSetLaunchScratch(scene->recorder, launch_scratch.handle, 0, launch_scratch.size);
        if (!declared.empty()) {
            EXPECT_EQ(rtrCmdDeclareScene(scene->recorder, static_cast<uint32_t>(declared.size()), declared.data()),
                      VK_SUCCESS);
        }
        out.recorded = rtrCmdTraceRays(scene->recorder, sbt.handle, regions.raygen.offset, sbt.handle,
                                       regions.miss.offset, regions.miss.stride, sbt.handle, regions.hit.offset,
                                       regions.hit.stride, VK_NULL_HANDLE, 0, 0, kLanes, 1, 1);
        vk->submit();
        if (out.recorded == VK_SUCCESS) {
            // By words, not through the messenger: an error is what is expected here.
            VkDescriptorBufferInfo place{};
            EXPECT_EQ(rtrGetLaunchErrorLocation(scene->recorder, 0, &place), VK_SUCCESS);
            rtrDecodeLaunchError(scene->control.as<uint32_t>(place.offset), &out.error);
            char text[512];
            rtrFormatLaunchError(&out.error, text, sizeof text);
            out.text = text;
        }
        EXPECT_EQ(rtrResetRecorder(scene->recorder), VK_SUCCESS);
        out.value = result.as<uint32_t>()[0];
        for (uint32_t i = 0; i < kLanes; ++i)
            if (result.as<uint32_t>()[i] != out.value) out.value = 0xffffffffu;
        return out;
    }

    void update(RtrAccelerationStructure top, const std::vector<VkAccelerationStructureInstanceNV>& instances) {
        Buffer data = scene->upload(instances.data(), instances.size() * sizeof instances[0]);
        VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
        info.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
        info.flags = VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV;
        info.instanceCount = static_cast<uint32_t>(instances.size());
        scene->run([&] {
            EXPECT_EQ(rtrCmdBuildAccelerationStructure(scene->recorder, &info, data.handle, 0, VK_TRUE, top, top,
                                                       scene->scratch.handle, 0),
                      VK_SUCCESS);
        });
    }

    RtrAccelerationStructure top(const std::vector<VkAccelerationStructureInstanceNV>& instances) {
        return scene->build_top(instances, VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV);
    }

    std::unique_ptr<Scene> scene;
    RtrAccelerationStructure opaque = nullptr, see_through = nullptr, boxes = nullptr;
    VkDescriptorSetLayout layout = VK_NULL_HANDLE;
    VkDescriptorPool pool = VK_NULL_HANDLE;
    VkDescriptorSet set = VK_NULL_HANDLE;
    RtrPipeline pipeline = nullptr;
    RtrSbtLayout regions{};
    Buffer result, sbt, launch_scratch;
};
