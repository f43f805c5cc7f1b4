/* RtrPipeline: a linked module as one compute pipeline, its layout and its groups. */
#include "internal.h"

/* Flags that mean something for the compute pipeline; those that only promise what rays need not
 * know are taken and dropped. */
#define COMPUTE_FLAGS                                                                              \
    (VK_PIPELINE_CREATE_DISABLE_OPTIMIZATION_BIT | VK_PIPELINE_CREATE_ALLOW_DERIVATIVES_BIT |      \
     VK_PIPELINE_CREATE_DEFER_COMPILE_BIT_NV | VK_PIPELINE_CREATE_CAPTURE_STATISTICS_BIT_KHR |     \
     VK_PIPELINE_CREATE_CAPTURE_INTERNAL_REPRESENTATIONS_BIT_KHR |                                 \
     VK_PIPELINE_CREATE_FAIL_ON_PIPELINE_COMPILE_REQUIRED_BIT |                                    \
     VK_PIPELINE_CREATE_EARLY_RETURN_ON_FAILURE_BIT)
#define PROMISES                                                        \
    (VK_PIPELINE_CREATE_RAY_TRACING_NO_NULL_ANY_HIT_SHADERS_BIT_KHR |     \
     VK_PIPELINE_CREATE_RAY_TRACING_NO_NULL_CLOSEST_HIT_SHADERS_BIT_KHR | \
     VK_PIPELINE_CREATE_RAY_TRACING_NO_NULL_MISS_SHADERS_BIT_KHR |        \
     VK_PIPELINE_CREATE_RAY_TRACING_NO_NULL_INTERSECTION_SHADERS_BIT_KHR)

static const VkDescriptorType k_reserved_types[RTC_BINDING_COUNT] = {
    VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER_DYNAMIC, VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER,
    VK_DESCRIPTOR_TYPE_STORAGE_BUFFER,         VK_DESCRIPTOR_TYPE_STORAGE_BUFFER,
    VK_DESCRIPTOR_TYPE_STORAGE_BUFFER,         VK_DESCRIPTOR_TYPE_STORAGE_BUFFER,
    VK_DESCRIPTOR_TYPE_STORAGE_BUFFER,         VK_DESCRIPTOR_TYPE_STORAGE_BUFFER,
    VK_DESCRIPTOR_TYPE_STORAGE_BUFFER,
};

uint32_t rtr_reserved_bindings(uint32_t used, uint32_t base, VkDescriptorSetLayoutBinding* bindings) {
    uint32_t i, count = 0;
    for (i = 0; i < RTC_BINDING_COUNT; i++) {
        if (!(used >> i & 1)) continue;
        if (bindings) {
            memset(&bindings[count], 0, sizeof bindings[count]);
            bindings[count].binding = base + i;
            bindings[count].descriptorType = k_reserved_types[i];
            bindings[count].descriptorCount = 1;
            bindings[count].stageFlags = VK_SHADER_STAGE_COMPUTE_BIT;
        }
        count++;
    }
    return count;
}

VkResult rtrGetReservedBindings(RtrDevice d, const uint32_t* pCode, size_t codeSize, uint32_t* pSet,
                                uint32_t* pBindingCount, VkDescriptorSetLayoutBinding* pBindings) {
    const VkAllocationCallbacks* a = rtr_pick(d, NULL);
    VkDescriptorSetLayoutBinding all[RTC_BINDING_COUNT];
    RtrModule module;
    uint32_t count;
    VkResult r = rtr_parse_module(d, pCode, codeSize, a, &module);
    if (r != VK_SUCCESS) return r;
    count = rtr_reserved_bindings(module.header.used_bindings, module.header.reserved_binding, all);
    if (pSet) *pSet = module.header.reserved_set;
    rtr_free_module(a, &module);
    if (pBindings) {
        uint32_t room = *pBindingCount;
        memcpy(pBindings, all, (room < count ? room : count) * sizeof *all);
        *pBindingCount = room < count ? room : count;
        return room < count ? VK_INCOMPLETE : VK_SUCCESS;
    }
    *pBindingCount = count;
    return VK_SUCCESS;
}

