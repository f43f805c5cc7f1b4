/* Plain Vulkan: instance, device, memory. Nothing here knows of ray tracing but rtrCreateDevice at the end.
 */
#include "engine.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void engine_check(VkResult result, const char* what, const char* file, int line) {
    if (result == VK_SUCCESS) return;
    fprintf(stderr, "%s:%d: %s returned %d\n", file, line, what, (int)result);
    exit(1);
}

static void fail(const char* text) {
    fprintf(stderr, "engine: %s\n", text);
    exit(1);
}

/* Both the validation layers and rtc's runtime report here. */
static VKAPI_ATTR VkBool32 VKAPI_CALL on_message(VkDebugUtilsMessageSeverityFlagBitsEXT severity,
                                                 VkDebugUtilsMessageTypeFlagsEXT type,
                                                 const VkDebugUtilsMessengerCallbackDataEXT* data,
                                                 void* user) {
    (void)severity, (void)type;
    ++((Gpu*)user)->messages;
    fprintf(stderr, "message: %s\n", data->pMessage);
    return VK_FALSE;
}

static VkDebugUtilsMessengerCreateInfoEXT messenger_info(Gpu* gpu) {
    VkDebugUtilsMessengerCreateInfoEXT info = {VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT};
    info.messageSeverity =
        VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
    info.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT; /* drivers have general remarks too */
    info.pfnUserCallback = on_message;
    info.pUserData = gpu;
    return info;
}

static void create_instance(Gpu* gpu, bool validate) {
    const VkApplicationInfo application = {
        VK_STRUCTURE_TYPE_APPLICATION_INFO, NULL, "rtc example engine", 1, NULL, 0, VK_API_VERSION_1_2};
    VkInstanceCreateInfo info = {VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO};
    info.pApplicationInfo = &application;
    const char* layer = "VK_LAYER_KHRONOS_validation";
    const char* extensions[] = {VK_EXT_DEBUG_UTILS_EXTENSION_NAME, VK_EXT_VALIDATION_FEATURES_EXTENSION_NAME};
    const VkValidationFeatureEnableEXT enables[] = {
        VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT};
    VkDebugUtilsMessengerCreateInfoEXT messenger = messenger_info(gpu);
    VkValidationFeaturesEXT features = {VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT};
    features.pNext = &messenger;
    features.enabledValidationFeatureCount = 1;
    features.pEnabledValidationFeatures = enables;
    if (validate) {
        info.pNext = &features;
        info.enabledLayerCount = 1;
        info.ppEnabledLayerNames = &layer;
        info.enabledExtensionCount = 2;
        info.ppEnabledExtensionNames = extensions;
    }
    CHECK(vkCreateInstance(&info, NULL, &gpu->instance));
    if (validate) {
        PFN_vkCreateDebugUtilsMessengerEXT create = (PFN_vkCreateDebugUtilsMessengerEXT)vkGetInstanceProcAddr(
            gpu->instance, "vkCreateDebugUtilsMessengerEXT");
        CHECK(create(gpu->instance, &messenger, NULL, &gpu->messenger));
    }
}

static bool name_contains(const char* name, const char* part) {
    for (; *name; ++name) {
        size_t i = 0;
        while (part[i] && tolower((unsigned char)name[i]) == tolower((unsigned char)part[i])) ++i;
        if (!part[i]) return true;
    }
    return !*part;
}

static void choose_device(Gpu* gpu, const char* wanted) {
    VkPhysicalDevice devices[16];
    uint32_t count = 16;
    const VkResult listed = vkEnumeratePhysicalDevices(gpu->instance, &count, devices);
    if (listed != VK_SUCCESS && listed != VK_INCOMPLETE) CHECK(listed);
    for (uint32_t i = 0; i < count; ++i) {
        VkPhysicalDeviceProperties properties;
        vkGetPhysicalDeviceProperties(devices[i], &properties);
        if (wanted && !name_contains(properties.deviceName, wanted)) continue;
        if (properties.apiVersion < VK_API_VERSION_1_2) continue;
        gpu->physical = devices[i];
        printf("device: %s\n", properties.deviceName);
        break;
    }
    if (!gpu->physical) fail("no Vulkan 1.2 device of that name");
    VkQueueFamilyProperties families[16];
    count = 16;
    vkGetPhysicalDeviceQueueFamilyProperties(gpu->physical, &count, families);
    gpu->queueFamily = ~0u;
    const VkQueueFlags flags = VK_QUEUE_GRAPHICS_BIT | VK_QUEUE_COMPUTE_BIT;
    for (uint32_t i = 0; i < count && gpu->queueFamily == ~0u; ++i)
        if ((families[i].queueFlags & flags) == flags) gpu->queueFamily = i;
    if (gpu->queueFamily == ~0u) fail("no queue family that draws and computes");
    vkGetPhysicalDeviceMemoryProperties(gpu->physical, &gpu->memory);
}

