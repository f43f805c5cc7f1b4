/* RtrDeviceCreateInfo::validation: references of instances must be those of bottom levels that
 * are bound and not destroyed. The host knows which those are (live.c); the device compares. */
#include "build.h"

/* ---- Pieces of the table, and what is looked at with each ------------------------------------- */

typedef struct Check {
    RtrRecorder r;
    RtrHeap heap;
    VkDescriptorBufferInfo table; /* where the pieces go */
    struct RtrBuildPush push;
    /* Looks at all records with the piece that is in place. */
    VkResult (*look)(struct Check* c);
    RtrBuild* build;             /* before a build */
    RtrAccelerationStructure top; /* before a launch, with its control block */
    VkDescriptorBufferInfo control;
} Check;

static VkResult look_through(Check* c) {
    RtrRecorder r = c->r;
    const RtrDeviceTable* vk = &r->device->vk;
    const uint32_t room = (uint32_t)(c->table.range / sizeof(RtrLive));
    RtrLive* entries;
    uint32_t count, at = 0;
    VkResult result = rtr_list_live(r, c->heap, true, &entries, &count);
    if (result != VK_SUCCESS) return result;
    do {
        const uint32_t n = count - at < room ? count - at : room;
        const uint64_t first = at ? rtr_live_base(&entries[at]) : 0;
        const uint64_t last = at + n < count ? rtr_live_base(&entries[at + n]) - 1 : ~0ull;
        rtr_barrier(r, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_ACCESS_SHADER_WRITE_BIT,
                    VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_WRITE_BIT);
        if (n) vk->CmdUpdateBuffer(r->cmd, c->table.buffer, c->table.offset, n * sizeof(RtrLive), &entries[at]);
        rtr_barrier(r, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_WRITE_BIT,
                    VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT);
        c->push.total = n;
        c->push.self_lo = (uint32_t)first;
        c->push.self_hi = (uint32_t)(first >> 32);
        c->push.src_lo = (uint32_t)last;
        c->push.src_hi = (uint32_t)(last >> 32);
        result = c->look(c);
        c->push.facts = 0;
        at += n;
    } while (result == VK_SUCCESS && at < count);
    rtr_free(r->has_allocator ? &r->allocator : NULL, entries);
    return result;
}

/* `header` and `marks`: the buffers of the kernel's other step stand in for what it does not use. */
static VkResult dispatch(Check* c, VkDescriptorBufferInfo records, VkDescriptorBufferInfo header,
                         VkDescriptorBufferInfo state, VkDescriptorBufferInfo marks,
                         VkDescriptorBufferInfo control) {
    const RtrBinding bindings[6] = {{0, RTR_IN_DATA, records},
                                    {0, RTR_IN_INDEX, c->table},
                                    {0, RTR_IN_TRANSFORM, header},
                                    {1, RTR_ARR_STATE, state},
                                    {1, RTR_ARR_MARKS, marks},
                                    {1, RTR_ARR_DST_HEADER, control}};
    VkResult result = rtr_bind_sets(c->r, c->heap, bindings, 6);
    if (result != VK_SUCCESS) return result;
    rtr_dispatch_kernel(c->r, c->heap ? RTR_KERNEL_check_instances : RTR_KERNEL_check_instances_address, &c->push,
                        rtr_groups(c->push.count, RTR_GROUP));
    rtr_compute_barrier(c->r);
    return VK_SUCCESS;
}

/* ---- Before a build ------------------------------------------------------------------------------ */

static VkResult look_at_input(Check* c) {
    const RtrBuild* b = c->build;
    const uint32_t most = (b->device->limits.maxStorageBufferRange - 1024u) / 64u;
    VkDescriptorBufferInfo records = {b->instance_data, 0, 0}, marks = {b->scratch, 0, 0}, state = marks;
    uint32_t at;
    marks.offset = b->scratch_offset + b->layout.offset[RTR_ARR_MARKS];
    marks.range = rtr_min_size(b->layout.size[RTR_ARR_MARKS], b->device->limits.maxStorageBufferRange);
    state.offset = b->scratch_offset + b->layout.offset[RTR_ARR_STATE];
    state.range = b->layout.size[RTR_ARR_STATE];
    c->push.ranges = b->indirect ? b->layout.ranges : 0;
    for (at = 0; at < b->primitives; at += most) {
        const VkDeviceSize begin = b->instance_offset + 64ull * at;
        VkResult result;
        c->push.first = at;
        c->push.count = b->primitives - at < most ? b->primitives - at : most;
        records.offset = begin / 256 * 256;
        records.range = b->indirect ? VK_WHOLE_SIZE : begin - records.offset + 64ull * c->push.count;
        c->push.data_offset = (uint32_t)(begin - records.offset);
        if ((result = dispatch(c, records, c->table, state, marks, marks)) != VK_SUCCESS) return result;
    }
    return VK_SUCCESS;
}

