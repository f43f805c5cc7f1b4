/* What a physical device offers, by name, and what suits it. */
#include <stdio.h>
#include <stdlib.h>

#include "internal.h"

uint32_t rtrGetAbiVersion(void) { return RTC_ABI_VERSION; }

static void require(RtrPhysicalDeviceSupport* s, const char* name, uint64_t required, uint64_t available) {
    RtrRequirement* r;
    if (s->requirementCount >= RTR_MAX_REQUIREMENTS) return;
    r = &s->requirements[s->requirementCount++];
    snprintf(r->name, sizeof r->name, "%s", name);
    r->required = required;
    r->available = available;
    r->met = available >= required;
    if (!r->met) s->supported = VK_FALSE;
}

/* "Mesa 22.3.6 (LLVM 15.0.6)" -> 22; 0 when it does not read like that. */
static unsigned mesa_major(const char* info) {
    const char* at = strstr(info, "Mesa ");
    return at ? (unsigned)strtoul(at + 5, NULL, 10) : 0;
}

/* Measured choices, not guesses: lavapipe 22.3 likes texel fetch, while-while and a
 * shared stack; lavapipe 25 texel fetch and local arrays; GPUs device addresses, local
 * arrays and small groups. lavapipe 22.3 also ends every loop once an invocation group has spent 65535
 * iterations in all its loops together, so a lane must suspend before its share. */
static void recommend(RtrPhysicalDeviceSupport* s, bool cpu, bool llvmpipe) {
    RtrTraceOptions* o = &s->recommended;
    o->fetch = RTR_FETCH_STORAGE;
    o->whileWhile = 0;
    o->sharedStack = 0;
    o->workgroupSize = 32;
    o->stepBudget = 0;
    s->recommendAddresses = s->addressMode && !cpu;
    if (!llvmpipe) return;
    o->fetch = RTR_FETCH_TEXEL;
    o->workgroupSize = 64;
    if (mesa_major(s->driverInfo) < 24) {
        uint32_t lanes = s->subgroupSize ? s->subgroupSize : 8;
        o->whileWhile = 1;
        o->sharedStack = 32;
        /* In the worst case the lanes of a group never turn together. An eighth is left
         * for what is not counted: user loops without a trace, the frame copies. */
        o->stepBudget = (65535u / lanes) / 8u * 7u;
        s->needsResumableModules = VK_TRUE;
    }
}

VkResult rtrGetPhysicalDeviceSupport(VkInstance instance, VkPhysicalDevice physicalDevice,
                                     PFN_vkGetInstanceProcAddr pfnGetInstanceProcAddr,
                                     RtrPhysicalDeviceSupport* pSupport) {
    RtrInstanceTable vk;
    const char* missing = NULL;
    VkPhysicalDeviceProperties2 properties = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2};
    VkPhysicalDeviceSubgroupProperties subgroup = {.sType =
                                                       VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_PROPERTIES};
    VkPhysicalDeviceDriverProperties driver = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES};
    VkPhysicalDeviceFeatures2 features = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2};
    VkPhysicalDeviceBufferDeviceAddressFeatures address = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_BUFFER_DEVICE_ADDRESS_FEATURES};
    VkFormatProperties format;
    const VkPhysicalDeviceLimits* l = &properties.properties.limits;
    uint64_t texels, storage;
    bool v12, llvmpipe;

    if (!pSupport) return VK_ERROR_VALIDATION_FAILED_EXT;
    memset(pSupport, 0, sizeof *pSupport);
    if (!instance || !physicalDevice || !pfnGetInstanceProcAddr) return VK_ERROR_VALIDATION_FAILED_EXT;
    if (!rtr_load_instance_table(instance, pfnGetInstanceProcAddr, &vk, &missing)) {
        return VK_ERROR_INITIALIZATION_FAILED;
    }
    /* Structures of 1.2 are only chained where the device knows them. */
    vk.GetPhysicalDeviceProperties2(physicalDevice, &properties);
    v12 = properties.properties.apiVersion >= VK_API_VERSION_1_2;
    properties.pNext = &subgroup;
    if (v12) subgroup.pNext = &driver;
    vk.GetPhysicalDeviceProperties2(physicalDevice, &properties);
    if (v12) features.pNext = &address;
    vk.GetPhysicalDeviceFeatures2(physicalDevice, &features);
    vk.GetPhysicalDeviceFormatProperties(physicalDevice, VK_FORMAT_R32G32B32A32_UINT, &format);

    pSupport->supported = VK_TRUE;
    snprintf(pSupport->deviceName, sizeof pSupport->deviceName, "%s", properties.properties.deviceName);
    snprintf(pSupport->driverName, sizeof pSupport->driverName, "%s", driver.driverName);
    snprintf(pSupport->driverInfo, sizeof pSupport->driverInfo, "%s", driver.driverInfo);
    pSupport->subgroupSize = subgroup.subgroupSize;
    pSupport->addressMode = address.bufferDeviceAddress;

    require(pSupport, "apiVersion", VK_API_VERSION_1_1, properties.properties.apiVersion);
    require(pSupport, "maxComputeWorkGroupInvocations", RTR_GROUP, l->maxComputeWorkGroupInvocations);
    require(pSupport, "maxComputeWorkGroupSize[0]", RTR_GROUP, l->maxComputeWorkGroupSize[0]);
    require(pSupport, "maxComputeSharedMemorySize", 16384, l->maxComputeSharedMemorySize);
    require(pSupport, "maxPerStageDescriptorStorageBuffers", RTR_ARR_COUNT + 3,
            l->maxPerStageDescriptorStorageBuffers);
    require(pSupport, "maxDescriptorSetStorageBuffers", RTR_ARR_COUNT + 3, l->maxDescriptorSetStorageBuffers);
    require(pSupport, "maxPerStageResources", RTR_ARR_COUNT + 4, l->maxPerStageResources);
    require(pSupport, "maxPushConstantsSize", sizeof(struct RtrBuildPush), l->maxPushConstantsSize);
    require(pSupport, "maxBoundDescriptorSets", 2, l->maxBoundDescriptorSets);
    require(pSupport, "maxComputeWorkGroupCount[0]", RTC_MAX_GROUPS_X, l->maxComputeWorkGroupCount[0]);
    require(pSupport, "maxStorageBufferRange", 1u << 27, l->maxStorageBufferRange);
    require(pSupport, "R32G32B32A32_UINT uniform texel buffers", 1,
            (format.bufferFeatures & VK_FORMAT_FEATURE_UNIFORM_TEXEL_BUFFER_BIT) ? 1 : 0);

    pSupport->heapMode = VK_TRUE;
    texels = l->maxTexelBufferElements < 0x7fffffffu ? l->maxTexelBufferElements : 0x7fffffffu; /* ints */
    storage = l->maxStorageBufferRange;
    pSupport->maxHeapSizeTexel = texels * RTC_QUAD_BYTES;
    pSupport->maxHeapSizeStorage = storage / 256 * 256;

    llvmpipe = v12 && driver.driverID == VK_DRIVER_ID_MESA_LLVMPIPE;
    recommend(pSupport, properties.properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU, llvmpipe);
    return VK_SUCCESS;
}

