/* RtrDevice: entry points, limits, the build kernels. Immutable once created. */
#include "internal.h"

static VkResult create_layouts(RtrDevice d, const VkAllocationCallbacks* a) {
    VkDescriptorSetLayoutBinding b[RTR_ARR_COUNT];
    VkDescriptorSetLayoutCreateInfo info = {.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO};
    VkPushConstantRange range = {VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(struct RtrBuildPush)};
    VkPipelineLayoutCreateInfo layout = {.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO};
    VkDescriptorSetLayout sets[2];
    VkResult r;
    uint32_t i;
    memset(b, 0, sizeof b);
    for (i = 0; i < RTR_ARR_COUNT; i++) {
        b[i].binding = i;
        b[i].descriptorCount = 1;
        b[i].descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
        b[i].stageFlags = VK_SHADER_STAGE_COMPUTE_BIT;
    }
    info.pBindings = b;
    if ((r = d->vk.CreateDescriptorSetLayout(d->device, &info, a, &d->empty_layout)) != VK_SUCCESS) return r;
    info.bindingCount = RTR_ARR_COUNT;
    if ((r = d->vk.CreateDescriptorSetLayout(d->device, &info, a, &d->array_layout)) != VK_SUCCESS) return r;
    info.bindingCount = RTR_IN_COUNT;
    b[RTR_IN_HEAP].descriptorType = VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
    if ((r = d->vk.CreateDescriptorSetLayout(d->device, &info, a, &d->input_layout)) != VK_SUCCESS) return r;
    sets[0] = d->input_layout;
    sets[1] = d->array_layout;
    layout.setLayoutCount = 2;
    layout.pSetLayouts = sets;
    layout.pushConstantRangeCount = 1;
    layout.pPushConstantRanges = &range;
    return d->vk.CreatePipelineLayout(d->device, &layout, a, &d->kernel_layout);
}

static bool is_address_kernel(RtrKernel kernel) {
#define X(name) || kernel == RTR_KERNEL_##name
    return false RTR_ADDRESS_KERNELS(X);
#undef X
}

static VkResult create_kernels(RtrDevice d, VkPipelineCache cache, const VkAllocationCallbacks* a) {
    /* Constant 0: memory fences in divergent code, see kernels/common.glsl. */
    const VkBool32 fences = strstr(d->support.deviceName, "llvmpipe") == NULL;
    const VkSpecializationMapEntry entry = {0, 0, sizeof fences};
    const VkSpecializationInfo specialization = {1, &entry, sizeof fences, &fences};
    uint32_t k;
    for (k = 0; k < RTR_KERNEL_COUNT; k++) {
        const RtrKernelCode* code = rtr_kernel_code((RtrKernel)k);
        VkShaderModuleCreateInfo module = {.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO};
        VkComputePipelineCreateInfo info = {.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO};
        VkShaderModule handle;
        VkResult r;
        if (is_address_kernel((RtrKernel)k) && !d->get_buffer_device_address) continue;
        module.codeSize = code->bytes;
        module.pCode = code->words;
        r = d->vk.CreateShaderModule(d->device, &module, a, &handle);
        if (r != VK_SUCCESS)
            return rtr_error(d, r, "kernel", "kernel '%s': vkCreateShaderModule failed (VkResult %d)", code->name, r);
        info.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
        info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
        info.stage.module = handle;
        info.stage.pName = "main";
        info.stage.pSpecializationInfo = &specialization;
        info.layout = d->kernel_layout;
        r = d->vk.CreateComputePipelines(d->device, cache, 1, &info, a, &d->kernels[k]);
        d->vk.DestroyShaderModule(d->device, handle, a);
        if (r != VK_SUCCESS)
            return rtr_error(d, r, "kernel", "kernel '%s': vkCreateComputePipelines failed (VkResult %d)", code->name,
                             r);
    }
    return VK_SUCCESS;
}

