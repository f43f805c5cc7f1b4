/* Builds and updates: scratch, checks, and several at once. */
#include <stdlib.h>

#include "build.h"

static void place(RtrScratchLayout* l, uint32_t array, VkDeviceSize size) {
    l->offset[array] = l->total;
    l->size[array] = rtr_align(size ? size : 256, 256);
    l->total += l->size[array];
}

/* In the place of an array that is not used at the same time. */
static void share(RtrScratchLayout* l, uint32_t array, uint32_t with, VkDeviceSize size) {
    l->offset[array] = l->offset[with];
    l->size[array] = rtr_align(size ? size : 256, 256);
}

/* Words of ranges of indirect builds; a top level has one. */
static VkDeviceSize range_words(uint32_t geometries) { return RTR_RANGE_WORDS * (VkDeviceSize)(geometries ? geometries : 1); }

void rtr_build_scratch(uint32_t n, uint32_t geometries, RtrScratchLayout* l) {
    /* The scans of the numbering need two words for blocks of the same size. */
    VkDeviceSize sums = (VkDeviceSize)rtr_groups(n, RTR_SORT_BLOCK) * RTR_SORT_BINS;
    /* A histogram for each pass of the fused sort. */
    if (n > RTR_SORT_SMALL && n <= RTR_SORT_FUSED) sums *= 32 / RTR_SORT_BITS;
    memset(l, 0, sizeof *l);
    l->ranges = (uint32_t)(RTR_ST_SUMS + sums);
    place(l, RTR_ARR_STATE, 4 * (l->ranges + range_words(geometries)));
    place(l, RTR_ARR_LEAF_BOX, 32ull * n);
    place(l, RTR_ARR_NODE_BOX, 32ull * n);
    place(l, RTR_ARR_INFO, 16ull * n);
    place(l, RTR_ARR_PAIRS_A, 8ull * n);
    place(l, RTR_ARR_LINKS, 8ull * n);
    place(l, RTR_ARR_MARKS, 4ull * n);
    place(l, RTR_ARR_SLOT_OF, 4ull * n);
    /* The sort is over before there are nodes, the fitting before they are numbered. */
    share(l, RTR_ARR_PAIRS_B, RTR_ARR_NODE_BOX, 8ull * n);
    share(l, RTR_ARR_OUT, RTR_ARR_MARKS, 4ull * n);
}

uint32_t rtr_most_nodes(const struct RtrAccelerationStructure_T* as) {
    if (!as->compacted_size) return rtr_node_room(as->primitive_count);
    return (uint32_t)(as->size / (RTC_NODE_QUADS * RTC_QUAD_BYTES));
}

/* Of a compacted structure only the size is known. */
static uint32_t most_slots(const struct RtrAccelerationStructure_T* as) {
    if (!as->compacted_size) return as->primitive_count;
    return (uint32_t)(as->size / RTC_QUAD_BYTES /
                      (as->type == VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV ? RTC_INSTANCE_QUADS : RTC_AABB_QUADS));
}

static uint32_t window_of(RtrDevice d, uint32_t bytes_each) {
    /* Whole multiples of 16 entries keep the next window aligned to 256 bytes. */
    return d->limits.maxStorageBufferRange / bytes_each / 16u * 16u;
}

void rtr_update_scratch(const struct RtrAccelerationStructure_T* as, RtrScratchLayout* l) {
    const uint32_t slots = most_slots(as), nodes = rtr_most_nodes(as);
    memset(l, 0, sizeof *l);
    l->ranges = RTR_ST_SUMS;
    place(l, RTR_ARR_STATE,
          4 * (RTR_ST_SUMS + range_words(as->compacted_size ? rtr_built_geometries(as) : as->geometry_count)));
    place(l, RTR_ARR_LEAF_BOX, 32ull * slots);
    place(l, RTR_ARR_LINKS, 4ull * nodes);
    place(l, RTR_ARR_MARKS, 4ull * (slots > nodes ? slots : nodes));
    if (nodes <= window_of(as->device, RTC_NODE_QUADS * RTC_QUAD_BYTES)) {
        share(l, RTR_ARR_PAIRS_A, RTR_ARR_LINKS, 4ull * nodes); /* not used, but bound */
        return;
    }
    place(l, RTR_ARR_NODE_BOX, 32ull * nodes);
    place(l, RTR_ARR_PAIRS_A, 8ull * nodes);
}

