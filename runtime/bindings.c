/* Ray tracing state of a recorder: pipeline, sets, push constants, heap, scratch, limits.
 * Remembered here and bound at each launch (trace.c), because everything else that is
 * dispatched through the command buffer shares the compute bind point. */
#include "internal.h"

VkResult rtr_not_begun(RtrRecorder r, const char* name) {
    return rtr_error(r->device, VK_ERROR_VALIDATION_FAILED_EXT, "recorder-not-begun",
                     "%s: rtrBeginRecorder first", name);
}

VkResult rtrCmdBindPipeline(RtrRecorder r, RtrPipeline pipeline) {
    if (!r->cmd) return rtr_not_begun(r, "rtrCmdBindPipeline");
    r->pipeline = pipeline;
    return VK_SUCCESS;
}

VkResult rtrCmdBindDescriptorSets(RtrRecorder r, uint32_t firstSet, uint32_t count,
                                  const VkDescriptorSet* sets, uint32_t dynamicCount,
                                  const uint32_t* dynamics) {
    RtrBoundSets* call;
    uint32_t i, kept = 0;
    if (!r->cmd) return rtr_not_begun(r, "rtrCmdBindDescriptorSets");
    if (count > RTR_MAX_SETS_PER_CALL || dynamicCount >= RTR_MAX_DYNAMICS_PER_CALL)
        return rtr_error(r->device, VK_ERROR_VALIDATION_FAILED_EXT, "bind-sets",
                         "%u sets, %u dynamic offsets; at most %u, %u", count, dynamicCount,
                         RTR_MAX_SETS_PER_CALL, RTR_MAX_DYNAMICS_PER_CALL - 1);
    if (!count) return VK_SUCCESS;
    /* Calls that this one covers whole have no effect any more. */
    for (i = 0; i < r->set_call_count; i++) {
        const RtrBoundSets* c = &r->set_calls[i];
        if (c->first >= firstSet && c->first + c->count <= firstSet + count) continue;
        if (kept != i) r->set_calls[kept] = *c;
        kept++;
    }
    r->set_call_count = kept;
    if (r->set_call_count == RTR_MAX_SET_CALLS)
        return rtr_error(r->device, VK_ERROR_VALIDATION_FAILED_EXT, "bind-sets",
                         "more than %u calls that overlap in part; bind such sets in one call", RTR_MAX_SET_CALLS);
    call = &r->set_calls[r->set_call_count++];
    call->first = firstSet;
    call->count = count;
    call->dynamic_count = dynamicCount;
    memcpy(call->sets, sets, count * sizeof *sets);
    if (dynamicCount) memcpy(call->dynamics, dynamics, dynamicCount * sizeof *dynamics);
    return VK_SUCCESS;
}

VkResult rtrCmdPushConstants(RtrRecorder r, uint32_t offset, uint32_t size, const void* values) {
    if (!r->cmd) return rtr_not_begun(r, "rtrCmdPushConstants");
    if (offset % 4 || size % 4 || size > RTR_MAX_PUSH_BYTES || offset > RTR_MAX_PUSH_BYTES - size)
        return rtr_error(r->device, VK_ERROR_VALIDATION_FAILED_EXT, "push-constants",
                         "offset %u and size %u must be multiples of 4 below %u", offset, size,
                         RTR_MAX_PUSH_BYTES);
    if (offset + size > r->push_size) {
        memset((char*)r->push_words + r->push_size, 0, offset + size - r->push_size);
        r->push_size = offset + size;
    }
    memcpy((char*)r->push_words + offset, values, size);
    return VK_SUCCESS;
}

VkResult rtrCmdSetHeap(RtrRecorder r, RtrHeap heap) {
    r->heap = heap;
    return VK_SUCCESS;
}

VkResult rtrCmdSetLaunchScratch(RtrRecorder r, VkBuffer buffer, VkDeviceSize offset, VkDeviceSize size) {
    if (buffer && offset % 256)
        return rtr_error(r->device, VK_ERROR_VALIDATION_FAILED_EXT, "scratch",
                         "launch scratch offset %llu: not a multiple of 256", (unsigned long long)offset);
    r->scratch = buffer;
    r->scratch_offset = offset;
    r->scratch_size = buffer ? size : 0;
    return VK_SUCCESS;
}

VkResult rtrCmdSetLaunchLimits(RtrRecorder r, uint64_t maxTileLanes, uint32_t maxRounds) {
    if (maxRounds > 16384)
        return rtr_error(r->device, VK_ERROR_VALIDATION_FAILED_EXT, "rounds", "maxRounds %u: at most 16384",
                         maxRounds);
    r->max_tile_lanes = maxTileLanes;
    r->max_rounds = maxRounds ? maxRounds : RTR_DEFAULT_ROUNDS;
    return VK_SUCCESS;
}
