// A test that launches: one descriptor set of the application (mostly storage buffers) and
// one pipeline from a hand-written module.
#pragma once

#include <vector>

#include "vulkan_harness.h"

class LaunchTest : public RuntimeTest {
  protected:
    void TearDown() override {
        if (vk) {
            rtrDestroyPipeline(rtr, pipeline, nullptr);
            if (pool) vk->DestroyDescriptorPool(vk->device, pool, nullptr);
            if (layout) vk->DestroyDescriptorSetLayout(vk->device, layout, nullptr);
        }
        RuntimeTest::TearDown();
    }

    // Storage buffers at bindings 0 to storage_buffers - 1, and more.
    void make_set(uint32_t storage_buffers, std::vector<VkDescriptorSetLayoutBinding> more = {}) {
        for (uint32_t i = 0; i < storage_buffers; i++)
            more.push_back({i, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr});
        VkDescriptorSetLayoutCreateInfo info{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO};
        info.bindingCount = static_cast<uint32_t>(more.size());
        info.pBindings = more.data();
        ASSERT_EQ(vk->CreateDescriptorSetLayout(vk->device, &info, nullptr, &layout), VK_SUCCESS);
        VkDescriptorPoolSize sizes[] = {{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 100},
                                        {VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER_DYNAMIC, 1},
                                        {VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER, 1}};
        VkDescriptorPoolCreateInfo pool_info{VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO};
        pool_info.maxSets = 1;
        pool_info.poolSizeCount = 3;
        pool_info.pPoolSizes = sizes;
        vk->CreateDescriptorPool(vk->device, &pool_info, nullptr, &pool);
        VkDescriptorSetAllocateInfo allocate{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO};
        allocate.descriptorPool = pool;
        allocate.descriptorSetCount = 1;
        allocate.pSetLayouts = &layout;
        ASSERT_EQ(vk->AllocateDescriptorSets(vk->device, &allocate, &set), VK_SUCCESS);
    }

    void write(uint32_t binding, VkDescriptorBufferInfo info) {
        VkWriteDescriptorSet w{VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
        w.dstSet = set;
        w.dstBinding = binding;
        w.descriptorCount = 1;
        w.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
        w.pBufferInfo = &info;
        vk->UpdateDescriptorSets(vk->device, 1, &w, 0, nullptr);
    }

    VkResult make_pipeline(const std::vector<uint32_t>& code, uint32_t push_bytes,
                           const RtrTraceOptions* options = nullptr,
                           const VkSpecializationInfo* specialization = nullptr, RtrDevice device = nullptr,
                           VkPipelineCreateFlags flags = 0) {
        VkPushConstantRange range{VK_SHADER_STAGE_COMPUTE_BIT, 0, push_bytes};
        RtrRayTracingPipelineCreateInfo info{};
        info.flags = flags;
        info.pCode = code.data();
        info.codeSize = code.size() * 4;
        info.setLayoutCount = layout ? 1 : 0;
        info.pSetLayouts = &layout;
        info.pushConstantRangeCount = 1;
        info.pPushConstantRanges = &range;
        info.pOptions = options;
        info.pSpecializationInfo = specialization;
        const VkResult result =
            rtrCreateRayTracingPipeline(device ? device : rtr, VK_NULL_HANDLE, &info, nullptr, &pipeline);
        // These modules hardly trace: that they do not check is no news.
        const std::string id = "not-checked";
        unchecked += std::erase_if(vk->runtime_messages,
                                   [&](const std::string& m) { return m.rfind(id + ':', 0) == 0; });
        return result;
    }

    VkDescriptorSetLayout layout = VK_NULL_HANDLE;
    VkDescriptorPool pool = VK_NULL_HANDLE;
    VkDescriptorSet set = VK_NULL_HANDLE;
    RtrPipeline pipeline = nullptr;
    size_t unchecked = 0; // warnings that a module does not check
};

// Launches on an RtrDevice of the test's own, with validation.
class ValidatedLaunchTest : public LaunchTest {
  protected:
    explicit ValidatedLaunchTest(bool messages = true, bool addresses = false)
        : messages_(messages), addresses_(addresses) {}

    void SetUp() override {
        RuntimeTest::SetUp();
        if (!vk) return;
        RtrDeviceCreateInfo info{};
        info.instance = vk->instance;
        info.physicalDevice = vk->physical_device;
        info.device = vk->device;
        info.pfnGetInstanceProcAddr = vk->get_instance_proc_addr;
        auto messenger = vk->messenger_info(true);
        if (messages_) info.pMessenger = &messenger;
        info.bufferDeviceAddress = addresses_ && vk->GetBufferDeviceAddress != nullptr;
        info.validation = VK_TRUE;
        ASSERT_EQ(rtrCreateDevice(&info, nullptr, &rtr), VK_SUCCESS);
    }
    void TearDown() override {
        auto device = rtr;
        LaunchTest::TearDown();
        if (vk) rtrDestroyDevice(device, nullptr);
    }

  private:
    bool messages_, addresses_;
};
