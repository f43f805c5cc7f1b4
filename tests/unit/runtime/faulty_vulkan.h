// A Vulkan that lies to an RtrDevice of the test's own: other limits, functions that fail or are
// not there. For diagnostics that a healthy device never provokes.
#pragma once

#include <functional>
#include <string>

#include "vulkan_harness.h"

class FaultyVulkan {
  public:
    explicit FaultyVulkan(Vulkan& vk);
    ~FaultyVulkan();
    FaultyVulkan(const FaultyVulkan&) = delete;
    FaultyVulkan& operator=(const FaultyVulkan&) = delete;

    // What the support query sees, and what the RtrDevice remembers and checks calls against.
    std::function<void(VkPhysicalDeviceLimits&)> offered, remembered;
    std::string missing;  // vkGet…ProcAddr has no such function, "vkCmdFillBuffer", nor KHR's or EXT's
    std::string fails;    // this function returns VK_ERROR_OUT_OF_DEVICE_MEMORY, while set
    bool no_subgroup_operations = false;
    VkPhysicalDeviceType type = VK_PHYSICAL_DEVICE_TYPE_MAX_ENUM;  // of the device, unless it is this
    bool null_addresses = false;  // buffers have the device address 0

    // The device is the test's to destroy; `result` is what creation returned.
    RtrDevice create(bool messages = true, bool addresses = false);
    VkResult result = VK_SUCCESS;

  private:
    Vulkan& vk_;
};