static VkResult check_limit(RtrDevice d, const char* name, uint32_t used, uint32_t limit) {
    if (used <= limit) return VK_SUCCESS;
    return rtr_error(d, VK_ERROR_FEATURE_NOT_PRESENT, name,
                     "%s is %u; the linked module uses %u (all ray tracing stages are one compute stage now)",
                     name, limit, used);
}

static VkResult check_sets(RtrDevice d, const RtrModule* m, uint32_t sets) {
    const uint32_t limit = d->limits.maxBoundDescriptorSets;
    if (sets <= limit || m->header.reserved_set + 1 != sets)
        return check_limit(d, "maxBoundDescriptorSets", sets, limit);
    return rtr_error(d, VK_ERROR_FEATURE_NOT_PRESENT, "maxBoundDescriptorSets",
                     "maxBoundDescriptorSets is %u, and rtc's own descriptors are in set %u; compile with "
                     "--reserved=SET.BINDING to put them behind the bindings of one of your sets",
                     limit, m->header.reserved_set);
}

static VkResult check_limits(RtrDevice d, const RtrModule* m, const RtrTraceOptions* o, uint32_t sets,
                             uint32_t push) {
    const VkPhysicalDeviceLimits* l = &d->limits;
    VkResult r;
    if ((r = check_limit(d, "maxPerStageDescriptorStorageBuffers", m->storage_buffers,
                         l->maxPerStageDescriptorStorageBuffers)) ||
        (r = check_limit(d, "maxPerStageDescriptorUniformBuffers", m->uniform_buffers,
                         l->maxPerStageDescriptorUniformBuffers)) ||
        (r = check_limit(d, "maxPerStageDescriptorSampledImages", m->sampled_images,
                         l->maxPerStageDescriptorSampledImages)) ||
        (r = check_limit(d, "maxPerStageDescriptorStorageImages", m->storage_images,
                         l->maxPerStageDescriptorStorageImages)) ||
        (r = check_limit(d, "maxPerStageDescriptorSamplers", m->samplers,
                         l->maxPerStageDescriptorSamplers)) ||
        (r = check_limit(d, "maxPerStageResources", m->total, l->maxPerStageResources)) ||
        (r = check_sets(d, m, sets)) ||
        (r = check_limit(d, "maxPushConstantsSize", push, l->maxPushConstantsSize)) ||
        (r = check_limit(d, "maxComputeWorkGroupInvocations", o->workgroupSize,
                         l->maxComputeWorkGroupInvocations)) ||
        (r = check_limit(d, "maxComputeWorkGroupSize[0]", o->workgroupSize, l->maxComputeWorkGroupSize[0])) ||
        (r = check_limit(d, "maxComputeSharedMemorySize", o->sharedStack * o->workgroupSize * 4,
                         l->maxComputeSharedMemorySize)))
        return r;
    return VK_SUCCESS;
}

static VkResult pick_options(RtrDevice d, const RtrModule* m, const RtrTraceOptions* given,
                             RtrTraceOptions* o) {
    const RtrTraceOptions* best = &d->support.recommended;
    *o = *best;
    if (given) {
        if (given->fetch != RTR_FETCH_DEFAULT) o->fetch = given->fetch;
        if (given->whileWhile != RTR_DEFAULT) o->whileWhile = given->whileWhile;
        if (given->sharedStack != RTR_DEFAULT) o->sharedStack = given->sharedStack;
        if (given->workgroupSize != RTR_DEFAULT) o->workgroupSize = given->workgroupSize;
        if (given->stepBudget != RTR_DEFAULT) o->stepBudget = given->stepBudget;
    }
    if ((o->fetch != RTR_FETCH_TEXEL && o->fetch != RTR_FETCH_STORAGE) || o->workgroupSize == 0 ||
        o->workgroupSize % 32 || o->sharedStack > RTC_TRAVERSAL_STACK)
        return rtr_error(
            d, VK_ERROR_VALIDATION_FAILED_EXT, "trace-options",
            "RtrTraceOptions: fetch %d, workgroupSize %u (a multiple of 32), sharedStack %u (at most %u)",
            (int)o->fetch, o->workgroupSize, o->sharedStack, RTC_TRAVERSAL_STACK);
    if (!(m->header.flags & RTC_MODULE_RESUMABLE)) {
        if (d->support.needsResumableModules)
            rtr_warning(
                d, "not-resumable",
                "this device ends long loops without a word and the module cannot suspend: pictures may be "
                "wrong; link it as resumable");
        o->stepBudget = 0;
    }
    if (d->validation && !(m->header.flags & RTC_MODULE_CHECKED))
        rtr_warning(d, "not-checked",
                    "validation with a module that was not linked --checked: its traversal follows damaged memory, and "
                    "references to nothing where the scene is not declared");
    return VK_SUCCESS;
}

