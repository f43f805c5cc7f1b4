/* Geometry and instance buffers, cut into pieces that one binding reaches. */
#include "build.h"

typedef struct Window {
    VkBuffer buffer;
    VkDeviceSize offset, range;
} Window;

/* A binding that covers [begin, end) of a buffer; *residual: begin relative to it. */
static Window window(VkBuffer buffer, VkDeviceSize begin, VkDeviceSize end, uint32_t* residual) {
    Window w;
    w.buffer = buffer;
    w.offset = begin / 256 * 256;
    w.range = rtr_align(end, 4) - w.offset;
    *residual = (uint32_t)(begin - w.offset);
    return w;
}

static VkResult bind_inputs(RtrBuild* b, Window data, Window index, Window transform) {
    RtrDevice d = b->device;
    VkDescriptorBufferInfo infos[3];
    VkWriteDescriptorSet writes[4];
    VkDescriptorSet set;
    uint32_t count = 0, i;
    const Window* windows[3] = {&data, &index, &transform};
    VkResult r = rtr_allocate_set(b->recorder, d->input_layout, &set);
    if (r != VK_SUCCESS) return r;
    memset(writes, 0, sizeof writes);
    for (i = 0; i < 3; i++) {
        const Window* w = windows[i]->buffer ? windows[i] : &data;
        infos[i].buffer = w->buffer;
        infos[i].offset = w->offset;
        infos[i].range = w->range;
        writes[count].sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
        writes[count].dstSet = set;
        writes[count].dstBinding = i;
        writes[count].descriptorCount = 1;
        writes[count].descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
        writes[count].pBufferInfo = &infos[i];
        count++;
    }
    if (b->dst->type == VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV && b->dst->heap) {
        writes[count].sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
        writes[count].dstSet = set;
        writes[count].dstBinding = RTR_IN_HEAP;
        writes[count].descriptorCount = 1;
        writes[count].descriptorType = VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
        writes[count].pTexelBufferView = &b->dst->heap->view;
        count++;
    }
    d->vk.UpdateDescriptorSets(d->device, count, writes, 0, NULL);
    d->vk.CmdBindDescriptorSets(b->recorder->cmd, VK_PIPELINE_BIND_POINT_COMPUTE, d->kernel_layout, 0, 1,
                                &set, 0, NULL);
    return VK_SUCCESS;
}

static VkResult too_large(RtrBuild* b, const char* what, uint32_t g, VkDeviceSize bytes) {
    return rtr_error(b->device, VK_ERROR_FEATURE_NOT_PRESENT, "maxStorageBufferRange",
                     "geometry %u: %s of %llu bytes: maxStorageBufferRange is %u", g, what,
                     (unsigned long long)bytes, b->device->limits.maxStorageBufferRange);
}

/* Of an indirect build only the device knows how far into a buffer its input lies. */
static Window input(RtrBuild* b, VkBuffer buffer, VkDeviceSize begin, VkDeviceSize end, uint32_t* residual) {
    Window w = window(buffer, begin, end, residual);
    if (b->indirect) w.range = VK_WHOLE_SIZE;
    return w;
}

/* Takes the cursor's next piece: at most `most` primitives of `count`; the last moves it on. */
static uint32_t take(RtrBuild* b, uint32_t count, VkDeviceSize most, uint32_t geometry) {
    RtrInputCursor* c = &b->cursor;
    const uint32_t n = count - c->at < most ? count - c->at : (uint32_t)most;
    b->push.count = n;
    b->push.first = c->first + c->at;
    b->push.primitive_base = c->at;
    b->push.geometry = geometry;
    b->push.ranges = b->indirect ? b->layout.ranges + RTR_RANGE_WORDS * c->geometry : 0;
    c->at += n;
    if (c->at == count) {
        c->geometry++;
        c->first += count;
        c->at = 0;
    }
    return n;
}

static VkResult indirect_pieces(RtrBuild* b, uint32_t g) {
    return rtr_error(b->device, VK_ERROR_FEATURE_NOT_PRESENT, "maxStorageBufferRange",
                     "geometry %u of an indirect build: its input must lie within maxStorageBufferRange (%u)", g,
                     b->device->limits.maxStorageBufferRange);
}

