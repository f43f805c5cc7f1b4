/* Acceleration structure objects: what they hold, how large they are, where they lie. */
#include "build.h"

#define MAX_PRIMITIVES (1u << 26)
#define MAX_INSTANCES (1u << 24)

static VkResult bad(RtrDevice d, const char* id, const char* text, unsigned geometry) {
    return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, id, "acceleration structure, geometry %u: %s",
                     geometry, text);
}

bool rtr_vertex_format(VkFormat format, uint32_t* code, uint32_t* bytes, uint32_t* component_bytes) {
    uint32_t components = 3;
    *component_bytes = 2;
    switch (format) {
        case VK_FORMAT_R32G32B32_SFLOAT:
        case VK_FORMAT_R32G32B32A32_SFLOAT:
            *code = RTR_VERTEX_FLOAT3;
            *component_bytes = 4;
            break;
        case VK_FORMAT_R32G32_SFLOAT:
            *code = RTR_VERTEX_FLOAT2;
            *component_bytes = 4;
            components = 2;
            break;
        case VK_FORMAT_R16G16B16_SFLOAT:
        case VK_FORMAT_R16G16B16A16_SFLOAT:
            *code = RTR_VERTEX_HALF3;
            break;
        case VK_FORMAT_R16G16_SFLOAT:
            *code = RTR_VERTEX_HALF2;
            components = 2;
            break;
        case VK_FORMAT_R16G16B16_SNORM:
        case VK_FORMAT_R16G16B16A16_SNORM:
            *code = RTR_VERTEX_SNORM3;
            break;
        case VK_FORMAT_R16G16_SNORM:
            *code = RTR_VERTEX_SNORM2;
            components = 2;
            break;
        default:
            return false;
    }
    *bytes = components * *component_bytes;
    return true;
}

static VkResult check_triangles(RtrDevice d, const VkGeometryTrianglesNV* t, unsigned g,
                                uint32_t* primitives) {
    uint32_t code, bytes, component;
    VkResult r = rtr_check_structure(d, "VkGeometryTrianglesNV", t, VK_STRUCTURE_TYPE_GEOMETRY_TRIANGLES_NV);
    if (r != VK_SUCCESS) return r;
    if (!rtr_vertex_format(t->vertexFormat, &code, &bytes, &component))
        return rtr_error(d, VK_ERROR_FEATURE_NOT_PRESENT, "vertex-format",
                         "acceleration structure, geometry %u: vertex format %d; VK_NV_ray_tracing lists "
                         "R32G32B32_SFLOAT, "
                         "R32G32_SFLOAT, R16G16B16_SFLOAT, R16G16_SFLOAT, R16G16_SNORM, R16G16B16_SNORM",
                         g, (int)t->vertexFormat);
    if (t->vertexStride % component != 0 || (t->vertexStride < bytes && t->vertexCount > 1))
        return bad(d, "vertex-stride",
                   "vertexStride must be a multiple of the component size and hold a vertex", g);
    if (t->vertexOffset % component != 0)
        return bad(d, "vertex-offset", "vertexOffset must be a multiple of the component size", g);
    switch (t->indexType) {
        case VK_INDEX_TYPE_NONE_NV:
            if (t->indexCount != 0)
                return bad(d, "index-count", "indexCount must be 0 with VK_INDEX_TYPE_NONE_NV", g);
            *primitives = t->vertexCount / 3;
            if (t->vertexCount % 3)
                return bad(d, "vertex-count", "vertexCount must be a multiple of 3 without indices", g);
            break;
        case VK_INDEX_TYPE_UINT8_EXT:
        case VK_INDEX_TYPE_UINT16:
        case VK_INDEX_TYPE_UINT32:
            if (t->indexOffset % rtr_index_size(t->indexType))
                return bad(d, "index-offset", "indexOffset must be a multiple of the index size", g);
            if (t->indexCount % 3) return bad(d, "index-count", "indexCount must be a multiple of 3", g);
            if (t->indexCount && !t->vertexCount) return bad(d, "vertex-count", "indices but no vertices", g);
            *primitives = t->indexCount / 3;
            break;
        default:
            return bad(d, "index-type", "indexType must be NONE_NV, UINT8_EXT, UINT16 or UINT32", g);
    }
    if (t->transformOffset % 16)
        return bad(d, "transform-offset", "transformOffset must be a multiple of 16", g);
    return VK_SUCCESS;
}

static VkResult check_aabbs(RtrDevice d, const VkGeometryAABBNV* b, unsigned g, uint32_t* primitives) {
    VkResult r = rtr_check_structure(d, "VkGeometryAABBNV", b, VK_STRUCTURE_TYPE_GEOMETRY_AABB_NV);
    if (r != VK_SUCCESS) return r;
    if (b->stride % 8 != 0 || (b->stride < 24 && b->numAABBs > 1))
        return bad(d, "aabb-stride", "stride must be a multiple of 8 and at least 24", g);
    if (b->offset % 8 != 0) return bad(d, "aabb-offset", "offset must be a multiple of 8", g);
    *primitives = b->numAABBs;
    return VK_SUCCESS;
}