static VkResult create_layout(RtrDevice d, const RtrRayTracingPipelineCreateInfo* info, RtrPipeline p,
                              const VkAllocationCallbacks* a) {
    VkDescriptorSetLayoutBinding reserved[RTC_BINDING_COUNT];
    VkDescriptorSetLayoutCreateInfo set = {.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO};
    VkPipelineLayoutCreateInfo layout = {.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO};
    VkDescriptorSetLayout sets[33];
    VkPushConstantRange range = {VK_SHADER_STAGE_COMPUTE_BIT, 0, 0};
    uint32_t i;
    VkResult r;
    for (i = 0; i < p->set_layout_count; i++) {
        sets[i] = i < info->setLayoutCount && info->pSetLayouts[i] ? info->pSetLayouts[i] : d->empty_layout;
    }
    if (!p->reserved_in_app_set) {
        set.bindingCount =
            rtr_reserved_bindings(p->header.used_bindings, p->header.reserved_binding, reserved);
        set.pBindings = reserved;
        r = d->vk.CreateDescriptorSetLayout(d->device, &set, a, &p->reserved_layout);
        if (r != VK_SUCCESS) return rtr_error(d, r, "reserved-set", "vkCreateDescriptorSetLayout failed (VkResult %d)", r);
        sets[p->header.reserved_set] = p->reserved_layout;
    }
    range.size = p->push_size;
    layout.setLayoutCount = p->set_layout_count;
    layout.pSetLayouts = sets;
    layout.pushConstantRangeCount = p->push_size ? 1 : 0;
    layout.pPushConstantRanges = &range;
    r = d->vk.CreatePipelineLayout(d->device, &layout, a, &p->layout);
    return r == VK_SUCCESS ? r : rtr_error(d, r, "pipeline-layout", "vkCreatePipelineLayout failed (VkResult %d)", r);
}

