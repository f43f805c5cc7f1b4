/* Launch errors and the float probe: turning words the device wrote into answers. */
#include <stdio.h>

#include "internal.h"

uint32_t rtrGetLaunchCount(RtrRecorder r) { return r->launch_count; }

VkResult rtrGetLaunchErrorLocation(RtrRecorder r, uint32_t index, VkDescriptorBufferInfo* info) {
    if (index >= r->launch_count)
        return rtr_error(r->device, VK_ERROR_VALIDATION_FAILED_EXT, "launch-index", "launch %u of the %u that were recorded since the recorder was retired", index, r->launch_count);
    info->buffer = r->control;
    info->offset = r->launches[index].offset;
    info->range = r->launches[index].size;
    return VK_SUCCESS;
}

VkResult rtrDecodeLaunchError(const uint32_t* words, RtrLaunchError* e) {
    e->code = words[RTC_CTRL_ERROR];
    e->count = words[RTC_CTRL_ERROR_COUNT];
    memcpy(e->launchId, words + RTC_CTRL_ERROR_LANE, sizeof e->launchId);
    e->detail[0] = words[RTC_CTRL_ERROR_DETAIL];
    e->detail[1] = words[RTC_CTRL_ERROR_DETAIL2];
    e->suspendedLanes = words[RTC_CTRL_SUSPENDED];
    return e->code == RTC_LAUNCH_ERROR_NONE ? VK_SUCCESS : VK_ERROR_UNKNOWN;
}

static const char* const k_regions[4] = {"raygen", "miss", "hit", "callable"};

static void describe_damage(const RtrLaunchError* e, char* text, size_t size) {
    static const char* const kinds[7][2] = {{"word", ""},
                                            {"quad", ", which is outside the heap"},
                                            {"", ""},
                                            {"node", ", which the structure does not have"},
                                            {"slot", ", which the structure does not have"},
                                            {"instance", ", which the top level does not have"},
                                            {"node or instance", " more often than a tree can be met"}};
    const uint32_t kind = e->detail[1] >> RTC_BAD_SHIFT, instance = e->detail[1] & RTC_BAD_INSTANCE_MASK;
    char met[128], where[32];
    if (kind == RTC_BAD_HEADER)
        snprintf(met, sizeof met, "a header that cannot be one");
    else if (kind == RTC_BAD_BASE)
        snprintf(met, sizeof met, "a reference (its low word 0x%08x) to no structure that is bound and not destroyed",
                 e->detail[0]);
    else
        snprintf(met, sizeof met, "%s %u%s", kinds[kind < 7 ? kind : 0][0], e->detail[0], kinds[kind < 7 ? kind : 0][1]);
    if (instance == RTC_BAD_INSTANCE_MASK)
        snprintf(where, sizeof where, "the top level");
    else
        snprintf(where, sizeof where, "instance %u", instance);
    snprintf(text, size, "acceleration structure memory is damaged: in %s a ray met %s", where, met);
}

static void describe_elsewhere(const RtrLaunchError* e, char* text, size_t size) {
    const uint32_t structure = e->detail[0] & ~RTC_HEAP_TAG, set = e->detail[1] & ~RTC_HEAP_TAG;
    char where[80], looked[80];
    if (e->detail[0] & RTC_HEAP_TAG)
        snprintf(where, sizeof where, "lies in heap %u of the RtrDevice", structure);
    else
        snprintf(where, sizeof where, "lies at a device address, or was never built");
    if (e->detail[0] & RTC_HEAP_TAG && !(e->detail[1] & RTC_HEAP_TAG))
        snprintf(looked, sizeof looked, "the module was linked with --addressing=address");
    else
        snprintf(looked, sizeof looked, "rtrCmdSetHeap set heap %u", set);
    snprintf(text, size, "the acceleration structure of a ray %s, and %s: the ray missed", where, looked);
}

