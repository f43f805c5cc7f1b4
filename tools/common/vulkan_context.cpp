#include "vulkan_context.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>

#include "error.h"

namespace rtc::tools {

namespace {

struct Messages {
    std::mutex mutex;
    std::vector<std::string> texts;
};

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";

bool flag_from_environment(const char* name) {
    const char* value = std::getenv(name);
    return value && *value && std::strcmp(value, "0") != 0;
}

VKAPI_ATTR VkBool32 VKAPI_CALL on_message(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                          VkDebugUtilsMessageTypeFlagsEXT,
                                          const VkDebugUtilsMessengerCallbackDataEXT* data, void* user) {
    // Loader chatter about drivers that do not fit this machine is not about us.
    if (data->pMessageIdName && std::strcmp(data->pMessageIdName, "Loader Message") == 0) return VK_FALSE;
    // What a driver's own SPIR-V reader remarks on is not validation: Mesa warns of capabilities that its device
    // need not have and of valid SPIR-V that it only dislikes.
    // (Mesa 22.3 puts "SPIR-V offset N: " in front.)
    if (std::strstr(data->pMessage, "SPIR-V WARNING:")) {
        std::fprintf(stderr, "driver: %s\n", data->pMessage);
        return VK_FALSE;
    }
    // A layer that is older than VK_KHR_ray_tracing_position_fetch knows neither the extension nor the structure that
    // switches it on.
    if (std::strstr(data->pMessage, "unknown VkStructureType (1000481000)") ||
        std::strstr(data->pMessage, "Device Extension VK_KHR_ray_tracing_position_fetch is not"))
        return VK_FALSE;
    auto messages = static_cast<Messages*>(user);
    std::lock_guard lock(messages->mutex);
    messages->texts.push_back(data->pMessage);
    std::fprintf(stderr, "validation: %s\n", data->pMessage);
    return VK_FALSE;
}

VkInstance create_instance(bool validate, const VkDebugUtilsMessengerCreateInfoEXT* messenger) {
    uint32_t version = VK_API_VERSION_1_1;
    vkEnumerateInstanceVersion(&version);
    VkApplicationInfo application{};
    application.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
    application.pApplicationName = "rtc tools";
    application.apiVersion = std::min(version, uint32_t(VK_API_VERSION_1_3));

    const VkValidationFeatureEnableEXT enabled[] = {
        VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT};
    VkValidationFeaturesEXT validation{};
    validation.sType = VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT;
    validation.pNext = messenger;
    validation.enabledValidationFeatureCount = 1;
    validation.pEnabledValidationFeatures = enabled;

    const char* extensions[] = {VK_EXT_DEBUG_UTILS_EXTENSION_NAME, VK_EXT_VALIDATION_FEATURES_EXTENSION_NAME};
    VkInstanceCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
    info.pApplicationInfo = &application;
    if (validate) {
        info.pNext = &validation;
        info.enabledLayerCount = 1;
        info.ppEnabledLayerNames = &kValidationLayer;
        info.enabledExtensionCount = 2;
        info.ppEnabledExtensionNames = extensions;
    }
    VkInstance instance = VK_NULL_HANDLE;
    VkResult result = vkCreateInstance(&info, nullptr, &instance);
    if (result == VK_ERROR_LAYER_NOT_PRESENT)
        throw Error(
            "validation was asked for, but VK_LAYER_KHRONOS_validation is not installed "
            "(Debian package vulkan-validationlayers)");
    if (result == VK_ERROR_INCOMPATIBLE_DRIVER)
        throw Error("no Vulkan driver found (Debian package mesa-vulkan-drivers brings lavapipe)");
    check(result, "vkCreateInstance");
    return instance;
}

std::vector<DeviceInfo> enumerate(VkInstance instance) {
    uint32_t count = 0;
    vkEnumeratePhysicalDevices(instance, &count, nullptr);
    std::vector<VkPhysicalDevice> handles(count);
    vkEnumeratePhysicalDevices(instance, &count, handles.data());
    std::vector<DeviceInfo> devices;
    for (uint32_t i = 0; i < count; ++i) {
        DeviceInfo info;
        info.index = i;
        info.physical = handles[i];
        info.driver.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES;
        vkGetPhysicalDeviceProperties(handles[i], &info.properties);
        if (info.properties.apiVersion >= VK_API_VERSION_1_2) {
            VkPhysicalDeviceProperties2 properties2{};
            properties2.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2;
            properties2.pNext = &info.driver;
            vkGetPhysicalDeviceProperties2(handles[i], &properties2);
            info.driver.pNext = nullptr;
        }
        devices.push_back(info);
    }
    return devices;
}

std::string lower(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
    return text;
}

int rank(const DeviceInfo& info) {
    switch (info.properties.deviceType) {
        case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
            return 4;
        case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
            return 3;
        case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
            return 2;
        default:
            return 1;
    }
}

std::vector<std::string> device_extensions(VkPhysicalDevice physical) {
    uint32_t count = 0;
    vkEnumerateDeviceExtensionProperties(physical, nullptr, &count, nullptr);
    std::vector<VkExtensionProperties> properties(count);
    vkEnumerateDeviceExtensionProperties(physical, nullptr, &count, properties.data());
    std::vector<std::string> names;
    for (const VkExtensionProperties& extension : properties) names.push_back(extension.extensionName);
    return names;
}

uint32_t compute_family(VkPhysicalDevice physical) {
    uint32_t count = 0;
    vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, families.data());
    for (uint32_t i = 0; i < count; ++i)
        if (families[i].queueFlags & VK_QUEUE_COMPUTE_BIT) return i;
    throw Error("the device has no compute queue");
}

// Every core feature the device has, or only device addresses, in one chain that vkCreateDevice takes back.
struct CoreFeatures {
    VkPhysicalDeviceVulkan13Features v13{};
    VkPhysicalDeviceVulkan12Features v12{};
    VkPhysicalDeviceVulkan11Features v11{};
    VkPhysicalDeviceFeatures2 v10{};