/* The application's constants with ours behind them. */
static VkResult create_pipeline(RtrDevice d, VkPipelineCache cache,
                                const RtrRayTracingPipelineCreateInfo* info, RtrPipeline p,
                                const VkAllocationCallbacks* a) {
    const VkSpecializationInfo* given = info->pSpecializationInfo;
    const uint32_t given_count = given ? given->mapEntryCount : 0;
    const size_t given_bytes = given ? given->dataSize : 0, ours_at = (given_bytes + 3) / 4 * 4;
    const uint32_t ours[5][2] = {
        {RTC_SPEC_WORKGROUP_SIZE, p->options.workgroupSize},
        {RTC_SPEC_FETCH, (uint32_t)p->options.fetch},
        {RTC_SPEC_WHILE_WHILE, p->options.whileWhile},
        {RTC_SPEC_STEP_BUDGET, p->options.stepBudget ? p->options.stepBudget : 0xffffffffu},
        {RTC_SPEC_SHARED_STACK, p->options.sharedStack}};
    VkSpecializationMapEntry* entries = rtr_alloc(a, (given_count + 5) * sizeof *entries);
    unsigned char* data = rtr_alloc(a, ours_at + 5 * 4);
    VkShaderModuleCreateInfo module = {.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO};
    VkComputePipelineCreateInfo create = {.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO};
    VkSpecializationInfo merged;
    VkShaderModule handle = VK_NULL_HANDLE;
    uint32_t* narrowed = NULL;
    VkResult r = entries && data ? VK_SUCCESS : VK_ERROR_OUT_OF_HOST_MEMORY;
    uint32_t i;
    if (r == VK_SUCCESS) {
        for (i = 0; i < given_count; i++) {
            entries[i] = given->pMapEntries[i];
            if (entries[i].constantID >= RTC_SPEC_BASE && entries[i].constantID < RTC_SPEC_BASE + 0x10000u)
                r = rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "specialization",
                              "specialisation constant 0x%x belongs to the runtime; use RtrTraceOptions",
                              entries[i].constantID);
        }
        if (given_bytes) memcpy(data, given->pData, given_bytes);
        for (i = 0; i < 5; i++) {
            entries[given_count + i].constantID = ours[i][0];
            entries[given_count + i].offset = (uint32_t)(ours_at + 4 * i);
            entries[given_count + i].size = 4;
            memcpy(data + ours_at + 4 * i, &ours[i][1], 4);
        }
        merged.mapEntryCount = given_count + 5;
        merged.pMapEntries = entries;
        merged.dataSize = ours_at + 20;
        merged.pData = data;
    }
    if (r == VK_SUCCESS) {
        module.codeSize = info->codeSize;
        module.pCode = info->pCode;
        if (d->support.needsResumableModules) { /* lavapipe before Mesa 24 */
            narrowed = rtr_narrow_scopes(info->pCode, &module.codeSize, a);
            module.pCode = narrowed;
            if (!narrowed) r = VK_ERROR_OUT_OF_HOST_MEMORY;
        }
    }
    if (r == VK_SUCCESS) {
        r = d->vk.CreateShaderModule(d->device, &module, a, &handle);
        if (r != VK_SUCCESS) rtr_error(d, r, "shader-module", "vkCreateShaderModule failed (VkResult %d)", r);
    }
    rtr_free(a, narrowed);
    if (r == VK_SUCCESS) {
        create.flags = info->flags & ~(VkPipelineCreateFlags)(VK_PIPELINE_CREATE_DEFER_COMPILE_BIT_NV | PROMISES);
        create.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
        create.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
        create.stage.module = handle;
        create.stage.pName = "main";
        create.stage.pSpecializationInfo = &merged;
        create.layout = p->layout;
        r = d->vk.CreateComputePipelines(d->device, cache, 1, &create, a, &p->pipeline);
        if (r != VK_SUCCESS) rtr_error(d, r, "pipeline", "vkCreateComputePipelines failed (VkResult %d)", r);
    }
    d->vk.DestroyShaderModule(d->device, handle, a);
    rtr_free(a, entries);
    rtr_free(a, data);
    return r;
}

static void forget_deferred(RtrPipeline p, const VkAllocationCallbacks* a) {
    if (!p->deferred) return;
    rtr_free(a, p->deferred->code);
    rtr_free(a, p->deferred->entries);
    rtr_free(a, p->deferred->data);
    rtr_free(a, p->deferred);
    p->deferred = NULL;
}

/* Keeps what create_pipeline needs until rtrCompileDeferred. */
static VkResult defer(VkPipelineCache cache, const RtrRayTracingPipelineCreateInfo* info, RtrPipeline p,
                      const VkAllocationCallbacks* a) {
    const VkSpecializationInfo* given = info->pSpecializationInfo;
    RtrDeferred* x = p->deferred = rtr_alloc(a, sizeof *x);
    if (!x) return VK_ERROR_OUT_OF_HOST_MEMORY;
    x->cache = cache;
    x->flags = info->flags;
    x->code_size = info->codeSize;
    x->code = rtr_alloc(a, info->codeSize);
    if (!x->code) return VK_ERROR_OUT_OF_HOST_MEMORY;
    memcpy(x->code, info->pCode, info->codeSize);
    if (!given || !given->mapEntryCount) return VK_SUCCESS;
    x->entries = rtr_alloc(a, given->mapEntryCount * sizeof *x->entries);
    x->data = rtr_alloc(a, given->dataSize);
    if (!x->entries || !x->data) return VK_ERROR_OUT_OF_HOST_MEMORY;
    memcpy(x->entries, given->pMapEntries, given->mapEntryCount * sizeof *x->entries);
    if (given->dataSize) memcpy(x->data, given->pData, given->dataSize);
    x->specialization = *given;
    x->specialization.pMapEntries = x->entries;
    x->specialization.pData = x->data;
    return VK_SUCCESS;
}

