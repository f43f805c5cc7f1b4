/* Copies, blobs and queries on the host, of structures whose memory it sees: what kernels/copy.comp,
 * serialize.comp, deserialize.comp and property.comp do. */
#include "build.h"

#define QUAD RTC_QUAD_BYTES
#define BLOB_BYTES(handles) ((uint64_t)QUAD * RTR_BLOB_DATA_QUAD(handles))

/* A structure in memory as it looks with its slots directly behind the nodes in use. */
typedef struct Block {
    const char* memory;
    uint32_t header[RTC_AS_HEADER_QUADS * 4];
    bool top;
    uint64_t nodes_end, src_slots, slot_bytes, end; /* bytes; end: of the compacted one */
} Block;

static VkResult open_block(RtrDevice d, const char* what, RtrAccelerationStructure as, const void* memory, Block* b) {
    const uint32_t* h = b->header;
    if (!as || !as->buffer || !memory)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "not-bound",
                         "%s on the host: a structure that is bound, and its memory, are needed", what);
    memset(b, 0, sizeof *b);
    b->memory = memory;
    memcpy(b->header, memory, sizeof b->header);
    b->top = h[RTC_HDR_KIND] == RTC_AS_KIND_TOP;
    b->slot_bytes = QUAD * (b->top                                 ? RTC_INSTANCE_QUADS
                            : h[RTC_HDR_FACTS] & RTC_FACT_AABBS ? RTC_AABB_QUADS
                                                                  : RTC_TRIANGLE_QUADS);
    b->nodes_end = QUAD * (RTC_AS_HEADER_QUADS + RTC_NODE_QUADS * (((uint64_t)h[RTC_HDR_NODE_COUNT] + 3) & ~3ull));
    b->src_slots = (uint64_t)QUAD * h[RTC_HDR_SLOTS];
    b->end = b->nodes_end + b->slot_bytes * h[RTC_HDR_SLOT_COUNT];
    if (h[RTC_HDR_MAGIC] != RTC_AS_MAGIC ||
        h[RTC_HDR_KIND] != (as->type == VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV ? RTC_AS_KIND_TOP : RTC_AS_KIND_BOTTOM) ||
        b->src_slots < b->nodes_end ||
        b->src_slots + b->slot_bytes * h[RTC_HDR_SLOT_COUNT] > as->size)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "host-memory",
                         "%s on the host: the memory holds no built structure of its type (its third word is 0x%x)", what,
                         h[RTC_HDR_MAGIC]);
    return VK_SUCCESS;
}

/* The structure without its base, from `to` on. */
static void put_compacted(const Block* b, char* to) {
    const uint32_t slots = (uint32_t)(b->nodes_end / QUAD);
    memcpy(to, b->memory, b->nodes_end);
    memcpy(to + b->nodes_end, b->memory + b->src_slots, b->end - b->nodes_end);
    memcpy(to + 4 * RTC_HDR_SLOTS, &slots, 4);
}

static void put_base(RtrAccelerationStructure as, void* memory) { memcpy(memory, &as->base, sizeof as->base); }

VkResult rtrCopyAccelerationStructureOnHost(RtrDevice d, RtrAccelerationStructure dst, void* pDst,
                                            RtrAccelerationStructure src, const void* pSrc,
                                            VkCopyAccelerationStructureModeNV mode) {
    const bool compact = mode == VK_COPY_ACCELERATION_STRUCTURE_MODE_COMPACT_NV;
    Block b;
    uint64_t bytes;
    VkResult r = open_block(d, "copy", src, pSrc, &b);
    if (r != VK_SUCCESS) return r;
    if (!compact && mode != VK_COPY_ACCELERATION_STRUCTURE_MODE_CLONE_NV)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "copy-mode", "copy mode %d: CLONE or COMPACT", (int)mode);
    if (!dst || !pDst || dst == src || !dst->buffer || dst->heap != src->heap || dst->type != src->type)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "copy",
                         "copy on the host: two different structures of one type, bound to the same heap or both to "
                         "buffers, and the memory of both are needed");
    bytes = compact ? b.end : b.src_slots + b.slot_bytes * b.header[RTC_HDR_SLOT_COUNT];
    if (bytes > dst->size)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "copy-size", "copy of %llu bytes into %llu",
                         (unsigned long long)bytes, (unsigned long long)dst->size);
    if (compact)
        put_compacted(&b, pDst);
    else
        memcpy(pDst, pSrc, bytes);
    put_base(dst, pDst);
    rtr_share_built(dst, src);
    return VK_SUCCESS;
}

static uint64_t handles_of(const Block* b) { return b->top ? b->header[RTC_HDR_SLOT_COUNT] : 0; }