VkResult rtr_check_geometry(RtrDevice d, const VkGeometryNV* g, unsigned index, uint32_t* primitives) {
    VkResult r = rtr_check_structure(d, "VkGeometryNV", g, VK_STRUCTURE_TYPE_GEOMETRY_NV);
    if (r != VK_SUCCESS) return r;
    if (g->flags & ~(VkGeometryFlagsNV)(VK_GEOMETRY_OPAQUE_BIT_NV | VK_GEOMETRY_NO_DUPLICATE_ANY_HIT_INVOCATION_BIT_NV))
        return bad(d, "geometry-flags", "flags other than OPAQUE and NO_DUPLICATE_ANY_HIT_INVOCATION", index);
    if (g->geometryType == VK_GEOMETRY_TYPE_TRIANGLES_NV)
        return check_triangles(d, &g->geometry.triangles, index, primitives);
    if (g->geometryType == VK_GEOMETRY_TYPE_AABBS_NV)
        return check_aabbs(d, &g->geometry.aabbs, index, primitives);
    return bad(d, "geometry-type", "geometryType must be TRIANGLES or AABBS", index);
}

static VkResult check_flags(RtrDevice d, VkBuildAccelerationStructureFlagsNV flags) {
    const VkBuildAccelerationStructureFlagsNV fast = VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_NV |
                                                     VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_BUILD_BIT_NV;
    /* ALLOW_DATA_ACCESS of VK_KHR_ray_tracing_position_fetch, which older headers lack: always granted. */
    const VkBuildAccelerationStructureFlagsNV data_access = 0x800;
    const VkBuildAccelerationStructureFlagsNV known =
        fast | data_access | VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV |
        VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_COMPACTION_BIT_NV | VK_BUILD_ACCELERATION_STRUCTURE_LOW_MEMORY_BIT_NV;
    if (!(flags & ~known) && (flags & fast) != fast) return VK_SUCCESS;
    return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "build-flags",
                     "acceleration structure: build flags 0x%x; PREFER_FAST_TRACE and PREFER_FAST_BUILD exclude each "
                     "other, and flags beyond those of VK_NV_ray_tracing and ALLOW_DATA_ACCESS are not known",
                     flags);
}

static VkResult fill_from_info(RtrDevice d, RtrAccelerationStructure as,
                               const VkAccelerationStructureInfoNV* info, const VkAllocationCallbacks* a) {
    uint64_t total = 0;
    uint32_t i;
    as->type = info->type;
    as->flags = info->flags;
    if (info->type == VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV) {
        if (info->geometryCount)
            return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "as-counts", "a top level has no geometries");
        if (info->instanceCount > MAX_INSTANCES)
            return rtr_error(d, VK_ERROR_FEATURE_NOT_PRESENT, "maxInstanceCount",
                             "%u instances; the limit is %u", info->instanceCount, MAX_INSTANCES);
        as->instance_count = as->primitive_count = info->instanceCount;
        return VK_SUCCESS;
    }
    if (info->type != VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "as-type",
                         "type must be TOP_LEVEL or BOTTOM_LEVEL");
    if (info->instanceCount)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "as-counts", "a bottom level has no instances");
    if (info->geometryCount > RTC_SLOT_GEOMETRY_MASK)
        return rtr_error(d, VK_ERROR_FEATURE_NOT_PRESENT, "maxGeometryCount",
                         "%u geometries; the limit is %u", info->geometryCount, RTC_SLOT_GEOMETRY_MASK);
    as->geometry_count = info->geometryCount;
    if (info->geometryCount) {
        as->geometries = rtr_alloc(a, info->geometryCount * sizeof *as->geometries);
        if (!as->geometries) return VK_ERROR_OUT_OF_HOST_MEMORY;
        memcpy(as->geometries, info->pGeometries, info->geometryCount * sizeof *as->geometries);
    }
    for (i = 0; i < info->geometryCount; i++) {
        uint32_t primitives = 0;
        VkResult r = rtr_check_geometry(d, &as->geometries[i], i, &primitives);
        if (r != VK_SUCCESS) return r;
        if (as->geometries[i].geometryType != as->geometries[0].geometryType)
            return bad(d, "mixed-geometry", "a bottom level holds either triangles or AABBs, not both", i);
        total += primitives;
    }
    as->aabbs = info->geometryCount && as->geometries[0].geometryType == VK_GEOMETRY_TYPE_AABBS_NV;
    if (total > MAX_PRIMITIVES)
        return rtr_error(d, VK_ERROR_FEATURE_NOT_PRESENT, "maxTriangleCount",
                         "%llu primitives; the limit is %u", (unsigned long long)total, MAX_PRIMITIVES);
    as->primitive_count = (uint32_t)total;
    return VK_SUCCESS;
}

