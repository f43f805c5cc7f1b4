/* rtrCmdBuildAccelerationStructure: which kernels run, in which order, on which arrays. */
#include "build.h"

static void place(RtrScratchLayout* l, uint32_t array, VkDeviceSize size) {
    l->offset[array] = l->total;
    l->size[array] = rtr_align(size ? size : 256, 256);
    l->total += l->size[array];
}

void rtr_build_scratch(uint32_t n, RtrScratchLayout* l) {
    /* The scans of the numbering need two words for blocks of the same size. */
    VkDeviceSize sums = (VkDeviceSize)rtr_groups(n, RTR_SORT_BLOCK) * RTR_SORT_BINS;
    memset(l, 0, sizeof *l);
    place(l, RTR_ARR_STATE, 4 * (RTR_ST_SUMS + sums));
    place(l, RTR_ARR_LEAF_BOX, 32ull * n);
    place(l, RTR_ARR_NODE_BOX, 32ull * n);
    place(l, RTR_ARR_INFO, 16ull * n);
    place(l, RTR_ARR_PAIRS_A, 8ull * n);
    place(l, RTR_ARR_PAIRS_B, 8ull * n);
    place(l, RTR_ARR_LINKS, 8ull * n);
    place(l, RTR_ARR_MARKS, 4ull * n);
    place(l, RTR_ARR_OUT, 4ull * n);
    place(l, RTR_ARR_SLOT_OF, 4ull * n);
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

void rtr_update_scratch(const struct RtrAccelerationStructure_T* as, RtrScratchLayout* l) {
    const uint32_t slots = most_slots(as), nodes = rtr_most_nodes(as);
    memset(l, 0, sizeof *l);
    place(l, RTR_ARR_STATE, 4 * RTR_ST_SUMS);
    place(l, RTR_ARR_LEAF_BOX, 32ull * slots);
    place(l, RTR_ARR_LINKS, 4ull * nodes);
    place(l, RTR_ARR_MARKS, 4ull * (slots > nodes ? slots : nodes));
}

VkResult rtr_bind_arrays(RtrBuild* b, uint32_t nodes_at, uint32_t slots_at) {
    RtrDevice d = b->device;
    const VkDeviceSize limit = d->limits.maxStorageBufferRange;
    const VkDeviceSize base = b->dst->offset;
    const VkDeviceSize end = base + b->dst->size;
    VkDescriptorBufferInfo infos[RTR_ARR_COUNT];
    VkWriteDescriptorSet writes[RTR_ARR_COUNT];
    uint32_t i, count = 0;
    VkResult r = rtr_allocate_set(b->recorder, d->array_layout, &b->arrays);
    if (r != VK_SUCCESS) return r;
    memset(writes, 0, sizeof writes);
    for (i = 0; i < RTR_ARR_COUNT; i++) {
        VkDescriptorBufferInfo* info = &infos[i];
        if (i == RTR_ARR_DST_HEADER) {
            info->buffer = b->dst->buffer;
            info->offset = base;
            info->range = RTC_AS_HEADER_QUADS * RTC_QUAD_BYTES;
        } else if (i == RTR_ARR_DST_NODES) {
            info->buffer = b->dst->buffer;
            info->offset =
                base + RTC_QUAD_BYTES * (RTC_AS_HEADER_QUADS + (VkDeviceSize)RTC_NODE_QUADS * nodes_at);
            info->range = rtr_min_size(
                limit, (b->update ? end : base + RTC_QUAD_BYTES * (VkDeviceSize)b->slots_quad) - info->offset);
        } else if (i == RTR_ARR_DST_SLOTS) {
            info->buffer = b->dst->buffer;
            info->offset =
                base + RTC_QUAD_BYTES * (b->update ? slots_at
                                                   : b->slots_quad + (VkDeviceSize)rtr_slot_quads(b->dst) * slots_at);
            if (info->offset >= end) continue; /* no slots at all */
            info->range = rtr_min_size(limit, end - info->offset);
        } else {
            if (!b->layout.size[i]) continue;
            info->buffer = b->scratch;
            info->offset = b->scratch_offset + b->layout.offset[i];
            info->range = rtr_min_size(limit, b->layout.size[i]);
        }
        writes[count].sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
        writes[count].dstSet = b->arrays;
        writes[count].dstBinding = i;
        writes[count].descriptorCount = 1;
        writes[count].descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
        writes[count].pBufferInfo = info;
        count++;
    }
    d->vk.UpdateDescriptorSets(d->device, count, writes, 0, NULL);
    d->vk.CmdBindDescriptorSets(b->recorder->cmd, VK_PIPELINE_BIND_POINT_COMPUTE, d->kernel_layout, 1, 1,
                                &b->arrays, 0, NULL);
    return VK_SUCCESS;
}

static void set_kernel(RtrBuild* b, RtrKernel kernel) {
    RtrDevice d = b->device;
    d->vk.CmdBindPipeline(b->recorder->cmd, VK_PIPELINE_BIND_POINT_COMPUTE, d->kernels[kernel]);
    d->vk.CmdPushConstants(b->recorder->cmd, d->kernel_layout, VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof b->push,
                           &b->push);
}

/* Every dispatch is followed by a barrier: the steps of a build depend on each other. */
void rtr_dispatch(RtrBuild* b, RtrKernel kernel, uint64_t groups) {
    uint32_t x = groups < RTC_MAX_GROUPS_X ? (uint32_t)groups : RTC_MAX_GROUPS_X;
    if (groups == 0) return;
    set_kernel(b, kernel);
    b->device->vk.CmdDispatch(b->recorder->cmd, x, rtr_groups(groups, RTC_MAX_GROUPS_X), 1);
    rtr_compute_barrier(b->recorder);
}

VkResult rtr_emit_leaves(RtrBuild* b) {
    RtrKernel kernel = RTR_KERNEL_leaf_triangles;
    if (b->push.flags & RTR_BUILD_AABBS) kernel = RTR_KERNEL_leaf_aabbs;
    if (b->push.flags & RTR_BUILD_TOP) {
        /* The records go straight to their place; a piece of the input is one window of them. */
        VkResult r = rtr_bind_arrays(b, 0, b->push.first);
        if (r != VK_SUCCESS) return r;
        b->push.window_first = b->push.first;
        b->push.window_count = b->push.count;
        rtr_dispatch(b, rtr_instance_kernel(b->dst), rtr_groups(b->push.count, RTR_GROUP));
        return VK_SUCCESS;
    }
    rtr_dispatch(b, kernel, rtr_groups(b->push.count, RTR_GROUP));
    return VK_SUCCESS;
}

static VkResult emit_slots(RtrBuild* b) {
    rtr_dispatch(b, (b->push.flags & RTR_BUILD_AABBS) ? RTR_KERNEL_encode_aabbs : RTR_KERNEL_encode_triangles,
                 rtr_groups(b->push.count, RTR_GROUP));
    return VK_SUCCESS;
}

static void sort(RtrBuild* b) {
    uint32_t shift;
    b->push.blocks = rtr_groups(b->primitives, RTR_SORT_BLOCK);
    for (shift = 0; shift < 32; shift += RTR_SORT_BITS) {
        b->push.step = shift;
        rtr_dispatch(b, RTR_KERNEL_sort_count, b->push.blocks);
        rtr_dispatch(b, RTR_KERNEL_sort_scan, 1);
        rtr_dispatch(b, RTR_KERNEL_sort_scatter, b->push.blocks);
    }
}

/* Passes that rotate; more gain less than a percent each (kernels/lbvh_fit.comp). */
#define ROTATION_PASSES 3u

static void tree(RtrBuild* b) {
    const uint32_t groups = rtr_groups(b->primitives, RTR_GROUP);
    const uint32_t passes = (b->push.build_flags & VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_BUILD_BIT_NV)
                                ? 1
                                : ROTATION_PASSES;
    uint32_t pass;
    b->push.step = 0;
    rtr_dispatch(b, RTR_KERNEL_lbvh_topology, groups);
    b->push.step = passes > 1;
    for (pass = 0; pass < passes; pass++) rtr_dispatch(b, RTR_KERNEL_lbvh_fit, groups);
    if (passes > 1) { /* does nothing unless the tree has become too deep */
        b->push.step = 2;
        rtr_dispatch(b, RTR_KERNEL_lbvh_topology, groups);
        rtr_dispatch(b, RTR_KERNEL_lbvh_fit, groups);
    }
    b->push.blocks = rtr_groups(b->primitives, RTR_SCAN_BLOCK);
    rtr_dispatch(b, RTR_KERNEL_number_count, b->push.blocks);
    rtr_dispatch(b, RTR_KERNEL_number_scan, 1);
    rtr_dispatch(b, RTR_KERNEL_number, b->push.blocks);
}

static VkResult record_build(RtrBuild* b) {
    uint32_t groups = rtr_groups(b->primitives, RTR_GROUP), at;
    VkResult r = rtr_bind_arrays(b, 0, 0);
    if (r != VK_SUCCESS) return r;
    rtr_dispatch(b, RTR_KERNEL_init, 1);
    if ((b->push.flags & RTR_BUILD_TOP) && (r = rtr_check_build_instances(b, RTR_ARR_MARKS)) != VK_SUCCESS)
        return r;
    if ((r = rtr_for_each_input(b, rtr_emit_leaves)) != VK_SUCCESS) return r;
    if (b->primitives) {
        rtr_dispatch(b, RTR_KERNEL_morton, groups);
        sort(b);
        tree(b);
    }
    for (at = 0; at < rtr_node_room(b->primitives); at += b->node_window) {
        if ((r = rtr_bind_arrays(b, at, 0)) != VK_SUCCESS) return r;
        b->push.window_first = at;
        b->push.window_count = b->node_window;
        rtr_dispatch(b, RTR_KERNEL_encode_nodes, groups ? groups : 1);
    }
    if (!(b->push.flags & RTR_BUILD_TOP)) {
        for (at = 0; at < b->primitives; at += b->slot_window) {
            if ((r = rtr_bind_arrays(b, 0, at)) != VK_SUCCESS) return r;
            b->push.window_first = at;
            b->push.window_count = b->slot_window;
            if ((r = rtr_for_each_input(b, emit_slots)) != VK_SUCCESS) return r;
        }
    }
    rtr_dispatch(b, RTR_KERNEL_header, 1);
    return VK_SUCCESS;
}

static uint32_t window_of(RtrDevice d, uint32_t bytes_each) {
    /* Whole multiples of 16 entries keep the next window aligned to 256 bytes. */
    return d->limits.maxStorageBufferRange / bytes_each / 16u * 16u;
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
    if ((r = rtr_check_chain(d, "VkAccelerationStructureInfoNV", info->pNext)) != VK_SUCCESS) return r;
    if (!dst || !dst->buffer)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "not-bound", "build: dst is not bound");
    if (info->type != dst->type || info->flags != dst->flags)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "as-info",
                         "build: type or flags differ from dst's creation");
    if (dst->compacted_size && !update)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "compacted-size",
                         "build: dst was created with compactedSize, for copies only");
    if (!b->scratch || b->scratch_offset % 256)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "scratch",
                         "build: scratch buffer missing or scratchOffset not a multiple of 256");
    if (update && !(dst->flags & VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV))
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "update-not-allowed",
                         "update of a structure without ALLOW_UPDATE");
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

