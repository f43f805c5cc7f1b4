/* Copies and property queries. */
#include "build.h"

VkResult rtr_bind_sets(RtrRecorder rec, RtrHeap heap, const RtrBinding* bindings, uint32_t count) {
    RtrDevice d = rec->device;
    VkWriteDescriptorSet writes[RTR_IN_COUNT + RTR_ARR_COUNT];
    VkDescriptorSet sets[2];
    uint32_t i;
    VkResult r = rtr_allocate_set(rec, d->input_layout, &sets[0]);
    if (r == VK_SUCCESS) r = rtr_allocate_set(rec, d->array_layout, &sets[1]);
    if (r != VK_SUCCESS) return r;
    memset(writes, 0, sizeof writes);
    for (i = 0; i < count; i++) {
        writes[i].sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
        writes[i].dstSet = sets[bindings[i].set];
        writes[i].dstBinding = bindings[i].binding;
        writes[i].descriptorCount = 1;
        writes[i].descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
        writes[i].pBufferInfo = &bindings[i].info;
    }
    if (heap) {
        writes[i].sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
        writes[i].dstSet = sets[0];
        writes[i].dstBinding = RTR_IN_HEAP;
        writes[i].descriptorCount = 1;
        writes[i].descriptorType = VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
        writes[i++].pTexelBufferView = &heap->view;
    }
    d->vk.UpdateDescriptorSets(d->device, i, writes, 0, NULL);
    d->vk.CmdBindDescriptorSets(rec->cmd, VK_PIPELINE_BIND_POINT_COMPUTE, d->kernel_layout, 0, 2, sets, 0,
                                NULL);
    return VK_SUCCESS;
}

void rtr_dispatch_kernel(RtrRecorder rec, RtrKernel kernel, const struct RtrBuildPush* push, uint32_t groups) {
    RtrDevice d = rec->device;
    d->vk.CmdBindPipeline(rec->cmd, VK_PIPELINE_BIND_POINT_COMPUTE, d->kernels[kernel]);
    d->vk.CmdPushConstants(rec->cmd, d->kernel_layout, VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof *push, push);
    d->vk.CmdDispatch(rec->cmd, groups < RTC_MAX_GROUPS_X ? groups : RTC_MAX_GROUPS_X,
                      rtr_groups(groups, RTC_MAX_GROUPS_X), 1);
}

void rtr_dispatch_kernel_indirect(RtrRecorder rec, RtrKernel kernel, const struct RtrBuildPush* push, VkBuffer buffer,
                                  VkDeviceSize offset) {
    RtrDevice d = rec->device;
    d->vk.CmdBindPipeline(rec->cmd, VK_PIPELINE_BIND_POINT_COMPUTE, d->kernels[kernel]);
    d->vk.CmdPushConstants(rec->cmd, d->kernel_layout, VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof *push, push);
    d->vk.CmdDispatchIndirect(rec->cmd, buffer, offset);
}

VkResult rtrCmdCopyAccelerationStructure(RtrRecorder rec, RtrAccelerationStructure dst,
                                         RtrAccelerationStructure src,
                                         VkCopyAccelerationStructureModeNV mode) {
    RtrDevice d = rec->device;
    const uint32_t window = d->limits.maxStorageBufferRange / RTC_QUAD_BYTES / 16u * 16u;
    const bool compact = mode == VK_COPY_ACCELERATION_STRUCTURE_MODE_COMPACT_NV;
    RtrBinding target = {1, RTR_ARR_DST_SLOTS, {VK_NULL_HANDLE, 0, 0}};
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
    push.slots_quad = (uint32_t)rtr_min_size(dst->size / RTC_QUAD_BYTES, 0xffffffffu);
    for (at = 0; at < quads; at += window) {
        push.window_first = at;
        push.window_count = quads - at < window ? quads - at : window;
        target.info.buffer = dst->buffer;
        target.info.offset = dst->offset + (VkDeviceSize)at * RTC_QUAD_BYTES;
        target.info.range = (VkDeviceSize)push.window_count * RTC_QUAD_BYTES;
        r = rtr_bind_sets(rec, dst->heap, &target, 1);
        if (r != VK_SUCCESS) return r;
        if (at) rtr_compute_barrier(rec);
        rtr_dispatch_kernel(rec, dst->heap ? RTR_KERNEL_copy : RTR_KERNEL_copy_address, &push, rtr_groups(push.window_count, RTR_GROUP));
    }
    rtr_share_built(dst, src);
    return VK_SUCCESS;
}

