/* Ray tracing pipelines from stages, for programs that link both rtc's compiler and its
 * runtime: vkCreateRayTracingPipelinesNV with the compiler in place of the driver's.
 *
 * Only inline functions; C11 or C++. The runtime itself does not know the compiler. The
 * structures are Vulkan's own; a stage's code is given as VK_KHR_maintenance5 does it:
 * `module` is VK_NULL_HANDLE and pNext leads to a VkShaderModuleCreateInfo, because SPIR-V
 * cannot be got back out of a VkShaderModule.
 */
#ifndef RTC_RUNTIME_COMPILER_H_
#define RTC_RUNTIME_COMPILER_H_

#include <stdio.h>
#include <string.h>

#include "rtc/compiler.h"
#include "rtc/runtime.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What VkRayTracingPipelineCreateInfoNV does not say. */
typedef struct RtrStagesInfo {
    rtcc_const_compiler_t compiler;
    rtcc_const_options_t options; /* NULL: the defaults. The recursion depth is taken from Vulkan's structure */
    /* The layouts and ranges of VkRayTracingPipelineCreateInfoNV::layout, which cannot be
     * read back; see RtrRayTracingPipelineCreateInfo. */
    uint32_t setLayoutCount;
    const VkDescriptorSetLayout* pSetLayouts;
    uint32_t pushConstantRangeCount;
    const VkPushConstantRange* pPushConstantRanges;
    const RtrTraceOptions* pOptions; /* NULL: as the device recommends */
} RtrStagesInfo;

static inline VkResult rtr_stages_error(RtrDevice device, const char* id, const char* text) {
    rtrReportMessage(device, VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT, id, text);
    return VK_ERROR_VALIDATION_FAILED_EXT;
}

/* The runtime's own check, for structures that only this header reads. */
static inline VkResult rtr_check_structure(RtrDevice device, const char* owner, VkStructureType type,
                                           VkStructureType expected, const void* next) {
    char text[160];
    if (type != expected) {
        snprintf(text, sizeof text, "%s::sType is %d, not %d", owner, (int)type, (int)expected);
        return rtr_stages_error(device, "sType", text);
    }
    if (!next) return VK_SUCCESS;
    snprintf(text, sizeof text,
             "%s::pNext leads to a structure of type %d, which rtc does not know; it must be NULL", owner,
             (int)((const VkBaseInStructure*)next)->sType);
    return rtr_stages_error(device, "pNext", text);
}

static inline rtcc_stage rtr_stage_of(VkShaderStageFlagBits stage) {
    switch (stage) {
        case VK_SHADER_STAGE_RAYGEN_BIT_NV:
            return RTCC_STAGE_RAYGEN;
        case VK_SHADER_STAGE_INTERSECTION_BIT_NV:
            return RTCC_STAGE_INTERSECTION;
        case VK_SHADER_STAGE_ANY_HIT_BIT_NV:
            return RTCC_STAGE_ANY_HIT;
        case VK_SHADER_STAGE_CLOSEST_HIT_BIT_NV:
            return RTCC_STAGE_CLOSEST_HIT;
        case VK_SHADER_STAGE_MISS_BIT_NV:
            return RTCC_STAGE_MISS;
        case VK_SHADER_STAGE_CALLABLE_BIT_NV:
            return RTCC_STAGE_CALLABLE;
        default:
            return RTCC_STAGE_AUTO;
    }
}

