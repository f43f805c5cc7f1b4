// The device a benchmark runs on, made so that rtc and the device's own ray tracing can run on it.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "../native/executor.h"
#include "rtc_device.h"

namespace rtc::bench {

// `native`: of "nv", "khr", "auto" (what the device has) and "none". `statistics`: rtc's pipelines keep what the driver
// tells of them (pipeline_statistics.h). Throws tools::Error.
class BenchDevice {
  public:
    BenchDevice(const std::string& device, const std::vector<std::string>& native, bool validate,
                bool statistics = false);

    std::vector<native::Requirements::Kind> kinds;
    std::unique_ptr<tools::Context> context;
    std::unique_ptr<tools::RtcDevice> rtc;
    std::string description;
    // Seconds that what `record` records takes: by timestamps on a GPU. Drivers that run on the CPU are timed by the
    // process's CPU time over the number of hardware threads, which other programs on the machine change little.
    double time(const std::function<void(VkCommandBuffer)>& record) const;
    bool is_cpu() const { return context->properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU; }

  private:
    VkPhysicalDevicePipelineExecutablePropertiesFeaturesKHR statistics_features_{};
    std::vector<std::unique_ptr<native::Requirements>> requirements_;  // the context's features lie in them
    std::unique_ptr<tools::GpuTimer> timer_;
};

double median_of(std::vector<double> values);  // 0 when there are none

}  // namespace rtc::bench
