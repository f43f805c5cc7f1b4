#include "vulkan_harness.h"

#include <dlfcn.h>

#include <cstdlib>

namespace {

VKAPI_ATTR VkBool32 VKAPI_CALL on_layer_message(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                                VkDebugUtilsMessageTypeFlagsEXT,
                                                const VkDebugUtilsMessengerCallbackDataEXT* data,
                                                void* user) {
    static_cast<Vulkan*>(user)->layer_messages.push_back(data->pMessage);
    return VK_FALSE;
}

VKAPI_ATTR VkBool32 VKAPI_CALL on_runtime_message(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                                  VkDebugUtilsMessageTypeFlagsEXT,
                                                  const VkDebugUtilsMessengerCallbackDataEXT* data,
                                                  void* user) {
    static_cast<Vulkan*>(user)->runtime_messages.push_back(std::string(data->pMessageIdName) + ": " +
                                                           data->pMessage);
    return VK_FALSE;
}

std::unique_ptr<Vulkan> shared_vulkan;
RtrDevice shared_device = nullptr;

}  // namespace

VkDebugUtilsMessengerCreateInfoEXT Vulkan::messenger_info(bool runtime) {
    VkDebugUtilsMessengerCreateInfoEXT info{VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT};
    info.messageSeverity =
        VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT;
    info.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT;
    info.pfnUserCallback = runtime ? on_runtime_message : on_layer_message;
    info.pUserData = this;
    return info;
}

