/* Launches: parameters, control blocks, tiles and rounds. */
#include "internal.h"


#define UPDATE_BYTES 16384u /* per vkCmdUpdateBuffer; Vulkan allows 65536 */

/* ---- Lanes, tiles, rounds -------------------------------------------------------------- */

typedef struct Shape {
    bool tile_8x4;
    uint64_t lanes;      /* of the launch */
    uint32_t tile_lanes; /* of a dispatch: a multiple of the workgroup size */
    uint32_t tiles, rounds;
} Shape;

/* 8x4 tiles unless rows waste fewer lanes (thin or flat launches). */
static uint64_t launch_lanes(uint32_t w, uint32_t h, uint32_t d, bool* tile_8x4) {
    uint64_t tiled = ((uint64_t)w + 7) / 8 * (((uint64_t)h + 3) / 4) * 32;
    uint64_t rows = ((uint64_t)w + 31) / 32 * 32 * h;
    *tile_8x4 = tiled <= rows && h > 1;
    return (*tile_8x4 ? tiled : rows) * d;
}

static VkResult shape_launch(RtrRecorder r, uint32_t w, uint32_t h, uint32_t d, Shape* s) {
    const RtrPipeline p = r->pipeline;
    const uint32_t group = p->options.workgroupSize;
    uint64_t most;
    s->lanes = 0;
    if ((uint64_t)w * h <= 0xffffffffu) s->lanes = launch_lanes(w, h, d, &s->tile_8x4);
    if (s->lanes == 0 || s->lanes > 0xffffffffu - group)
        return rtr_error(r->device, VK_ERROR_VALIDATION_FAILED_EXT, "launch-size",
                         "launch of %u x %u x %u: lanes must stay below 2^32", w, h, d);
    s->lanes = rtr_align(s->lanes, group);
    most = s->lanes;
    if (r->max_tile_lanes && r->max_tile_lanes < most) most = r->max_tile_lanes;
    if (p->header.scratch_words) {
        const uint64_t each = 4ull * p->header.scratch_words;
        const uint64_t room = rtr_min_size(r->scratch_size, r->device->limits.maxStorageBufferRange) / each;
        if (room < group)
            return rtr_error(r->device, VK_ERROR_VALIDATION_FAILED_EXT, "launch-scratch",
                             "the module needs at least %llu bytes of launch scratch "
                             "(rtrGetLaunchScratchSize), %llu are set",
                             (unsigned long long)(each * group), (unsigned long long)r->scratch_size);
        if (room < most) most = room;
    }
    most = most / group * group;
    if (most == 0) most = group;
    s->tile_lanes = (uint32_t)most;
    s->tiles = (uint32_t)((s->lanes + most - 1) / most);
    s->rounds = (p->header.flags & RTC_MODULE_RESUMABLE) && p->options.stepBudget ? r->max_rounds : 1;
    return VK_SUCCESS;
}

VkDeviceSize rtrGetLaunchScratchSize(RtrDevice device, RtrPipeline p, uint32_t w, uint32_t h, uint32_t d,
                                     VkDeviceSize* pMinimum) {
    const VkDeviceSize each = 4ull * p->header.scratch_words;
    const uint32_t group = p->options.workgroupSize;
    VkDeviceSize full, reach = device->limits.maxStorageBufferRange / 256 * 256;
    bool tile;
    if (pMinimum) *pMinimum = rtr_align(each * group, 256);
    if (!each || !w || !h || !d) return 0;
    full = rtr_align(rtr_align(launch_lanes(w, h, d, &tile), group) * each, 256);
    /* One binding cannot reach more; the launch is then cut into tiles. */
    return rtr_min_size(full, reach);
}

uint32_t rtrGetLaunchTileCount(RtrDevice device, RtrPipeline p, uint32_t w, uint32_t h, uint32_t d,
                               VkDeviceSize scratch, uint64_t max_tile_lanes) {
    const uint64_t group = p->options.workgroupSize, each = 4ull * p->header.scratch_words;
    uint64_t lanes = 0, most, tiles;
    bool tile;
    if ((uint64_t)w * h <= 0xffffffffu) lanes = rtr_align(launch_lanes(w, h, d, &tile), group);
    if (!lanes || lanes > 0xffffffffu) return 0;
    most = max_tile_lanes && max_tile_lanes < lanes ? max_tile_lanes : lanes;
    if (each) most = rtr_min_size(most, rtr_min_size(scratch, device->limits.maxStorageBufferRange) / each);
    if (most < group) most = group;
    tiles = (lanes + most / group * group - 1) / (most / group * group);
    return (uint32_t)tiles;
}

