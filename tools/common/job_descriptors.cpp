#include "job_descriptors.h"

#include <algorithm>
#include <map>

#include "error.h"

namespace rtc::tools {

JobDescriptors::JobDescriptors(
    const Context& context, const std::vector<JobBinding>& bindings, VkShaderStageFlags stages,
    VkDescriptorType structure_type,
    const std::function<void(VkDescriptorSet, uint32_t, uint32_t)>& write_structure, const ExtraBindings& extra)
    : device_(context.device) {
    auto type_of = [&](const JobBinding& binding) {
        return binding.acceleration_structure ? structure_type : binding.type;
    };
    std::map<VkDescriptorType, uint32_t> counts;
    uint32_t set_count = 0;
    for (const JobBinding& binding : bindings) {
        set_count = std::max(set_count, binding.set + 1);
        counts[type_of(binding)] += binding.count;
    }
    if (!extra.bindings.empty()) set_count = std::max(set_count, extra.set + 1);
    for (const VkDescriptorSetLayoutBinding& binding : extra.bindings)
        counts[binding.descriptorType] += binding.descriptorCount;
    if (set_count == 0) return;
    for (uint32_t set = 0; set < set_count; ++set) {
        std::vector<VkDescriptorSetLayoutBinding> list;
        for (const JobBinding& binding : bindings)
            if (binding.set == set)
                list.push_back({binding.binding, type_of(binding), binding.count, stages, nullptr});
        if (set == extra.set) list.insert(list.end(), extra.bindings.begin(), extra.bindings.end());
        VkDescriptorSetLayoutCreateInfo info{};
        info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
        info.bindingCount = uint32_t(list.size());
        info.pBindings = list.data();
        layouts.push_back(VK_NULL_HANDLE);
        check(vkCreateDescriptorSetLayout(device_, &info, nullptr, &layouts.back()),
              "vkCreateDescriptorSetLayout");
    }
    std::vector<VkDescriptorPoolSize> sizes;
    for (const auto& [type, count] : counts) sizes.push_back({type, count});
    VkDescriptorPoolCreateInfo poolInfo{};
    poolInfo.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO;
    poolInfo.maxSets = set_count;
    poolInfo.poolSizeCount = uint32_t(sizes.size());
    poolInfo.pPoolSizes = sizes.data();
    check(vkCreateDescriptorPool(device_, &poolInfo, nullptr, &pool_), "vkCreateDescriptorPool");
    sets.resize(set_count);
    VkDescriptorSetAllocateInfo allocate{};
    allocate.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO;
    allocate.descriptorPool = pool_;
    allocate.descriptorSetCount = set_count;
    allocate.pSetLayouts = layouts.data();
    check(vkAllocateDescriptorSets(device_, &allocate, sets.data()), "vkAllocateDescriptorSets");

    for (const JobBinding& binding : bindings) {
        if (binding.acceleration_structure) {
            for (uint32_t element = 0; element < binding.count; ++element)
                write_structure(sets[binding.set], binding.binding, element);
            continue;
        }
        VkWriteDescriptorSet write{};
        write.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
        write.dstSet = sets[binding.set];
        write.dstBinding = binding.binding;
        write.descriptorCount = binding.count;
        write.descriptorType = binding.type;
        write.pBufferInfo = binding.buffers.data();
        write.pImageInfo = binding.images.data();
        write.pTexelBufferView = binding.texel_buffers.data();
        vkUpdateDescriptorSets(device_, 1, &write, 0, nullptr);
    }
}

JobDescriptors::~JobDescriptors() {
    vkDestroyDescriptorPool(device_, pool_, nullptr);
    for (VkDescriptorSetLayout layout : layouts) vkDestroyDescriptorSetLayout(device_, layout, nullptr);
}

}  // namespace rtc::tools