const RtrPhysicalDeviceSupport* rtrGetDeviceSupport(RtrDevice device) { return &device->support; }

void rtrGetRayTracingProperties(RtrDevice device, VkPhysicalDeviceRayTracingPropertiesNV* p) {
    p->shaderGroupHandleSize = RTC_HANDLE_BYTES;
    p->maxRecursionDepth = 31;
    p->maxShaderGroupStride = RTC_SBT_MAX_STRIDE;
    p->shaderGroupBaseAlignment = RTC_SBT_BASE_ALIGNMENT;
    p->maxGeometryCount = RTC_SLOT_GEOMETRY_MASK;
    p->maxInstanceCount = 1u << 24;
    p->maxTriangleCount = 1u << 26;
    p->maxDescriptorSetAccelerationStructures = device->limits.maxPerStageDescriptorStorageBuffers;
}

void rtrGetRayTracingPipelineProperties(RtrDevice device, VkPhysicalDeviceRayTracingPipelinePropertiesKHR* p) {
    (void)device;
    p->shaderGroupHandleSize = RTC_HANDLE_BYTES;
    p->maxRayRecursionDepth = 31;
    p->maxShaderGroupStride = RTC_SBT_MAX_STRIDE;
    p->shaderGroupBaseAlignment = RTC_SBT_BASE_ALIGNMENT;
    p->shaderGroupHandleCaptureReplaySize = 0;
    p->maxRayDispatchInvocationCount = 1u << 31;
    p->shaderGroupHandleAlignment = RTC_SBT_HANDLE_ALIGNMENT;
    p->maxRayHitAttributeSize = 32;
}

void rtrGetAccelerationStructureProperties(RtrDevice device,
                                           VkPhysicalDeviceAccelerationStructurePropertiesKHR* p) {
    p->maxGeometryCount = RTC_SLOT_GEOMETRY_MASK;
    p->maxInstanceCount = 1u << 24;
    p->maxPrimitiveCount = 1u << 26;
    p->maxPerStageDescriptorAccelerationStructures =
        p->maxPerStageDescriptorUpdateAfterBindAccelerationStructures =
            device->limits.maxPerStageDescriptorStorageBuffers;
    p->maxDescriptorSetAccelerationStructures =
        p->maxDescriptorSetUpdateAfterBindAccelerationStructures =
            device->limits.maxDescriptorSetStorageBuffers;
    p->minAccelerationStructureScratchOffsetAlignment = 256;
}