static uint32_t param_stride(RtrDevice d) {
    return (uint32_t)rtr_align(RTR_PARAM_BYTES, d->limits.minUniformBufferOffsetAlignment);
}

static VkDeviceSize control_bytes(uint32_t rounds) {
    return rtr_align(4ull * (RTC_CTRL_HEADER_WORDS + 4ull * (rounds + 1)), 256);
}

static VkDeviceSize live_bytes(uint32_t count) { return rtr_align((count + 1ull) * sizeof(RtrLive), 256); }

VkDeviceSize rtrGetRecorderControlSize(RtrDevice d, uint32_t launches, uint32_t tiles, uint32_t rounds) {
    VkDeviceSize params, table = 0;
    if (!tiles) tiles = 1;
    if (!rounds) rounds = RTR_DEFAULT_ROUNDS;
    params = rtr_align((VkDeviceSize)param_stride(d) * tiles * rounds, 256);
    if (d->validation) table = live_bytes(rtr_count_live(d));
    if (d->validation && table < RTR_CHECK_BYTES) table = RTR_CHECK_BYTES;
    return launches * (params + control_bytes(rounds) + table);
}

/* ---- One launch --------------------------------------------------------------------------- */

typedef struct Launch {
    RtrRecorder r;
    RtrPipeline p;
    Shape shape;
    RtrStridedBufferRegion region[4];
    VkDescriptorBufferInfo sbt[4];
    VkDeviceSize sbt_offset[4]; /* of the region in its binding */
    uint32_t size[3];
    VkBuffer indirect; /* extents on the device; size is then the largest */
    VkDeviceSize indirect_offset;
    VkDeviceSize params, control; /* in the control buffer */
    VkDeviceSize table, table_bytes; /* behind the control block, see take_control */
    RtrLive* live;                   /* what a checking module is told, or NULL */
    uint32_t live_count;
    VkDescriptorSet reserved;
} Launch;

static VkResult check_region(RtrRecorder r, const char* name, const RtrStridedBufferRegion* g, bool raygen) {
    if (!g->buffer) {
        if (!raygen) return VK_SUCCESS;
        return rtr_error(r->device, VK_ERROR_VALIDATION_FAILED_EXT, "sbt-raygen",
                         "the raygen region has no buffer");
    }
    if (g->offset % RTC_SBT_BASE_ALIGNMENT)
        return rtr_error(r->device, VK_ERROR_VALIDATION_FAILED_EXT, "sbt-offset",
                         "%s region: offset %llu is not a multiple of %u", name,
                         (unsigned long long)g->offset, RTC_SBT_BASE_ALIGNMENT);
    if (!raygen && (g->stride % RTC_SBT_HANDLE_ALIGNMENT || g->stride > RTC_SBT_MAX_STRIDE))
        return rtr_error(r->device, VK_ERROR_VALIDATION_FAILED_EXT, "sbt-stride",
                         "%s region: stride %llu must be a multiple of %u and at most %u", name,
                         (unsigned long long)g->stride, RTC_SBT_HANDLE_ALIGNMENT, RTC_SBT_MAX_STRIDE);
    return VK_SUCCESS;
}

static void place_sbt(Launch* l) {
    uint32_t i;
    for (i = 0; i < 4; i++) {
        const RtrStridedBufferRegion* g = &l->region[i];
        VkDescriptorBufferInfo* info = &l->sbt[i];
        VkDeviceSize begin;
        if (!g->buffer) {
            *info = l->sbt[0];
            l->sbt_offset[i] = 0;
            continue;
        }
        /* In a set of the application the whole buffer is bound, see rtrWriteReservedDescriptors. */
        begin = l->p->reserved_in_app_set ? 0 : g->offset / 256 * 256;
        info->buffer = g->buffer;
        info->offset = begin;
        info->range = g->size == VK_WHOLE_SIZE || l->r->device->validation ? VK_WHOLE_SIZE : rtr_align(g->offset + g->size - begin, 4);
        l->sbt_offset[i] = g->offset - begin;
    }
}

