/* A build as phases: which kernels run, in which order, on which arrays. Dispatches of one phase
 * do not depend on each other; a barrier follows. */
#include "build.h"

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

/* The arrays without windows, allocated once. */
static VkResult use_arrays(RtrBuild* b) {
    RtrDevice d = b->device;
    VkResult r = VK_SUCCESS;
    if (!b->whole) {
        if ((r = rtr_bind_arrays(b, 0, 0)) == VK_SUCCESS) b->whole = b->arrays;
        return r;
    }
    d->vk.CmdBindDescriptorSets(b->recorder->cmd, VK_PIPELINE_BIND_POINT_COMPUTE, d->kernel_layout, 1, 1, &b->whole,
                                0, NULL);
    return r;
}

void rtr_dispatch(RtrBuild* b, RtrKernel kernel, uint64_t groups) {
    if (groups == 0) return;
    rtr_dispatch_kernel(b->recorder, kernel, &b->push, (uint32_t)groups);
    b->dispatched = true;
}

VkResult rtr_dispatch_whole(RtrBuild* b, RtrKernel kernel, uint64_t groups) {
    VkResult r = use_arrays(b);
    if (r == VK_SUCCESS) rtr_dispatch(b, kernel, groups);
    return r;
}

VkResult rtr_emit_leaves(RtrBuild* b) {
    RtrKernel kernel = b->push.flags & RTR_BUILD_AABBS ? RTR_KERNEL_leaf_aabbs : RTR_KERNEL_leaf_triangles;
    if (b->push.flags & RTR_BUILD_TOP) {
        /* The records go straight to their place; a piece of the input is one window of them. */
        VkResult r = rtr_bind_arrays(b, 0, b->push.first);
        if (r != VK_SUCCESS) return r;
        b->push.window_first = b->push.first;
        b->push.window_count = b->push.count;
        rtr_dispatch(b, rtr_instance_kernel(b->dst), rtr_groups(b->push.count, RTR_GROUP));
        return VK_SUCCESS;
    }
    return rtr_dispatch_whole(b, kernel, rtr_groups(b->push.count, RTR_GROUP));
}

/* Passes that rotate (kernels/lbvh_fit.comp). The third takes as long as each and makes trees 0.4 to
 * 1 percent cheaper by SAH: only for bottom levels that are to be traced fast. */
#define ROTATION_PASSES 3u
static uint32_t rotation_passes(const RtrBuild* b) {
    const uint32_t flags = b->push.build_flags;
    if (flags & VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_BUILD_BIT_NV) return 0;
    return flags & VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_NV && !(b->push.flags & RTR_BUILD_TOP)
               ? ROTATION_PASSES
               : ROTATION_PASSES - 1;
}

enum {
    INIT,
    RANGES, /* of an indirect build */
    LEAVES,
    MORTON,
    SORT,
    TOPOLOGY = SORT + 3 * 32 / RTR_SORT_BITS,
    FIT,
    TOO_DEEP = FIT + ROTATION_PASSES, /* nothing happens unless the tree has become so */
    FIT_AGAIN,
    NUMBER_COUNT,
    NUMBER_SCAN,
    NUMBER,
    NODES, /* and the header */
    SLOTS
};

static VkResult leaves(RtrBuild* b) {
    bool more;
    VkResult r;
    if (b->cursor.at == 0 && b->cursor.geometry == 0 && b->push.flags & RTR_BUILD_TOP &&
        (r = rtr_check_build_instances(b, RTR_ARR_MARKS)) != VK_SUCCESS)
        return r;
    r = rtr_next_input(b, &more);
    if (r == VK_SUCCESS && more) return rtr_emit_leaves(b);
    b->phase++;
    return r;
}

static VkResult sort(RtrBuild* b) {
    static const RtrKernel kernels[3] = {RTR_KERNEL_sort_count, RTR_KERNEL_sort_scan, RTR_KERNEL_sort_scatter};
    const uint32_t step = b->phase++ - SORT;
    b->push.blocks = rtr_groups(b->primitives, RTR_SORT_BLOCK);
    if (b->primitives <= RTR_SORT_FUSED) {
        b->push.step = step * RTR_SORT_BITS;
        if (step == 32 / RTR_SORT_BITS - 1) b->phase = TOPOLOGY;
        return rtr_dispatch_whole(b, RTR_KERNEL_sort_fused, b->push.blocks);
    }
    b->push.step = step / 3 * RTR_SORT_BITS;
    return rtr_dispatch_whole(b, kernels[step % 3], step % 3 == 1 ? 1 : b->push.blocks);
}

/* Levels that are worth a dispatch each; the nodes above are few. */
static uint32_t fit_levels(const RtrBuild* b) {
    uint32_t levels = 0;
    while (levels < RTR_FIT_LEVELS - 2 && b->primitives >> levels > b->device->level_nodes) levels++;
    return levels;
}

