/* What a structure was last built of, as recorded: an update must not change it. */
#include "build.h"

/* Shared by a structure and its copies. */
struct RtrBuilt {
    atomic_uint owners;
    uint32_t instances, geometry_count;
    RtrBuiltGeometry geometries[];
};

static RtrBuiltGeometry describe(const VkGeometryNV* g) {
    RtrBuiltGeometry b;
    memset(&b, 0, sizeof b);
    b.type = g->geometryType;
    b.flags = g->flags;
    if (g->geometryType == VK_GEOMETRY_TYPE_TRIANGLES_NV) {
        const VkGeometryTrianglesNV* t = &g->geometry.triangles;
        b.format = t->vertexFormat;
        b.index_type = t->indexType;
        b.vertices = t->vertexCount;
        b.primitives = (t->indexType == VK_INDEX_TYPE_NONE_NV ? t->vertexCount : t->indexCount) / 3;
        b.transform = t->transformData != VK_NULL_HANDLE;
    } else {
        b.primitives = g->geometry.aabbs.numAABBs;
    }
    return b;
}

uint32_t rtr_built_geometries(const struct RtrAccelerationStructure_T* as) {
    return as->built ? as->built->geometry_count : 0;
}

void rtr_forget_built(RtrAccelerationStructure as) {
    struct RtrBuilt* b = as->built;
    as->built = NULL;
    if (b && atomic_fetch_sub(&b->owners, 1) == 1) rtr_free(rtr_pick(as->device, NULL), b);
}

void rtr_share_built(RtrAccelerationStructure dst, RtrAccelerationStructure src) {
    if (dst->built == src->built) return;
    rtr_forget_built(dst);
    if (src->built) atomic_fetch_add(&src->built->owners, 1);
    dst->built = src->built;
}

VkResult rtr_remember_built(RtrAccelerationStructure as, const VkAccelerationStructureInfoNV* info) {
    struct RtrBuilt* b = as->built;
    uint32_t i;
    if (!b || atomic_load(&b->owners) != 1 || b->geometry_count != info->geometryCount) {
        rtr_forget_built(as);
        b = rtr_alloc(rtr_pick(as->device, NULL), sizeof *b + info->geometryCount * sizeof b->geometries[0]);
        if (!b) return VK_ERROR_OUT_OF_HOST_MEMORY;
        atomic_init(&b->owners, 1);
        b->geometry_count = info->geometryCount;
        as->built = b;
    }
    b->instances = info->instanceCount;
    for (i = 0; i < info->geometryCount; i++) b->geometries[i] = describe(&info->pGeometries[i]);
    return VK_SUCCESS;
}

static VkResult changed(RtrDevice d, uint32_t g, const char* what, uint32_t now, uint32_t then) {
    return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "update-changed",
                     "update, geometry %u: %s is %u; the structure was built with %u", g, what, now, then);
}

VkResult rtr_check_update(RtrAccelerationStructure src, const VkAccelerationStructureInfoNV* info) {
    RtrDevice d = src->device;
    const struct RtrBuilt* b = src->built;
    uint32_t g;
    if (!b) return VK_SUCCESS; /* deserialised, or built by what was not recorded here: the device compares counts */
    if (info->instanceCount != b->instances || info->geometryCount != b->geometry_count)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "update-changed",
                         "update with %u instances and %u geometries; the structure was built with %u and %u",
                         info->instanceCount, info->geometryCount, b->instances, b->geometry_count);
    for (g = 0; g < b->geometry_count; g++) {
        const RtrBuiltGeometry now = describe(&info->pGeometries[g]), *then = &b->geometries[g];
        if (now.type != then->type) return changed(d, g, "geometryType", now.type, then->type);
        if (now.flags != then->flags) return changed(d, g, "flags", now.flags, then->flags);
        if (now.primitives != then->primitives)
            return changed(d, g, "its number of primitives", now.primitives, then->primitives);
        if (now.format != then->format) return changed(d, g, "vertexFormat", now.format, then->format);
        if (now.index_type != then->index_type)
            return changed(d, g, "indexType", now.index_type, then->index_type);
        if (now.vertices != then->vertices) return changed(d, g, "vertexCount", now.vertices, then->vertices);
        if (now.transform != then->transform)
            return changed(d, g, "having transformData (0 or 1)", now.transform, then->transform);
    }
    return VK_SUCCESS;
}