static VkResult check_build(RtrBuild* b, const VkAccelerationStructureInfoNV* info, VkBool32 update,
                            RtrAccelerationStructure src) {
    RtrDevice d = b->device;
    RtrAccelerationStructure dst = b->dst;
    const bool top = info->type == VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
    uint64_t total = 0;
    uint32_t g;
    VkResult r;
    if (!b->recorder->cmd)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "recorder-not-begun",
                         "build: rtrBeginRecorder first");
    if ((r = rtr_check_structure(d, "VkAccelerationStructureInfoNV", info, VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV)) != VK_SUCCESS) return r;
    if (!dst || !dst->buffer)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "not-bound", "build: dst is not bound");
    if (info->type != dst->type || info->flags != dst->flags)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "as-info",
                         "build: type or flags differ from dst's creation");
    if (dst->compacted_size && !update)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "compacted-size",
                         "build: dst was created with compactedSize, for copies only");
    if (b->indirect && (b->indirect_offset % 4 || b->indirect_stride % 4 ||
                        (b->indirect_stride < 16 && info->geometryCount > 1)))
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "indirect-build",
                         "build: indirectOffset and indirectStride must be multiples of 4, the stride at least 16");
    if (!b->scratch || b->scratch_offset % 256)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "scratch",
                         "build: scratch buffer missing or scratchOffset not a multiple of 256");
    if (update && !(dst->flags & VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV))
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "update-not-allowed",
                         "update of a structure without ALLOW_UPDATE: create and build it with that flag");
    if (update && src && (src->type != dst->type || src->flags != dst->flags || !src->buffer))
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "update-src",
                         "update: src is of another type, was created with other flags, or is not bound");
    if (update && (r = rtr_check_update(src ? src : dst, info)) != VK_SUCCESS) return r;
    if (top) {
        if (info->instanceCount > dst->instance_count && !dst->compacted_size)
            return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "as-counts",
                             "build of %u instances; created for %u", info->instanceCount,
                             dst->instance_count);
        if (info->instanceCount && (!b->instance_data || b->instance_offset % 16))
            return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "instance-data",
                             "instanceData missing or instanceOffset not a multiple of 16");
        b->primitives = info->instanceCount;
    } else {
        if (info->geometryCount > dst->geometry_count && !dst->compacted_size)
            return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "as-counts",
                             "build of %u geometries; created for %u", info->geometryCount,
                             dst->geometry_count);
        for (g = 0; g < info->geometryCount; g++) {
            uint32_t n = 0, made = 0;
            if ((r = rtr_check_geometry(d, &info->pGeometries[g], g, &n)) != VK_SUCCESS) return r;
            total += n;
            if (dst->compacted_size) continue;
            rtr_check_geometry(d, &dst->geometries[g], g, &made);
            if (info->pGeometries[g].geometryType != dst->geometries[g].geometryType || n > made)
                return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "as-geometry",
                                 "geometry %u: type or count (%u) do not fit its creation (%u)", g, n, made);
        }
        b->primitives = (uint32_t)total;
    }
    if ((VkDeviceSize)b->primitives * 32 > d->limits.maxStorageBufferRange)
        return rtr_error(d, VK_ERROR_FEATURE_NOT_PRESENT, "maxStorageBufferRange",
                         "build of %u primitives: maxStorageBufferRange %u allows %u", b->primitives,
                         d->limits.maxStorageBufferRange, d->limits.maxStorageBufferRange / 32);
    return VK_SUCCESS;
}