/* Launches of this recording look at what it built. */
static VkResult remember(const RtrBuild* b) {
    if (!b->device->validation || !b->recorder->control) return VK_SUCCESS;
    return rtr_add_checked(b->recorder, b->dst, RTC_ERROR_BUILT);
}

VkResult rtrCmdBuildAccelerationStructure(RtrRecorder recorder, const VkAccelerationStructureInfoNV* info,
                                          VkBuffer instanceData, VkDeviceSize instanceOffset, VkBool32 update,
                                          RtrAccelerationStructure dst, RtrAccelerationStructure src,
                                          VkBuffer scratch, VkDeviceSize scratchOffset) {
    RtrBuild b;
    bool opaque;
    VkResult r;
    memset(&b, 0, sizeof b);
    b.recorder = recorder;
    b.device = recorder->device;
    b.dst = dst;
    b.scratch = scratch;
    b.scratch_offset = scratchOffset;
    b.instance_data = instanceData;
    b.instance_offset = instanceOffset;
    if ((r = check_build(&b, info, update, src)) != VK_SUCCESS) return r;
    b.geometries = info->pGeometries;
    b.geometry_count = info->geometryCount;
    b.slots_quad = rtr_slots_quad(dst->primitive_count);
    b.node_window = window_of(b.device, RTC_NODE_QUADS * RTC_QUAD_BYTES);
    b.slot_window = window_of(b.device, rtr_slot_quads(dst) * RTC_QUAD_BYTES);
    b.push.total = b.primitives;
    b.push.self_lo = (uint32_t)dst->base;
    b.push.self_hi = (uint32_t)(dst->base >> 32);
    b.push.slots_quad = b.slots_quad;
    b.push.heap_quads = dst->heap ? (uint32_t)(dst->heap->size / RTC_QUAD_BYTES) : 0;
    b.push.slot_quads = rtr_slot_quads(dst);
    b.push.build_flags = info->flags;
    b.push.geometry_count = info->geometryCount;
    if (dst->type == VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV) b.push.flags |= RTR_BUILD_TOP;
    b.update = update;
    if (update) b.push.flags |= RTR_BUILD_UPDATE;
    if (info->geometryCount && info->pGeometries[0].geometryType == VK_GEOMETRY_TYPE_AABBS_NV)
        b.push.flags |= RTR_BUILD_AABBS;
    if (info->flags & VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV)
        b.push.flags |= RTR_BUILD_KEEP_DEGENERATE;
    b.push.not_opaque = rtr_first_not_opaque(info);
    opaque = b.push.not_opaque == 0xffffffffu;
    b.push.facts = (dst->aabbs ? RTC_FACT_AABBS : 0u) | (opaque ? RTC_FACT_ALL_OPAQUE : 0u) |
                   (dst->heap ? 0u : RTC_FACT_ADDRESSES);
    if (update) {
        rtr_update_scratch(dst, &b.layout);
        r = rtr_record_update(&b, src);
        return r == VK_SUCCESS ? remember(&b) : r;
    }
    rtr_build_scratch(dst->primitive_count, &b.layout);
    r = record_build(&b);
    if (r == VK_SUCCESS) r = rtr_remember_built(dst, info);
    return r == VK_SUCCESS ? remember(&b) : r;
}
