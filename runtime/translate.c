/* Enums of VK_NV_ray_tracing, turned into those of Vulkan 1.1. The KHR values are the
 * same numbers. */
#include "internal.h"

VkBufferUsageFlags rtrTranslateBufferUsage(VkBufferUsageFlags usage) {
    if (usage & VK_BUFFER_USAGE_RAY_TRACING_BIT_NV) {
        usage &= ~(VkBufferUsageFlags)VK_BUFFER_USAGE_RAY_TRACING_BIT_NV;
        usage |= VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT |
                 VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
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