static inline VkResult rtr_add_stage(RtrDevice device, rtcc_pipeline_t pipeline, uint32_t index,
                                     const VkPipelineShaderStageCreateInfo* info) {
    const VkBaseInStructure* next = (const VkBaseInStructure*)info->pNext;
    const VkShaderModuleCreateInfo* code;
    const VkSpecializationInfo* constants = info->pSpecializationInfo;
    char name[24], text[192];
    VkResult r;
    uint32_t i;
    int32_t stage;
    /* A stage's chain is the words and nothing else. */
    code = next && next->sType == VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO
               ? (const VkShaderModuleCreateInfo*)next
               : NULL;
    r = rtr_check_structure(device, "VkPipelineShaderStageCreateInfo", info->sType,
                            VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO, code ? code->pNext : (const void*)next);
    if (r != VK_SUCCESS) return r;
    snprintf(name, sizeof name, "stage %u", (unsigned)index);
    if (info->flags || (code && code->flags)) {
        snprintf(text, sizeof text, "%s: flags 0x%x of the stage, 0x%x of its module: subgroup sizes and others are "
                 "not a ray tracing stage's to ask for", name, (unsigned)info->flags, code ? (unsigned)code->flags : 0u);
        return rtr_stages_error(device, "stage", text);
    }
    if (!code || info->module || rtr_stage_of(info->stage) == RTCC_STAGE_AUTO) {
        snprintf(text, sizeof text, "%s: needs a ray tracing stage bit, no module, and a VkShaderModuleCreateInfo",
                 name);
        return rtr_stages_error(device, "stage", text);
    }
    stage = rtcc_pipeline_add_spirv(pipeline, rtr_stage_of(info->stage), name, name, code->pCode,
                                    code->codeSize / 4, info->pName);
    if (stage < 0) return rtr_stages_error(device, "stage", "a stage was refused, or memory is out");
    for (i = 0; constants && i < constants->mapEntryCount; i++) {
        const VkSpecializationMapEntry* entry = &constants->pMapEntries[i];
        uint64_t bits = 0;
        if (entry->size > sizeof bits || entry->offset > constants->dataSize ||
            entry->size > constants->dataSize - entry->offset)
            return rtr_stages_error(device, "specialization", "a constant reaches beyond its data");
        memcpy(&bits, (const char*)constants->pData + entry->offset, entry->size);
        if (rtcc_pipeline_specialize(pipeline, stage, entry->constantID, bits) != RTCC_STATUS_SUCCESS)
            return VK_ERROR_OUT_OF_HOST_MEMORY;
    }
    return VK_SUCCESS;
}

static inline VkResult rtr_add_group(RtrDevice device, rtcc_pipeline_t pipeline, uint32_t index,
                                     const VkRayTracingShaderGroupCreateInfoNV* info, uint32_t stage_count) {
    const uint32_t shaders[4] = {info->generalShader, info->closestHitShader, info->anyHitShader,
                                 info->intersectionShader};
    int32_t stage[4], group;
    const int general = info->type == VK_RAY_TRACING_SHADER_GROUP_TYPE_GENERAL_NV;
    char name[24], text[128];
    uint32_t i;
    const VkResult r = rtr_check_structure(device, "VkRayTracingShaderGroupCreateInfoNV", info->sType,
                                           VK_STRUCTURE_TYPE_RAY_TRACING_SHADER_GROUP_CREATE_INFO_NV, info->pNext);
    if (r != VK_SUCCESS) return r;
    snprintf(name, sizeof name, "group %u", (unsigned)index);
    for (i = 0; i < 4; i++) {
        stage[i] = shaders[i] == VK_SHADER_UNUSED_NV ? -1 : (int32_t)shaders[i];
        if ((shaders[i] != VK_SHADER_UNUSED_NV && shaders[i] >= stage_count) ||
            (general == (i > 0) && stage[i] >= 0)) {
            snprintf(text, sizeof text, "%s: shader %u has no place in a group of type %d, or is no stage", name,
                     (unsigned)shaders[i], (int)info->type);
            return rtr_stages_error(device, "group", text);
        }
    }
    if ((info->type == VK_RAY_TRACING_SHADER_GROUP_TYPE_PROCEDURAL_HIT_GROUP_NV) != (stage[3] >= 0)) {
        snprintf(text, sizeof text, "%s: procedural groups have an intersection shader, others none", name);
        return rtr_stages_error(device, "group", text);
    }
    group = general ? rtcc_pipeline_add_general_group(pipeline, name, stage[0])
                    : rtcc_pipeline_add_hit_group(pipeline, name, stage[1], stage[2], stage[3]);
    if (group >= 0) return VK_SUCCESS;
    snprintf(text, sizeof text, "%s was refused, or memory is out", name);
    return rtr_stages_error(device, "group", text);
}

/* Links the stages into a module and makes a pipeline of it. Group n of pCreateInfo is group
 * n of the pipeline. Compiler messages go to the device's messenger. pCreateInfo's `layout`
 * and base pipeline are ignored. On a device with validation the checking variant of traversal is
 * linked (rtcc_options_set_checked). maxRecursionDepth is the linker's (at most 31); with 0 no shader
 * may trace at all. Thread-safe as rtcc_compile_pipeline is. Host memory of the compiler is malloc's:
 * pAllocator is for the pipeline.
 * Counterpart: vkCreateRayTracingPipelinesNV (one pipeline a call).
 * Errors: VALIDATION_FAILED with a message for what cannot be compiled or linked, for structures behind
 * pNext other than a stage's words, for another sType and for flags of stages; those of
 * rtrCreateRayTracingPipeline. */