VkResult rtrCreateAccelerationStructure(RtrDevice d, const VkAccelerationStructureCreateInfoNV* info,
                                        const VkAllocationCallbacks* allocator,
                                        RtrAccelerationStructure* pAs) {
    const VkAllocationCallbacks* a = rtr_pick(d, allocator);
    RtrAccelerationStructure as;
    VkResult r;
    *pAs = NULL;
    if ((r = rtr_check_structure(d, "VkAccelerationStructureCreateInfoNV", info,
                                 VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_NV)) != VK_SUCCESS ||
        (r = rtr_check_structure(d, "VkAccelerationStructureInfoNV", &info->info,
                                 VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV)) != VK_SUCCESS ||
        (r = check_flags(d, info->info.flags)) != VK_SUCCESS)
        return r;
    if (info->compactedSize && (info->info.geometryCount || info->info.instanceCount))
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "compacted-size",
                         "with compactedSize, geometryCount and instanceCount must be 0");
    as = rtr_alloc(a, sizeof *as);
    if (!as) return VK_ERROR_OUT_OF_HOST_MEMORY;
    as->device = d;
    r = fill_from_info(d, as, &info->info, a);
    if (r != VK_SUCCESS) {
        rtrDestroyAccelerationStructure(d, as, allocator);
        return r;
    }
    as->compacted_size = info->compactedSize;
    if (info->compactedSize) {
        as->size = info->compactedSize;
    } else {
        as->size = RTC_QUAD_BYTES * (rtr_slots_quad(as->primitive_count) +
                                     (VkDeviceSize)rtr_slot_quads(as) * as->primitive_count);
    }
    /* All that its memory requirements ask for: structures of the same requirements are clones' equals. */
    as->size = rtr_align(as->size, RTC_AS_ALIGNMENT);
    *pAs = as;
    return VK_SUCCESS;
}

void rtrDestroyAccelerationStructure(RtrDevice d, RtrAccelerationStructure as,
                                     const VkAllocationCallbacks* allocator) {
    const VkAllocationCallbacks* a = rtr_pick(d, allocator);
    if (!as) return;
    rtr_remove_live(as);
    rtr_forget_built(as);
    rtr_free(a, as->geometries);
    rtr_free(a, as);
}

void rtrGetAccelerationStructureMemoryRequirements(RtrDevice d,
                                                   VkAccelerationStructureMemoryRequirementsTypeNV type,
                                                   RtrAccelerationStructure as, VkMemoryRequirements2* out) {
    RtrScratchLayout layout;
    VkDeviceSize size = as->size;
    VkBaseOutStructure* next = out->pNext;
    if (type == VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_BUILD_SCRATCH_NV) {
        rtr_build_scratch(as->primitive_count, as->geometry_count, &layout);
        size = layout.total;
    } else if (type == VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_UPDATE_SCRATCH_NV) {
        rtr_update_scratch(as, &layout);
        size = layout.total;
    } else if (type != VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_OBJECT_NV) {
        rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "requirements-type",
                  "memory requirements of type %d: OBJECT, BUILD_SCRATCH or UPDATE_SCRATCH", (int)type);
        size = 0;
    }
    /* The memory is that of a buffer, which may be any. */
    for (; next; next = next->pNext)
        if (next->sType == VK_STRUCTURE_TYPE_MEMORY_DEDICATED_REQUIREMENTS)
            ((VkMemoryDedicatedRequirements*)next)->prefersDedicatedAllocation =
                ((VkMemoryDedicatedRequirements*)next)->requiresDedicatedAllocation = VK_FALSE;
    out->memoryRequirements.size = rtr_align(size, RTC_AS_ALIGNMENT);
    out->memoryRequirements.alignment = RTC_AS_ALIGNMENT;
    out->memoryRequirements.memoryTypeBits = 0xffffffffu;
}

static VkResult bind_address(RtrDevice d, RtrAccelerationStructure as, VkBuffer buffer, VkDeviceSize offset,
                             unsigned i) {
    VkBufferDeviceAddressInfo info = {.sType = VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO};
    VkDeviceAddress address;
    if (!d->get_buffer_device_address)
        return rtr_error(d, VK_ERROR_FEATURE_NOT_PRESENT, "address-mode",
                         "bind %u: a buffer, but the RtrDevice was created without bufferDeviceAddress", i);
    if (offset % RTC_AS_ALIGNMENT)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "bind-offset",
                         "bind %u: bufferOffset %llu must be a multiple of 256", i,
                         (unsigned long long)offset);
    info.buffer = buffer;
    address = d->get_buffer_device_address(d->device, &info);
    if (!address || address % RTC_QUAD_BYTES)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "bind-address",
                         "bind %u: the buffer's device address is 0x%llx; it needs the usages of "
                         "RTR_ADDRESS_BUFFER_USAGE and memory",
                         i, (unsigned long long)address);
    as->buffer = buffer;
    as->offset = offset;
    as->base = address + offset;
    return VK_SUCCESS;
}