static void put64(uint32_t* w, uint32_t at, VkDeviceSize v) {
    w[at] = (uint32_t)v;
    w[at + 1] = (uint32_t)(v >> 32);
}

static void fill_params(const Launch* l, uint32_t tile, uint32_t round, uint32_t* w) {
    const uint32_t at[4] = {RTC_PARAM_RAYGEN_OFFSET, RTC_PARAM_MISS_OFFSET, RTC_PARAM_HIT_OFFSET,
                            RTC_PARAM_CALLABLE_OFFSET};
    const uint64_t base = (uint64_t)tile * l->shape.tile_lanes;
    uint32_t i;
    memset(w, 0, RTR_PARAM_BYTES);
    for (i = 0; i < 4; i++) {
        const RtrStridedBufferRegion* g = &l->region[i];
        if (!g->buffer) continue;
        put64(w, at[i], l->sbt_offset[i]);
        /* The NV entry point does not tell the size: "as large as can be". */
        put64(w, at[i] + 2, g->size == VK_WHOLE_SIZE ? 0xffffffffu : g->size);
        if (i) put64(w, at[i] + 4, g->stride);
    }
    w[RTC_PARAM_WIDTH] = l->size[0];
    w[RTC_PARAM_HEIGHT] = l->size[1];
    w[RTC_PARAM_DEPTH] = l->size[2];
    w[RTC_PARAM_LANE_BASE] = (uint32_t)base;
    w[RTC_PARAM_LANE_COUNT] = (uint32_t)rtr_min_size(l->shape.tile_lanes, l->shape.lanes - base);
    w[RTC_PARAM_ROUND] = round;
    w[RTC_PARAM_CONTROL_WORD] =
        l->p->reserved_in_app_set ? (uint32_t)((l->control - l->r->control_offset) / 4) : 0;
    w[RTC_PARAM_SCRATCH_WORD] = 0;
    if (l->live) {
        w[RTC_PARAM_LIVE_TABLE] = w[RTC_PARAM_CONTROL_WORD] + (uint32_t)((l->table - l->control) / 4);
        w[RTC_PARAM_LIVE_COUNT] = l->live_count;
    }
    w[RTC_PARAM_HEAP_QUADS] = l->r->heap ? (uint32_t)(l->r->heap->size / RTC_QUAD_BYTES) : 0;
    w[RTC_PARAM_HEAP_ID] = l->r->heap ? l->r->heap->id : 0;
    w[RTC_PARAM_FLAGS] = l->shape.tile_8x4 ? RTC_LAUNCH_TILE_8X4 : 0;
}

static void tile_groups(const Launch* l, uint32_t tile, uint32_t groups[4]) {
    const uint64_t base = (uint64_t)tile * l->shape.tile_lanes;
    const uint32_t n =
        rtr_groups(rtr_min_size(l->shape.tile_lanes, l->shape.lanes - base), l->p->options.workgroupSize);
    groups[0] = n < RTC_MAX_GROUPS_X ? n : RTC_MAX_GROUPS_X;
    groups[1] = rtr_groups(n, RTC_MAX_GROUPS_X);
    groups[2] = 1;
    groups[3] = 0;
}

static void upload_params(const Launch* l) {
    RtrRecorder r = l->r;
    const uint32_t stride = param_stride(r->device), per_batch = UPDATE_BYTES / stride;
    const uint64_t total = (uint64_t)l->shape.tiles * l->shape.rounds;
    uint32_t words[UPDATE_BYTES / 4];
    uint64_t at;
    for (at = 0; at < total; at += per_batch) {
        const uint32_t n = (uint32_t)(total - at < per_batch ? total - at : per_batch);
        uint32_t i;
        memset(words, 0, (size_t)n * stride);
        for (i = 0; i < n; i++) {
            fill_params(l, (uint32_t)((at + i) / l->shape.rounds), (uint32_t)((at + i) % l->shape.rounds),
                        words + i * (stride / 4));
        }
        r->device->vk.CmdUpdateBuffer(r->cmd, r->control, l->params + at * stride, (VkDeviceSize)n * stride,
                                      words);
    }
}