static VkResult triangles(RtrBuild* b, uint32_t count) {
    const uint32_t g = b->cursor.geometry, at = b->cursor.at;
    const VkGeometryTrianglesNV* t = &b->geometries[g].geometry.triangles;
    const VkDeviceSize limit = b->device->limits.maxStorageBufferRange - 1024u;
    const bool indexed = t->indexType != VK_INDEX_TYPE_NONE_NV;
    const VkDeviceSize index_size = rtr_index_size(t->indexType);
    uint32_t code = 0, size = 12, component = 4, n;
    const bool known = rtr_vertex_format(t->vertexFormat, &code, &size, &component);
    const VkDeviceSize vertex_bytes =
        known && t->vertexCount ? (t->vertexCount - 1) * t->vertexStride + size : 0;
    const VkDeviceSize bytes_each = indexed ? 3 * index_size : 3 * t->vertexStride;
    const VkDeviceSize most = bytes_each ? limit / bytes_each : count;
    Window data, index = {VK_NULL_HANDLE, 0, 0}, transform = {VK_NULL_HANDLE, 0, 0};
    if (!t->vertexData || (indexed && !t->indexData))
        return rtr_error(b->device, VK_ERROR_VALIDATION_FAILED_EXT, "geometry-data",
                         "geometry %u: %s is VK_NULL_HANDLE", g, t->vertexData ? "indexData" : "vertexData");
    if (indexed && vertex_bytes > limit) return too_large(b, "vertex data", g, vertex_bytes);
    if (most == 0) return too_large(b, "one triangle", g, bytes_each);
    if (b->indirect && most < count) return indirect_pieces(b, g);
    n = take(b, count, most, rtr_slot_word(&b->geometries[g], g));
    b->push.flags &= ~RTR_BUILD_HAS_TRANSFORM;
    if (indexed) {
        const VkDeviceSize begin = t->indexOffset + at * bytes_each;
        data = input(b, t->vertexData, t->vertexOffset, t->vertexOffset + vertex_bytes, &b->push.data_offset);
        index = input(b, t->indexData, begin, begin + n * bytes_each, &b->push.index_offset);
        b->push.vertex_count = t->vertexCount;
        b->push.index_type = index_size == 1 ? RTR_INDEX_8 : index_size == 2 ? RTR_INDEX_16 : RTR_INDEX_32;
    } else {
        const VkDeviceSize begin = t->vertexOffset + at * bytes_each;
        data = input(b, t->vertexData, begin, begin + (3 * n - 1) * t->vertexStride + size, &b->push.data_offset);
        b->push.vertex_count = 3 * n;
        b->push.index_type = RTR_INDEX_NONE;
    }
    if (t->transformData) {
        transform = input(b, t->transformData, t->transformOffset, t->transformOffset + 48,
                          &b->push.transform_offset);
        b->push.flags |= RTR_BUILD_HAS_TRANSFORM;
    }
    b->push.data_stride = (uint32_t)t->vertexStride;
    b->push.vertex_format = code;
    return bind_inputs(b, data, index, transform);
}

/* AABBs and instances: records of a fixed stride. */
static VkResult records(RtrBuild* b, VkBuffer buffer, VkDeviceSize offset, VkDeviceSize stride,
                        VkDeviceSize size, uint32_t geometry, uint32_t count, VkDeviceSize most) {
    const VkDeviceSize limit = b->device->limits.maxStorageBufferRange - 1024u;
    const VkDeviceSize begin = offset + b->cursor.at * stride;
    const Window none = {VK_NULL_HANDLE, 0, 0};
    Window data;
    uint32_t n;
    if (stride && limit / stride < most) most = limit / stride;
    if (b->indirect && most < count) return indirect_pieces(b, b->cursor.geometry);
    n = take(b, count, most, geometry);
    data = input(b, buffer, begin, begin + (n - 1) * stride + size, &b->push.data_offset);
    b->push.data_stride = (uint32_t)stride;
    return bind_inputs(b, data, none, none);
}

VkResult rtr_next_input(RtrBuild* b, bool* more) {
    RtrInputCursor* c = &b->cursor;
    const RtrInputCursor start = {0, 0, 0};
    *more = true;
    if (b->dst->type == VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV) {
        if (b->primitives && !c->geometry)
            return records(b, b->instance_data, b->instance_offset, 64, 64, 0, b->primitives, b->slot_window);
    } else {
        for (; c->geometry < b->geometry_count; c->geometry++) {
            const VkGeometryNV* geometry = &b->geometries[c->geometry];
            const VkGeometryAABBNV* boxes = &geometry->geometry.aabbs;
            uint32_t count = 0;
            VkResult r = rtr_check_geometry(b->device, geometry, c->geometry, &count);
            if (r != VK_SUCCESS) return r;
            if (!count) continue;
            if (geometry->geometryType == VK_GEOMETRY_TYPE_TRIANGLES_NV) return triangles(b, count);
            if (!boxes->aabbData)
                return rtr_error(b->device, VK_ERROR_VALIDATION_FAILED_EXT, "geometry-data",
                                 "geometry %u: aabbData is VK_NULL_HANDLE", c->geometry);
            return records(b, boxes->aabbData, boxes->offset, boxes->stride, 24,
                           rtr_slot_word(geometry, c->geometry), count, count);
        }
    }
    *more = false;
    *c = start;
    return VK_SUCCESS;
}

VkResult rtr_load_ranges(RtrBuild* b) {
    const Window none = {VK_NULL_HANDLE, 0, 0};
    const uint32_t count = b->push.flags & RTR_BUILD_TOP ? 1 : b->geometry_count;
    Window ranges;
    VkResult r;
    if (!b->indirect || !count) return VK_SUCCESS;
    ranges = window(b->indirect, b->indirect_offset,
                    b->indirect_offset + (VkDeviceSize)(count - 1) * b->indirect_stride + 4 * RTR_RANGE_WORDS,
                    &b->push.data_offset);
    b->push.count = count;
    b->push.data_stride = b->indirect_stride;
    b->push.ranges = b->layout.ranges;
    if ((r = bind_inputs(b, ranges, none, none)) != VK_SUCCESS) return r;
    return rtr_dispatch_whole(b, RTR_KERNEL_ranges, rtr_groups(count, RTR_GROUP));
}
