// The descriptor sets of a job: layouts, pool, sets, contents.
#pragma once

#include <vulkan/vulkan.h>

#include <functional>
#include <vector>

#include "ray_tracing_job.h"
#include "vulkan_context.h"

namespace rtc::tools {

// Bindings of one set that somebody else writes.
struct ExtraBindings {
    uint32_t set = 0;
    std::vector<VkDescriptorSetLayoutBinding> bindings;
};

class JobDescriptors {
  public:
    // `structure_type` is what an acceleration structure's descriptor is to the executor, which writes
    // those itself through `write_structure(set, binding, element)`.
    JobDescriptors(const Context& context, const std::vector<JobBinding>& bindings, VkShaderStageFlags stages,
                   VkDescriptorType structure_type,
                   const std::function<void(VkDescriptorSet, uint32_t, uint32_t)>& write_structure,
                   const ExtraBindings& extra = {});
    ~JobDescriptors();
    JobDescriptors(const JobDescriptors&) = delete;
    JobDescriptors& operator=(const JobDescriptors&) = delete;

    // From set 0 up to the highest used.
    std::vector<VkDescriptorSetLayout> layouts;
    std::vector<VkDescriptorSet> sets;

  private:
    VkDevice device_;
    VkDescriptorPool pool_ = VK_NULL_HANDLE;
};

}  // namespace rtc::tools