/* Zeroes the block, or from the arguments on; round 0's arguments are the tile's groups. */
static void reset_control(const Launch* l, uint32_t tile, bool whole) {
    RtrRecorder r = l->r;
    const VkDeviceSize skip = whole ? 0 : 4 * RTC_CTRL_ARGS;
    uint32_t groups[4];
    tile_groups(l, tile, groups);
    r->device->vk.CmdFillBuffer(r->cmd, r->control, l->control + skip, control_bytes(l->shape.rounds) - skip,
                                0);
    if (l->shape.rounds > 1) {
        rtr_barrier(r, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_WRITE_BIT,
                    VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_WRITE_BIT);
        r->device->vk.CmdUpdateBuffer(r->cmd, r->control, l->control + 4 * RTC_CTRL_ARGS, sizeof groups,
                                      groups);
    }
}

static void after_transfer(RtrRecorder r) {
    rtr_barrier(r, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_WRITE_BIT,
                VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_DRAW_INDIRECT_BIT,
                VK_ACCESS_UNIFORM_READ_BIT | VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT |
                    VK_ACCESS_INDIRECT_COMMAND_READ_BIT);
}

static void before_transfer(RtrRecorder r) {
    rtr_barrier(r, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_DRAW_INDIRECT_BIT,
                VK_ACCESS_SHADER_WRITE_BIT, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_WRITE_BIT);
}

static VkResult own_set(Launch* l) {
    RtrRecorder r = l->r;
    RtrReservedInfo info;
    uint32_t i;
    VkResult result = rtr_allocate_set(r, l->p->reserved_layout, &l->reserved);
    if (result != VK_SUCCESS) return result;
    info.texels = VK_NULL_HANDLE;
    for (i = 0; i < RTC_BINDING_COUNT; i++) {
        info.buffers[i].buffer = r->control; /* stands in where the application gave none */
        info.buffers[i].offset = l->control;
        info.buffers[i].range = control_bytes(l->shape.rounds);
    }
    info.buffers[RTC_BINDING_CONTROL].range = l->table + l->table_bytes - l->control;
    info.buffers[RTC_BINDING_PARAMS].offset = r->control_offset;
    info.buffers[RTC_BINDING_PARAMS].range = RTR_PARAM_BYTES;
    for (i = 0; i < 4; i++) info.buffers[RTC_BINDING_SBT_RAYGEN + i] = l->sbt[i];
    if (r->heap) rtr_reserved_heap(r->device, r->heap, &info);
    if (r->scratch) {
        info.buffers[RTC_BINDING_SCRATCH].buffer = r->scratch;
        info.buffers[RTC_BINDING_SCRATCH].offset = r->scratch_offset;
        info.buffers[RTC_BINDING_SCRATCH].range =
            rtr_min_size(r->scratch_size, r->device->limits.maxStorageBufferRange);
    }
    rtr_write_reserved(r->device, l->p, l->reserved, &info);
    return VK_SUCCESS;
}

/* Binds pipeline, the application's sets and push constants. */
static VkResult bind_state(const Launch* l, uint32_t params_dynamic) {
    RtrRecorder r = l->r;
    const RtrDeviceTable* vk = &r->device->vk;
    const uint32_t reserved = l->p->header.reserved_set;
    bool found = !l->p->reserved_in_app_set;
    uint32_t i;
    vk->CmdBindPipeline(r->cmd, VK_PIPELINE_BIND_POINT_COMPUTE, l->p->pipeline);
    for (i = 0; i < r->set_call_count; i++) {
        RtrBoundSets* c = &r->set_calls[i];
        uint32_t dynamics = c->dynamic_count;
        if (c->first + c->count > l->p->set_layout_count) continue;
        if (reserved >= c->first && reserved < c->first + c->count) {
            if (!l->p->reserved_in_app_set)
                return rtr_error(r->device, VK_ERROR_VALIDATION_FAILED_EXT, "reserved-set",
                                 "set %u is the module's reserved set; the runtime binds it", reserved);
            if (reserved + 1 != c->first + c->count)
                return rtr_error(r->device, VK_ERROR_VALIDATION_FAILED_EXT, "reserved-set",
                                 "set %u holds the reserved bindings and must be the last of its bind call",
                                 reserved);
            found = true;
            c->dynamics[dynamics++] = params_dynamic;
        }
        vk->CmdBindDescriptorSets(r->cmd, VK_PIPELINE_BIND_POINT_COMPUTE, l->p->layout, c->first, c->count,
                                  c->sets, dynamics, c->dynamics);
    }
    if (!found)
        return rtr_error(r->device, VK_ERROR_VALIDATION_FAILED_EXT, "reserved-set",
                         "set %u with the reserved bindings is not bound", reserved);
    if (l->p->push_size && r->push_size)
        vk->CmdPushConstants(r->cmd, l->p->layout, VK_SHADER_STAGE_COMPUTE_BIT, 0,
                             r->push_size < l->p->push_size ? r->push_size : l->p->push_size, r->push_words);
    return VK_SUCCESS;
}