void rtrFormatLaunchError(const RtrLaunchError* e, char* text, size_t size) {
    char what[384];
    switch (e->code) {
        case RTC_LAUNCH_ERROR_NONE:
            snprintf(what, sizeof what, "no error");
            break;
        case RTC_LAUNCH_ERROR_RECURSION_DEPTH:
            snprintf(what, sizeof what,
                     "a trace below the pipeline's recursion limit was dropped (rtc --max-recursion-depth)");
            break;
        case RTC_LAUNCH_ERROR_CALLABLE_DEPTH:
            snprintf(what, sizeof what,
                     "a callable below the pipeline's depth limit was dropped (rtc --max-callable-depth)");
            break;
        case RTC_LAUNCH_ERROR_BAD_HANDLE:
            if (e->detail[1] & RTC_ERROR_RECORD) {
                snprintf(what, sizeof what,
                         "record %u of the %s region holds no handle of this pipeline (word read: 0x%08x)",
                         e->detail[1] & RTC_ERROR_RECORD_MASK,
                         k_regions[e->detail[1] >> RTC_ERROR_REGION_SHIFT & 3], e->detail[0]);
                break;
            }
            snprintf(what, sizeof what, "an SBT record holds no shader of this pipeline (word read: 0x%08x)",
                     e->detail[0]);
            break;
        case RTC_LAUNCH_ERROR_SBT_RANGE:
            snprintf(what, sizeof what,
                     "record %u of the %s region does not lie in its buffer, which ends %u bytes behind the "
                     "region's start",
                     e->detail[1] & RTC_ERROR_RECORD_MASK,
                     k_regions[e->detail[1] >> RTC_ERROR_REGION_SHIFT & 3], e->detail[0]);
            break;
        case RTC_LAUNCH_ERROR_BAD_UPDATE:
        case RTC_LAUNCH_ERROR_BAD_INSTANCE: {
            char which[96];
            if (e->detail[1] == RTC_ERROR_BUILT)
                snprintf(which, sizeof which, "a structure that this recording built");
            else
                snprintf(which, sizeof which, "structure %u of rtrCmdDeclareScene", e->detail[1]);
            if (e->code == RTC_LAUNCH_ERROR_BAD_UPDATE) {
                if (e->detail[0] == RTC_BAD_UPDATE_COUNTS)
                    snprintf(what, sizeof what,
                             "an update of %s had other counts than its build, or the build no ALLOW_UPDATE; "
                             "it changed nothing",
                             which);
                else if (e->detail[0] == RTC_BAD_UPDATE_ACTIVE)
                    snprintf(what, sizeof what, "an update of %s made inactive primitives active", which);
                else
                    snprintf(what, sizeof what,
                             "an update of %s made its primitive or instance %u active or inactive", which,
                             e->detail[0] - 1);
                break;
            }
            snprintf(what, sizeof what,
                     "instance %u of %s refers to no bottom level that is built and not destroyed", e->detail[0],
                     which);
            break;
        }
        case RTC_LAUNCH_ERROR_BAD_MEMORY:
            describe_damage(e, what, sizeof what);
            break;
        case RTC_LAUNCH_ERROR_ABI:
            snprintf(
                what, sizeof what,
                "an acceleration structure is not of this ABI version, or no structure (word read: 0x%08x)",
                e->detail[0]);
            break;
        case RTC_LAUNCH_ERROR_HEAP:
            describe_elsewhere(e, what, sizeof what);
            break;
        case RTC_LAUNCH_ERROR_ASSUMPTION:
            rtr_format_assumption(e->detail[0], e->detail[1], what, sizeof what);
            break;
        case RTC_LAUNCH_ERROR_UNFINISHED:
            snprintf(what, sizeof what,
                     "up to %u lanes were not finished when the rounds ran out (rtrCmdSetLaunchLimits)",
                     e->detail[0]);
            break;
        case RTC_LAUNCH_ERROR_STACK:
            snprintf(what, sizeof what, "a traversal or word stack overflowed (internal)");
            break;
        default:
            snprintf(what, sizeof what, "unknown launch error %u", e->code);
            break;
    }
    if (e->code == RTC_LAUNCH_ERROR_NONE || e->code == RTC_LAUNCH_ERROR_UNFINISHED ||
        e->code == RTC_LAUNCH_ERROR_SBT_RANGE || e->code == RTC_LAUNCH_ERROR_BAD_INSTANCE ||
        e->code == RTC_LAUNCH_ERROR_BAD_UPDATE ||
        (e->code == RTC_LAUNCH_ERROR_BAD_HANDLE && e->detail[1] & RTC_ERROR_RECORD)) {
        snprintf(text, size, "%s", what);
    } else {
        snprintf(text, size, "%s; %u events, the first at launch id (%u, %u, %u)", what, e->count,
                 e->launchId[0], e->launchId[1], e->launchId[2]);
    }
}

