/* Descriptors of the reserved set: of a set of the runtime, or in one of the application. */
#include "internal.h"

void rtr_write_reserved(RtrDevice d, const struct RtrPipeline_T* p, VkDescriptorSet set,
                        const RtrReservedInfo* info) {
    VkWriteDescriptorSet writes[RTC_BINDING_COUNT];
    VkDescriptorSetLayoutBinding bindings[RTC_BINDING_COUNT];
    const uint32_t count =
        rtr_reserved_bindings(p->header.used_bindings, p->header.reserved_binding, bindings);
    uint32_t i;
    memset(writes, 0, sizeof writes);
    for (i = 0; i < count; i++) {
        const uint32_t which = bindings[i].binding - p->header.reserved_binding;
        writes[i].sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
        writes[i].dstSet = set;
        writes[i].dstBinding = bindings[i].binding;
        writes[i].descriptorCount = 1;
        writes[i].descriptorType = bindings[i].descriptorType;
        writes[i].pBufferInfo = &info->buffers[which];
        writes[i].pTexelBufferView = &info->texels;
    }
    d->vk.UpdateDescriptorSets(d->device, count, writes, 0, NULL);
}

void rtr_reserved_heap(RtrDevice d, RtrHeap heap, RtrReservedInfo* info) {
    info->texels = heap->view;
    info->buffers[RTC_BINDING_HEAP].buffer = heap->buffer;
    info->buffers[RTC_BINDING_HEAP].offset = heap->offset;
    info->buffers[RTC_BINDING_HEAP].range = rtr_min_size(heap->size, d->limits.maxStorageBufferRange);
}

VkResult rtrWriteReservedDescriptors(RtrDevice d, RtrPipeline p, VkDescriptorSet set,
                                     const RtrReservedDescriptors* in) {
    const VkBuffer sbt[4] = {in->raygenBuffer, in->missBuffer, in->hitBuffer, in->callableBuffer};
    RtrReservedInfo info;
    uint32_t i;
    if (!p->reserved_in_app_set)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "reserved-set",
                         "the pipeline keeps its reserved bindings in a set of the runtime");
    if (!in->recorder || !in->recorder->control)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "control-buffer",
                         "RtrReservedDescriptors: a recorder with a control region is needed");
    info.texels = VK_NULL_HANDLE;
    for (i = 0; i < RTC_BINDING_COUNT; i++) {
        info.buffers[i].buffer = in->recorder->control;
        info.buffers[i].offset = in->recorder->control_offset;
        info.buffers[i].range = rtr_min_size(in->recorder->control_size, d->limits.maxStorageBufferRange);
    }
    info.buffers[RTC_BINDING_PARAMS].range = RTR_PARAM_BYTES;
    for (i = 0; i < 4; i++) {
        if (!sbt[i]) continue;
        info.buffers[RTC_BINDING_SBT_RAYGEN + i].buffer = sbt[i];
        info.buffers[RTC_BINDING_SBT_RAYGEN + i].offset = 0;
        info.buffers[RTC_BINDING_SBT_RAYGEN + i].range = VK_WHOLE_SIZE;
    }
    if (in->heap) rtr_reserved_heap(d, in->heap, &info);
    if (in->launchScratch) {
        info.buffers[RTC_BINDING_SCRATCH].buffer = in->launchScratch;
        info.buffers[RTC_BINDING_SCRATCH].offset = in->launchScratchOffset;
        info.buffers[RTC_BINDING_SCRATCH].range =
            rtr_min_size(in->launchScratchSize, d->limits.maxStorageBufferRange);
    }
    rtr_write_reserved(d, p, set, &info);
    return VK_SUCCESS;
}
