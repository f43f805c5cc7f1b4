// Every diagnostic about devices and pipelines: limits that a module exceeds, functions of Vulkan
// that fail or are missing. Id, VkResult and advice.
#include "expect_refused.h"
#include "faulty_vulkan.h"
#include "launch_fixture.h"
#include "module_util.h"
#include "scene_util.h"
#include "spv/module_resources.h"
#include "spv/module_resume.h"

namespace {

constexpr VkResult kInvalid = VK_ERROR_VALIDATION_FAILED_EXT, kAbsent = VK_ERROR_FEATURE_NOT_PRESENT,
                   kFailed = VK_ERROR_OUT_OF_DEVICE_MEMORY;
constexpr uint32_t kUsed = 1u << RTC_BINDING_PARAMS | 1u << RTC_BINDING_CONTROL | 1u << RTC_BINDING_SCRATCH;

class MisuseDeviceTest : public LaunchTest {
  protected:
    std::vector<uint32_t> module(uint32_t reserved_set = 1) {
        RtcModuleHeader header = module_header(kUsed, 1);
        header.reserved_set = reserved_set;
        return with_reflection(module_resume_spv, sizeof module_resume_spv, header, "");
    }
};

TEST_F(MisuseDeviceTest, LimitsOfOneStage) {
    FaultyVulkan faulty(*vk);
    const auto resources =
        with_reflection(module_resources_spv, sizeof module_resources_spv, module_header(kUsed, 1), "");
    using Limits = VkPhysicalDeviceLimits;
    RtrTraceOptions options = RTR_TRACE_OPTIONS_DEFAULT;
    options.workgroupSize = 256;
    options.sharedStack = 32;
    options.fetch = RTR_FETCH_TEXEL;
    const struct {
        const char* id;
        const char* says;
        std::function<void(Limits&)> limit;
        std::vector<uint32_t> code;
        uint32_t push = 8;
    } rows[] = {
        {"maxPerStageDescriptorStorageBuffers", "is 19; the linked module uses 20",
         [](Limits& l) { l.maxPerStageDescriptorStorageBuffers = 19; }, resources},
        {"maxPerStageDescriptorUniformBuffers", "is 13; the linked module uses 14",
         [](Limits& l) { l.maxPerStageDescriptorUniformBuffers = 13; }, resources},
        {"maxPerStageDescriptorSampledImages", "is 8; the linked module uses 9",
         [](Limits& l) { l.maxPerStageDescriptorSampledImages = 8; }, resources},
        {"maxPerStageDescriptorStorageImages", "is 3; the linked module uses 4",
         [](Limits& l) { l.maxPerStageDescriptorStorageImages = 3; }, resources},
        {"maxPerStageDescriptorSamplers", "is 7; the linked module uses 8",
         [](Limits& l) { l.maxPerStageDescriptorSamplers = 7; }, resources},
        {"maxPerStageResources", "all ray tracing stages are one compute stage now",
         [](Limits& l) { l.maxPerStageResources = 46; }, resources},
        {"maxBoundDescriptorSets", "is 1; the linked module uses 3", [](Limits& l) { l.maxBoundDescriptorSets = 1; },
         module(), 8},
        {"maxPushConstantsSize", "is 128; the linked module uses 132",
         [](Limits& l) { l.maxPushConstantsSize = 128; }, module(), 132},
        {"maxComputeWorkGroupInvocations", "is 128; the linked module uses 256",
         [](Limits& l) { l.maxComputeWorkGroupInvocations = 128; }, module()},
        {"maxComputeWorkGroupSize[0]", "is 128; the linked module uses 256",
         [](Limits& l) { l.maxComputeWorkGroupSize[0] = 128; }, module()},
        {"maxComputeSharedMemorySize", "is 16384; the linked module uses 32768",
         [](Limits& l) { l.maxComputeSharedMemorySize = 16384; }, module()},
    };
    make_set(1);
    for (auto& row : rows) {
        faulty.remembered = [&](Limits& l) {
            // Room for everything else, whatever this device has.
            l.maxPerStageDescriptorStorageBuffers = l.maxPerStageDescriptorUniformBuffers = 32;
            l.maxPerStageResources = 128;
            row.limit(l);
        };
        RtrDevice d = faulty.create();
        ASSERT_NE(d, nullptr);
        const std::vector<VkDescriptorSetLayout> layouts(3, layout);
        VkPushConstantRange range{VK_SHADER_STAGE_COMPUTE_BIT, 0, row.push};
        RtrRayTracingPipelineCreateInfo info{};
        info.flags = VK_PIPELINE_CREATE_DEFER_COMPILE_BIT_NV;
        info.pCode = row.code.data();
        info.codeSize = row.code.size() * 4;
        info.setLayoutCount = !strcmp(row.id, "maxBoundDescriptorSets") ? 3 : 1;
        info.pSetLayouts = layouts.data();
        info.pushConstantRangeCount = 1;
        info.pPushConstantRanges = &range;
        info.pOptions = &options;
        auto create = [&] { return rtrCreateRayTracingPipeline(d, VK_NULL_HANDLE, &info, nullptr, &pipeline); };
        // The device may warn that the module is not resumable, before it comes to the limits.
        RtrPhysicalDeviceSupport support = *rtrGetDeviceSupport(d);
        if (support.needsResumableModules) {
            EXPECT_EQ(create(), kAbsent);
            ASSERT_EQ(vk->runtime_messages.size(), 2u) << row.id;
            vk->runtime_messages.erase(vk->runtime_messages.begin());
            EXPECT_EQ(vk->runtime_messages[0].find(std::string(row.id) + ": "), 0u) << vk->runtime_messages[0];
            EXPECT_NE(vk->runtime_messages[0].find(row.says), std::string::npos) << vk->runtime_messages[0];
            vk->runtime_messages.clear();
        } else {
            expect_refused(*vk, {{row.id, kAbsent, row.says, create}});
        }
        EXPECT_EQ(pipeline, nullptr);
        rtrDestroyDevice(d, nullptr);
    }
    // Where rtc's own set is the one too many there is a way out.
    faulty.remembered = [](Limits& l) { l.maxBoundDescriptorSets = 2; };
    RtrDevice d = faulty.create();
    EXPECT_EQ(make_pipeline(module(2), 8, nullptr, nullptr, d), kAbsent);
    EXPECT_NE(vk->runtime_messages.back().find("--reserved=SET.BINDING"), std::string::npos);
    vk->runtime_messages.clear();
    rtrDestroyDevice(d, nullptr);
}

TEST_F(MisuseDeviceTest, Pipelines) {
    make_set(1);
    const auto code = module();
    const std::vector<VkDescriptorSetLayout> layouts(33, layout);
    RtrRayTracingPipelineCreateInfo info{};
    info.pCode = code.data();
    info.codeSize = code.size() * 4;
    info.setLayoutCount = 33;
    info.pSetLayouts = layouts.data();
    expect_refused(*vk, {
        {"set-layouts", kInvalid, "33 set layouts; at most 32",
         [&] { return rtrCreateRayTracingPipeline(rtr, VK_NULL_HANDLE, &info, nullptr, &pipeline); }},
        {"push-constants", kAbsent, "4100 bytes of push constants; at most 4096",
         [&] { return make_pipeline(code, 4100); }},
    });
}

TEST_F(MisuseDeviceTest, FunctionsThatFail) {
    make_set(1);
    FaultyVulkan faulty(*vk);
    RtrDevice d = faulty.create();
    ASSERT_NE(d, nullptr);
    const RtcModuleHeader header = [] {
        RtcModuleHeader h = module_header(kUsed, 1);
        h.flags |= RTC_MODULE_RESUMABLE;  // so that no device warns
        return h;
    }();
    const auto code = with_reflection(module_resume_spv, sizeof module_resume_spv, header, "");
    Buffer heap_buffer = vk->buffer(4096, RTR_HEAP_BUFFER_USAGE), scratch = vk->buffer(4096, RTR_SCRATCH_BUFFER_USAGE);
    auto failing = [&](const char* function, const char* id, const std::function<VkResult()>& call) {
        faulty.fails = function;
        expect_refused(*vk, {{id, kFailed, "failed (VkResult -2)", call}});
        faulty.fails.clear();
    };
    const auto pipelines = [&] { return make_pipeline(code, 8, nullptr, nullptr, d); };
    failing("vkCreateDescriptorSetLayout", "reserved-set", pipelines);
    failing("vkCreatePipelineLayout", "pipeline-layout", pipelines);
    failing("vkCreateShaderModule", "shader-module", pipelines);
    failing("vkCreateComputePipelines", "pipeline", pipelines);
    EXPECT_EQ(pipeline, nullptr);
    RtrHeap heap = nullptr;
    RtrHeapCreateInfo heap_info{nullptr, heap_buffer.handle, 0, heap_buffer.size};
    failing("vkCreateBufferView", "heap-view", [&] { return rtrCreateHeap(d, &heap_info, nullptr, &heap); });
    EXPECT_EQ(heap, nullptr);
    {
        Scene scene(*vk, d, 4096);
        VkAccelerationStructureInfoNV top{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
        top.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
        auto as = scene.create(top);
        scene.run([&] {
            failing("vkCreateDescriptorPool", "descriptor-pool", [&] {
                return rtrCmdBuildAccelerationStructure(scene.recorder, &top, VK_NULL_HANDLE, 0, VK_FALSE, as, nullptr,
                                                        scratch.handle, 0);
            });
        });
    }
    rtrDestroyDevice(d, nullptr);
    vk->destroy(heap_buffer);
    vk->destroy(scratch);
}

TEST_F(MisuseDeviceTest, DevicesThatCannotBe) {
    FaultyVulkan faulty(*vk);
    auto create = [&] {
        EXPECT_EQ(faulty.create(), nullptr);
        return faulty.result;
    };
    auto failing = [&](const char* function, const char* id, const char* says) {
        faulty.fails = function;
        expect_refused(*vk, {{id, kFailed, says, create}});
        faulty.fails.clear();
    };
    failing("vkCreateShaderModule", "kernel", "kernel 'init': vkCreateShaderModule failed (VkResult -2)");
    failing("vkCreateComputePipelines", "kernel", "kernel 'init': vkCreateComputePipelines failed (VkResult -2)");
    failing("vkCreatePipelineLayout", "kernel", "layouts of the kernels");
    failing("vkEnumerateDeviceExtensionProperties", "features", "pDeviceCreateInfo would tell them");
    for (const char* name : {"vkCmdFillBuffer", "vkGetPhysicalDeviceFeatures2"}) {
        faulty.missing = name;
        expect_refused(*vk, {{"entry-point", VK_ERROR_INITIALIZATION_FAILED, name, create}});
    }
    faulty.missing.clear();
    faulty.offered = [](VkPhysicalDeviceLimits& l) { l.maxStorageBufferRange = 1 << 20; };
    expect_refused(*vk, {{"unsupported-device", kAbsent, "maxStorageBufferRange: rtc needs 134217728", create}});
    // Each limit that is missed is named.
    faulty.offered = [](VkPhysicalDeviceLimits& l) { l.maxBoundDescriptorSets = l.maxPushConstantsSize = 1; };
    EXPECT_EQ(create(), kAbsent);
    ASSERT_EQ(vk->runtime_messages.size(), 2u);
    EXPECT_NE(vk->runtime_messages[1].find("maxBoundDescriptorSets"), std::string::npos);
    vk->runtime_messages.clear();
    faulty.offered = nullptr;
    if (!vk->GetBufferDeviceAddress) return;
    faulty.missing = "vkGetBufferDeviceAddress";
    expect_refused(*vk, {{"address-mode", kAbsent, "enable the feature", [&] {
                              EXPECT_EQ(faulty.create(true, true), nullptr);
                              return faulty.result;
                          }}});
}

// What the module names and the device does not have, or was created without.
TEST_F(MisuseDeviceTest, SubgroupsAndExtensions) {
    make_set(1);
    FaultyVulkan faulty(*vk);
    faulty.no_subgroup_operations = true;
    RtrDevice d = faulty.create();
    ASSERT_NE(d, nullptr);
    auto code = module();
    code.insert(code.begin() + 5, {2u << 16 | 17u, 63});  // OpCapability GroupNonUniformArithmetic
    expect_refused(*vk, {{"missing-subgroup-operation", kAbsent, "VK_SUBGROUP_FEATURE_ARITHMETIC_BIT",
                          [&] { return make_pipeline(code, 8, nullptr, nullptr, d); }}});
    VkDeviceCreateInfo made{VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO};
    RtrDeviceCreateInfo info{};
    info.instance = vk->instance;
    info.physicalDevice = vk->physical_device;
    info.device = vk->device;
    info.pfnGetInstanceProcAddr = vk->get_instance_proc_addr;
    auto messenger = vk->messenger_info(true);
    info.pMessenger = &messenger;
    info.pDeviceCreateInfo = &made;
    RtrDevice told = nullptr;
    ASSERT_EQ(rtrCreateDevice(&info, nullptr, &told), VK_SUCCESS);
    const char name[24] = "SPV_KHR_shader_clock";
    code = module();
    std::vector<uint32_t> extension{7u << 16 | 10u, 0, 0, 0, 0, 0, 0};  // OpExtension
    memcpy(&extension[1], name, sizeof name);
    size_t at = 5;
    while ((code[at] & 0xffff) == 17) at += code[at] >> 16;
    code.insert(code.begin() + static_cast<long>(at), extension.begin(), extension.end());
    expect_refused(*vk, {
        {"missing-extension", kAbsent, "VK_KHR_shader_clock; the device was created without it",
         [&] { return make_pipeline(code, 8, nullptr, nullptr, told); }},
    });
    rtrDestroyDevice(told, nullptr);
    rtrDestroyDevice(d, nullptr);
}

}  // namespace