VkResult rtrCompileDeferred(RtrDevice d, RtrPipeline p, uint32_t shader,
                            const VkAllocationCallbacks* allocator) {
    const VkAllocationCallbacks* a = rtr_pick(d, allocator);
    RtrRayTracingPipelineCreateInfo info;
    VkResult r;
    (void)shader;
    if (!p->deferred) return VK_SUCCESS;
    memset(&info, 0, sizeof info);
    info.flags = p->deferred->flags;
    info.pCode = p->deferred->code;
    info.codeSize = p->deferred->code_size;
    if (p->deferred->entries) info.pSpecializationInfo = &p->deferred->specialization;
    r = create_pipeline(d, p->deferred->cache, &info, p, a);
    if (r == VK_SUCCESS) forget_deferred(p, a);
    return r;
}

VkResult rtrCreateRayTracingPipeline(RtrDevice d, VkPipelineCache cache,
                                     const RtrRayTracingPipelineCreateInfo* info,
                                     const VkAllocationCallbacks* allocator, RtrPipeline* pPipeline) {
    const VkAllocationCallbacks* a = rtr_pick(d, allocator);
    RtrModule module;
    RtrPipeline p;
    uint32_t i;
    VkResult r;
    *pPipeline = NULL;
    if ((r = rtr_check_chain(d, "RtrRayTracingPipelineCreateInfo", info->pNext)) != VK_SUCCESS) return r;
    if (info->flags & ~(VkPipelineCreateFlags)(COMPUTE_FLAGS | PROMISES))
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "pipeline-flags",
                         "pipeline: flags 0x%x are none that a pipeline of rtc can have",
                         info->flags & ~(VkPipelineCreateFlags)(COMPUTE_FLAGS | PROMISES));
    if (info->setLayoutCount > 32)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "set-layouts", "%u set layouts; at most 32", info->setLayoutCount);
    if ((r = rtr_parse_module(d, info->pCode, info->codeSize, a, &module)) != VK_SUCCESS) return r;
    p = rtr_alloc(a, sizeof *p);
    if (!p) {
        rtr_free_module(a, &module);
        return VK_ERROR_OUT_OF_HOST_MEMORY;
    }
    p->device = d;
    p->header = module.header;
    p->groups = module.groups;
    p->json = module.json;
    /* A module that uses none of our bindings cannot come from rtc: the parameters are always used. */
    p->reserved_in_app_set =
        p->header.reserved_set < info->setLayoutCount && info->pSetLayouts[p->header.reserved_set];
    p->set_layout_count =
        info->setLayoutCount > p->header.reserved_set + 1 ? info->setLayoutCount : p->header.reserved_set + 1;
    for (i = 0; i < info->pushConstantRangeCount; i++) {
        uint32_t end = info->pPushConstantRanges[i].offset + info->pPushConstantRanges[i].size;
        if (end > p->push_size) p->push_size = end;
    }
    if (p->push_size > RTR_MAX_PUSH_BYTES)
        r = rtr_error(d, VK_ERROR_FEATURE_NOT_PRESENT, "push-constants", "%u bytes of push constants; at most %u", p->push_size,
                      RTR_MAX_PUSH_BYTES);
    if (r == VK_SUCCESS) r = rtr_check_features(d, info->pCode, info->codeSize);
    if (r == VK_SUCCESS) r = pick_options(d, &module, info->pOptions, &p->options);
    if (r == VK_SUCCESS) r = check_limits(d, &module, &p->options, p->set_layout_count, p->push_size);
    if (r == VK_SUCCESS) r = create_layout(d, info, p, a);
    if (r == VK_SUCCESS)
        r = info->flags & VK_PIPELINE_CREATE_DEFER_COMPILE_BIT_NV ? defer(cache, info, p, a)
                                                                  : create_pipeline(d, cache, info, p, a);
    if (r != VK_SUCCESS) {
        rtrDestroyPipeline(d, p, allocator);
        return r;
    }
    *pPipeline = p;
    return VK_SUCCESS;
}