    CoreFeatures(VkPhysicalDevice physical, uint32_t apiVersion, bool all) {
        v10.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2;
        v11.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_FEATURES;
        v12.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES;
        v13.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES;
        if (apiVersion < VK_API_VERSION_1_2 && !all) return;
        if (apiVersion >= VK_API_VERSION_1_2) {
            v10.pNext = &v11;
            v11.pNext = &v12;
        }
        if (apiVersion >= VK_API_VERSION_1_3) v12.pNext = &v13;
        vkGetPhysicalDeviceFeatures2(physical, &v10);
        // Costs speed everywhere and hides errors; capture replay changes address allocation.
        v10.features.robustBufferAccess = VK_FALSE;
        v13.robustImageAccess = VK_FALSE;
        v12.bufferDeviceAddressCaptureReplay = VK_FALSE;
        if (all) return;
        // Nothing optional but addresses, which decide how acceleration structures are best reached.
        const VkBool32 addresses = v12.bufferDeviceAddress;
        v10 = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2};
        v12 = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES};
        v12.bufferDeviceAddress = addresses;
        if (addresses) v10.pNext = &v12;
    }

    void append(void* more) {
        auto last = reinterpret_cast<VkBaseOutStructure*>(&v10);
        while (last->pNext) last = last->pNext;
        last->pNext = static_cast<VkBaseOutStructure*>(more);
    }
};

}  // namespace

// Outlives the instance: the layers report leaks from vkDestroyInstance too.
struct Context::Validation {
    VkDebugUtilsMessengerEXT messenger = VK_NULL_HANDLE;
    Messages messages;
    bool on = false;
};

std::string describe_device(const VkPhysicalDeviceProperties& properties,
                            const VkPhysicalDeviceDriverProperties& driver) {
    std::string text = properties.deviceName;
    if (driver.driverName[0]) text += std::string(" (") + driver.driverName + " " + driver.driverInfo + ")";
    const uint32_t v = properties.apiVersion;
    return text + ", Vulkan " + std::to_string(VK_API_VERSION_MAJOR(v)) + "." +
           std::to_string(VK_API_VERSION_MINOR(v)) + "." + std::to_string(VK_API_VERSION_PATCH(v));
}

