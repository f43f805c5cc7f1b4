/* Updates (refits): the tree stays, boxes and slots follow the geometry. */
#include "build.h"

static VkResult emit_instances(RtrBuild* b) {
    rtr_dispatch(b, rtr_instance_kernel(b->dst), rtr_groups(b->push.count, RTR_GROUP));
    return VK_SUCCESS;
}

static VkResult emit_slots(RtrBuild* b) {
    const bool aabbs = b->push.flags & RTR_BUILD_AABBS;
    uint32_t lanes = b->push.window_count / (aabbs ? RTC_AABB_QUADS : RTC_TRIANGLE_QUADS) + 1;
    if (lanes > b->primitives) lanes = b->primitives;
    rtr_dispatch(b, aabbs ? RTR_KERNEL_refit_aabbs : RTR_KERNEL_refit_triangles, rtr_groups(lanes, RTR_GROUP));
    return VK_SUCCESS;
}

/* The slots as windows of the whole structure: where they start only its header says. */
static VkResult for_each_window(RtrBuild* b, RtrInputFunction emit) {
    const uint32_t limit = b->device->limits.maxStorageBufferRange / RTC_QUAD_BYTES;
    /* A slot that begins in a window may end behind its last quad. */
    const uint32_t step = (limit - RTC_INSTANCE_QUADS) / 16u * 16u;
    const uint64_t quads = b->dst->size / RTC_QUAD_BYTES;
    uint64_t at;
    for (at = 0; at < quads; at += step) {
        VkResult r = rtr_bind_arrays(b, 0, (uint32_t)at);
        if (r != VK_SUCCESS) return r;
        b->push.window_first = (uint32_t)at;
        b->push.window_count = step;
        if ((r = rtr_for_each_input(b, emit)) != VK_SUCCESS) return r;
    }
    return VK_SUCCESS;
}

/* With validation: how many primitives are active now, for refit_nodes to compare. */
static VkResult count_active(RtrBuild* b) {
    const uint64_t room = b->layout.size[RTR_ARR_MARKS] / 4;
    if (!b->device->validation || b->push.flags & RTR_BUILD_TOP || b->primitives > room ||
        32ull * b->primitives > b->layout.size[RTR_ARR_LEAF_BOX])
        return VK_SUCCESS;
    b->push.flags |= RTR_BUILD_COUNTED;
    return rtr_for_each_input(b, rtr_emit_leaves);
}

VkResult rtr_record_update(RtrBuild* b, RtrAccelerationStructure src) {
    RtrDevice d = b->device;
    uint32_t nodes = rtr_most_nodes(b->dst);
    VkResult r;
    if (nodes > rtr_node_room(b->primitives)) nodes = rtr_node_room(b->primitives);
    if (nodes > b->node_window)
        return rtr_error(d, VK_ERROR_FEATURE_NOT_PRESENT, "maxStorageBufferRange",
                         "update of %u primitives: maxStorageBufferRange %u reaches the nodes of %u",
                         b->primitives, d->limits.maxStorageBufferRange, b->node_window);
    if (src && src != b->dst) {
        r = rtrCmdCopyAccelerationStructure(b->recorder, b->dst, src,
                                            VK_COPY_ACCELERATION_STRUCTURE_MODE_CLONE_NV);
        if (r != VK_SUCCESS) return r;
        rtr_compute_barrier(b->recorder);
    }
    if ((r = rtr_bind_arrays(b, 0, 0)) != VK_SUCCESS) return r;
    rtr_dispatch(b, RTR_KERNEL_init, 1);
    if ((r = count_active(b)) != VK_SUCCESS) return r;
    rtr_dispatch(b, RTR_KERNEL_refit_links,
                 rtr_groups(b->primitives > nodes ? b->primitives : nodes, RTR_GROUP));
    if (b->push.flags & RTR_BUILD_TOP) {
        if ((r = rtr_check_build_instances(b, RTR_ARR_LINKS)) != VK_SUCCESS) return r;
        r = for_each_window(b, emit_instances);
    } else {
        r = for_each_window(b, emit_slots);
    }
    if (r != VK_SUCCESS || (r = rtr_bind_arrays(b, 0, 0)) != VK_SUCCESS) return r;
    rtr_dispatch(b, RTR_KERNEL_refit_nodes, rtr_groups(nodes, RTR_GROUP));
    return VK_SUCCESS;
}
