// What the driver tells of a compiled pipeline: registers, spills, code size.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "vulkan_context.h"

namespace rtc::tools {

// Lets a Context of these options be asked for statistics, where the device has
// VK_KHR_pipeline_executable_properties. `features` must live until the Context is made.
void want_pipeline_statistics(ContextOptions& options,
                              VkPhysicalDevicePipelineExecutablePropertiesFeaturesKHR& features);

// For VkComputePipelineCreateInfo::flags; 0 where the device tells nothing.
VkPipelineCreateFlags statistics_flag(const Context& context);

// (name, value) of every statistic of every executable of a pipeline made with that flag; empty without.
std::vector<std::pair<std::string, std::string>> pipeline_statistics(const Context& context, VkPipeline pipeline);

}  // namespace rtc::tools