const DeviceInfo& select_device(const std::vector<DeviceInfo>& devices, std::string wanted) {
    if (devices.empty()) throw Error("no Vulkan device found");
    if (wanted.empty()) {
        const char* fromEnvironment = std::getenv("RTC_DEVICE");
        if (fromEnvironment) wanted = fromEnvironment;
    }
    if (wanted.empty())
        return *std::max_element(devices.begin(), devices.end(),
                                 [](const DeviceInfo& a, const DeviceInfo& b) { return rank(a) < rank(b); });
    std::string list;
    for (const DeviceInfo& info : devices)
        list += "\n  " + std::to_string(info.index) + ": " + describe_device(info.properties, info.driver);
    if (std::all_of(wanted.begin(), wanted.end(), [](unsigned char c) { return std::isdigit(c); })) {
        const size_t index = wanted.size() < 6 ? size_t(std::stoul(wanted)) : devices.size();
        if (index < devices.size()) return devices[index];
        throw Error("no device " + wanted + "; there are:" + list);
    }
    for (const DeviceInfo& info : devices)
        if (lower(describe_device(info.properties, info.driver)).find(lower(wanted)) != std::string::npos)
            return info;
    throw Error("no device is called '" + wanted + "'; there are:" + list);
}

DeviceList::DeviceList(bool validate) {
    instance = create_instance(validate, nullptr);
    devices = enumerate(instance);
}

DeviceList::~DeviceList() { vkDestroyInstance(instance, nullptr); }

Context::Context(const ContextOptions& options) : validation_(std::make_unique<Validation>()) {
    validation_->on = options.validate || flag_from_environment("RTC_VALIDATION");
    VkDebugUtilsMessengerCreateInfoEXT messenger{};
    messenger.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT;
    messenger.messageSeverity =
        VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
    messenger.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_GENERAL_BIT_EXT |
                            VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT;
    messenger.pfnUserCallback = on_message;
    messenger.pUserData = &validation_->messages;
    instance = create_instance(validation_->on, validation_->on ? &messenger : nullptr);
    if (validation_->on) {
        auto create = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
            vkGetInstanceProcAddr(instance, "vkCreateDebugUtilsMessengerEXT"));
        check(create(instance, &messenger, nullptr, &validation_->messenger),
              "vkCreateDebugUtilsMessengerEXT");
    }

    const std::vector<DeviceInfo> devices = enumerate(instance);
    const DeviceInfo& chosen = select_device(devices, options.device);
    physical = chosen.physical;
    properties = chosen.properties;
    driver = chosen.driver;
    if (properties.apiVersion < VK_API_VERSION_1_1)
        throw Error(std::string(properties.deviceName) + " offers Vulkan 1.0 only; rtc needs 1.1");
    vkGetPhysicalDeviceMemoryProperties(physical, &memory);
    queue_family = compute_family(physical);

    const std::vector<std::string> present = device_extensions(physical);
    auto is_present = [&](const char* name) {
        return std::find(present.begin(), present.end(), name) != present.end();
    };
    std::string missing;
    std::vector<const char*> names;
    for (const char* name : options.required_extensions) {
        if (!is_present(name)) missing += std::string(missing.empty() ? "" : ", ") + name;
        names.push_back(name);
    }
    if (!missing.empty()) throw Error(std::string(properties.deviceName) + " lacks " + missing);
    for (const char* name : options.optional_extensions)
        if (is_present(name)) names.push_back(name);
    extensions_.assign(names.begin(), names.end());

    CoreFeatures core(physical, properties.apiVersion, options.all_core_features);
    if (options.features) core.append(options.features);
    for (const ContextOptions::OptionalFeatures& optional : options.optional_features)
        if (has_extension(optional.extension)) core.append(optional.features);
    features = core.v10.features;
    device_addresses = core.v12.bufferDeviceAddress == VK_TRUE;

    const float priority = 1.0f;
    VkDeviceQueueCreateInfo queueInfo{};
    queueInfo.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO;
    queueInfo.queueFamilyIndex = queue_family;
    queueInfo.queueCount = 1;
    queueInfo.pQueuePriorities = &priority;
    VkDeviceCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
    info.pNext = &core.v10;
    info.queueCreateInfoCount = 1;
    info.pQueueCreateInfos = &queueInfo;
    info.enabledExtensionCount = uint32_t(names.size());
    info.ppEnabledExtensionNames = names.data();
    check(vkCreateDevice(physical, &info, nullptr, &device), "vkCreateDevice");
    vkGetDeviceQueue(device, queue_family, 0, &queue);

    VkCommandPoolCreateInfo poolInfo{};
    poolInfo.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
    poolInfo.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
    poolInfo.queueFamilyIndex = queue_family;
    check(vkCreateCommandPool(device, &poolInfo, nullptr, &pool), "vkCreateCommandPool");

    if (options.print_device) {
        std::printf("device: %s\n", describe_device(properties, driver).c_str());
        std::fflush(stdout);
    }
}