VkResult rtr_property_of_query(RtrDevice d, VkQueryType type, uint32_t* what) {
    switch (type) {
        case VK_QUERY_TYPE_ACCELERATION_STRUCTURE_COMPACTED_SIZE_NV:
        case VK_QUERY_TYPE_ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR:
            *what = RTR_PROPERTY_COMPACTED_SIZE;
            break;
        case VK_QUERY_TYPE_ACCELERATION_STRUCTURE_SERIALIZATION_SIZE_KHR:
            *what = RTR_PROPERTY_SERIALIZED_SIZE;
            break;
        case VK_QUERY_TYPE_ACCELERATION_STRUCTURE_SERIALIZATION_BOTTOM_LEVEL_POINTERS_KHR:
            *what = RTR_PROPERTY_HANDLES;
            break;
        case VK_QUERY_TYPE_ACCELERATION_STRUCTURE_SIZE_KHR:
            *what = RTR_PROPERTY_SIZE;
            break;
        default:
            return rtr_error(d, VK_ERROR_FEATURE_NOT_PRESENT, "query-type",
                             "query type %d: only COMPACTED_SIZE (NV, KHR), SIZE, SERIALIZATION_SIZE and "
                             "SERIALIZATION_BOTTOM_LEVEL_POINTERS",
                             (int)type);
    }
    return VK_SUCCESS;
}

VkResult rtrCmdWriteAccelerationStructuresProperties(RtrRecorder rec, uint32_t count,
                                                     const RtrAccelerationStructure* structures,
                                                     VkQueryType type, VkBuffer dst, VkDeviceSize offset) {
    RtrDevice d = rec->device;
    uint32_t what = RTR_PROPERTY_SIZE, i;
    VkResult r;
    if (!rec->cmd)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "recorder-not-begun",
                         "properties: rtrBeginRecorder first");
    if ((r = rtr_property_of_query(d, type, &what)) != VK_SUCCESS) return r;
    if (!dst || offset % 8)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "query-buffer",
                         "dstBuffer missing, or dstOffset not a multiple of 8");
    for (i = 0; i < count; i++) {
        const RtrAccelerationStructure as = structures[i];
        const VkDeviceSize at = offset + 8ull * i, begin = at / 256 * 256;
        RtrBinding bindings[2] = {{1, RTR_ARR_OUT, {dst, begin, at + 8 - begin}},
                                  {1, RTR_ARR_DST_HEADER, {VK_NULL_HANDLE, 0, 0}}};
        struct RtrBuildPush push;
        if (!as || !as->buffer)
            return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "not-bound", "structure %u is not bound", i);
        bindings[1].info = rtr_header_info(as);
        r = rtr_bind_sets(rec, NULL, bindings, 2);
        if (r != VK_SUCCESS) return r;
        memset(&push, 0, sizeof push);
        push.step = (uint32_t)((at - begin) / 4);
        push.count = what;
        push.first = (uint32_t)rtr_align(as->size, RTC_AS_ALIGNMENT);
        push.total = (uint32_t)(rtr_align(as->size, RTC_AS_ALIGNMENT) >> 32);
        if (i) rtr_compute_barrier(rec);
        rtr_dispatch_kernel(rec, RTR_KERNEL_property, &push, 1);
    }
    return VK_SUCCESS;
}