/* One dispatch of a fitting pass: all of it, or one level. */
static VkResult fit_pass(RtrBuild* b, uint32_t pass) {
    const uint32_t groups = rtr_groups(b->primitives, RTR_GROUP), levels = fit_levels(b), level = b->level++;
    const uint32_t half = (b->primitives + 1) / 2;
    VkResult r = use_arrays(b);
    b->push.flags &= ~(RTR_FIT_LISTED | RTR_FIT_KEPT);
    if (pass > 0 && pass < ROTATION_PASSES) b->push.flags |= RTR_FIT_KEPT;
    if (r != VK_SUCCESS) return r;
    if (level == levels) {
        b->level = 0;
        b->phase++;
    }
    if (!levels) {
        rtr_dispatch(b, RTR_KERNEL_lbvh_fit, groups);
        return VK_SUCCESS;
    }
    b->push.first = RTR_ST_LEVELS + RTR_LEVEL_WORDS * (RTR_FIT_LEVELS * pass + level);
    b->push.window_first = level % 2 * half;
    b->push.window_count = half - b->push.window_first;
    if (level == 0) {
        rtr_dispatch(b, RTR_KERNEL_lbvh_fit_first, groups);
        return VK_SUCCESS;
    }
    if (level == levels) b->push.flags |= RTR_FIT_LISTED;
    rtr_dispatch_kernel_indirect(b->recorder, level == levels ? RTR_KERNEL_lbvh_fit : RTR_KERNEL_lbvh_fit_level, &b->push,
                                 b->scratch, b->scratch_offset + b->layout.offset[RTR_ARR_STATE] + 4 * b->push.first);
    b->dispatched = true;
    return VK_SUCCESS;
}

/* PREFER_FAST_BUILD takes the Morton tree as it is. */
static VkResult fit(RtrBuild* b) {
    const uint32_t step = b->phase - TOPOLOGY, groups = rtr_groups(b->primitives, RTR_GROUP);
    const uint32_t passes = rotation_passes(b), once = passes ? passes : 1; /* boxes need one */
    if (step < TOO_DEEP - TOPOLOGY ? step > once : !passes) {
        b->phase++;
        return VK_SUCCESS;
    }
    b->push.step = 0;
    if (step > 0 && step < TOO_DEEP - TOPOLOGY) b->push.step = passes > 0;
    if (step >= TOO_DEEP - TOPOLOGY) b->push.step = 2;
    if (step != 0 && step != TOO_DEEP - TOPOLOGY) return fit_pass(b, step < TOO_DEEP - TOPOLOGY ? step - 1 : ROTATION_PASSES);
    b->phase++;
    return rtr_dispatch_whole(b, RTR_KERNEL_lbvh_topology, groups);
}

static VkResult number(RtrBuild* b) {
    static const RtrKernel kernels[3] = {RTR_KERNEL_number_count, RTR_KERNEL_number_scan, RTR_KERNEL_number};
    const uint32_t step = b->phase++ - NUMBER_COUNT;
    b->push.blocks = rtr_groups(b->primitives, RTR_SCAN_BLOCK);
    b->push.step = b->push.blocks <= b->device->few_blocks;
    if (b->push.step && step < 2) return VK_SUCCESS;
    return rtr_dispatch_whole(b, kernels[step], step == 1 ? 1 : b->push.blocks);
}

/* A piece of the input into a window of the slots. */
static VkResult slots(RtrBuild* b) {
    bool more;
    VkResult r;
    if (b->push.flags & RTR_BUILD_TOP || b->window >= b->primitives) {
        b->done = true;
        return VK_SUCCESS;
    }
    if ((r = rtr_next_input(b, &more)) != VK_SUCCESS) return r;
    if (!more) {
        b->window += b->slot_window;
        return VK_SUCCESS;
    }
    if (b->window ? (r = rtr_bind_arrays(b, 0, b->window)) : (r = use_arrays(b))) return r;
    b->push.window_first = b->window;
    b->push.window_count = b->slot_window;
    rtr_dispatch(b, (b->push.flags & RTR_BUILD_AABBS) ? RTR_KERNEL_encode_aabbs : RTR_KERNEL_encode_triangles,
                 rtr_groups(b->push.count, RTR_GROUP));
    return VK_SUCCESS;
}

/* A window of the nodes. */
static VkResult nodes(RtrBuild* b) {
    const uint32_t groups = rtr_groups(b->primitives, RTR_GROUP);
    VkResult r = VK_SUCCESS;
    if (b->window == 0) r = rtr_dispatch_whole(b, RTR_KERNEL_header, 1);
    if (r != VK_SUCCESS || (r = rtr_bind_arrays(b, b->window, 0)) != VK_SUCCESS) return r;
    b->push.window_first = b->window;
    b->push.window_count = b->node_window;
    rtr_dispatch(b, RTR_KERNEL_encode_nodes, groups ? groups : 1);
    b->window += b->node_window;
    if (b->window < rtr_node_room(b->primitives)) return VK_SUCCESS;
    b->window = 0;
    b->phase++;
    return slots(b); /* they need nothing of the nodes */
}

VkResult rtr_record_build_phase(RtrBuild* b) {
    if (!b->primitives && b->phase >= MORTON && b->phase < NODES) b->phase = NODES;
    if (b->phase == INIT) {
        b->phase++;
        return rtr_dispatch_whole(b, RTR_KERNEL_init, 1);
    }
    if (b->phase == RANGES) {
        b->phase++;
        return rtr_load_ranges(b);
    }
    if (b->phase == LEAVES) return leaves(b);
    if (b->phase == MORTON && b->primitives <= RTR_SORT_SMALL) {
        b->phase = TOPOLOGY;
        return rtr_dispatch_whole(b, RTR_KERNEL_sort_small, 1);
    }
    if (b->phase == MORTON) {
        b->phase++;
        b->push.blocks = rtr_groups(b->primitives, RTR_SORT_BLOCK);
        return rtr_dispatch_whole(b, RTR_KERNEL_morton, rtr_groups(b->primitives, RTR_GROUP));
    }
    if (b->phase < TOPOLOGY) return sort(b);
    if (b->phase < NUMBER_COUNT) return fit(b);
    if (b->phase < NODES) return number(b);
    if (b->phase == NODES) return nodes(b);
    return slots(b);
}