std::unique_ptr<Vulkan> Vulkan::create(std::string& why) {
    std::unique_ptr<Vulkan> v(new Vulkan);
    v->library_ = dlopen("libvulkan.so.1", RTLD_NOW | RTLD_LOCAL);
    if (!v->library_) {
        why = "libvulkan.so.1 is not installed";
        return nullptr;
    }
    v->get_instance_proc_addr =
        reinterpret_cast<PFN_vkGetInstanceProcAddr>(dlsym(v->library_, "vkGetInstanceProcAddr"));
    auto global = [&](const char* name) { return v->get_instance_proc_addr(nullptr, name); };
    auto enumerate_layers = reinterpret_cast<PFN_vkEnumerateInstanceLayerProperties>(
        global("vkEnumerateInstanceLayerProperties"));
    uint32_t count = 0;
    enumerate_layers(&count, nullptr);
    std::vector<VkLayerProperties> layers(count);
    enumerate_layers(&count, layers.data());
    for (auto& l : layers) v->validation |= !strcmp(l.layerName, "VK_LAYER_KHRONOS_validation");
    if (getenv("RTC_TEST_NO_VALIDATION")) v->validation = false;  // for timing by hand

    VkApplicationInfo app{VK_STRUCTURE_TYPE_APPLICATION_INFO};
    app.apiVersion = VK_API_VERSION_1_1;
    VkDebugUtilsMessengerCreateInfoEXT messenger = v->messenger_info(false);
    VkValidationFeatureEnableEXT enable = VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT;
    VkValidationFeaturesEXT features{VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT};
    features.enabledValidationFeatureCount = 1;
    features.pEnabledValidationFeatures = &enable;
    features.pNext = &messenger;
    const char* layer = "VK_LAYER_KHRONOS_validation";
    const char* extensions[] = {"VK_EXT_debug_utils", "VK_EXT_validation_features"};
    VkInstanceCreateInfo info{VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO};
    info.pApplicationInfo = &app;
    if (v->validation) {
        info.pNext = &features;
        info.enabledLayerCount = 1;
        info.ppEnabledLayerNames = &layer;
        info.enabledExtensionCount = 2;
        info.ppEnabledExtensionNames = extensions;
    }
    auto create_instance = reinterpret_cast<PFN_vkCreateInstance>(global("vkCreateInstance"));
    if (create_instance(&info, nullptr, &v->instance) != VK_SUCCESS) {
        why = "vkCreateInstance failed";
        return nullptr;
    }
#define X(name) v->name = reinterpret_cast<PFN_vk##name>(v->get_instance_proc_addr(v->instance, "vk" #name));
    HARNESS_FUNCTIONS(X)
#undef X
    if (v->validation) v->CreateDebugUtilsMessengerEXT(v->instance, &messenger, nullptr, &v->messenger_);

    v->EnumeratePhysicalDevices(v->instance, &count, nullptr);
    std::vector<VkPhysicalDevice> devices(count);
    v->EnumeratePhysicalDevices(v->instance, &count, devices.data());
    const char* wanted = getenv("RTC_TEST_DEVICE");
    for (auto candidate : devices) {
        VkPhysicalDeviceProperties p;
        v->GetPhysicalDeviceProperties(candidate, &p);
        if (!v->physical_device && (!wanted || strstr(p.deviceName, wanted))) v->physical_device = candidate;
    }
    if (!v->physical_device) {
        why = "no Vulkan device";
        return nullptr;
    }
    float priority = 1;
    VkDeviceQueueCreateInfo queue{VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO};
    v->GetPhysicalDeviceQueueFamilyProperties(v->physical_device, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    v->GetPhysicalDeviceQueueFamilyProperties(v->physical_device, &count, families.data());
    for (uint32_t i = count; i-- > 0;) {
        if (families[i].queueFlags & VK_QUEUE_COMPUTE_BIT) v->queue_family = i;
    }
    queue.queueFamilyIndex = v->queue_family;
    queue.queueCount = 1;
    queue.pQueuePriorities = &priority;
    VkDeviceCreateInfo device{VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO};
    device.queueCreateInfoCount = 1;
    device.pQueueCreateInfos = &queue;
    // Address mode where the device has it. The instance is one of Vulkan 1.1, so it is an extension.
    RtrPhysicalDeviceSupport support;
    rtrGetPhysicalDeviceSupport(v->instance, v->physical_device, v->get_instance_proc_addr, &support);
    std::vector<const char*> wanted_extensions;
    VkPhysicalDeviceBufferDeviceAddressFeatures address{
        VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_BUFFER_DEVICE_ADDRESS_FEATURES};
    address.bufferDeviceAddress = VK_TRUE;
    if (support.addressMode && !getenv("RTC_TEST_NO_ADDRESSES")) {
        device.pNext = &address;
        wanted_extensions.push_back("VK_KHR_buffer_device_address");
    }
    // Update-after-bind likewise.
    auto list_extensions = reinterpret_cast<PFN_vkEnumerateDeviceExtensionProperties>(
        v->get_instance_proc_addr(v->instance, "vkEnumerateDeviceExtensionProperties"));
    list_extensions(v->physical_device, nullptr, &count, nullptr);
    std::vector<VkExtensionProperties> known(count);
    list_extensions(v->physical_device, nullptr, &count, known.data());
    VkPhysicalDeviceDescriptorIndexingFeatures indexing{
        VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DESCRIPTOR_INDEXING_FEATURES};
    for (auto& e : known) {
        if (strcmp(e.extensionName, "VK_EXT_descriptor_indexing") != 0) continue;
        VkPhysicalDeviceFeatures2 features2{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, &indexing};
        reinterpret_cast<PFN_vkGetPhysicalDeviceFeatures2>(
            v->get_instance_proc_addr(v->instance, "vkGetPhysicalDeviceFeatures2"))(v->physical_device, &features2);
        v->update_after_bind = indexing.descriptorBindingStorageBufferUpdateAfterBind;
    }
    if (v->update_after_bind) {
        indexing = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DESCRIPTOR_INDEXING_FEATURES, const_cast<void*>(device.pNext)};
        indexing.descriptorBindingStorageBufferUpdateAfterBind = VK_TRUE;
        device.pNext = &indexing;
        wanted_extensions.push_back("VK_EXT_descriptor_indexing");
    }
    device.enabledExtensionCount = static_cast<uint32_t>(wanted_extensions.size());
    device.ppEnabledExtensionNames = wanted_extensions.data();
    if (v->CreateDevice(v->physical_device, &device, nullptr, &v->device) != VK_SUCCESS) {
        why = "vkCreateDevice failed";
        return nullptr;
    }
    if (support.addressMode && !getenv("RTC_TEST_NO_ADDRESSES"))
        v->GetBufferDeviceAddress = reinterpret_cast<PFN_vkGetBufferDeviceAddress>(
            v->get_instance_proc_addr(v->instance, "vkGetBufferDeviceAddressKHR"));
    v->GetDeviceQueue(v->device, v->queue_family, 0, &v->queue);
    VkCommandPoolCreateInfo pool{VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO};
    pool.queueFamilyIndex = v->queue_family;
    v->CreateCommandPool(v->device, &pool, nullptr, &v->pool);
    VkCommandBufferAllocateInfo allocate{VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO};
    allocate.commandPool = v->pool;
    allocate.commandBufferCount = 1;
    v->AllocateCommandBuffers(v->device, &allocate, &v->cmd);
    return v;
}

Vulkan::~Vulkan() {
    if (device) {
        DeviceWaitIdle(device);
        for (auto& b : buffers_) {
            DestroyBuffer(device, b.handle, nullptr);
            FreeMemory(device, b.memory, nullptr);
        }
        DestroyCommandPool(device, pool, nullptr);
        DestroyDevice(device, nullptr);
    }
    if (messenger_) DestroyDebugUtilsMessengerEXT(instance, messenger_, nullptr);
    if (instance) DestroyInstance(instance, nullptr);
}

Buffer Vulkan::buffer(VkDeviceSize size, VkBufferUsageFlags usage) {
    Buffer b;
    b.size = size = (size + 255) / 256 * 256;
    VkBufferCreateInfo info{VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO};
    info.size = size;
    info.usage = usage;
    EXPECT_EQ(CreateBuffer(device, &info, nullptr, &b.handle), VK_SUCCESS);
    VkMemoryRequirements need;
    GetBufferMemoryRequirements(device, b.handle, &need);
    VkPhysicalDeviceMemoryProperties memory;
    GetPhysicalDeviceMemoryProperties(physical_device, &memory);
    VkMemoryAllocateInfo allocate{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO};
    allocate.allocationSize = need.size;
    VkMemoryAllocateFlagsInfo address{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO};
    address.flags = VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT;
    if (usage & VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT) allocate.pNext = &address;
    const VkMemoryPropertyFlags flags =
        VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
    for (uint32_t i = memory.memoryTypeCount; i-- > 0;) {
        if ((need.memoryTypeBits >> i & 1) && (memory.memoryTypes[i].propertyFlags & flags) == flags)
            allocate.memoryTypeIndex = i;
    }
    EXPECT_EQ(AllocateMemory(device, &allocate, nullptr, &b.memory), VK_SUCCESS);
    BindBufferMemory(device, b.handle, b.memory, 0);
    MapMemory(device, b.memory, 0, VK_WHOLE_SIZE, 0, &b.data);
    // Whatever is not written must not look like something.
    memset(b.data, 0xcd, size);
    buffers_.push_back(b);
    return b;
}

