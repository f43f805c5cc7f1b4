// A module that needs a feature, extension or version of SPIR-V that the device lacks, or was
// created without, is refused by name before Vulkan sees it.
#include "launch_fixture.h"
#include "module_util.h"
#include "spv/module_resume.h"

namespace {

constexpr uint32_t kUsed = 1u << RTC_BINDING_PARAMS | 1u << RTC_BINDING_CONTROL | 1u << RTC_BINDING_SCRATCH;

class FeaturesTest : public LaunchTest {
  protected:
    void SetUp() override {
        LaunchTest::SetUp();
        if (vk) make_set(1);
    }

    std::vector<uint32_t> module(const std::vector<uint32_t>& capabilities, const char* extension = nullptr,
                                 uint32_t minor = 3) {
        auto code = with_reflection(module_resume_spv, sizeof module_resume_spv, module_header(kUsed, 1), "");
        std::vector<uint32_t> more;
        for (uint32_t c : capabilities) more.insert(more.end(), {2u << 16 | 17u, c});
        code.insert(code.begin() + 5, more.begin(), more.end());
        if (extension) {
            std::vector<uint32_t> words(strlen(extension) / 4 + 2);
            words[0] = static_cast<uint32_t>(words.size()) << 16 | 10u;
            memcpy(&words[1], extension, strlen(extension));
            size_t at = 5;
            while ((code[at] & 0xffff) == 17) at += code[at] >> 16;
            code.insert(code.begin() + static_cast<long>(at), words.begin(), words.end());
        }
        code[1] = minor << 8 | 1u << 16;
        return code;
    }

    // Deferred, so that Vulkan never sees a module the device cannot take.
    VkResult create(RtrDevice device, const std::vector<uint32_t>& code) {
        VkResult r = make_pipeline(code, 8, nullptr, nullptr, device, VK_PIPELINE_CREATE_DEFER_COMPILE_BIT_NV);
        rtrDestroyPipeline(device, pipeline, nullptr);
        pipeline = nullptr;
        said.clear();
        for (auto& m : vk->runtime_messages)
            if (m.find("not-resumable") == std::string::npos) said += m + "\n";
        vk->runtime_messages.clear();
        return r;
    }

    RtrDevice device(const VkDeviceCreateInfo* made) {
        RtrDeviceCreateInfo info{};
        info.instance = vk->instance;
        info.physicalDevice = vk->physical_device;
        info.device = vk->device;
        info.pfnGetInstanceProcAddr = vk->get_instance_proc_addr;
        auto messenger = vk->messenger_info(true);
        info.pMessenger = &messenger;
        info.pDeviceCreateInfo = made;
        RtrDevice d = nullptr;
        EXPECT_EQ(rtrCreateDevice(&info, nullptr, &d), VK_SUCCESS);
        return d;
    }