VkResult rtrGetLaunchError(RtrRecorder r, uint32_t index, const void* mapped, RtrLaunchError* e) {
    VkDescriptorBufferInfo info = {VK_NULL_HANDLE, 0, 0};
    uint32_t words[RTR_LAUNCH_ERROR_BYTES / 4];
    VkResult result = rtrGetLaunchErrorLocation(r, index, &info);
    if (result != VK_SUCCESS) return result;
    memcpy(words, (const char*)mapped + info.offset, sizeof words);
    result = rtrDecodeLaunchError(words, e);
    if (result != VK_SUCCESS) {
        char text[512];
        rtrFormatLaunchError(e, text, sizeof text);
        rtr_error(r->device, result, "launch-error", "launch %u: %s", index, text);
    }
    return result;
}

static uint32_t float_bits(float f) {
    uint32_t u;
    memcpy(&u, &f, sizeof u);
    return u;
}

VkResult rtrCmdProbeFloat(RtrRecorder r, VkBuffer dstBuffer, VkDeviceSize dstOffset) {
    RtrDevice d = r->device;
    struct RtrBuildPush push;
    VkDescriptorBufferInfo info;
    VkWriteDescriptorSet write = {.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
    VkResult result;
    if (!r->cmd || dstOffset % 256)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "probe",
                         "rtrCmdProbeFloat: begin the recorder; dstOffset a multiple of 256");
    if ((result = rtr_allocate_set(r, d->array_layout, &write.dstSet)) != VK_SUCCESS) return result;
    info.buffer = dstBuffer;
    info.offset = dstOffset;
    info.range = RTR_FLOAT_PROBE_BYTES;
    write.dstBinding = RTR_ARR_STATE;
    write.descriptorCount = 1;
    write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    write.pBufferInfo = &info;
    d->vk.UpdateDescriptorSets(d->device, 1, &write, 0, NULL);
    memset(&push, 0, sizeof push);
    push.count = float_bits(1.0f + 1.0f / 4096);
    push.total = float_bits(-(1.0f + 2.0f / 4096));
    push.first = 0x00800000u; /* smallest normal */
    push.primitive_base = float_bits(0.5f);
    push.geometry = float_bits(3.0f);
    push.data_offset = 0x7fc00000u;
    push.data_stride = float_bits(1.0f / 16777216);
    d->vk.CmdBindPipeline(r->cmd, VK_PIPELINE_BIND_POINT_COMPUTE, d->kernels[RTR_KERNEL_probe]);
    d->vk.CmdBindDescriptorSets(r->cmd, VK_PIPELINE_BIND_POINT_COMPUTE, d->kernel_layout, 1, 1, &write.dstSet,
                                0, NULL);
    d->vk.CmdPushConstants(r->cmd, d->kernel_layout, VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof push, &push);
    d->vk.CmdDispatch(r->cmd, 1, 1, 1);
    return VK_SUCCESS;
}

void rtrDecodeFloatProbe(const void* data, RtrFloatProbe* p) {
    uint32_t w[RTR_FLOAT_PROBE_BYTES / 4];
    memcpy(w, data, sizeof w);
    /* (1 + 2^-12)^2 - (1 + 2^-11) is 2^-24 exactly; the rounded square is 1 + 2^-11. */
    p->contractsUnmarked = (w[0] & 0x7fffffffu) != 0;
    p->contractsPrecise = (w[1] & 0x7fffffffu) != 0;
    p->fmaIsFused = (w[2] & 0x7fffffffu) != 0;
    p->flushesDenormals = (w[3] & 0x7fffffffu) == 0;
    p->roundsToNearestEven = w[4] == 0x3f800000u && w[5] == 0x3f800002u;
    p->exactDivision = w[6] == float_bits(1.0f / 3.0f) && w[7] == float_bits(1.0f / 7.0f);
    p->keepsSignedZero = w[8] == 0x80000000u;
    p->nanFailsComparison = w[9] == 0;
}
