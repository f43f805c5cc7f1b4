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

static VkResult triangles(RtrBuild* b, uint32_t g, uint32_t first, uint32_t count, RtrInputFunction emit) {
    const VkGeometryTrianglesNV* t = &b->geometries[g].geometry.triangles;
    const VkDeviceSize limit = b->device->limits.maxStorageBufferRange - 1024u;
    const bool indexed = t->indexType != VK_INDEX_TYPE_NONE_NV;
    const VkDeviceSize index_size = rtr_index_size(t->indexType);
    uint32_t code = 0, size = 12, component = 4;
    const bool known = rtr_vertex_format(t->vertexFormat, &code, &size, &component);
    const VkDeviceSize vertex_bytes =
        known && t->vertexCount ? (t->vertexCount - 1) * t->vertexStride + size : 0;
    VkDeviceSize bytes_each = indexed ? 3 * index_size : 3 * t->vertexStride;
    uint32_t chunk = bytes_each ? (uint32_t)rtr_min_size(limit / bytes_each, count) : count;
    uint32_t at;
    if (!t->vertexData || (indexed && !t->indexData))
        return rtr_error(b->device, VK_ERROR_VALIDATION_FAILED_EXT, "geometry-data",
                         "geometry %u: %s is VK_NULL_HANDLE", g, t->vertexData ? "indexData" : "vertexData");
    if (indexed && vertex_bytes > limit) return too_large(b, "vertex data", g, vertex_bytes);
    if (chunk == 0) return too_large(b, "one triangle", g, bytes_each);
    for (at = 0; at < count; at += chunk) {
        uint32_t n = count - at < chunk ? count - at : chunk;
        Window data, index = {VK_NULL_HANDLE, 0, 0}, transform = {VK_NULL_HANDLE, 0, 0};
        VkResult r;
        b->push.flags &= ~RTR_BUILD_HAS_TRANSFORM;
        if (indexed) {
            VkDeviceSize begin = t->indexOffset + at * bytes_each;
            data =
                window(t->vertexData, t->vertexOffset, t->vertexOffset + vertex_bytes, &b->push.data_offset);
            index = window(t->indexData, begin, begin + n * bytes_each, &b->push.index_offset);
            b->push.vertex_count = t->vertexCount;
            b->push.index_type = index_size == 1 ? RTR_INDEX_8 : index_size == 2 ? RTR_INDEX_16 : RTR_INDEX_32;
        } else {
            VkDeviceSize begin = t->vertexOffset + at * bytes_each;
            data = window(t->vertexData, begin, begin + (3 * n - 1) * t->vertexStride + size,
                          &b->push.data_offset);
            b->push.vertex_count = 3 * n;
            b->push.index_type = RTR_INDEX_NONE;
        }
        if (t->transformData) {
            transform = window(t->transformData, t->transformOffset, t->transformOffset + 48,
                               &b->push.transform_offset);
            b->push.flags |= RTR_BUILD_HAS_TRANSFORM;
        }
        b->push.count = n;
        b->push.first = first + at;
        b->push.primitive_base = at;
        b->push.geometry = rtr_slot_word(&b->geometries[g], g);
        b->push.data_stride = (uint32_t)t->vertexStride;
        b->push.vertex_format = code;
        if ((r = bind_inputs(b, data, index, transform)) != VK_SUCCESS || (r = emit(b)) != VK_SUCCESS)
            return r;
    }
    return VK_SUCCESS;
}

/* AABBs and instances: records of a fixed stride. */
static VkResult records(RtrBuild* b, VkBuffer buffer, VkDeviceSize offset, VkDeviceSize stride,
                        VkDeviceSize size, uint32_t geometry, uint32_t first, uint32_t count, uint32_t most,
                        RtrInputFunction emit) {
    const VkDeviceSize limit = b->device->limits.maxStorageBufferRange - 1024u;
    uint32_t chunk = stride ? (uint32_t)rtr_min_size(limit / stride, count) : count;
    uint32_t at;
    if (chunk > most) chunk = most;
    for (at = 0; at < count; at += chunk) {
        const Window none = {VK_NULL_HANDLE, 0, 0};
        uint32_t n = count - at < chunk ? count - at : chunk;
        VkDeviceSize begin = offset + at * stride;
        VkResult r;
        Window data = window(buffer, begin, begin + (n - 1) * stride + size, &b->push.data_offset);
        b->push.count = n;
        b->push.first = first + at;
        b->push.primitive_base = at;
        b->push.geometry = geometry;
        b->push.data_stride = (uint32_t)stride;
        if ((r = bind_inputs(b, data, none, none)) != VK_SUCCESS || (r = emit(b)) != VK_SUCCESS) return r;
    }
    return VK_SUCCESS;
}

VkResult rtr_for_each_input(RtrBuild* b, RtrInputFunction emit) {
    uint32_t g, first = 0;
    if (b->dst->type == VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV) {
        if (!b->primitives) return VK_SUCCESS;
        return records(b, b->instance_data, b->instance_offset, 64, 64, 0, 0, b->primitives, b->slot_window,
                       emit);
    }
    for (g = 0; g < b->geometry_count; g++) {
        const VkGeometryNV* geometry = &b->geometries[g];
        uint32_t count = 0;
        VkResult r = rtr_check_geometry(b->device, geometry, g, &count);
        if (r != VK_SUCCESS) return r;
        if (!count) continue;
        if (geometry->geometryType == VK_GEOMETRY_TYPE_TRIANGLES_NV) {
            r = triangles(b, g, first, count, emit);
        } else {
            const VkGeometryAABBNV* boxes = &geometry->geometry.aabbs;
            if (!boxes->aabbData)
                return rtr_error(b->device, VK_ERROR_VALIDATION_FAILED_EXT, "geometry-data",
                                 "geometry %u: aabbData is VK_NULL_HANDLE", g);
            r = records(b, boxes->aabbData, boxes->offset, boxes->stride, 24, rtr_slot_word(geometry, g), first,
                        count, count, emit);
        }
        if (r != VK_SUCCESS) return r;
        first += count;
    }
    return VK_SUCCESS;
}
