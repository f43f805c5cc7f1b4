#include "pipeline_statistics.h"

namespace rtc::tools {
namespace {

std::string text_of(const VkPipelineExecutableStatisticKHR& statistic) {
    switch (statistic.format) {
        case VK_PIPELINE_EXECUTABLE_STATISTIC_FORMAT_BOOL32_KHR: return statistic.value.b32 ? "true" : "false";
        case VK_PIPELINE_EXECUTABLE_STATISTIC_FORMAT_INT64_KHR: return std::to_string(statistic.value.i64);
        case VK_PIPELINE_EXECUTABLE_STATISTIC_FORMAT_UINT64_KHR: return std::to_string(statistic.value.u64);
        case VK_PIPELINE_EXECUTABLE_STATISTIC_FORMAT_FLOAT64_KHR: return std::to_string(statistic.value.f64);
        default: return "?";
    }
}

template <typename F>
F load(const Context& context, const char* name) {
    return reinterpret_cast<F>(vkGetDeviceProcAddr(context.device, name));
}

}  // namespace

void want_pipeline_statistics(ContextOptions& options,
                              VkPhysicalDevicePipelineExecutablePropertiesFeaturesKHR& features) {
    features = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PIPELINE_EXECUTABLE_PROPERTIES_FEATURES_KHR};
    features.pipelineExecutableInfo = VK_TRUE;
    options.optional_extensions.push_back(VK_KHR_PIPELINE_EXECUTABLE_PROPERTIES_EXTENSION_NAME);
    options.optional_features.push_back({VK_KHR_PIPELINE_EXECUTABLE_PROPERTIES_EXTENSION_NAME, &features});
}

VkPipelineCreateFlags statistics_flag(const Context& context) {
    return context.has_extension(VK_KHR_PIPELINE_EXECUTABLE_PROPERTIES_EXTENSION_NAME)
               ? VK_PIPELINE_CREATE_CAPTURE_STATISTICS_BIT_KHR
               : 0;
}

std::vector<std::pair<std::string, std::string>> pipeline_statistics(const Context& context, VkPipeline pipeline) {
    std::vector<std::pair<std::string, std::string>> out;
    if (!statistics_flag(context)) return out;
    const auto executables =
        load<PFN_vkGetPipelineExecutablePropertiesKHR>(context, "vkGetPipelineExecutablePropertiesKHR");
    const auto statistics =
        load<PFN_vkGetPipelineExecutableStatisticsKHR>(context, "vkGetPipelineExecutableStatisticsKHR");
    VkPipelineInfoKHR info{VK_STRUCTURE_TYPE_PIPELINE_INFO_KHR};
    info.pipeline = pipeline;
    uint32_t count = 0;
    executables(context.device, &info, &count, nullptr);
    for (uint32_t i = 0; i < count; ++i) {
        VkPipelineExecutableInfoKHR executable{VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_INFO_KHR};
        executable.pipeline = pipeline;
        executable.executableIndex = i;
        uint32_t values = 0;
        statistics(context.device, &executable, &values, nullptr);
        std::vector<VkPipelineExecutableStatisticKHR> list(
            values, VkPipelineExecutableStatisticKHR{VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_STATISTIC_KHR});
        statistics(context.device, &executable, &values, list.data());
        for (const VkPipelineExecutableStatisticKHR& statistic : list)
            out.emplace_back(statistic.name, text_of(statistic));
    }
    return out;
}

}  // namespace rtc::tools