/* Fills in what recording needs. */
static VkResult prepare(RtrBuild* b, RtrRecorder recorder, const RtrAccelerationStructureBuildInfo* given) {
    const VkAccelerationStructureInfoNV* info = given->pInfo;
    const RtrAccelerationStructure dst = given->dst;
    bool opaque;
    VkResult r;
    b->recorder = recorder;
    b->device = recorder->device;
    b->dst = dst;
    b->src = given->src;
    b->info = info;
    b->update = given->update;
    b->scratch = given->scratch;
    b->scratch_offset = given->scratchOffset;
    b->instance_data = given->instanceData;
    b->instance_offset = given->instanceOffset;
    b->indirect = given->indirectBuffer;
    b->indirect_offset = given->indirectOffset;
    b->indirect_stride = given->indirectStride;
    if ((r = rtr_check_chain(b->device, "RtrAccelerationStructureBuildInfo", given->pNext)) != VK_SUCCESS ||
        (r = check_build(b, info, given->update, given->src)) != VK_SUCCESS)
        return r;
    b->geometries = info->pGeometries;
    b->geometry_count = info->geometryCount;
    b->slots_quad = rtr_slots_quad(dst->primitive_count);
    b->node_window = window_of(b->device, RTC_NODE_QUADS * RTC_QUAD_BYTES);
    b->slot_window = window_of(b->device, rtr_slot_quads(dst) * RTC_QUAD_BYTES);
    b->push.total = b->primitives;
    b->push.self_lo = (uint32_t)dst->base;
    b->push.self_hi = (uint32_t)(dst->base >> 32);
    b->push.slots_quad = b->slots_quad;
    b->push.heap_quads = dst->heap ? (uint32_t)(dst->heap->size / RTC_QUAD_BYTES) : 0;
    b->push.slot_quads = rtr_slot_quads(dst);
    b->push.build_flags = info->flags;
    b->push.geometry_count = info->geometryCount;
    if (dst->type == VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV) b->push.flags |= RTR_BUILD_TOP;
    if (b->update) b->push.flags |= RTR_BUILD_UPDATE;
    if (info->flags & VK_BUILD_ACCELERATION_STRUCTURE_LOW_MEMORY_BIT_NV) b->push.flags |= RTR_BUILD_LOW_MEMORY;
    if (info->geometryCount && info->pGeometries[0].geometryType == VK_GEOMETRY_TYPE_AABBS_NV)
        b->push.flags |= RTR_BUILD_AABBS;
    if (info->flags & VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV)
        b->push.flags |= RTR_BUILD_KEEP_DEGENERATE;
    b->push.not_opaque = rtr_first_not_opaque(info);
    opaque = b->push.not_opaque == 0xffffffffu;
    b->push.facts = (b->push.flags & RTR_BUILD_AABBS ? RTC_FACT_AABBS : 0u) | (opaque ? RTC_FACT_ALL_OPAQUE : 0u) |
                    (dst->heap ? 0u : RTC_FACT_ADDRESSES);
    if (b->update)
        rtr_update_scratch(dst, &b->layout);
    else
        rtr_build_scratch(dst->primitive_count, dst->geometry_count, &b->layout);
    if (b->indirect && 4 * (b->layout.ranges + range_words(info->geometryCount)) > b->layout.size[RTR_ARR_STATE])
        return rtr_error(b->device, VK_ERROR_FEATURE_NOT_PRESENT, "indirect-build",
                         "indirect update of %u geometries of a structure that the host knows nothing of",
                         info->geometryCount);
    return VK_SUCCESS;
}

/* ---- Several at once ------------------------------------------------------------------------- */

/* What a build writes: scratch or its destination. */
typedef struct Span {
    uint64_t buffer;
    VkDeviceSize begin, end;
    uint32_t build;
    bool scratch;
} Span;

static int by_place(const void* a, const void* b) {
    const Span *x = a, *y = b;
    if (x->buffer != y->buffer) return x->buffer < y->buffer ? -1 : 1;
    return x->begin < y->begin ? -1 : x->begin > y->begin;
}

static VkResult check_overlap(RtrRecorder r, const RtrBuild* builds, uint32_t count) {
    const VkAllocationCallbacks* a = r->has_allocator ? &r->allocator : NULL;
    Span* spans = rtr_alloc(a, 2 * (size_t)count * sizeof *spans);
    VkResult result = VK_SUCCESS;
    uint32_t i;
    if (!spans) return VK_ERROR_OUT_OF_HOST_MEMORY;
    for (i = 0; i < count; i++) {
        const RtrBuild* b = &builds[i];
        spans[2 * i] = (Span){(uint64_t)b->scratch, b->scratch_offset, b->scratch_offset + b->layout.total, i, true};
        spans[2 * i + 1] =
            (Span){(uint64_t)b->dst->buffer, b->dst->offset, b->dst->offset + b->dst->size, i, false};
    }
    qsort(spans, 2 * (size_t)count, sizeof *spans, by_place);
    for (i = 1; i < 2 * count && result == VK_SUCCESS; i++) {
        const Span *x = &spans[i - 1], *y = &spans[i];
        if (x->buffer != y->buffer || y->begin >= x->end) continue;
        result = rtr_error(r->device, VK_ERROR_VALIDATION_FAILED_EXT, "batch-overlap",
                           "builds of one call: the %s of number %u and the %s of number %u share memory",
                           x->scratch ? "scratch" : "dst", x->build, y->scratch ? "scratch" : "dst", y->build);
    }
    rtr_free(a, spans);
    return result;
}