void Vulkan::destroy(Buffer& buffer) {
    for (size_t i = 0; i < buffers_.size(); i++) {
        if (buffers_[i].handle != buffer.handle) continue;
        buffers_.erase(buffers_.begin() + static_cast<long>(i));
        DestroyBuffer(device, buffer.handle, nullptr);
        FreeMemory(device, buffer.memory, nullptr);
        break;
    }
    buffer = Buffer();
}

void Vulkan::begin() {
    ResetCommandPool(device, pool, 0);
    VkCommandBufferBeginInfo info{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
    info.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    BeginCommandBuffer(cmd, &info);
}

void Vulkan::submit() {
    host_barrier();
    ASSERT_EQ(EndCommandBuffer(cmd), VK_SUCCESS);
    VkSubmitInfo info{VK_STRUCTURE_TYPE_SUBMIT_INFO};
    info.commandBufferCount = 1;
    info.pCommandBuffers = &cmd;
    ASSERT_EQ(QueueSubmit(queue, 1, &info, VK_NULL_HANDLE), VK_SUCCESS);
    ASSERT_EQ(QueueWaitIdle(queue), VK_SUCCESS);
}

void Vulkan::barrier(VkPipelineStageFlags src, VkAccessFlags src_access, VkPipelineStageFlags dst,
                     VkAccessFlags dst_access) {
    VkMemoryBarrier b{VK_STRUCTURE_TYPE_MEMORY_BARRIER};
    b.srcAccessMask = src_access;
    b.dstAccessMask = dst_access;
    CmdPipelineBarrier(cmd, src, dst, 0, 1, &b, 0, nullptr, 0, nullptr);
}

void Vulkan::compute_barrier() {
    // What a ported application writes: its NV masks, translated.
    auto stage = rtrTranslatePipelineStages(VK_PIPELINE_STAGE_ACCELERATION_STRUCTURE_BUILD_BIT_NV);
    auto access = rtrTranslateAccess(VK_ACCESS_ACCELERATION_STRUCTURE_READ_BIT_NV |
                                     VK_ACCESS_ACCELERATION_STRUCTURE_WRITE_BIT_NV);
    barrier(stage, access, stage, access);
}

void Vulkan::host_barrier() {
    barrier(VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, VK_ACCESS_MEMORY_WRITE_BIT, VK_PIPELINE_STAGE_HOST_BIT,
            VK_ACCESS_HOST_READ_BIT);
}

void RuntimeTest::SetUp() {
    std::string why;
    if (!shared_vulkan) shared_vulkan = Vulkan::create(why);
    if (!shared_vulkan) GTEST_SKIP() << why;
    vk = shared_vulkan.get();
    vk->layer_messages.clear();
    vk->runtime_messages.clear();
    if (!shared_device) {
        RtrDeviceCreateInfo info{};
        info.instance = vk->instance;
        info.physicalDevice = vk->physical_device;
        info.device = vk->device;
        info.pfnGetInstanceProcAddr = vk->get_instance_proc_addr;
        auto messenger = vk->messenger_info(true);
        info.pMessenger = &messenger;
        info.bufferDeviceAddress = vk->GetBufferDeviceAddress != nullptr;
        ASSERT_EQ(rtrCreateDevice(&info, nullptr, &shared_device), VK_SUCCESS);
    }
    rtr = shared_device;
}

void RuntimeTest::TearDown() {
    if (!vk) return;
    for (auto& m : vk->layer_messages) ADD_FAILURE() << "validation: " << m;
    for (auto& m : vk->runtime_messages) ADD_FAILURE() << "runtime: " << m;
}

void RuntimeTest::TearDownTestSuite() {
    if (!shared_vulkan) return;
    rtrDestroyDevice(shared_device, nullptr);
    shared_device = nullptr;
    auto messages = std::move(shared_vulkan->layer_messages);
    shared_vulkan->layer_messages.clear();
    shared_vulkan.reset();
    for (auto& m : messages) ADD_FAILURE() << "validation at teardown: " << m;
}

void RuntimeTest::expect_runtime_error(const std::string& id) {
    ASSERT_FALSE(vk->runtime_messages.empty()) << "no message; expected " << id;
    EXPECT_EQ(vk->runtime_messages[0].substr(0, id.size() + 1), id + ":") << vk->runtime_messages[0];
    vk->runtime_messages.clear();
}