Context::~Context() {
    if (device) {
        vkDestroyCommandPool(device, pool, nullptr);
        vkDestroyDevice(device, nullptr);
    }
    if (validation_->messenger) {
        auto destroy = reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
            vkGetInstanceProcAddr(instance, "vkDestroyDebugUtilsMessengerEXT"));
        destroy(instance, validation_->messenger, nullptr);
    }
    vkDestroyInstance(instance, nullptr);
}

bool Context::has_extension(const char* name) const {
    return std::find(extensions_.begin(), extensions_.end(), name) != extensions_.end();
}

uint32_t Context::memory_type(uint32_t type_bits, VkMemoryPropertyFlags wanted) const {
    for (uint32_t i = 0; i < memory.memoryTypeCount; ++i)
        if ((type_bits & (1u << i)) && (memory.memoryTypes[i].propertyFlags & wanted) == wanted) return i;
    return ~0u;
}

VkCommandBuffer Context::begin_commands() const {
    VkCommandBufferAllocateInfo allocate{};
    allocate.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
    allocate.commandPool = pool;
    allocate.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
    allocate.commandBufferCount = 1;
    VkCommandBuffer commands = VK_NULL_HANDLE;
    check(vkAllocateCommandBuffers(device, &allocate, &commands), "vkAllocateCommandBuffers");
    VkCommandBufferBeginInfo begin{};
    begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
    begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    check(vkBeginCommandBuffer(commands, &begin), "vkBeginCommandBuffer");
    return commands;
}

void Context::submit_and_wait(VkCommandBuffer commands) const {
    check(vkEndCommandBuffer(commands), "vkEndCommandBuffer");
    VkFenceCreateInfo fenceInfo{};
    fenceInfo.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
    VkFence fence = VK_NULL_HANDLE;
    check(vkCreateFence(device, &fenceInfo, nullptr, &fence), "vkCreateFence");
    VkSubmitInfo submit{};
    submit.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
    submit.commandBufferCount = 1;
    submit.pCommandBuffers = &commands;
    VkResult result = vkQueueSubmit(queue, 1, &submit, fence);
    if (result == VK_SUCCESS) result = vkWaitForFences(device, 1, &fence, VK_TRUE, UINT64_MAX);
    vkDestroyFence(device, fence, nullptr);
    vkFreeCommandBuffers(device, pool, 1, &commands);
    check(result, "submitting commands");
}

void Context::run(const std::function<void(VkCommandBuffer)>& record) const {
    VkCommandBuffer commands = begin_commands();
    record(commands);
    submit_and_wait(commands);
}

bool Context::validating() const { return validation_->on; }

const std::vector<std::string>& Context::validation_messages() const { return validation_->messages.texts; }

void Context::require_silent_validation() const {
    const size_t count = validation_->messages.texts.size();
    if (count)
        throw Error(std::to_string(count) +
                    " message(s) from the validation layers, first: " + validation_->messages.texts.front());
    if (validation_->on) std::printf("validation: silent (synchronisation validation included)\n");
}

GpuTimer::GpuTimer(const Context& context, uint32_t pairs) : context_(context) {
    VkQueryPoolCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO;
    info.queryType = VK_QUERY_TYPE_TIMESTAMP;
    info.queryCount = pairs * 2;
    check(vkCreateQueryPool(context.device, &info, nullptr, &pool_), "vkCreateQueryPool");
    pairs_ = pairs;
}

GpuTimer::~GpuTimer() { vkDestroyQueryPool(context_.device, pool_, nullptr); }

void GpuTimer::reset(VkCommandBuffer commands) const { vkCmdResetQueryPool(commands, pool_, 0, pairs_ * 2); }

void GpuTimer::begin(VkCommandBuffer commands, uint32_t pair) const {
    vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, pool_, pair * 2);
}

void GpuTimer::end(VkCommandBuffer commands, uint32_t pair) const {
    vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, pool_, pair * 2 + 1);
}

double GpuTimer::seconds(uint32_t pair) const {
    uint64_t ticks[2] = {};
    check(vkGetQueryPoolResults(context_.device, pool_, pair * 2, 2, sizeof ticks, ticks, sizeof ticks[0],
                                VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT),
          "vkGetQueryPoolResults");
    return double(ticks[1] - ticks[0]) * context_.properties.limits.timestampPeriod * 1e-9;
}

}  // namespace rtc::tools