/* A phase of all of them, one barrier, the next phase. */
static VkResult record_together(RtrRecorder r, RtrBuild* builds, uint32_t count, bool tops) {
    VkResult result = VK_SUCCESS;
    bool recorded = true;
    uint32_t i;
    while (recorded) {
        recorded = false;
        for (i = 0; i < count; i++) {
            RtrBuild* b = &builds[i];
            if (((b->push.flags & RTR_BUILD_TOP) != 0) != tops) continue;
            b->dispatched = false;
            while (!b->dispatched && !b->done && result == VK_SUCCESS)
                result = b->update ? rtr_record_update_phase(b) : rtr_record_build_phase(b);
            if (result != VK_SUCCESS) return result;
            recorded |= b->dispatched;
        }
        if (recorded) rtr_compute_barrier(r);
    }
    return VK_SUCCESS;
}

/* Launches of this recording look at what it built. */
static VkResult remember(const RtrBuild* b) {
    VkResult r = VK_SUCCESS;
    if (!b->update) r = rtr_remember_built(b->dst, b->info);
    if (r != VK_SUCCESS || !b->device->validation || !b->recorder->control) return r;
    return rtr_add_checked(b->recorder, b->dst, RTC_ERROR_BUILT);
}

VkResult rtrCmdBuildAccelerationStructures(RtrRecorder recorder, uint32_t count,
                                           const RtrAccelerationStructureBuildInfo* infos) {
    const VkAllocationCallbacks* a = recorder->has_allocator ? &recorder->allocator : NULL;
    RtrBuild one, *builds = &one;
    VkResult r = VK_SUCCESS;
    uint32_t i;
    if (!count) return VK_SUCCESS;
    memset(&one, 0, sizeof one);
    if (count > 1) builds = rtr_alloc(a, count * sizeof *builds);
    if (!builds) return VK_ERROR_OUT_OF_HOST_MEMORY;
    for (i = 0; i < count && r == VK_SUCCESS; i++) r = prepare(&builds[i], recorder, &infos[i]);
    if (r == VK_SUCCESS && count > 1) r = check_overlap(recorder, builds, count);
    if (r == VK_SUCCESS) r = record_together(recorder, builds, count, false);
    /* In a heap top levels read bottom levels through a binding of all of it, and write to it:
     * nobody but us knows that it is not the same part. */
    for (i = 0; i < count && r == VK_SUCCESS; i++)
        if (builds[i].dst->heap) r = record_together(recorder, &builds[i], 1, true);
    if (r == VK_SUCCESS) r = record_together(recorder, builds, count, true);
    for (i = 0; i < count && r == VK_SUCCESS; i++) r = remember(&builds[i]);
    if (count > 1) rtr_free(a, builds);
    return r;
}

VkResult rtrCmdBuildAccelerationStructure(RtrRecorder recorder, const VkAccelerationStructureInfoNV* info,
                                          VkBuffer instanceData, VkDeviceSize instanceOffset, VkBool32 update,
                                          RtrAccelerationStructure dst, RtrAccelerationStructure src,
                                          VkBuffer scratch, VkDeviceSize scratchOffset) {
    RtrAccelerationStructureBuildInfo b;
    memset(&b, 0, sizeof b);
    b.pInfo = info;
    b.instanceData = instanceData;
    b.instanceOffset = instanceOffset;
    b.update = update;
    b.dst = dst;
    b.src = src;
    b.scratch = scratch;
    b.scratchOffset = scratchOffset;
    return rtrCmdBuildAccelerationStructures(recorder, 1, &b);
}