VkResult rtrWriteAccelerationStructuresPropertiesOnHost(RtrDevice d, uint32_t count,
                                                        const RtrAccelerationStructure* structures,
                                                        const void* const* ppMemory, VkQueryType type, size_t dataSize,
                                                        void* pData, size_t stride) {
    uint32_t i, what = RTR_PROPERTY_SIZE;
    VkResult r = rtr_property_of_query(d, type, &what);
    if (r != VK_SUCCESS) return r;
    if (count && (!pData || stride < sizeof(uint64_t) || dataSize < (count - 1) * stride + sizeof(uint64_t)))
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "query-buffer",
                         "%u answers %llu bytes apart do not fit %llu", count, (unsigned long long)stride,
                         (unsigned long long)dataSize);
    for (i = 0; i < count; i++) {
        Block b;
        uint64_t answer;
        if ((r = open_block(d, "query", structures[i], ppMemory[i], &b)) != VK_SUCCESS) return r;
        answer = b.end;
        if (what == RTR_PROPERTY_SIZE) answer = structures[i]->size;
        if (what == RTR_PROPERTY_HANDLES) answer = handles_of(&b);
        if (what == RTR_PROPERTY_SERIALIZED_SIZE) answer += BLOB_BYTES(handles_of(&b));
        memcpy((char*)pData + i * stride, &answer, sizeof answer);
    }
    return VK_SUCCESS;
}

VkResult rtrCopyAccelerationStructureToMemoryOnHost(RtrDevice d, RtrAccelerationStructure src, const void* pSrc,
                                                    size_t dataSize, void* pData) {
    char* data = pData;
    Block b;
    uint64_t handles, at, total, i;
    VkResult r = open_block(d, "serialise", src, pSrc, &b);
    if (r != VK_SUCCESS) return r;
    handles = handles_of(&b);
    at = BLOB_BYTES((uint32_t)handles);
    total = at + b.end;
    if (!data || dataSize < total)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "blob-range",
                         "serialise on the host: %llu bytes, the blob has %llu", (unsigned long long)dataSize,
                         (unsigned long long)total);
    memset(data, 0, at);
    memcpy(data, d->blob_version, sizeof d->blob_version);
    memcpy(data + 4 * RTR_BLOB_SIZE, &total, 8);
    memcpy(data + 4 * RTR_BLOB_STRUCTURE_SIZE, &b.end, 8);
    memcpy(data + 4 * RTR_BLOB_HANDLE_COUNT, &handles, 8);
    put_compacted(&b, data + at);
    memset(data + at, 0, 8);
    for (i = 0; i < handles; i++) { /* where a bottom level lies is the handle's matter */
        char* reference = data + at + b.nodes_end + i * b.slot_bytes + 6 * QUAD;
        uint64_t handle;
        memcpy(&handle, reference, 8);
        memcpy(data + 4 * RTR_BLOB_HANDLES + 8 * i, &handle, 8);
        handle = handle != 0;
        memcpy(reference, &handle, 8);
    }
    return VK_SUCCESS;
}

VkResult rtrCopyMemoryToAccelerationStructureOnHost(RtrDevice d, size_t dataSize, const void* pData,
                                                    RtrAccelerationStructure dst, void* pDst) {
    RtrSerializedInfo info;
    struct RtrAccelerationStructure_T whole;
    const char* data = pData;
    Block b;
    uint32_t facts;
    VkResult r = rtrGetSerializedAccelerationStructureInfo(d, pData, dataSize, &info);
    if (r != VK_SUCCESS) return r;
    if (!dst || !dst->buffer || !pDst || dst->type != VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV ||
        info.handleCount)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "blob",
                         "deserialise on the host: of bottom levels, into one that is bound, and its memory; top "
                         "levels are read on the device, beside their bottom levels");
    if (info.deserializedSize > dst->size || dataSize < info.serializedSize ||
        info.deserializedSize < RTC_AS_HEADER_QUADS * QUAD)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "blob",
                         "deserialise on the host: %llu bytes into a structure of %llu",
                         (unsigned long long)info.deserializedSize, (unsigned long long)dst->size);
    /* As large as it says, and laid out as such. */
    whole = *dst;
    whole.size = info.deserializedSize;
    if ((r = open_block(d, "deserialise", &whole, data + BLOB_BYTES(0), &b)) != VK_SUCCESS) return r;
    if (b.top || b.end != info.deserializedSize || b.src_slots != b.nodes_end ||
        b.header[RTC_HDR_NODES] != RTC_AS_HEADER_QUADS)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "blob", "deserialise on the host: a damaged structure");
    memcpy(pDst, b.memory, info.deserializedSize);
    put_base(dst, pDst);
    facts = (b.header[RTC_HDR_FACTS] & ~RTC_FACT_ADDRESSES) | (dst->heap ? 0 : RTC_FACT_ADDRESSES);
    memcpy((char*)pDst + 4 * RTC_HDR_FACTS, &facts, 4);
    rtr_forget_built(dst);
    return VK_SUCCESS;
}