VkResult rtrCreateDevice(const RtrDeviceCreateInfo* info, const VkAllocationCallbacks* allocator,
                         RtrDevice* pDevice) {
    VkPhysicalDeviceIDProperties id = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ID_PROPERTIES};
    VkPhysicalDeviceProperties2 properties = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2};
    const char* missing = NULL;
    RtrDevice d;
    VkResult r;
    uint32_t i;
    if (!pDevice) return VK_ERROR_VALIDATION_FAILED_EXT;
    *pDevice = NULL;
    if (!info || !info->instance || !info->physicalDevice || !info->device || !info->pfnGetInstanceProcAddr)
        return VK_ERROR_VALIDATION_FAILED_EXT;
    d = rtr_alloc(allocator, sizeof *d);
    if (!d) return VK_ERROR_OUT_OF_HOST_MEMORY;
    if (allocator) {
        d->allocator = *allocator;
        d->has_allocator = true;
    }
    d->instance = info->instance;
    d->physical_device = info->physicalDevice;
    d->device = info->device;
    if (info->pMessenger) {
        d->message_severities = info->pMessenger->messageSeverity;
        d->message_types = info->pMessenger->messageType;
        d->message_callback = info->pMessenger->pfnUserCallback;
        d->message_user_data = info->pMessenger->pUserData;
    }
    if ((r = rtr_check_chain(d, "RtrDeviceCreateInfo", info->pNext)) != VK_SUCCESS) goto fail;
    if (!rtr_load_instance_table(d->instance, info->pfnGetInstanceProcAddr, &d->vki, &missing) ||
        !rtr_load_device_table(&d->vki, d->device, &d->vk, &missing)) {
        r = rtr_error(d, VK_ERROR_INITIALIZATION_FAILED, "entry-point", "pfnGetInstanceProcAddr finds no %s: give it a loader and a device of Vulkan 1.1 or later", missing);
        goto fail;
    }
    r = rtrGetPhysicalDeviceSupport(d->instance, d->physical_device, info->pfnGetInstanceProcAddr,
                                    &d->support);
    if (r != VK_SUCCESS) goto fail;
    if (!d->support.supported) {
        for (i = 0; i < d->support.requirementCount; i++) {
            const RtrRequirement* q = &d->support.requirements[i];
            if (!q->met)
                rtr_error(d, VK_ERROR_FEATURE_NOT_PRESENT, "unsupported-device",
                          "%s: rtc needs %llu, the device has %llu (rtc-info lists all that is asked of one)", q->name, (unsigned long long)q->required,
                          (unsigned long long)q->available);
        }
        r = VK_ERROR_FEATURE_NOT_PRESENT;
        goto fail;
    }
    d->validation = info->validation;
    atomic_flag_clear(&d->live_lock);
    if (info->bufferDeviceAddress) {
        d->get_buffer_device_address =
            d->support.addressMode ? rtr_load_buffer_device_address(&d->vki, d->device) : NULL;
        if (!d->get_buffer_device_address) {
            r = rtr_error(d, VK_ERROR_FEATURE_NOT_PRESENT, "address-mode",
                          "RtrDeviceCreateInfo::bufferDeviceAddress: %s",
                          d->support.addressMode ? "vkGetBufferDeviceAddress is missing; enable the feature"
                                                 : "the physical device has no such feature");
            goto fail;
        }
    }
    properties.pNext = &id;
    d->vki.GetPhysicalDeviceProperties2(d->physical_device, &properties);
    d->limits = properties.properties.limits;
    /* Measured (docs/benchmarks.md): dispatches are dear on GPUs, lanes that wait for others on lavapipe. */
    d->few_blocks = properties.properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU ? 1 : RTR_SCAN_FEW;
    d->level_nodes = properties.properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU ? RTR_GROUP : 100000;
    rtr_make_blob_version(&id, d->blob_version);
    if ((r = rtr_learn_features(d, info->pDeviceCreateInfo)) != VK_SUCCESS) {
        rtr_error(d, r, "features", "the features and extensions of the device could not be queried (VkResult %d); pDeviceCreateInfo would "
                  "tell them", r);
        goto fail;
    }
    r = create_layouts(d, allocator);
    if (r != VK_SUCCESS) rtr_error(d, r, "kernel", "the layouts of the kernels could not be created (VkResult %d)", r);
    if (r == VK_SUCCESS) r = create_kernels(d, info->pipelineCache, allocator);
    if (r != VK_SUCCESS) goto fail;
    *pDevice = d;
    return VK_SUCCESS;
fail:
    rtrDestroyDevice(d, allocator);
    return r;
}

void rtrDestroyDevice(RtrDevice d, const VkAllocationCallbacks* allocator) {
    const VkAllocationCallbacks* a;
    VkAllocationCallbacks copy;
    uint32_t k;
    if (!d) return;
    a = rtr_pick(d, allocator);
    if (a) {
        copy = *a;
        a = &copy;
    }
    if (d->vk.DestroyPipeline) {
        for (k = 0; k < RTR_KERNEL_COUNT; k++) d->vk.DestroyPipeline(d->device, d->kernels[k], a);
        d->vk.DestroyPipelineLayout(d->device, d->kernel_layout, a);
        d->vk.DestroyDescriptorSetLayout(d->device, d->input_layout, a);
        d->vk.DestroyDescriptorSetLayout(d->device, d->array_layout, a);
        d->vk.DestroyDescriptorSetLayout(d->device, d->empty_layout, a);
    }
    rtr_free(a, d);
}