void rtrDestroyPipeline(RtrDevice d, RtrPipeline p, const VkAllocationCallbacks* allocator) {
    const VkAllocationCallbacks* a = rtr_pick(d, allocator);
    if (!p) return;
    d->vk.DestroyPipeline(d->device, p->pipeline, a);
    d->vk.DestroyPipelineLayout(d->device, p->layout, a);
    d->vk.DestroyDescriptorSetLayout(d->device, p->reserved_layout, a);
    forget_deferred(p, a);
    rtr_free(a, p->groups);
    rtr_free(a, p->json);
    rtr_free(a, p);
}

VkResult rtrGetRayTracingShaderGroupHandles(RtrDevice d, RtrPipeline p, uint32_t firstGroup,
                                            uint32_t groupCount, size_t dataSize, void* pData) {
    uint32_t i;
    if (firstGroup > p->header.group_count || groupCount > p->header.group_count - firstGroup ||
        dataSize / RTC_HANDLE_BYTES < groupCount)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "group-handles",
                         "groups %u to %u of %u, %llu bytes: out of range, or too few bytes", firstGroup,
                         firstGroup + groupCount, p->header.group_count, (unsigned long long)dataSize);
    for (i = 0; i < groupCount; i++)
        memcpy((char*)pData + (size_t)i * RTC_HANDLE_BYTES, p->groups[firstGroup + i].handle,
               RTC_HANDLE_BYTES);
    return VK_SUCCESS;
}

void rtrGetPipelineInfo(RtrPipeline p, RtrPipelineInfo* info) {
    memset(info, 0, sizeof *info);
    info->moduleFlags = p->header.flags;
    info->groupCount = p->header.group_count;
    info->stateCount = p->header.state_count;
    info->maxRecursionDepth = p->header.max_recursion_depth;
    info->maxCallableDepth = p->header.max_callable_depth;
    info->stackWords = p->header.stack_words;
    info->scratchWords = p->header.scratch_words;
    info->payloadWords = p->header.payload_words;
    info->attributeWords = p->header.attribute_words;
    info->callableWords = p->header.callable_words;
    info->reservedSet = p->header.reserved_set;
    info->reservedBinding = p->header.reserved_binding;
    info->usedBindings = p->header.used_bindings;
    info->reservedInAppSet = p->reserved_in_app_set;
    info->options = p->options;
    info->pReflectionJson = p->json;
    info->reflectionJsonSize = p->header.json_bytes;
    info->layout = p->layout;
    info->pipeline = p->pipeline;
}

VkDeviceSize rtrGetRayTracingShaderGroupStackSize(RtrDevice d, RtrPipeline p, uint32_t group,
                                                  VkShaderGroupShaderKHR shader) {
    (void)d;
    if (group >= p->header.group_count || p->groups[group].kind != RTC_GROUP_GENERAL ||
        shader != VK_SHADER_GROUP_SHADER_GENERAL_KHR)
        return 0;
    return 4ull * p->header.stack_words;
}

VkResult rtrCmdSetRayTracingPipelineStackSize(RtrRecorder r, uint32_t size) {
    if (!r->cmd) return rtr_not_begun(r, "rtrCmdSetRayTracingPipelineStackSize");
    r->stack_size = size;
    return VK_SUCCESS;
}
