/* RtrDeviceCreateInfo::validation: what is looked at on the device before a launch. */
#include "build.h"

static const uint32_t k_size_word[4] = {0, RTC_PARAM_MISS_SIZE, RTC_PARAM_HIT_SIZE, RTC_PARAM_CALLABLE_SIZE};

VkResult rtr_validate_launch(RtrRecorder r, const RtrLaunchCheck* c) {
    struct RtrBuildPush push;
    RtrBinding b[3] = {{0, RTR_IN_DATA, {VK_NULL_HANDLE, 0, 0}},
                       {1, RTR_ARR_STATE, c->params},
                       {1, RTR_ARR_DST_HEADER, c->control}};
    uint32_t i;
    VkResult result;
    memset(&push, 0, sizeof push);
    push.blocks = c->slots;
    push.step = c->slot_words;
    push.facts = c->identity;
    for (i = 0; i < 4; i++) {
        const RtrStridedBufferRegion* g = &c->regions[i];
        uint64_t records = 0;
        if (!g->buffer) continue;
        b[0].info.buffer = g->buffer;
        b[0].info.offset = g->offset / 256 * 256;
        b[0].info.range = VK_WHOLE_SIZE;
        push.data_offset = (uint32_t)(g->offset - b[0].info.offset);
        push.data_stride = (uint32_t)g->stride;
        push.first = i;
        push.window_first = k_size_word[i];
        push.total = g->size > 0xffffffffu ? 0xffffffffu : (uint32_t)g->size;
        /* Without a size nobody knows where the table ends and something else begins. */
        if (i == 0) {
            records = 1;
        } else if (g->size != VK_WHOLE_SIZE) {
            records = g->stride ? g->size / g->stride : g->size != 0;
        }
        push.count = records > RTC_ERROR_RECORD_MASK ? RTC_ERROR_RECORD_MASK : (uint32_t)records;
        if ((result = rtr_bind_sets(r, NULL, b, 3)) != VK_SUCCESS) return result;
        rtr_dispatch_kernel(r, RTR_KERNEL_validate_launch, &push,
                            rtr_groups(push.count > c->slots ? push.count : c->slots, RTR_GROUP));
        rtr_compute_barrier(r);
    }
    if ((result = rtr_check_launch_instances(r, c)) != VK_SUCCESS) return result;
    b[0].info = c->params; /* not looked at */
    push.flags = 1;
    if ((result = rtr_bind_sets(r, NULL, b, 3)) != VK_SUCCESS) return result;
    rtr_dispatch_kernel(r, RTR_KERNEL_validate_launch, &push, rtr_groups(c->slots, RTR_GROUP));
    rtr_compute_barrier(r);
    return VK_SUCCESS;
}