VkResult rtr_check_build_instances(RtrBuild* b, uint32_t end) {
    Check c;
    if (!b->device->validation || !b->primitives) return VK_SUCCESS;
    memset(&c, 0, sizeof c);
    c.r = b->recorder;
    c.heap = b->dst->heap;
    c.build = b;
    c.look = look_at_input;
    c.table.buffer = b->scratch;
    c.table.offset = b->scratch_offset + b->layout.offset[RTR_ARR_LEAF_BOX];
    c.table.range =
        rtr_min_size(b->layout.offset[end] - b->layout.offset[RTR_ARR_LEAF_BOX], RTR_CHECK_BYTES);
    b->push.flags |= RTR_BUILD_CHECKED;
    return look_through(&c);
}

/* ---- Before a launch ------------------------------------------------------------------------------ */

VkResult rtr_add_checked(RtrRecorder r, RtrAccelerationStructure as, uint32_t index) {
    uint32_t i;
    for (i = 0; i < r->checked_count; i++)
        if (r->checked[i].as == as && r->checked[i].index == index) return VK_SUCCESS;
    if (r->checked_count == r->checked_capacity) {
        const VkAllocationCallbacks* a = r->has_allocator ? &r->allocator : NULL;
        const uint32_t capacity = r->checked_capacity ? 2 * r->checked_capacity : 8;
        RtrChecked* more = rtr_alloc(a, capacity * sizeof *more);
        if (!more) return VK_ERROR_OUT_OF_HOST_MEMORY;
        if (r->checked_count) memcpy(more, r->checked, r->checked_count * sizeof *more);
        rtr_free(a, r->checked);
        r->checked = more;
        r->checked_capacity = capacity;
    }
    r->checked[r->checked_count].as = as;
    r->checked[r->checked_count++].index = index;
    return VK_SUCCESS;
}

void rtr_forget_declared(RtrRecorder r) {
    uint32_t i, kept = 0;
    for (i = 0; i < r->checked_count; i++)
        if (r->checked[i].index == RTC_ERROR_BUILT) r->checked[kept++] = r->checked[i];
    r->checked_count = kept;
}

static VkResult look_at_records(Check* c) {
    const RtrAccelerationStructure top = c->top;
    const VkDeviceSize window = c->r->device->limits.maxStorageBufferRange / 256 * 256;
    VkDescriptorBufferInfo records = {top->buffer, 0, 0};
    VkDeviceSize at;
    for (at = 0; at < top->size && (!at || c->push.step == 1 + RTC_AS_KIND_TOP); at += window) {
        VkResult result;
        records.offset = top->offset + at;
        records.range = rtr_min_size(top->size - at, window);
        c->push.window_first = (uint32_t)(at / RTC_QUAD_BYTES);
        c->push.window_count = (uint32_t)(records.range / RTC_QUAD_BYTES);
        result = dispatch(c, records, rtr_header_info(top), c->control, c->control, c->control);
        if (result != VK_SUCCESS) return result;
    }
    return VK_SUCCESS;
}

VkResult rtr_check_launch_instances(RtrRecorder r, const RtrLaunchCheck* check) {
    uint32_t i;
    for (i = 0; i < r->checked_count; i++) {
        const RtrChecked* t = &r->checked[i];
        const uint64_t most = t->as->size / (RTC_INSTANCE_QUADS * RTC_QUAD_BYTES);
        Check c;
        VkResult result;
        if (!t->as->buffer) continue;
        memset(&c, 0, sizeof c);
        c.r = r;
        c.heap = t->as->heap;
        c.top = t->as;
        c.control = check->control;
        c.look = look_at_records;
        c.table.buffer = r->control;
        c.table.offset = check->table;
        c.table.range = RTR_CHECK_BYTES;
        c.push.step = t->as->type == VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV ? 1 + RTC_AS_KIND_TOP
                                                                                 : 1 + RTC_AS_KIND_BOTTOM;
        c.push.facts = 1;
        c.push.geometry = t->index;
        c.push.index_offset = (uint32_t)t->as->base;
        c.push.index_type = (uint32_t)(t->as->base >> 32);
        c.push.vertex_count = (uint32_t)rtr_min_size(t->as->size / RTC_QUAD_BYTES, 0xffffffffu);
        c.push.count = c.push.step == 1 + RTC_AS_KIND_TOP ? (uint32_t)most : 1; /* of a bottom level the header */
        if ((result = look_through(&c)) != VK_SUCCESS) return result;
    }
    return VK_SUCCESS;
}
