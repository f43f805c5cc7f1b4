/* RtrRecorder: what stands beside a command buffer. Descriptor pools, control-region
 * pieces, tracked bindings. */
#include "internal.h"

static const VkAllocationCallbacks* own(RtrRecorder r) { return r->has_allocator ? &r->allocator : NULL; }

VkResult rtrCreateRecorder(RtrDevice d, const RtrRecorderCreateInfo* info,
                           const VkAllocationCallbacks* allocator, RtrRecorder* pRecorder) {
    const VkAllocationCallbacks* a = rtr_pick(d, allocator);
    RtrRecorder r;
    VkResult result;
    *pRecorder = NULL;
    if ((result = rtr_check_chain(d, "RtrRecorderCreateInfo", info->pNext)) != VK_SUCCESS) return result;
    if (info->controlBuffer && info->controlOffset % 256)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "control-offset",
                         "controlOffset %llu must be a multiple of 256",
                         (unsigned long long)info->controlOffset);
    r = rtr_alloc(a, sizeof *r);
    if (!r) return VK_ERROR_OUT_OF_HOST_MEMORY;
    r->device = d;
    if (a) {
        r->allocator = *a;
        r->has_allocator = true;
    }
    r->control = info->controlBuffer;
    r->control_offset = info->controlOffset;
    r->control_size = info->controlBuffer ? info->controlSize / 256 * 256 : 0;
    r->max_rounds = RTR_DEFAULT_ROUNDS;
    *pRecorder = r;
    return VK_SUCCESS;
}

void rtrDestroyRecorder(RtrDevice d, RtrRecorder r, const VkAllocationCallbacks* allocator) {
    const VkAllocationCallbacks* a = rtr_pick(d, allocator);
    RtrPool* pool;
    if (!r) return;
    for (pool = r->pools; pool;) {
        RtrPool* next = pool->next;
        d->vk.DestroyDescriptorPool(d->device, pool->pool, own(r));
        rtr_free(own(r), pool);
        pool = next;
    }
    rtr_free(own(r), r->launches);
    rtr_free(own(r), r->checked);
    rtr_free(a, r);
}

VkResult rtrBeginRecorder(RtrRecorder r, VkCommandBuffer cmd) {
    if (!cmd)
        return rtr_error(r->device, VK_ERROR_VALIDATION_FAILED_EXT, "command-buffer",
                         "rtrBeginRecorder: commandBuffer is VK_NULL_HANDLE; one in the recording state is needed");
    r->cmd = cmd;
    r->pipeline = NULL;
    r->set_call_count = 0;
    r->push_size = 0;
    r->stack_size = 0;
    r->scene = RTR_NOTHING_DECLARED;
    r->checked_count = 0;
    return VK_SUCCESS;
}

VkResult rtrRetireRecorder(RtrRecorder r) {
    RtrPool* pool;
    for (pool = r->pools; pool; pool = pool->next)
        r->device->vk.ResetDescriptorPool(r->device->device, pool->pool, 0);
    r->current_pool = r->pools;
    r->control_used = 0;
    r->launch_count = 0;
    return VK_SUCCESS;
}

VkResult rtrResetRecorder(RtrRecorder r) {
    rtrRetireRecorder(r);
    r->cmd = VK_NULL_HANDLE;
    r->pipeline = NULL;
    r->heap = NULL;
    r->scratch = VK_NULL_HANDLE;
    r->scratch_offset = r->scratch_size = 0;
    r->max_tile_lanes = 0;
    r->max_rounds = RTR_DEFAULT_ROUNDS;
    r->set_call_count = 0;
    r->push_size = 0;
    r->stack_size = 0;
    return VK_SUCCESS;
}

static VkResult add_pool(RtrRecorder r) {
    const VkDescriptorPoolSize sizes[] = {
        {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, RTR_POOL_SETS * 8},
        {VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER, RTR_POOL_SETS},
        {VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER_DYNAMIC, RTR_POOL_SETS},
    };
    VkDescriptorPoolCreateInfo info = {.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO};
    RtrPool *pool = rtr_alloc(own(r), sizeof *pool), **end;
    VkResult result;
    if (!pool) return VK_ERROR_OUT_OF_HOST_MEMORY;
    info.maxSets = RTR_POOL_SETS;
    info.poolSizeCount = 3;
    info.pPoolSizes = sizes;
    result = r->device->vk.CreateDescriptorPool(r->device->device, &info, own(r), &pool->pool);
    if (result != VK_SUCCESS) {
        rtr_free(own(r), pool);
        return rtr_error(r->device, result, "descriptor-pool", "vkCreateDescriptorPool failed (VkResult %d)", result);
    }
    for (end = &r->pools; *end; end = &(*end)->next) {
    }
    *end = pool;
    r->current_pool = pool;
    return VK_SUCCESS;
}

VkResult rtr_allocate_set(RtrRecorder r, VkDescriptorSetLayout layout, VkDescriptorSet* set) {
    VkDescriptorSetAllocateInfo info = {.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO};
    info.descriptorSetCount = 1;
    info.pSetLayouts = &layout;
    for (;;) {
        VkResult result;
        if (!r->current_pool && (result = add_pool(r)) != VK_SUCCESS) return result;
        info.descriptorPool = r->current_pool->pool;
        result = r->device->vk.AllocateDescriptorSets(r->device->device, &info, set);
        if (result != VK_ERROR_OUT_OF_POOL_MEMORY && result != VK_ERROR_FRAGMENTED_POOL) return result;
        r->current_pool = r->current_pool->next;
    }
}

void rtr_barrier(RtrRecorder r, VkPipelineStageFlags src, VkAccessFlags src_access, VkPipelineStageFlags dst,
                 VkAccessFlags dst_access) {
    VkMemoryBarrier barrier = {.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER};
    barrier.srcAccessMask = src_access;
    barrier.dstAccessMask = dst_access;
    r->device->vk.CmdPipelineBarrier(r->cmd, src, dst, 0, 1, &barrier, 0, NULL, 0, NULL);
}

void rtr_compute_barrier(RtrRecorder r) {
    rtr_barrier(r, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
                VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_SHADER_READ_BIT,
                VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_DRAW_INDIRECT_BIT,
                VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_UNIFORM_READ_BIT |
                    VK_ACCESS_INDIRECT_COMMAND_READ_BIT);
}
