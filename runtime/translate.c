/* Enums of VK_NV_ray_tracing, turned into those of Vulkan 1.1. The KHR values are the
 * same numbers. */
#include "internal.h"

VkBufferUsageFlags rtrTranslateBufferUsage(VkBufferUsageFlags usage) {
    if (usage & VK_BUFFER_USAGE_RAY_TRACING_BIT_NV) {
        usage &= ~(VkBufferUsageFlags)VK_BUFFER_USAGE_RAY_TRACING_BIT_NV;
        usage |= VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT |
                 VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
    }
    /* KHR's: what builds read, and what structures are bound to (in address mode). */
    if (usage & VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_BIT_KHR) {
        usage &= ~(VkBufferUsageFlags)VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_BIT_KHR;
        usage |= VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
    }
    if (usage & VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_STORAGE_BIT_KHR) {
        usage &= ~(VkBufferUsageFlags)VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_STORAGE_BIT_KHR;
        usage |= VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT |
                 VK_BUFFER_USAGE_TRANSFER_DST_BIT;
    }
    return usage;
}

VkPipelineStageFlags rtrTranslatePipelineStages(VkPipelineStageFlags stages) {
    if (stages & VK_PIPELINE_STAGE_RAY_TRACING_SHADER_BIT_NV) {
        stages &= ~(VkPipelineStageFlags)VK_PIPELINE_STAGE_RAY_TRACING_SHADER_BIT_NV;
        stages |= VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT;
    }
    if (stages & VK_PIPELINE_STAGE_ACCELERATION_STRUCTURE_BUILD_BIT_NV) {
        stages &= ~(VkPipelineStageFlags)VK_PIPELINE_STAGE_ACCELERATION_STRUCTURE_BUILD_BIT_NV;
        stages |= VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT;
    }
    return stages;
}

VkAccessFlags rtrTranslateAccess(VkAccessFlags access) {
    if (access & VK_ACCESS_ACCELERATION_STRUCTURE_READ_BIT_NV) {
        access &= ~(VkAccessFlags)VK_ACCESS_ACCELERATION_STRUCTURE_READ_BIT_NV;
        access |= VK_ACCESS_SHADER_READ_BIT;
    }
    if (access & VK_ACCESS_ACCELERATION_STRUCTURE_WRITE_BIT_NV) {
        access &= ~(VkAccessFlags)VK_ACCESS_ACCELERATION_STRUCTURE_WRITE_BIT_NV;
        /* Scratch is named with both AS bits by NV applications; it is read and written. */
        access |= VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_SHADER_READ_BIT;
    }
    return access;
}

VkShaderStageFlags rtrTranslateShaderStages(VkShaderStageFlags stages) {
    const VkShaderStageFlags ray = VK_SHADER_STAGE_RAYGEN_BIT_NV | VK_SHADER_STAGE_ANY_HIT_BIT_NV |
                                   VK_SHADER_STAGE_CLOSEST_HIT_BIT_NV | VK_SHADER_STAGE_MISS_BIT_NV |
                                   VK_SHADER_STAGE_INTERSECTION_BIT_NV | VK_SHADER_STAGE_CALLABLE_BIT_NV;
    if (stages == VK_SHADER_STAGE_ALL) return stages;
    if (stages & ray) stages = (stages & ~ray) | VK_SHADER_STAGE_COMPUTE_BIT;
    return stages;
}

VkDescriptorType rtrTranslateDescriptorType(VkDescriptorType type) {
    if (type == VK_DESCRIPTOR_TYPE_ACCELERATION_STRUCTURE_NV ||
        type == VK_DESCRIPTOR_TYPE_ACCELERATION_STRUCTURE_KHR)
        return VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    return type;
}

VkPipelineStageFlags2 rtrTranslatePipelineStages2(VkPipelineStageFlags2 stages) {
    const VkPipelineStageFlags2 build = VK_PIPELINE_STAGE_2_ACCELERATION_STRUCTURE_BUILD_BIT_KHR |
                                        VK_PIPELINE_STAGE_2_ACCELERATION_STRUCTURE_COPY_BIT_KHR;
    if (stages & VK_PIPELINE_STAGE_2_RAY_TRACING_SHADER_BIT_KHR) {
        stages &= ~VK_PIPELINE_STAGE_2_RAY_TRACING_SHADER_BIT_KHR;
        stages |= VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT;
    }
    if (stages & build) {
        stages &= ~build;
        stages |= VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT;
    }
    return stages;
}

VkAccessFlags2 rtrTranslateAccess2(VkAccessFlags2 access) {
    if (access & (VK_ACCESS_2_ACCELERATION_STRUCTURE_READ_BIT_KHR | VK_ACCESS_2_SHADER_BINDING_TABLE_READ_BIT_KHR)) {
        access &= ~(VK_ACCESS_2_ACCELERATION_STRUCTURE_READ_BIT_KHR | VK_ACCESS_2_SHADER_BINDING_TABLE_READ_BIT_KHR);
        access |= VK_ACCESS_2_SHADER_READ_BIT;
    }
    if (access & VK_ACCESS_2_ACCELERATION_STRUCTURE_WRITE_BIT_KHR) {
        access &= ~VK_ACCESS_2_ACCELERATION_STRUCTURE_WRITE_BIT_KHR;
        access |= VK_ACCESS_2_SHADER_WRITE_BIT | VK_ACCESS_2_SHADER_READ_BIT;
    }
    return access;
}

VkPipelineBindPoint rtrTranslateBindPoint(VkPipelineBindPoint point) {
    return point == VK_PIPELINE_BIND_POINT_RAY_TRACING_NV ? VK_PIPELINE_BIND_POINT_COMPUTE : point;
}

void rtrTranslatePoolSizes(uint32_t count, const VkDescriptorPoolSize* in, VkDescriptorPoolSize* out) {
    uint32_t i;
    for (i = 0; i < count; i++) {
        out[i].type = rtrTranslateDescriptorType(in[i].type);
        out[i].descriptorCount = in[i].descriptorCount;
    }
}

void rtrTranslateLayoutBindings(uint32_t count, const VkDescriptorSetLayoutBinding* in,
                                VkDescriptorSetLayoutBinding* out) {
    uint32_t i;
    for (i = 0; i < count; i++) {
        out[i] = in[i];
        out[i].descriptorType = rtrTranslateDescriptorType(in[i].descriptorType);
        out[i].stageFlags = rtrTranslateShaderStages(in[i].stageFlags);
    }
}

uint32_t rtrTranslatePushConstantRanges(uint32_t count, const VkPushConstantRange* in,
                                        VkPushConstantRange* out) {
    /* Two ranges of one layout must not name the same stage, so those of all ray tracing
     * stages and of compute become one. */
    uint32_t i, kept = 0, begin = 0xffffffffu, end = 0;
    for (i = 0; i < count; i++) {
        VkPushConstantRange range = in[i];
        range.stageFlags = rtrTranslateShaderStages(range.stageFlags);
        if (range.stageFlags & VK_SHADER_STAGE_COMPUTE_BIT) {
            if (range.offset < begin) begin = range.offset;
            if (range.offset + range.size > end) end = range.offset + range.size;
            range.stageFlags &= ~(VkShaderStageFlags)VK_SHADER_STAGE_COMPUTE_BIT;
        }
        if (range.stageFlags) out[kept++] = range;
    }
    if (end) {
        out[kept].stageFlags = VK_SHADER_STAGE_COMPUTE_BIT;
        out[kept].offset = begin;
        out[kept++].size = end - begin;
    }
    return kept;
}
