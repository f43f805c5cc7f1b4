/* RtrHeap: a range of an application buffer with its texel view, and an arena over it. */
#include "internal.h"

VkResult rtrCreateHeap(RtrDevice d, const RtrHeapCreateInfo* info, const VkAllocationCallbacks* allocator,
                       RtrHeap* pHeap) {
    const VkAllocationCallbacks* a = rtr_pick(d, allocator);
    VkBufferViewCreateInfo view = {.sType = VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO};
    RtrHeap h;
    VkResult r;
    *pHeap = NULL;
    if ((r = rtr_check_chain(d, "RtrHeapCreateInfo", info->pNext)) != VK_SUCCESS) return r;
    if (!info->buffer || info->offset % RTC_AS_ALIGNMENT != 0 || info->size < 2 * RTC_AS_ALIGNMENT)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "heap-range",
                         "heap: buffer %s, offset %llu must be a multiple of 256, size %llu at least 512",
                         info->buffer ? "given" : "missing", (unsigned long long)info->offset,
                         (unsigned long long)info->size);
    if (info->size > d->support.maxHeapSizeTexel)
        return rtr_error(
            d, VK_ERROR_FEATURE_NOT_PRESENT, "heap-size",
            "heap of %llu bytes: maxTexelBufferElements allows %llu (address mode would lift this)",
            (unsigned long long)info->size, (unsigned long long)d->support.maxHeapSizeTexel);
    h = rtr_alloc(a, sizeof *h);
    if (!h) return VK_ERROR_OUT_OF_HOST_MEMORY;
    h->device = d;
    if (a) {
        h->allocator = *a;
        h->has_allocator = true;
    }
    h->buffer = info->buffer;
    h->offset = info->offset;
    h->size = info->size / RTC_AS_ALIGNMENT * RTC_AS_ALIGNMENT;
    h->id = RTC_HEAP_TAG | (atomic_fetch_add_explicit(&d->heaps, 1, memory_order_relaxed) + 1);
    view.buffer = h->buffer;
    view.format = VK_FORMAT_R32G32B32A32_UINT;
    view.offset = h->offset;
    view.range = h->size;
    r = d->vk.CreateBufferView(d->device, &view, a, &h->view);
    if (r != VK_SUCCESS) {
        rtr_free(a, h);
        return rtr_error(d, r, "heap-view", "heap: vkCreateBufferView failed (VkResult %d)", r);
    }
    *pHeap = h;
    return VK_SUCCESS;
}

void rtrDestroyHeap(RtrDevice d, RtrHeap heap, const VkAllocationCallbacks* allocator) {
    const VkAllocationCallbacks* a = rtr_pick(d, allocator);
    if (!heap) return;
    d->vk.DestroyBufferView(d->device, heap->view, a);
    rtr_free(heap->has_allocator ? &heap->allocator : NULL, heap->used);
    rtr_free(a, heap);
}

VkResult rtrCmdInitializeHeap(RtrRecorder recorder, RtrHeap heap) {
    RtrDevice d = recorder->device;
    if (!recorder->cmd)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "recorder-not-begun",
                         "rtrCmdInitializeHeap: begin first");
    d->vk.CmdFillBuffer(recorder->cmd, heap->buffer, heap->offset, RTC_AS_ALIGNMENT, 0);
    rtr_barrier(recorder, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_WRITE_BIT,
                VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_ACCESS_SHADER_READ_BIT);
    return VK_SUCCESS;
}

VkResult rtrAllocateHeapRange(RtrHeap heap, VkDeviceSize size, VkDeviceSize alignment,
                              VkDeviceSize* pOffset) {
    VkDeviceSize at = RTC_AS_ALIGNMENT; /* the null structure lies before */
    uint32_t i;
    if (alignment < RTC_AS_ALIGNMENT) alignment = RTC_AS_ALIGNMENT;
    size = rtr_align(size ? size : 1, RTC_AS_ALIGNMENT);
    for (i = 0; i < heap->used_count; i++) {
        VkDeviceSize begin = rtr_align(at, alignment);
        if (begin + size <= heap->used[i].offset) break;
        at = heap->used[i].offset + heap->used[i].size;
    }
    at = rtr_align(at, alignment);
    if (size > heap->size || at > heap->size - size)
        return rtr_error(heap->device, VK_ERROR_OUT_OF_DEVICE_MEMORY, "heap-full",
                         "heap of %llu bytes has no free range of %llu", (unsigned long long)heap->size,
                         (unsigned long long)size);
    if (heap->used_count == heap->used_capacity) {
        const VkAllocationCallbacks* a = heap->has_allocator ? &heap->allocator : NULL;
        uint32_t capacity = heap->used_capacity ? 2 * heap->used_capacity : 16;
        RtrHeapRange* more = rtr_alloc(a, capacity * sizeof *more);
        if (!more) return VK_ERROR_OUT_OF_HOST_MEMORY;
        if (heap->used_count) memcpy(more, heap->used, heap->used_count * sizeof *more);
        rtr_free(a, heap->used);
        heap->used = more;
        heap->used_capacity = capacity;
    }
    memmove(heap->used + i + 1, heap->used + i, (heap->used_count - i) * sizeof *heap->used);
    heap->used[i].offset = at;
    heap->used[i].size = size;
    heap->used_count++;
    *pOffset = at;
    return VK_SUCCESS;
}

void rtrFreeHeapRange(RtrHeap heap, VkDeviceSize offset) {
    uint32_t i;
    for (i = 0; i < heap->used_count; i++) {
        if (heap->used[i].offset == offset) {
            memmove(heap->used + i, heap->used + i + 1, (heap->used_count - i - 1) * sizeof *heap->used);
            heap->used_count--;
            return;
        }
    }
    rtr_warning(heap->device, "heap-free", "rtrFreeHeapRange: no range starts at %llu",
                (unsigned long long)offset);
}
