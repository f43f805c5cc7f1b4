/* Updates (refits): the tree stays, boxes and slots follow the geometry. */
#include "build.h"

static VkResult emit_instances(RtrBuild* b) {
    VkResult r = rtr_bind_arrays(b, 0, b->push.first);
    if (r != VK_SUCCESS) return r;
    b->push.window_first = b->push.first;
    b->push.window_count = b->push.count;
    rtr_dispatch(b, rtr_instance_kernel(b->dst), rtr_groups(b->push.count, RTR_GROUP));
    return VK_SUCCESS;
}

static VkResult emit_slots(RtrBuild* b) {
    uint32_t lanes = b->primitives - b->push.window_first;
    if (lanes > b->push.window_count) lanes = b->push.window_count;
    rtr_dispatch(b, b->dst->aabbs ? RTR_KERNEL_refit_aabbs : RTR_KERNEL_refit_triangles,
                 rtr_groups(lanes, RTR_GROUP));
    return VK_SUCCESS;
}

VkResult rtr_record_update(RtrBuild* b, RtrAccelerationStructure src) {
    RtrDevice d = b->device;
    const uint32_t nodes = rtr_node_room(b->dst->primitive_count);
    uint32_t at;
    VkResult r;
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
    rtr_dispatch(b, RTR_KERNEL_refit_links,
                 rtr_groups(b->primitives > nodes ? b->primitives : nodes, RTR_GROUP));
    if (b->push.flags & RTR_BUILD_TOP) {
        if ((r = rtr_check_build_instances(b, RTR_ARR_LINKS)) != VK_SUCCESS) return r;
        if ((r = rtr_for_each_input(b, emit_instances)) != VK_SUCCESS) return r;
    } else {
        for (at = 0; at < b->primitives; at += b->slot_window) {
            if ((r = rtr_bind_arrays(b, 0, at)) != VK_SUCCESS) return r;
            b->push.window_first = at;
            b->push.window_count = b->slot_window;
            if ((r = rtr_for_each_input(b, emit_slots)) != VK_SUCCESS) return r;
        }
    }
    if ((r = rtr_bind_arrays(b, 0, 0)) != VK_SUCCESS) return r;
    rtr_dispatch(b, RTR_KERNEL_refit_nodes, rtr_groups(nodes, RTR_GROUP));
    return VK_SUCCESS;
}
