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

/* Whether they are seen through windows; rtr_update_scratch has arrays for that then. */
static bool windowed(const RtrBuild* b) { return b->layout.size[RTR_ARR_NODE_BOX] != 0; }

/* One window of the nodes: their links, or their boxes. *more: there is another. */
static VkResult node_window(RtrBuild* b, RtrKernel kernel, bool* more) {
    const uint32_t count = nodes(b) - b->window < b->node_window ? nodes(b) - b->window : b->node_window;
    const uint32_t lanes = kernel == RTR_KERNEL_refit_links && !b->window && b->primitives > count ? b->primitives : count;
    VkResult r = VK_SUCCESS;
    b->push.window_first = b->window;
    b->push.window_count = count;
    if (b->window) r = rtr_bind_arrays(b, b->window, 0);
    if (r != VK_SUCCESS) return r;
    if (b->window)
        rtr_dispatch(b, kernel, rtr_groups(lanes, RTR_GROUP));
    else
        r = rtr_dispatch_whole(b, kernel, rtr_groups(lanes, RTR_GROUP));
    b->window += count;
    *more = b->window < nodes(b);
    if (!*more) b->window = 0;
    return r;
}

/* Nothing before the links needs the state words. */
static bool links_begin(const RtrBuild* b) { return !b->indirect && !b->device->validation; }

enum { COPY, INIT, RANGES, COUNT, LINKS, CHECK, SLOTS, NODES, STORE };

VkResult rtr_record_update_phase(RtrBuild* b) {
    bool more = false;
    VkResult r;
    switch (b->phase) {
        case COPY:
            b->phase++;
            if (!b->src || b->src == b->dst) return VK_SUCCESS;
            b->dispatched = true;
            return rtrCmdCopyAccelerationStructure(b->recorder, b->dst, b->src,
                                                   VK_COPY_ACCELERATION_STRUCTURE_MODE_CLONE_NV);
        case INIT:
            b->phase++;
            if (windowed(b)) b->push.flags |= RTR_REFIT_WINDOWS;
            if (links_begin(b)) {
                b->push.flags |= RTR_REFIT_INIT;
                return VK_SUCCESS;
            }
            return rtr_dispatch_whole(b, RTR_KERNEL_init, 1);
        case RANGES:
            b->phase++;
            return rtr_load_ranges(b);
        case COUNT:
            return count_active(b);
        case LINKS:
            r = node_window(b, RTR_KERNEL_refit_links, &more);
            if (!more) b->phase++;
            return r;
        case CHECK:
            b->phase++;
            return b->push.flags & RTR_BUILD_TOP ? rtr_check_build_instances(b, RTR_ARR_LINKS) : VK_SUCCESS;
        case SLOTS:
            return slots(b);
        case NODES:
            b->phase++;
            b->window = 0;
            b->done = !windowed(b);
            return rtr_dispatch_whole(b, windowed(b) ? RTR_KERNEL_refit_boxes : RTR_KERNEL_refit_nodes,
                                      rtr_groups(nodes(b), RTR_GROUP));
        default:
            r = node_window(b, RTR_KERNEL_refit_store, &more);
            b->done = !more;
            return r;
    }
}
