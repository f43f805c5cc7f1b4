/* Structures to blobs and back, and what a blob says of itself. The layout is that of
 * VK_KHR_acceleration_structure; kernels/build_shared.h has its words. */
#include "build.h"

#define UUID VK_UUID_SIZE
#define HEADER_BYTES (RTR_BLOB_HANDLES * 4u)

/* Compatibility UUID: a tag, the ABI version, and the device's UUID folded to 8 bytes. */
void rtr_make_blob_version(const VkPhysicalDeviceIDProperties* id, uint8_t version[2 * VK_UUID_SIZE]) {
    const uint32_t abi = RTC_ABI_VERSION;
    uint32_t i;
    memcpy(version, id->driverUUID, UUID);
    memcpy(version + UUID, "rtc1", 4);
    memcpy(version + UUID + 4, &abi, 4);
    for (i = 0; i < 8; i++) version[UUID + 8 + i] = id->deviceUUID[i] ^ id->deviceUUID[8 + i];
}

static void push_version(RtrDevice d, struct RtrBuildPush* push) {
    uint32_t w[8];
    memcpy(w, d->blob_version, sizeof w);
    push->count = w[0];
    push->first = w[1];
    push->primitive_base = w[2];
    push->geometry = w[3];
    push->data_stride = w[4];
    push->vertex_count = w[5];
    push->index_offset = w[6];
    push->index_type = w[7];
}

static VkResult check(RtrRecorder rec, const char* what, RtrAccelerationStructure as, VkBuffer buffer,
                      VkDeviceSize offset, VkDeviceSize size) {
    RtrDevice d = rec->device;
    if (!rec->cmd)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "recorder-not-begun",
                         "%s: rtrBeginRecorder first", what);
    if (!as || !as->buffer)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "not-bound", "%s: the structure is not bound",
                         what);
    if (!buffer || offset % 256 || size < 512)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "blob-range",
                         "%s: buffer %s, offset %llu must be a multiple of 256, size %llu at least 512", what,
                         buffer ? "given" : "missing", (unsigned long long)offset, (unsigned long long)size);
    return VK_SUCCESS;
}

static uint32_t most_handles(RtrAccelerationStructure as) {
    if (as->type != VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV) return 0;
    return (uint32_t)(as->size / (RTC_INSTANCE_QUADS * RTC_QUAD_BYTES));
}

static void take_window(struct RtrBuildPush* push, VkDeviceSize at, VkDeviceSize end, uint32_t window) {
    push->window_first = (uint32_t)at;
    push->window_count = (uint32_t)rtr_min_size(end - at, window);
}

VkResult rtrCmdCopyAccelerationStructureToMemory(RtrRecorder rec, RtrAccelerationStructure src, VkBuffer dst,
                                                 VkDeviceSize offset, VkDeviceSize size) {
    RtrDevice d = rec->device;
    const uint32_t window = d->limits.maxStorageBufferRange / RTC_QUAD_BYTES / 16u * 16u;
    struct RtrBuildPush push;
    RtrBinding binding = {1, RTR_ARR_DST_SLOTS, {VK_NULL_HANDLE, 0, 0}};
    VkDeviceSize at, end;
    VkResult r = check(rec, "serialise", src, dst, offset, size);
    if (r != VK_SUCCESS) return r;
    end = RTR_BLOB_DATA_QUAD(most_handles(src)) + src->size / RTC_QUAD_BYTES;
    end = rtr_min_size(end, size / RTC_QUAD_BYTES);
    memset(&push, 0, sizeof push);
    push_version(d, &push);
    push.src_lo = (uint32_t)src->base;
    push.src_hi = (uint32_t)(src->base >> 32);
    push.total = (uint32_t)rtr_min_size(size / RTC_QUAD_BYTES, 0xffffffffu);
    binding.info.buffer = dst;
    for (at = 0; at < end; at += window) {
        take_window(&push, at, end, window);
        binding.info.offset = offset + at * RTC_QUAD_BYTES;
        binding.info.range = (VkDeviceSize)push.window_count * RTC_QUAD_BYTES;
        if ((r = rtr_bind_sets(rec, src->heap, &binding, 1)) != VK_SUCCESS) return r;
        rtr_dispatch_kernel(rec, src->heap ? RTR_KERNEL_serialize : RTR_KERNEL_serialize_address, &push,
                            rtr_groups(push.window_count, RTR_GROUP));
    }
    return VK_SUCCESS;
}

