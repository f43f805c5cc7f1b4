// One Vulkan device, ready to compute: instance, device, queue, commands,
// validation. Programs that need extensions (native ray tracing) ask for them
// by name and chain their feature structures.
#pragma once

#include <vulkan/vulkan.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace rtc::tools {

struct ContextOptions {
    // An index into the loader's list, or a part of the device's name (any case). Empty: the
    // environment variable RTC_DEVICE, else the first device of the best kind.
    std::string device;
    // Validation with synchronisation validation. On as well when RTC_VALIDATION=1 is set.
    bool validate = false;
    std::vector<const char*> required_extensions;  // device extensions; missing: an Error naming them
    std::vector<const char*> optional_extensions;  // enabled where present, see Context::has_extension
    // Structures appended to the device's pNext chain (features of the extensions above).
    void* features = nullptr;
    // Of an optional extension, appended where that is present.
    struct OptionalFeatures {
        const char* extension;
        void* features;
    };
    std::vector<OptionalFeatures> optional_features;
    // Enable every core feature (1.0 to 1.3) the device has, so that any shader a user brings runs.
    // Off: none at all, which is what rtc itself needs.
    bool all_core_features = false;
    bool print_device = true;  // "device: NAME (driver ...)" on stdout
};

// What vkEnumeratePhysicalDevices lists, without creating a device.
struct DeviceInfo {
    uint32_t index = 0;
    VkPhysicalDevice physical = VK_NULL_HANDLE;
    VkPhysicalDeviceProperties properties{};
    VkPhysicalDeviceDriverProperties driver{};
};

class Context {
  public:
    explicit Context(const ContextOptions& options = {});
    ~Context();
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;

    VkInstance instance = VK_NULL_HANDLE;
    VkPhysicalDevice physical = VK_NULL_HANDLE;
    VkDevice device = VK_NULL_HANDLE;
    VkQueue queue = VK_NULL_HANDLE;
    uint32_t queue_family = 0;
    VkCommandPool pool = VK_NULL_HANDLE;
    VkPhysicalDeviceProperties properties{};
    VkPhysicalDeviceDriverProperties driver{};
    VkPhysicalDeviceMemoryProperties memory{};
    VkPhysicalDeviceFeatures features{};  // as enabled
    bool device_addresses = false;        // bufferDeviceAddress was enabled

    bool has_extension(const char* name) const;
    // First memory type of `type_bits` with all of `wanted`; ~0u if there is none.
    uint32_t memory_type(uint32_t type_bits, VkMemoryPropertyFlags wanted) const;

    VkCommandBuffer begin_commands() const;
    // Ends, submits, waits for the device, frees. A lost device is an Error.
    void submit_and_wait(VkCommandBuffer commands) const;
    void run(const std::function<void(VkCommandBuffer)>& record) const;

    template <typename Function>
    Function device_function(const char* name) const {
        return reinterpret_cast<Function>(vkGetDeviceProcAddr(device, name));
    }

    bool validating() const;
    // Warnings and errors of the validation layers so far, in order.
    const std::vector<std::string>& validation_messages() const;
    // Throws an Error when the layers said anything. Programs call it last.
    void require_silent_validation() const;

  private:
    struct Validation;
    std::unique_ptr<Validation> validation_;
    std::vector<std::string> extensions_;
};

// Keeps an instance alive for listing devices (rtc-info).
class DeviceList {
  public:
    explicit DeviceList(bool validate = false);
    ~DeviceList();
    DeviceList(const DeviceList&) = delete;
    DeviceList& operator=(const DeviceList&) = delete;
    VkInstance instance = VK_NULL_HANDLE;
    std::vector<DeviceInfo> devices;
};

// The device an option names: an index, or a part of describe_device() in any case. Empty: RTC_DEVICE,
// else the best kind. Throws Error listing what there is.
const DeviceInfo& select_device(const std::vector<DeviceInfo>& devices, std::string wanted);

// "NAME (DRIVER INFO), Vulkan x.y.z"
std::string describe_device(const VkPhysicalDeviceProperties& properties,
                            const VkPhysicalDeviceDriverProperties& driver);

// Seconds on the device between two points of a command buffer.
class GpuTimer {
  public:
    explicit GpuTimer(const Context& context, uint32_t pairs = 1);
    ~GpuTimer();
    GpuTimer(const GpuTimer&) = delete;
    GpuTimer& operator=(const GpuTimer&) = delete;
    void reset(VkCommandBuffer commands) const;
    void begin(VkCommandBuffer commands, uint32_t pair = 0) const;
    void end(VkCommandBuffer commands, uint32_t pair = 0) const;
    double seconds(uint32_t pair = 0) const;  // after the commands have completed
  private:
    const Context& context_;
    VkQueryPool pool_ = VK_NULL_HANDLE;
    uint32_t pairs_ = 0;
};

}  // namespace rtc::tools