void gpu_create(Gpu* gpu, const char* wantedDevice, bool validate) {
    memset(gpu, 0, sizeof *gpu);
    create_instance(gpu, validate);
    choose_device(gpu, wantedDevice);

    VkPhysicalDeviceVulkan12Features available = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES};
    VkPhysicalDeviceFeatures2 query = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, &available};
    vkGetPhysicalDeviceFeatures2(gpu->physical, &query);
    gpu->nonUniformIndexing = available.shaderStorageBufferArrayNonUniformIndexing &&
                              available.shaderSampledImageArrayNonUniformIndexing;
    VkPhysicalDeviceVulkan12Features enabled = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES};
    enabled.shaderStorageBufferArrayNonUniformIndexing = gpu->nonUniformIndexing;
    enabled.shaderSampledImageArrayNonUniformIndexing = gpu->nonUniformIndexing;

    const float priority = 1.0f;
    VkDeviceQueueCreateInfo queue = {VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO};
    queue.queueFamilyIndex = gpu->queueFamily;
    queue.queueCount = 1;
    queue.pQueuePriorities = &priority;
    VkDeviceCreateInfo info = {VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO};
    info.pNext = &enabled; /* rtc itself needs no feature and no extension */
    info.queueCreateInfoCount = 1;
    info.pQueueCreateInfos = &queue;
    CHECK(vkCreateDevice(gpu->physical, &info, NULL, &gpu->device));
    vkGetDeviceQueue(gpu->device, gpu->queueFamily, 0, &gpu->queue);
    VkCommandPoolCreateInfo pool = {VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO};
    pool.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
    pool.queueFamilyIndex = gpu->queueFamily;
    CHECK(vkCreateCommandPool(gpu->device, &pool, NULL, &gpu->pool));

    /* [guide: device] */
    RtrPhysicalDeviceSupport support;
    CHECK(rtrGetPhysicalDeviceSupport(gpu->instance, gpu->physical, vkGetInstanceProcAddr, &support));
    for (uint32_t i = 0; i < support.requirementCount; ++i)
        if (!support.requirements[i].met) fprintf(stderr, "missing: %s\n", support.requirements[i].name);
    if (!support.supported) fail("rtc does not run on this device");

    VkDebugUtilsMessengerCreateInfoEXT messenger = messenger_info(gpu);
    messenger.messageType |= VK_DEBUG_UTILS_MESSAGE_TYPE_GENERAL_BIT_EXT;
    RtrDeviceCreateInfo rtr = {0};
    rtr.instance = gpu->instance;
    rtr.physicalDevice = gpu->physical;
    rtr.device = gpu->device;
    rtr.pfnGetInstanceProcAddr = vkGetInstanceProcAddr;
    rtr.pMessenger = &messenger; /* every error is a VkResult and a sentence */
    CHECK(rtrCreateDevice(&rtr, NULL, &gpu->rtr));
    /* [guide] */
}

void gpu_destroy(Gpu* gpu) {
    rtrDestroyDevice(gpu->rtr, NULL);
    vkDestroyCommandPool(gpu->device, gpu->pool, NULL);
    vkDestroyDevice(gpu->device, NULL);
    if (gpu->messenger) {
        PFN_vkDestroyDebugUtilsMessengerEXT destroy =
            (PFN_vkDestroyDebugUtilsMessengerEXT)vkGetInstanceProcAddr(gpu->instance,
                                                                       "vkDestroyDebugUtilsMessengerEXT");
        destroy(gpu->instance, gpu->messenger, NULL);
    }
    vkDestroyInstance(gpu->instance, NULL);
}

static VkDeviceMemory allocate(Gpu* gpu, VkMemoryRequirements needs, VkMemoryPropertyFlags flags) {
    for (uint32_t i = 0; i < gpu->memory.memoryTypeCount; ++i) {
        if (!(needs.memoryTypeBits >> i & 1u) || (gpu->memory.memoryTypes[i].propertyFlags & flags) != flags)
            continue;
        const VkMemoryAllocateInfo info = {VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, NULL, needs.size, i};
        VkDeviceMemory memory;
        CHECK(vkAllocateMemory(gpu->device, &info, NULL, &memory));
        return memory;
    }
    fail("no memory type fits");
    return VK_NULL_HANDLE;
}

