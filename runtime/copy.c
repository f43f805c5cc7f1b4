/* Copies and property queries. */
#include "build.h"

/* Set 0 with the heap alone, set 1 with one array; binds both. */
static VkResult bind_copy(RtrRecorder rec, RtrHeap heap, uint32_t array, VkBuffer buffer, VkDeviceSize offset,
                          VkDeviceSize range, const VkDescriptorBufferInfo* header) {
    RtrDevice d = rec->device;
    VkDescriptorBufferInfo info = {buffer, offset, range};
    VkWriteDescriptorSet writes[3];
    VkDescriptorSet sets[2];
    uint32_t count = 2;
    VkResult r = rtr_allocate_set(rec, d->input_layout, &sets[0]);
    if (r == VK_SUCCESS) r = rtr_allocate_set(rec, d->array_layout, &sets[1]);
    if (r != VK_SUCCESS) return r;
    memset(writes, 0, sizeof writes);
    writes[0].sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
    writes[0].dstSet = sets[0];
    writes[0].dstBinding = RTR_IN_HEAP;
    writes[0].descriptorCount = 1;
    writes[0].descriptorType = VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
    if (heap) writes[0].pTexelBufferView = &heap->view;
    writes[1].sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
    writes[1].dstSet = sets[1];
    writes[1].dstBinding = array;
    writes[1].descriptorCount = 1;
    writes[1].descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    writes[1].pBufferInfo = &info;
    if (header) {
        writes[2] = writes[1];
        writes[2].dstBinding = RTR_ARR_DST_HEADER;
        writes[2].pBufferInfo = header;
        count = 3;
    }
    d->vk.UpdateDescriptorSets(d->device, heap ? count : count - 1, heap ? writes : writes + 1, 0, NULL);
    d->vk.CmdBindDescriptorSets(rec->cmd, VK_PIPELINE_BIND_POINT_COMPUTE, d->kernel_layout, 0, 2, sets, 0,
                                NULL);
    return VK_SUCCESS;
}

static void dispatch(RtrRecorder rec, RtrKernel kernel, const struct RtrBuildPush* push, uint32_t groups) {
    RtrDevice d = rec->device;
    d->vk.CmdBindPipeline(rec->cmd, VK_PIPELINE_BIND_POINT_COMPUTE, d->kernels[kernel]);
    d->vk.CmdPushConstants(rec->cmd, d->kernel_layout, VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof *push, push);
    d->vk.CmdDispatch(rec->cmd, groups < RTC_MAX_GROUPS_X ? groups : RTC_MAX_GROUPS_X,
                      rtr_groups(groups, RTC_MAX_GROUPS_X), 1);
}

VkResult rtrCmdCopyAccelerationStructure(RtrRecorder rec, RtrAccelerationStructure dst,
                                         RtrAccelerationStructure src,
                                         VkCopyAccelerationStructureModeNV mode) {
    RtrDevice d = rec->device;
    const uint32_t window = d->limits.maxStorageBufferRange / RTC_QUAD_BYTES / 16u * 16u;
    const bool compact = mode == VK_COPY_ACCELERATION_STRUCTURE_MODE_COMPACT_NV;
    struct RtrBuildPush push;
    uint32_t quads, at;
    VkResult r;
    if (!rec->cmd)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "recorder-not-begun",
                         "copy: rtrBeginRecorder first");
    if (!compact && mode != VK_COPY_ACCELERATION_STRUCTURE_MODE_CLONE_NV)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "copy-mode", "copy mode %d: CLONE or COMPACT",
                         (int)mode);
    if (!dst || !src || dst == src || !dst->buffer || !src->buffer || dst->heap != src->heap || dst->type != src->type)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "copy",
                         "copy: two different structures of one type, bound to the same heap or both to buffers, are needed");
    if (!compact && dst->size < src->size)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "copy-size", "clone of %llu bytes into %llu",
                         (unsigned long long)src->size, (unsigned long long)dst->size);
    quads = (uint32_t)(rtr_min_size(dst->size, src->size) / RTC_QUAD_BYTES);
    memset(&push, 0, sizeof push);
    push.self_lo = (uint32_t)dst->base;
    push.self_hi = (uint32_t)(dst->base >> 32);
    push.src_lo = (uint32_t)src->base;
    push.src_hi = (uint32_t)(src->base >> 32);
    push.step = compact;
    for (at = 0; at < quads; at += window) {
        push.window_first = at;
        push.window_count = quads - at < window ? quads - at : window;
        r = bind_copy(rec, dst->heap, RTR_ARR_DST_SLOTS, dst->buffer,
                      dst->offset + (VkDeviceSize)at * RTC_QUAD_BYTES,
                      (VkDeviceSize)push.window_count * RTC_QUAD_BYTES, NULL);
        if (r != VK_SUCCESS) return r;
        if (at) rtr_compute_barrier(rec);
        dispatch(rec, dst->heap ? RTR_KERNEL_copy : RTR_KERNEL_copy_address, &push, rtr_groups(push.window_count, RTR_GROUP));
    }
    return VK_SUCCESS;
}

VkResult rtrCmdWriteAccelerationStructuresProperties(RtrRecorder rec, uint32_t count,
                                                     const RtrAccelerationStructure* structures,
                                                     VkQueryType type, VkBuffer dst, VkDeviceSize offset) {
    RtrDevice d = rec->device;
    uint32_t i;
    if (!rec->cmd)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "recorder-not-begun",
                         "properties: rtrBeginRecorder first");
    if (type != VK_QUERY_TYPE_ACCELERATION_STRUCTURE_COMPACTED_SIZE_NV &&
        type != VK_QUERY_TYPE_ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR)
        return rtr_error(d, VK_ERROR_FEATURE_NOT_PRESENT, "query-type",
                         "query type %d: only VK_QUERY_TYPE_ACCELERATION_STRUCTURE_COMPACTED_SIZE_NV",
                         (int)type);
    if (!dst || offset % 8)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "query-buffer",
                         "dstBuffer missing, or dstOffset not a multiple of 8");
    for (i = 0; i < count; i++) {
        const RtrAccelerationStructure as = structures[i];
        const VkDeviceSize at = offset + 8ull * i, begin = at / 256 * 256;
        VkDescriptorBufferInfo header;
        struct RtrBuildPush push;
        VkResult r;
        if (!as || !as->buffer)
            return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "not-bound", "structure %u is not bound", i);
        header = rtr_header_info(as);
        r = bind_copy(rec, as->heap, RTR_ARR_OUT, dst, begin, at + 8 - begin, &header);
        if (r != VK_SUCCESS) return r;
        memset(&push, 0, sizeof push);
        push.step = (uint32_t)((at - begin) / 4);
        if (i) rtr_compute_barrier(rec);
        dispatch(rec, RTR_KERNEL_property, &push, 1);
    }
    return VK_SUCCESS;
}
