/* RtrDeviceCreateInfo::validation: which acceleration structures are bound and not destroyed, and how large they are. */
#include <stdlib.h>

#include "internal.h"

static void lock(RtrDevice d) {
    while (atomic_flag_test_and_set_explicit(&d->live_lock, memory_order_acquire)) {
    }
}
static void unlock(RtrDevice d) { atomic_flag_clear_explicit(&d->live_lock, memory_order_release); }

void rtr_add_live(RtrAccelerationStructure as) {
    RtrDevice d = as->device;
    if (!d->validation) return;
    lock(d);
    as->live_next = d->live;
    if (d->live) d->live->live_before = as;
    d->live = as;
    d->live_count++;
    unlock(d);
}

void rtr_remove_live(RtrAccelerationStructure as) {
    RtrDevice d = as->device;
    if (!d->validation || !as->buffer) return;
    lock(d);
    if (as->live_next) as->live_next->live_before = as->live_before;
    if (as->live_before)
        as->live_before->live_next = as->live_next;
    else
        d->live = as->live_next;
    d->live_count--;
    unlock(d);
}

uint32_t rtr_count_live(RtrDevice d) {
    uint32_t count;
    lock(d);
    count = d->live_count;
    unlock(d);
    return count;
}

static int by_base(const void* a, const void* b) {
    const uint64_t x = rtr_live_base(a), y = rtr_live_base(b);
    return x < y ? -1 : x > y;
}

VkResult rtr_list_live(RtrRecorder r, RtrHeap heap, bool bottom_only, RtrLive** list, uint32_t* count) {
    RtrDevice d = r->device;
    const VkAllocationCallbacks* a = r->has_allocator ? &r->allocator : NULL;
    uint32_t room = 0, n = 0;
    RtrAccelerationStructure as;
    for (;;) {
        *list = rtr_alloc(a, room * sizeof **list);
        if (!*list) return VK_ERROR_OUT_OF_HOST_MEMORY;
        lock(d);
        for (n = 0, as = d->live; as; as = as->live_next) {
            if (as->heap != heap || (bottom_only && as->type != VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV))
                continue;
            if (n < room) {
                const VkDeviceSize quads = as->size / RTC_QUAD_BYTES;
                (*list)[n].lo = (uint32_t)as->base;
                (*list)[n].hi = (uint32_t)(as->base >> 32);
                (*list)[n].quads = quads > 0xffffffffu ? 0xffffffffu : (uint32_t)quads;
                (*list)[n].unused = 0;
            }
            n++;
        }
        unlock(d);
        if (n <= room) break;
        rtr_free(a, *list);
        room = n;
    }
    *count = n;
    qsort(*list, n, sizeof **list, by_base);
    return VK_SUCCESS;
}
