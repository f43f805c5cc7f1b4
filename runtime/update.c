/* Updates (refits) as phases: the tree stays, boxes and slots follow the geometry. */
#include "build.h"

/* A slot that begins in a window may end behind its last quad. */
static uint32_t window_quads(RtrDevice d) {
    return (d->limits.maxStorageBufferRange / RTC_QUAD_BYTES - RTC_INSTANCE_QUADS) / 16u * 16u;
}

static void emit(RtrBuild* b) {
    const bool aabbs = b->push.flags & RTR_BUILD_AABBS;
    uint32_t lanes = b->push.window_count / (aabbs ? RTC_AABB_QUADS : RTC_TRIANGLE_QUADS) + 1;
    if (b->push.flags & RTR_BUILD_TOP) {
        rtr_dispatch(b, rtr_instance_kernel(b->dst), rtr_groups(b->push.count, RTR_GROUP));
        return;
    }
    if (lanes > b->primitives) lanes = b->primitives;
    rtr_dispatch(b, aabbs ? RTR_KERNEL_refit_aabbs : RTR_KERNEL_refit_triangles, rtr_groups(lanes, RTR_GROUP));
}

/* A piece of the input into a window of the whole structure: where slots start only its header says. */
static VkResult slots(RtrBuild* b) {
    const uint64_t at = (uint64_t)b->window * window_quads(b->device);
    bool more;
    VkResult r;
    if (at >= b->dst->size / RTC_QUAD_BYTES) {
        b->phase++;
        return VK_SUCCESS;
    }
    if ((r = rtr_next_input(b, &more)) != VK_SUCCESS) return r;
    if (!more) {
        b->window++;
        return VK_SUCCESS;
    }
    if ((r = rtr_bind_arrays(b, 0, (uint32_t)at)) != VK_SUCCESS) return r;
    b->push.window_first = (uint32_t)at;
    b->push.window_count = window_quads(b->device);
    emit(b);
    return VK_SUCCESS;
}

/* With validation: how many primitives are active now, for refit_nodes to compare. */
static VkResult count_active(RtrBuild* b) {
    const uint64_t room = b->layout.size[RTR_ARR_MARKS] / 4;
    bool more = false;
    VkResult r = VK_SUCCESS;
    if (b->device->validation && !(b->push.flags & RTR_BUILD_TOP) && b->primitives <= room &&
        32ull * b->primitives <= b->layout.size[RTR_ARR_LEAF_BOX]) {
        b->push.flags |= RTR_BUILD_COUNTED;
        r = rtr_next_input(b, &more);
    }
    if (r == VK_SUCCESS && more) return rtr_emit_leaves(b);
    b->phase++;
    return r;
}

static uint32_t nodes(const RtrBuild* b) {
    const uint32_t most = rtr_most_nodes(b->dst), room = rtr_node_room(b->primitives);
    return most < room ? most : room;
}

VkResult rtr_check_update_reach(RtrBuild* b) {
    if (nodes(b) <= b->node_window) return VK_SUCCESS;
    return rtr_error(b->device, VK_ERROR_FEATURE_NOT_PRESENT, "maxStorageBufferRange",
                     "update of %u primitives: maxStorageBufferRange %u reaches the nodes of %u", b->primitives,
                     b->device->limits.maxStorageBufferRange, b->node_window);
}

enum { COPY, INIT, RANGES, COUNT, LINKS, CHECK, SLOTS, NODES };

VkResult rtr_record_update_phase(RtrBuild* b) {
    switch (b->phase) {
        case COPY:
            b->phase++;
            if (!b->src || b->src == b->dst) return VK_SUCCESS;
            b->dispatched = true;
            return rtrCmdCopyAccelerationStructure(b->recorder, b->dst, b->src,
                                                   VK_COPY_ACCELERATION_STRUCTURE_MODE_CLONE_NV);
        case INIT:
            b->phase++;
            return rtr_dispatch_whole(b, RTR_KERNEL_init, 1);
        case RANGES:
            b->phase++;
            return rtr_load_ranges(b);
        case COUNT:
            return count_active(b);
        case LINKS:
            b->phase++;
            return rtr_dispatch_whole(b, RTR_KERNEL_refit_links,
                                      rtr_groups(b->primitives > nodes(b) ? b->primitives : nodes(b), RTR_GROUP));
        case CHECK:
            b->phase++;
            return b->push.flags & RTR_BUILD_TOP ? rtr_check_build_instances(b, RTR_ARR_LINKS) : VK_SUCCESS;
        case SLOTS:
            return slots(b);
        default:
            b->done = true;
            return rtr_dispatch_whole(b, RTR_KERNEL_refit_nodes, rtr_groups(nodes(b), RTR_GROUP));
    }
}
