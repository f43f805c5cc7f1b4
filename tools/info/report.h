// What rtc-info finds out about a device, and how it says so.
#pragma once

#include <rtc/runtime.h>

#include <string>
#include <vector>

#include "vulkan_context.h"

namespace rtc::tools {

struct DeviceReport {
    DeviceInfo device;
    RtrPhysicalDeviceSupport support{};
    std::vector<std::string> native;  // ray tracing extensions the driver has
    bool probed = false;
    RtrFloatProbe probe{};
    std::string probe_problem;  // why there is no probe
};

// `probe` runs a shader on the device.
DeviceReport examine(const DeviceList& list, const DeviceInfo& device, bool probe);

std::string as_text(const DeviceReport& report);
std::string as_json(const std::vector<DeviceReport>& reports);

}  // namespace rtc::tools