static inline VkResult rtrCreateRayTracingPipelineFromStages(RtrDevice device, VkPipelineCache pipelineCache,
                                                             const VkRayTracingPipelineCreateInfoNV* pCreateInfo,
                                                             const RtrStagesInfo* pStages,
                                                             const VkAllocationCallbacks* pAllocator,
                                                             RtrPipeline* pPipeline) {
    rtcc_pipeline_t pipeline = rtcc_pipeline_create();
    rtcc_options_t options = rtcc_options_clone(pStages->options);
    rtcc_result_t result = NULL;
    RtrRayTracingPipelineCreateInfo info;
    VkResult r = pipeline && options ? VK_SUCCESS : VK_ERROR_OUT_OF_HOST_MEMORY;
    uint32_t i;
    size_t d;
    *pPipeline = NULL;
    if (r == VK_SUCCESS)
        r = rtr_check_structure(device, "VkRayTracingPipelineCreateInfoNV", pCreateInfo->sType,
                                VK_STRUCTURE_TYPE_RAY_TRACING_PIPELINE_CREATE_INFO_NV, pCreateInfo->pNext);
    for (i = 0; r == VK_SUCCESS && i < pCreateInfo->stageCount; i++)
        r = rtr_add_stage(device, pipeline, i, &pCreateInfo->pStages[i]);
    for (i = 0; r == VK_SUCCESS && i < pCreateInfo->groupCount; i++)
        r = rtr_add_group(device, pipeline, i, &pCreateInfo->pGroups[i], pCreateInfo->stageCount);
    if (r == VK_SUCCESS &&
        rtcc_options_set_max_recursion_depth(options, pCreateInfo->maxRecursionDepth
                                                          ? pCreateInfo->maxRecursionDepth
                                                          : 1) != RTCC_STATUS_SUCCESS)
        r = rtr_stages_error(device, "recursion-limit", "maxRecursionDepth must be 31 or less");
    if (r == VK_SUCCESS && rtrIsValidating(device) && rtcc_options_set_checked(options, 1) != RTCC_STATUS_SUCCESS)
        r = VK_ERROR_OUT_OF_HOST_MEMORY;
    if (r == VK_SUCCESS) {
        result = rtcc_compile_pipeline(pStages->compiler, pipeline, options);
        if (!result) r = VK_ERROR_OUT_OF_HOST_MEMORY;
    }
    for (d = 0; r == VK_SUCCESS && d < rtcc_result_diagnostic_count(result); d++) {
        const rtcc_diagnostic message = rtcc_result_diagnostic(result, d);
        rtrReportMessage(device,
                         message.severity == RTCC_SEVERITY_ERROR ? VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT
                                                                 : VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT,
                         message.id, message.text);
    }
    if (r == VK_SUCCESS && rtcc_result_status(result) != RTCC_STATUS_SUCCESS) r = VK_ERROR_VALIDATION_FAILED_EXT;
    /* No depth: not even ray generation traces. */
    for (d = 0; r == VK_SUCCESS && !pCreateInfo->maxRecursionDepth && d < rtcc_result_reflection(result)->trace_site_count; d++)
        if (!rtcc_result_reflection(result)->trace_sites[d].callable)
            r = rtr_stages_error(device, "recursion-limit", "maxRecursionDepth is 0, but a shader traces; it must be 1 or more");
    if (r == VK_SUCCESS) {
        memset(&info, 0, sizeof info);
        info.flags = pCreateInfo->flags & ~(VkPipelineCreateFlags)VK_PIPELINE_CREATE_DERIVATIVE_BIT;
        info.pCode = rtcc_result_words(result);
        info.codeSize = 4 * rtcc_result_word_count(result);
        info.setLayoutCount = pStages->setLayoutCount;
        info.pSetLayouts = pStages->pSetLayouts;
        info.pushConstantRangeCount = pStages->pushConstantRangeCount;
        info.pPushConstantRanges = pStages->pPushConstantRanges;
        info.pOptions = pStages->pOptions;
        r = rtrCreateRayTracingPipeline(device, pipelineCache, &info, pAllocator, pPipeline);
    }
    rtcc_result_release(result);
    rtcc_options_release(options);
    rtcc_pipeline_release(pipeline);
    return r;
}

#ifdef __cplusplus
}
#endif

#endif /* RTC_RUNTIME_COMPILER_H_ */