    std::string said;
};

constexpr uint32_t kFloat64 = 10, kInt64 = 11, kInt64Atomics = 12, kInt8 = 39, kShaderClock = 5055,
                   kRuntimeArray = 5302, kStorage16 = 4433;

TEST_F(FeaturesTest, WithoutAWordThePhysicalDeviceCounts) {
    auto get = reinterpret_cast<PFN_vkGetPhysicalDeviceFeatures>(
        vk->get_instance_proc_addr(vk->instance, "vkGetPhysicalDeviceFeatures"));
    VkPhysicalDeviceFeatures f{};
    get(vk->physical_device, &f);
    const struct {
        uint32_t capability;
        VkBool32 there;
        const char* name;
    } rows[] = {{kFloat64, f.shaderFloat64, "shaderFloat64"},
                {kInt64, f.shaderInt64, "shaderInt64"},
                {22, f.shaderInt16, "shaderInt16"},
                {41, f.shaderResourceResidency, "shaderResourceResidency"},
                {42, f.shaderResourceMinLod, "shaderResourceMinLod"},
                {25, f.shaderImageGatherExtended, "shaderImageGatherExtended"},
                {49, f.shaderStorageImageExtendedFormats, "shaderStorageImageExtendedFormats"}};
    for (auto& row : rows) {
        SCOPED_TRACE(row.name);
        EXPECT_EQ(create(rtr, module({row.capability})), row.there ? VK_SUCCESS : VK_ERROR_FEATURE_NOT_PRESENT);
        EXPECT_EQ(said.find(std::string("missing-feature: the module needs the feature ") + row.name) == 0,
                  !row.there)
            << said;
    }
}

TEST_F(FeaturesTest, OnlyWhatWasEnabledCounts) {
    VkPhysicalDeviceFeatures core{};
    core.shaderFloat64 = VK_TRUE;
    VkPhysicalDeviceVulkan12Features v12{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES};
    v12.runtimeDescriptorArray = VK_TRUE;
    VkPhysicalDevice16BitStorageFeatures small{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_16BIT_STORAGE_FEATURES};
    small.pNext = &v12;
    small.storageBuffer16BitAccess = VK_TRUE;
    const char* clock = "VK_KHR_shader_clock";
    VkDeviceCreateInfo made{VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO};
    made.pNext = &small;
    made.pEnabledFeatures = &core;
    made.enabledExtensionCount = 1;
    made.ppEnabledExtensionNames = &clock;
    RtrDevice d = device(&made);
    EXPECT_EQ(create(d, module({kFloat64, kRuntimeArray, kStorage16}, "SPV_KHR_shader_clock")), VK_SUCCESS);
    EXPECT_EQ(said, "");
    // All that is missing is told at once.
    EXPECT_EQ(create(d, module({kInt64, kFloat64, kInt64Atomics, kInt8, kShaderClock},
                               "SPV_EXT_shader_atomic_float_add")),
              VK_ERROR_FEATURE_NOT_PRESENT);
    for (const char* name : {"shaderInt64;", "shaderBufferInt64Atomics;", "shaderInt8;", "shaderSubgroupClock;",
                             "VK_EXT_shader_atomic_float;", "was created without it"})
        EXPECT_NE(said.find(name), std::string::npos) << name << " in " << said;
    EXPECT_EQ(said.find("shaderFloat64"), std::string::npos) << said;
    // Either feature of a capability is enough.
    v12.shaderSharedInt64Atomics = VK_TRUE;
    RtrDevice shared = device(&made);
    EXPECT_EQ(create(shared, module({kInt64Atomics})), VK_SUCCESS) << said;
    rtrDestroyDevice(shared, nullptr);
    rtrDestroyDevice(d, nullptr);
}

TEST_F(FeaturesTest, CoreFeaturesInTheChain) {
    VkPhysicalDeviceFeatures2 all{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2};
    all.features.shaderInt64 = VK_TRUE;
    VkDeviceCreateInfo made{VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO};
    made.pNext = &all;
    RtrDevice d = device(&made);
    EXPECT_EQ(create(d, module({kInt64})), VK_SUCCESS) << said;
    EXPECT_EQ(create(d, module({kFloat64})), VK_ERROR_FEATURE_NOT_PRESENT);
    rtrDestroyDevice(d, nullptr);
}

TEST_F(FeaturesTest, VersionsAndSubgroups) {
    VkPhysicalDeviceProperties p;
    vk->GetPhysicalDeviceProperties(vk->physical_device, &p);
    const uint32_t most = p.apiVersion >= VK_API_VERSION_1_3 ? 6 : p.apiVersion >= VK_API_VERSION_1_2 ? 5 : 3;
    EXPECT_EQ(create(rtr, module({}, nullptr, most)), VK_SUCCESS) << said;
    EXPECT_EQ(create(rtr, module({}, nullptr, most + (most == 3 ? 2 : 1))), VK_ERROR_FEATURE_NOT_PRESENT);
    EXPECT_EQ(said.find("spirv-version: "), 0u) << said;
    EXPECT_EQ(create(rtr, module({61})), VK_SUCCESS) << said;  // basic ones are always there
}

}  // namespace