VkResult rtrCmdCopyMemoryToAccelerationStructure(RtrRecorder rec, RtrAccelerationStructure dst, VkBuffer src,
                                                 VkDeviceSize offset, VkDeviceSize size) {
    RtrDevice d = rec->device;
    const RtrKernel kernel = dst && !dst->heap ? RTR_KERNEL_deserialize_address : RTR_KERNEL_deserialize;
    const VkDeviceSize limit = d->limits.maxStorageBufferRange / 256u * 256u;
    struct RtrBuildPush push;
    RtrBinding b[4] = {{1, RTR_ARR_DST_SLOTS, {VK_NULL_HANDLE, 0, 0}},
                       {1, RTR_ARR_DST_HEADER, {VK_NULL_HANDLE, 0, 0}},
                       {0, RTR_IN_INDEX, {VK_NULL_HANDLE, 0, 0}},
                       {0, RTR_IN_DATA, {VK_NULL_HANDLE, 0, 0}}};
    VkDeviceSize at, end, ahead;
    uint32_t window;
    VkResult r = check(rec, "deserialise", dst, src, offset, size);
    if (r != VK_SUCCESS) return r;
    size = size / RTC_QUAD_BYTES * RTC_QUAD_BYTES;
    /* Where the structure starts in the blob is known only to within its handles. */
    ahead = RTR_BLOB_DATA_QUAD(most_handles(dst));
    if (ahead * 2 > limit / RTC_QUAD_BYTES)
        return rtr_error(d, VK_ERROR_FEATURE_NOT_PRESENT, "maxStorageBufferRange",
                         "deserialise: maxStorageBufferRange %u reaches the handles of %u instances",
                         d->limits.maxStorageBufferRange, (uint32_t)(limit / 16));
    window = (uint32_t)(limit / RTC_QUAD_BYTES - ahead) / 16u * 16u;
    memset(&push, 0, sizeof push);
    push_version(d, &push);
    push.self_lo = (uint32_t)dst->base;
    push.self_hi = (uint32_t)(dst->base >> 32);
    push.heap_quads = dst->heap ? (uint32_t)(dst->heap->size / RTC_QUAD_BYTES) : 0;
    push.facts = dst->heap ? 0 : RTC_FACT_ADDRESSES;
    push.flags = dst->type == VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV ? RTR_BUILD_TOP : 0;
    push.total = (uint32_t)rtr_min_size(size / RTC_QUAD_BYTES, 0xffffffffu);
    push.blocks = (uint32_t)(rtr_min_size(size, limit) / RTC_QUAD_BYTES);
    push.slots_quad = (uint32_t)(dst->size / RTC_QUAD_BYTES);
    end = dst->size / RTC_QUAD_BYTES;
    b[0].info.buffer = dst->buffer;
    b[1].info = rtr_header_info(dst);
    b[2].info.buffer = b[3].info.buffer = src;
    b[2].info.offset = offset;
    b[2].info.range = rtr_min_size(size, limit);
    for (at = 0; at < end; at += window) {
        const VkDeviceSize first = RTR_BLOB_DATA_QUAD(0) + at; /* the earliest place in the blob */
        if (first * RTC_QUAD_BYTES >= size) break;
        take_window(&push, at, end, window);
        push.data_offset = (uint32_t)first;
        b[0].info.offset = dst->offset + at * RTC_QUAD_BYTES;
        b[0].info.range = (VkDeviceSize)push.window_count * RTC_QUAD_BYTES;
        b[3].info.offset = offset + first * RTC_QUAD_BYTES;
        b[3].info.range =
            rtr_min_size((push.window_count + ahead) * RTC_QUAD_BYTES, size - first * RTC_QUAD_BYTES);
        if ((r = rtr_bind_sets(rec, dst->heap, b, 4)) != VK_SUCCESS) return r;
        if (at == 0) {
            push.step = 0;
            rtr_dispatch_kernel(rec, kernel, &push, 1);
            rtr_compute_barrier(rec);
        }
        push.step = 1;
        rtr_dispatch_kernel(rec, kernel, &push, rtr_groups(push.window_count, RTR_GROUP));
    }
    rtr_forget_built(dst);
    return VK_SUCCESS;
}

VkResult rtrGetSerializedAccelerationStructureInfo(RtrDevice d, const void* data, size_t size,
                                                   RtrSerializedInfo* info) {
    const unsigned char* bytes = data;
    memset(info, 0, sizeof *info);
    if (!data || size < HEADER_BYTES || memcmp(bytes + UUID, d->blob_version + UUID, 4) != 0)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "blob",
                         "%llu bytes are no acceleration structure that rtc serialised",
                         (unsigned long long)size);
    if (memcmp(bytes + UUID + 4, d->blob_version + UUID + 4, 4) != 0)
        return rtr_error(d, VK_ERROR_INCOMPATIBLE_DRIVER, "blob-version",
                         "the structure was serialised by another ABI version of rtc; this one has %u: build "
                         "it again",
                         RTC_ABI_VERSION);
    if (memcmp(bytes + UUID + 8, d->blob_version + UUID + 8, 8) != 0)
        return rtr_error(d, VK_ERROR_INCOMPATIBLE_DRIVER, "blob-device",
                         "the structure was serialised on another device than '%s': build it again",
                         d->support.deviceName);
    if (memcmp(bytes, d->blob_version, UUID) != 0)
        return rtr_error(d, VK_ERROR_INCOMPATIBLE_DRIVER, "blob-driver",
                         "the structure was serialised with another driver or version of it: build it again");
    memcpy(&info->serializedSize, bytes + 4 * RTR_BLOB_SIZE, 8);
    memcpy(&info->deserializedSize, bytes + 4 * RTR_BLOB_STRUCTURE_SIZE, 8);
    memcpy(&info->handleCount, bytes + 4 * RTR_BLOB_HANDLE_COUNT, 8);
    if (info->handleCount > 1u << 24 || info->deserializedSize > 1ull << 36 ||
        info->serializedSize !=
            (VkDeviceSize)RTC_QUAD_BYTES * RTR_BLOB_DATA_QUAD(info->handleCount) + info->deserializedSize ||
        (size > HEADER_BYTES && size < info->serializedSize))
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "blob",
                         "a serialised structure of %llu bytes with %llu handles: damaged, or cut to %llu "
                         "bytes",
                         (unsigned long long)info->serializedSize, (unsigned long long)info->handleCount,
                         (unsigned long long)size);
    return VK_SUCCESS;
}

void rtrGetDeviceAccelerationStructureCompatibility(RtrDevice d, const uint8_t* version,
                                                    VkAccelerationStructureCompatibilityKHR* compatibility) {
    *compatibility = memcmp(version, d->blob_version, 2 * UUID) == 0
                         ? VK_ACCELERATION_STRUCTURE_COMPATIBILITY_COMPATIBLE_KHR
                         : VK_ACCELERATION_STRUCTURE_COMPATIBILITY_INCOMPATIBLE_KHR;
}
