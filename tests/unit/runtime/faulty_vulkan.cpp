#include "faulty_vulkan.h"

namespace {

FaultyVulkan* current;
PFN_vkGetInstanceProcAddr real_instance_proc;
PFN_vkGetDeviceProcAddr real_device_proc;
PFN_vkGetPhysicalDeviceProperties2 real_properties;
PFN_vkEnumerateDeviceExtensionProperties real_extensions;

// name, parameters, arguments
#define FAILING(X)                                                                                                 \
    X(CreateBufferView, (VkDevice d, const VkBufferViewCreateInfo* i, const VkAllocationCallbacks* a,              \
                         VkBufferView* o), (d, i, a, o))                                                           \
    X(CreateShaderModule, (VkDevice d, const VkShaderModuleCreateInfo* i, const VkAllocationCallbacks* a,          \
                           VkShaderModule* o), (d, i, a, o))                                                       \
    X(CreateComputePipelines, (VkDevice d, VkPipelineCache c, uint32_t n, const VkComputePipelineCreateInfo* i,    \
                               const VkAllocationCallbacks* a, VkPipeline* o), (d, c, n, i, a, o))                 \
    X(CreatePipelineLayout, (VkDevice d, const VkPipelineLayoutCreateInfo* i, const VkAllocationCallbacks* a,      \
                             VkPipelineLayout* o), (d, i, a, o))                                                   \
    X(CreateDescriptorSetLayout, (VkDevice d, const VkDescriptorSetLayoutCreateInfo* i,                            \
                                  const VkAllocationCallbacks* a, VkDescriptorSetLayout* o), (d, i, a, o))         \
    X(CreateDescriptorPool, (VkDevice d, const VkDescriptorPoolCreateInfo* i, const VkAllocationCallbacks* a,      \
                             VkDescriptorPool* o), (d, i, a, o))

#define X(name, parameters, arguments)                                                     \
    PFN_vk##name real_##name;                                                              \
    VKAPI_ATTR VkResult VKAPI_CALL faulty_##name parameters {                              \
        return current->fails == "vk" #name ? VK_ERROR_OUT_OF_DEVICE_MEMORY : real_##name arguments; \
    }
FAILING(X)
#undef X

VKAPI_ATTR VkResult VKAPI_CALL faulty_extensions(VkPhysicalDevice p, const char* layer, uint32_t* count,
                                                 VkExtensionProperties* out) {
    if (current->fails == "vkEnumerateDeviceExtensionProperties") return VK_ERROR_OUT_OF_DEVICE_MEMORY;
    return real_extensions(p, layer, count, out);
}

VKAPI_ATTR void VKAPI_CALL faulty_properties(VkPhysicalDevice p, VkPhysicalDeviceProperties2* out) {
    real_properties(p, out);
    if (current->type != VK_PHYSICAL_DEVICE_TYPE_MAX_ENUM) out->properties.deviceType = current->type;
    if (current->offered) current->offered(out->properties.limits);
    for (auto* s = static_cast<VkBaseOutStructure*>(out->pNext); s; s = s->pNext) {
        // Only the query whose limits the RtrDevice keeps asks for the ids of device and driver.
        if (s->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ID_PROPERTIES && current->remembered)
            current->remembered(out->properties.limits);
        if (s->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_PROPERTIES && current->no_subgroup_operations)
            reinterpret_cast<VkPhysicalDeviceSubgroupProperties*>(s)->supportedOperations = 0;
    }
}

bool is_missing(const std::string& name) {
    const std::string& m = current->missing;
    return !m.empty() && (name == m || name == m + "KHR" || name == m + "EXT");
}

VKAPI_ATTR VkDeviceAddress VKAPI_CALL null_address(VkDevice, const VkBufferDeviceAddressInfo*) { return 0; }

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL faulty_device_proc(VkDevice device, const char* name) {
    if (is_missing(name)) return nullptr;
    auto f = real_device_proc(device, name);
#define X(function, parameters, arguments)                                   \
    if (!strcmp(name, "vk" #function)) {                                     \
        real_##function = reinterpret_cast<PFN_vk##function>(f);             \
        return reinterpret_cast<PFN_vkVoidFunction>(faulty_##function);      \
    }
    FAILING(X)
#undef X
    if (current->null_addresses && !strncmp(name, "vkGetBufferDeviceAddress", 24))
        return reinterpret_cast<PFN_vkVoidFunction>(null_address);
    return f;
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL faulty_instance_proc(VkInstance instance, const char* name) {
    if (is_missing(name)) return nullptr;
    auto f = real_instance_proc(instance, name);
    if (!strcmp(name, "vkGetDeviceProcAddr")) {
        real_device_proc = reinterpret_cast<PFN_vkGetDeviceProcAddr>(f);
        return reinterpret_cast<PFN_vkVoidFunction>(faulty_device_proc);
    }
    if (!strcmp(name, "vkGetPhysicalDeviceProperties2")) {
        real_properties = reinterpret_cast<PFN_vkGetPhysicalDeviceProperties2>(f);
        return reinterpret_cast<PFN_vkVoidFunction>(faulty_properties);
    }
    if (!strcmp(name, "vkEnumerateDeviceExtensionProperties")) {
        real_extensions = reinterpret_cast<PFN_vkEnumerateDeviceExtensionProperties>(f);
        return reinterpret_cast<PFN_vkVoidFunction>(faulty_extensions);
    }
    return f;
}

}  // namespace

FaultyVulkan::FaultyVulkan(Vulkan& vk) : vk_(vk) {
    current = this;
    real_instance_proc = vk.get_instance_proc_addr;
}

FaultyVulkan::~FaultyVulkan() { current = nullptr; }

RtrDevice FaultyVulkan::create(bool messages, bool addresses) {
    RtrDeviceCreateInfo info{};
    info.instance = vk_.instance;
    info.physicalDevice = vk_.physical_device;
    info.device = vk_.device;
    info.pfnGetInstanceProcAddr = faulty_instance_proc;
    auto messenger = vk_.messenger_info(true);
    if (messages) info.pMessenger = &messenger;
    info.bufferDeviceAddress = addresses && vk_.GetBufferDeviceAddress;
    RtrDevice device = nullptr;
    result = rtrCreateDevice(&info, nullptr, &device);
    return device;
}