Buffer buffer_create(Gpu* gpu, VkDeviceSize size, VkBufferUsageFlags usage, MemoryKind kind) {
    Buffer buffer = {.size = size};
    VkBufferCreateInfo info = {VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO};
    info.size = size;
    info.usage = usage;
    CHECK(vkCreateBuffer(gpu->device, &info, NULL, &buffer.handle));
    VkMemoryRequirements needs;
    vkGetBufferMemoryRequirements(gpu->device, buffer.handle, &needs);
    buffer.memory = allocate(gpu, needs,
                             kind == MEMORY_HOST
                                 ? VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT
                                 : VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
    CHECK(vkBindBufferMemory(gpu->device, buffer.handle, buffer.memory, 0));
    if (kind == MEMORY_HOST)
        CHECK(vkMapMemory(gpu->device, buffer.memory, 0, VK_WHOLE_SIZE, 0, &buffer.mapped));
    return buffer;
}

void buffer_destroy(Gpu* gpu, Buffer* buffer) {
    vkDestroyBuffer(gpu->device, buffer->handle, NULL);
    vkFreeMemory(gpu->device, buffer->memory, NULL);
}

Image image_create(Gpu* gpu, uint32_t width, uint32_t height, VkFormat format, VkImageUsageFlags usage,
                   VkImageAspectFlags aspect) {
    Image image = {.width = width, .height = height};
    VkImageCreateInfo info = {VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO};
    info.imageType = VK_IMAGE_TYPE_2D;
    info.format = format;
    info.extent = (VkExtent3D){width, height, 1};
    info.mipLevels = info.arrayLayers = 1;
    info.samples = VK_SAMPLE_COUNT_1_BIT;
    info.usage = usage;
    CHECK(vkCreateImage(gpu->device, &info, NULL, &image.handle));
    VkMemoryRequirements needs;
    vkGetImageMemoryRequirements(gpu->device, image.handle, &needs);
    image.memory = allocate(gpu, needs, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
    CHECK(vkBindImageMemory(gpu->device, image.handle, image.memory, 0));
    VkImageViewCreateInfo view = {VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO};
    view.image = image.handle;
    view.viewType = VK_IMAGE_VIEW_TYPE_2D;
    view.format = format;
    view.subresourceRange = (VkImageSubresourceRange){aspect, 0, 1, 0, 1};
    CHECK(vkCreateImageView(gpu->device, &view, NULL, &image.view));
    return image;
}

void image_destroy(Gpu* gpu, Image* image) {
    vkDestroyImageView(gpu->device, image->view, NULL);
    vkDestroyImage(gpu->device, image->handle, NULL);
    vkFreeMemory(gpu->device, image->memory, NULL);
}

VkShaderModule shader_create(Gpu* gpu, const uint32_t* words, size_t bytes) {
    VkShaderModuleCreateInfo info = {VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO};
    info.codeSize = bytes;
    info.pCode = words;
    VkShaderModule module;
    CHECK(vkCreateShaderModule(gpu->device, &info, NULL, &module));
    return module;
}

VkCommandBuffer commands_begin(Gpu* gpu) {
    const VkCommandBufferAllocateInfo allocation = {VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO, NULL,
                                                    gpu->pool, VK_COMMAND_BUFFER_LEVEL_PRIMARY, 1};
    VkCommandBuffer cb;
    CHECK(vkAllocateCommandBuffers(gpu->device, &allocation, &cb));
    VkCommandBufferBeginInfo begin = {VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
    begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    CHECK(vkBeginCommandBuffer(cb, &begin));
    return cb;
}

void commands_finish(Gpu* gpu, VkCommandBuffer cb) {
    CHECK(vkEndCommandBuffer(cb));
    VkSubmitInfo submit = {VK_STRUCTURE_TYPE_SUBMIT_INFO};
    submit.commandBufferCount = 1;
    submit.pCommandBuffers = &cb;
    CHECK(vkQueueSubmit(gpu->queue, 1, &submit, VK_NULL_HANDLE));
    CHECK(vkQueueWaitIdle(gpu->queue));
    vkFreeCommandBuffers(gpu->device, gpu->pool, 1, &cb);
}

void image_barrier(VkCommandBuffer cb, VkImage image, VkImageAspectFlags aspect, VkImageLayout from,
                   VkImageLayout to, VkPipelineStageFlags srcStage, VkAccessFlags srcAccess,
                   VkPipelineStageFlags dstStage, VkAccessFlags dstAccess) {
    VkImageMemoryBarrier barrier = {VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER};
    barrier.srcAccessMask = srcAccess;
    barrier.dstAccessMask = dstAccess;
    barrier.oldLayout = from;
    barrier.newLayout = to;
    barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
    barrier.image = image;
    barrier.subresourceRange = (VkImageSubresourceRange){aspect, 0, 1, 0, 1};
    vkCmdPipelineBarrier(cb, srcStage, dstStage, 0, 0, NULL, 0, NULL, 1, &barrier);
}