VkResult rtrBindAccelerationStructureMemory(RtrDevice d, uint32_t count,
                                            const RtrBindAccelerationStructureMemoryInfo* infos) {
    uint32_t i;
    for (i = 0; i < count; i++) {
        const RtrBindAccelerationStructureMemoryInfo* b = &infos[i];
        VkResult r = rtr_check_chain(d, "RtrBindAccelerationStructureMemoryInfo", b->pNext);
        if (r != VK_SUCCESS) return r;
        RtrAccelerationStructure as = b->accelerationStructure;
        if (!as || as->buffer || !b->heap == !b->buffer)
            return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "bind",
                             "bind %u: needs an acceleration structure not bound yet, and a heap or (address "
                             "mode) a buffer, not both",
                             i);
        if (b->buffer) {
            r = bind_address(d, as, b->buffer, b->bufferOffset, i);
            if (r != VK_SUCCESS) return r;
            rtr_add_live(as);
            continue;
        }
        if (b->heapOffset == 0 || b->heapOffset % RTC_AS_ALIGNMENT)
            return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "bind-offset",
                             "bind %u: heapOffset %llu must be a multiple of 256 and not 0", i,
                             (unsigned long long)b->heapOffset);
        if (b->heapOffset > b->heap->size || as->size > b->heap->size - b->heapOffset)
            return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "bind-range",
                             "bind %u: %llu bytes at %llu do not fit a heap of %llu", i,
                             (unsigned long long)as->size,
                             (unsigned long long)b->heapOffset, (unsigned long long)b->heap->size);
        as->heap = b->heap;
        as->buffer = b->heap->buffer;
        as->offset = b->heap->offset + b->heapOffset;
        as->base = (uint64_t)b->heap->id << 32 | b->heapOffset / RTC_QUAD_BYTES;
        rtr_add_live(as);
    }
    return VK_SUCCESS;
}

VkResult rtrGetAccelerationStructureHandle(RtrDevice d, RtrAccelerationStructure as, size_t size,
                                           void* data) {
    if (!as->buffer)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "not-bound",
                         "handle of an unbound structure: rtrBindAccelerationStructureMemory first");
    if (size < sizeof as->base)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "handle-size", "dataSize must be 8 or more");
    memcpy(data, &as->base, sizeof as->base);
    return VK_SUCCESS;
}

VkResult rtrGetAccelerationStructureDescriptor(RtrDevice d, RtrAccelerationStructure as,
                                               VkDescriptorBufferInfo* info) {
    if (!as->buffer)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "not-bound",
                         "descriptor of an unbound structure: rtrBindAccelerationStructureMemory first");
    *info = rtr_header_info(as);
    return VK_SUCCESS;
}

VkResult rtrGetNullAccelerationStructureDescriptor(RtrDevice d, RtrHeap heap, VkDescriptorBufferInfo* info) {
    (void)d;
    info->buffer = heap->buffer;
    info->offset = heap->offset;
    info->range = RTC_AS_HEADER_QUADS * RTC_QUAD_BYTES;
    return VK_SUCCESS;
}

VkResult rtrUpdateAccelerationStructureDescriptors(RtrDevice d, VkDescriptorSet set, uint32_t binding,
                                                   uint32_t element, uint32_t count,
                                                   const RtrAccelerationStructure* structures,
                                                   RtrHeap null_heap) {
    VkDescriptorBufferInfo infos[64];
    VkWriteDescriptorSet write = {.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
    uint32_t at, i;
    for (i = 0; i < count; i++) {
        if (structures[i] ? !structures[i]->buffer : !null_heap)
            return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "not-bound", "structure %u of %u is %s", i,
                             count, structures[i] ? "not bound" : "NULL, and there is no nullHeap");
    }
    write.dstSet = set;
    write.dstBinding = binding;
    write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    write.pBufferInfo = infos;
    for (at = 0; at < count; at += 64) {
        write.dstArrayElement = element + at;
        write.descriptorCount = count - at < 64 ? count - at : 64;
        for (i = 0; i < write.descriptorCount; i++) {
            if (structures[at + i])
                infos[i] = rtr_header_info(structures[at + i]);
            else
                rtrGetNullAccelerationStructureDescriptor(d, null_heap, &infos[i]);
        }
        d->vk.UpdateDescriptorSets(d->device, 1, &write, 0, NULL);
    }
    return VK_SUCCESS;
}