/* Only the dynamic offset of the parameters differs from round to round. */
static VkResult bind_params(const Launch* l, uint32_t tile, uint32_t round) {
    RtrRecorder r = l->r;
    const uint64_t slot = (uint64_t)tile * l->shape.rounds + round;
    const uint32_t dynamic = (uint32_t)(l->params - r->control_offset + slot * param_stride(r->device));
    if (l->p->reserved_in_app_set) return bind_state(l, dynamic);
    r->device->vk.CmdBindDescriptorSets(r->cmd, VK_PIPELINE_BIND_POINT_COMPUTE, l->p->layout,
                                        l->p->header.reserved_set, 1, &l->reserved, 1, &dynamic);
    return VK_SUCCESS;
}

static VkResult finish_tile(const Launch* l) {
    RtrRecorder r = l->r;
    RtrDevice d = r->device;
    struct RtrBuildPush push;
    VkDescriptorBufferInfo info;
    VkWriteDescriptorSet write = {.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
    VkResult result = rtr_allocate_set(r, d->array_layout, &write.dstSet);
    if (result != VK_SUCCESS) return result;
    info.buffer = r->control;
    info.offset = l->control;
    info.range = control_bytes(l->shape.rounds);
    write.dstBinding = RTR_ARR_STATE;
    write.descriptorCount = 1;
    write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    write.pBufferInfo = &info;
    d->vk.UpdateDescriptorSets(d->device, 1, &write, 0, NULL);
    memset(&push, 0, sizeof push);
    push.step = RTC_CTRL_ARGS + 4 * l->shape.rounds;
    push.count = l->p->options.workgroupSize;
    d->vk.CmdBindPipeline(r->cmd, VK_PIPELINE_BIND_POINT_COMPUTE, d->kernels[RTR_KERNEL_finish_launch]);
    d->vk.CmdBindDescriptorSets(r->cmd, VK_PIPELINE_BIND_POINT_COMPUTE, d->kernel_layout, 1, 1, &write.dstSet,
                                0, NULL);
    d->vk.CmdPushConstants(r->cmd, d->kernel_layout, VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof push, &push);
    d->vk.CmdDispatch(r->cmd, 1, 1, 1);
    return VK_SUCCESS;
}

/* Corrects the parameters by the extents that lie in device memory. */
static VkResult prepare_indirect(const Launch* l) {
    RtrRecorder r = l->r;
    RtrDevice d = r->device;
    const VkDeviceSize begin = l->indirect_offset / 256 * 256;
    const uint32_t slots = l->shape.tiles * l->shape.rounds;
    const VkDescriptorBufferInfo infos[3] = {
        {l->indirect, begin, l->indirect_offset + 12 - begin},
        {r->control, l->params, (VkDeviceSize)slots * param_stride(d)},
        {r->control, l->control, control_bytes(l->shape.rounds)},
    };
    const uint32_t bindings[3] = {RTR_IN_DATA, RTR_ARR_STATE, RTR_ARR_DST_HEADER};
    VkWriteDescriptorSet writes[3];
    VkDescriptorSet sets[2];
    struct RtrBuildPush push;
    uint32_t i;
    VkResult result = rtr_allocate_set(r, d->input_layout, &sets[0]);
    if (result == VK_SUCCESS) result = rtr_allocate_set(r, d->array_layout, &sets[1]);
    if (result != VK_SUCCESS) return result;
    memset(writes, 0, sizeof writes);
    for (i = 0; i < 3; i++) {
        writes[i].sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
        writes[i].dstSet = sets[i ? 1 : 0];
        writes[i].dstBinding = bindings[i];
        writes[i].descriptorCount = 1;
        writes[i].descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
        writes[i].pBufferInfo = &infos[i];
    }
    d->vk.UpdateDescriptorSets(d->device, 3, writes, 0, NULL);
    memset(&push, 0, sizeof push);
    push.data_offset = (uint32_t)(l->indirect_offset - begin);
    push.count = slots;
    push.data_stride = param_stride(d) / 4;
    push.step = l->shape.rounds;
    push.total = l->shape.tile_lanes;
    push.blocks = l->p->options.workgroupSize;
    push.window_count = (uint32_t)l->shape.lanes;
    d->vk.CmdBindPipeline(r->cmd, VK_PIPELINE_BIND_POINT_COMPUTE, d->kernels[RTR_KERNEL_prepare_launch]);
    d->vk.CmdBindDescriptorSets(r->cmd, VK_PIPELINE_BIND_POINT_COMPUTE, d->kernel_layout, 0, 2, sets, 0,
                                NULL);
    d->vk.CmdPushConstants(r->cmd, d->kernel_layout, VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof push, &push);
    d->vk.CmdDispatch(r->cmd, rtr_groups(slots, RTR_GROUP), 1, 1);
    rtr_compute_barrier(r);
    return VK_SUCCESS;
}

/* The table that a module linked --checked looks bases up in; what was checked before used its place. */
static void upload_live(const Launch* l) {
    RtrRecorder r = l->r;
    const uint32_t most = UPDATE_BYTES / sizeof(RtrLive);
    uint32_t at;
    before_transfer(r);
    for (at = 0; at < l->live_count; at += most) {
        const uint32_t n = l->live_count - at < most ? l->live_count - at : most;
        r->device->vk.CmdUpdateBuffer(r->cmd, r->control, l->table + at * sizeof(RtrLive), n * sizeof(RtrLive),
                                      l->live + at);
    }
    after_transfer(r);
}

static VkResult validate(const Launch* l) {
    RtrDevice d = l->r->device;
    RtrLaunchCheck c;
    c.regions = l->region;
    c.slots = l->shape.tiles * l->shape.rounds;
    c.slot_words = param_stride(d) / 4;
    c.params = (VkDescriptorBufferInfo){l->r->control, l->params, (VkDeviceSize)c.slots * param_stride(d)};
    c.control = (VkDescriptorBufferInfo){l->r->control, l->control, control_bytes(l->shape.rounds)};
    c.identity = l->p->header.identity;
    c.table = l->table;
    return rtr_validate_launch(l->r, &c);
}

static VkResult record_tiles(Launch* l) {
    RtrRecorder r = l->r;
    const RtrDeviceTable* vk = &r->device->vk;
    uint32_t tile, round;
    VkResult result;
    for (tile = 0; tile < l->shape.tiles; tile++) {
        if (tile) {
            if (l->shape.rounds > 1) {
                before_transfer(r);
                reset_control(l, tile, false);
                after_transfer(r);
            }
            rtr_compute_barrier(r); /* tiles share scratch and the control block */
        }
        if (tile == 0 || l->shape.rounds > 1)
            if ((result = bind_state(l, (uint32_t)(l->params - r->control_offset))) != VK_SUCCESS)
                return result;
        for (round = 0; round < l->shape.rounds; round++) {
            if (round) rtr_compute_barrier(r);
            if ((result = bind_params(l, tile, round)) != VK_SUCCESS) return result;
            if (l->shape.rounds == 1) {
                uint32_t groups[4];
                tile_groups(l, tile, groups);
                vk->CmdDispatch(r->cmd, groups[0], groups[1], groups[2]);
            } else {
                vk->CmdDispatchIndirect(r->cmd, r->control, l->control + 4 * (RTC_CTRL_ARGS + 4ull * round));
            }
        }
        if (l->shape.rounds > 1) {
            rtr_compute_barrier(r);
            if ((result = finish_tile(l)) != VK_SUCCESS) return result;
        }
    }
    return VK_SUCCESS;
}

/* Parameters, control block, and with validation a table: pieces of it while instances are checked before the launch
 * (RTR_CHECK_BYTES), then the whole for a module that checks. */
static VkResult take_control(Launch* l) {
    RtrRecorder r = l->r;
    const VkDeviceSize params =
        rtr_align((VkDeviceSize)param_stride(r->device) * l->shape.tiles * l->shape.rounds, 256);
    const VkDeviceSize block = control_bytes(l->shape.rounds);
    VkDeviceSize table = r->checked_count ? RTR_CHECK_BYTES : 0;
    if (l->live && live_bytes(l->live_count) > table) table = live_bytes(l->live_count);
    if (r->launch_count == r->launch_capacity) {
        const VkAllocationCallbacks* a = r->has_allocator ? &r->allocator : NULL;
        const uint32_t capacity = r->launch_capacity ? 2 * r->launch_capacity : 16;
        RtrLaunchPlace* more = rtr_alloc(a, capacity * sizeof *more);
        if (!more) return VK_ERROR_OUT_OF_HOST_MEMORY;
        if (r->launch_count) memcpy(more, r->launches, r->launch_count * sizeof *more);
        rtr_free(a, r->launches);
        r->launches = more;
        r->launch_capacity = capacity;
    }
    if (params + block + table > r->control_size - r->control_used)
        return rtr_error(r->device, VK_ERROR_OUT_OF_POOL_MEMORY, "control-region",
                         "the recorder's control region of %llu bytes is full: this launch (%u tiles, %u "
                         "rounds%s) needs %llu, "
                         "%llu are left (rtrGetRecorderControlSize, rtrRetireRecorder)",
                         (unsigned long long)r->control_size, l->shape.tiles, l->shape.rounds,
                         l->live ? ", a table of all live structures" : "",
                         (unsigned long long)(params + block + table),
                         (unsigned long long)(r->control_size - r->control_used));
    l->params = r->control_offset + r->control_used;
    l->control = l->params + params;
    l->table = l->control + block;
    l->table_bytes = table;
    return VK_SUCCESS;
}

static VkResult record(Launch* l) {
    RtrRecorder r = l->r;
    VkResult result = take_control(l);
    if (result != VK_SUCCESS) return result;
    place_sbt(l);
    if (!l->p->reserved_in_app_set && (result = own_set(l)) != VK_SUCCESS) return result;
    /* With the control region bound whole, earlier launches count as writers of all of it. */
    if (l->p->reserved_in_app_set) before_transfer(r);
    upload_params(l);
    reset_control(l, 0, true);
    after_transfer(r);
    if (l->indirect && (result = prepare_indirect(l)) != VK_SUCCESS) return result;
    if (r->device->validation && (result = validate(l)) != VK_SUCCESS) return result;
    if (l->live) upload_live(l);
    if ((result = record_tiles(l)) != VK_SUCCESS) return result;
    r->launches[r->launch_count].offset = l->control;
    r->launches[r->launch_count].size = control_bytes(l->shape.rounds);
    r->launch_count++;
    r->control_used = l->table + l->table_bytes - r->control_offset;
    return VK_SUCCESS;
}

static VkResult trace(RtrRecorder r, const RtrStridedBufferRegion* raygen, const RtrStridedBufferRegion* miss,
                      const RtrStridedBufferRegion* hit, const RtrStridedBufferRegion* callable,
                      VkBuffer indirect, VkDeviceSize indirect_offset, uint32_t w, uint32_t h, uint32_t d) {
    static const char* const names[4] = {"raygen", "miss", "hit", "callable"};
    const RtrStridedBufferRegion* given[4];
    Launch l;
    uint32_t i;
    VkResult result;
    if (!r->cmd) return rtr_not_begun(r, "rtrCmdTraceRays");
    if (!r->pipeline)
        return rtr_error(r->device, VK_ERROR_VALIDATION_FAILED_EXT, "no-pipeline",
                         "rtrCmdTraceRays: no pipeline is bound; rtrCmdBindPipeline first");
    if (!r->pipeline->pipeline)
        return rtr_error(r->device, VK_ERROR_VALIDATION_FAILED_EXT, "not-compiled",
                         "rtrCmdTraceRays: the pipeline was created with DEFER_COMPILE; rtrCompileDeferred "
                         "first");
    if (r->stack_size && r->stack_size < 4ull * r->pipeline->header.stack_words)
        return rtr_error(r->device, VK_ERROR_VALIDATION_FAILED_EXT, "stack-size",
                         "rtrCmdSetRayTracingPipelineStackSize said %u bytes; the pipeline's stack has %u",
                         r->stack_size, 4 * r->pipeline->header.stack_words);
    memset(&l, 0, sizeof l);
    l.r = r;
    l.p = r->pipeline;
    given[0] = raygen;
    given[1] = miss;
    given[2] = hit;
    given[3] = callable;
    for (i = 0; i < 4; i++) {
        if (given[i]) l.region[i] = *given[i];
        if ((result = check_region(r, names[i], &l.region[i], i == 0)) != VK_SUCCESS) return result;
    }
    if (!w || !h || !d) return VK_SUCCESS;
    if ((result = rtr_check_scene(r, l.p)) != VK_SUCCESS) return result;
    if (!r->control)
        return rtr_error(r->device, VK_ERROR_VALIDATION_FAILED_EXT, "control-buffer",
                         "the recorder was created without a control region; launches need one");
    if ((l.p->header.used_bindings >> RTC_BINDING_HEAP_TEXELS & 3) && !r->heap)
        return rtr_error(r->device, VK_ERROR_VALIDATION_FAILED_EXT, "no-heap",
                         "rtrCmdTraceRays: rtrCmdSetHeap first");
    if ((result = rtr_check_scene_heap(r, l.p)) != VK_SUCCESS) return result;
    if (r->heap && l.p->options.fetch == RTR_FETCH_STORAGE &&
        r->heap->size > r->device->limits.maxStorageBufferRange)
        return rtr_error(
            r->device, VK_ERROR_FEATURE_NOT_PRESENT, "maxStorageBufferRange",
            "heap of %llu bytes with RTR_FETCH_STORAGE: maxStorageBufferRange is %u; use RTR_FETCH_TEXEL",
            (unsigned long long)r->heap->size, r->device->limits.maxStorageBufferRange);
    l.indirect = indirect;
    l.indirect_offset = indirect_offset;
    l.size[0] = w;
    l.size[1] = h;
    l.size[2] = d;
    if ((result = shape_launch(r, w, h, d, &l.shape)) != VK_SUCCESS) return result;
    if (r->device->validation && l.p->header.flags & RTC_MODULE_CHECKED) {
        const bool addresses = l.p->header.flags & RTC_MODULE_ADDRESS_MODE;
        result = rtr_list_live(r, addresses ? NULL : r->heap, false, &l.live, &l.live_count);
        if (result != VK_SUCCESS) return result;
    }
    result = record(&l);
    rtr_free(r->has_allocator ? &r->allocator : NULL, l.live);
    return result;
}

VkResult rtrCmdTraceRaysRegions(RtrRecorder r, const RtrStridedBufferRegion* raygen,
                                const RtrStridedBufferRegion* miss, const RtrStridedBufferRegion* hit,
                                const RtrStridedBufferRegion* callable, uint32_t w, uint32_t h, uint32_t d) {
    return trace(r, raygen, miss, hit, callable, VK_NULL_HANDLE, 0, w, h, d);
}

VkResult rtrCmdTraceRaysIndirect(RtrRecorder r, const RtrStridedBufferRegion* raygen,
                                 const RtrStridedBufferRegion* miss, const RtrStridedBufferRegion* hit,
                                 const RtrStridedBufferRegion* callable, VkBuffer indirect,
                                 VkDeviceSize offset, uint32_t max_w, uint32_t max_h, uint32_t max_d) {
    if (!indirect || offset % 4)
        return rtr_error(r->device, VK_ERROR_VALIDATION_FAILED_EXT, "indirect-buffer",
                         "indirectBuffer missing, or indirectOffset %llu not a multiple of 4",
                         (unsigned long long)offset);
    return trace(r, raygen, miss, hit, callable, indirect, offset, max_w, max_h, max_d);
}

VkResult rtrCmdTraceRays(RtrRecorder r, VkBuffer raygenBuffer, VkDeviceSize raygenOffset, VkBuffer missBuffer,
                         VkDeviceSize missOffset, VkDeviceSize missStride, VkBuffer hitBuffer,
                         VkDeviceSize hitOffset, VkDeviceSize hitStride, VkBuffer callableBuffer,
                         VkDeviceSize callableOffset, VkDeviceSize callableStride, uint32_t width,
                         uint32_t height, uint32_t depth) {
    const RtrStridedBufferRegion raygen = {raygenBuffer, raygenOffset, 0, VK_WHOLE_SIZE};
    const RtrStridedBufferRegion miss = {missBuffer, missOffset, missStride, VK_WHOLE_SIZE};
    const RtrStridedBufferRegion hit = {hitBuffer, hitOffset, hitStride, VK_WHOLE_SIZE};
    const RtrStridedBufferRegion callable = {callableBuffer, callableOffset, callableStride, VK_WHOLE_SIZE};
    return rtrCmdTraceRaysRegions(r, &raygen, &miss, &hit, &callable, width, height, depth);
}
