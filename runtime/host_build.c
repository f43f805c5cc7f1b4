/* Building a bottom level on the host: top-down, splits by the surface area heuristic over
 * bins of centroids (Wald 2007, "On fast construction of SAH-based bounding volume
 * hierarchies"). For geometry that is built once and traced often. The block it writes is
 * the one the device's builder writes (rtc/abi.h). */
#include <float.h>
#include <math.h>

#include "build.h"

#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif

#define BINS 32u
/* The same weights as in kernels/common.glsl. */
#define COST_NODE 1.2
#define COST_SLOT 1.0
#define NO_PARENT 0xffffffffu
#define STACK 64u /* ranges waiting: at most one a level */

typedef struct Box {
    float lo[3], hi[3];
} Box;

typedef struct Primitive {
    Box box;
    uint32_t geometry, index;
} Primitive;

typedef struct Range {
    uint32_t begin, end, depth, parent, side;
} Range;

typedef struct HostBuild {
    const VkAccelerationStructureInfoNV* info;
    const RtrHostGeometry* data;
    bool keep_degenerate;
    Primitive* primitives; /* active ones, in slot order at last */
    uint32_t active, nodes, depth;
    uint32_t* block;
    uint32_t slots_quad;
} HostBuild;

/* ---- Geometry ------------------------------------------------------------------------ */

static float half_to_float(uint16_t h) {
    const uint32_t sign = (uint32_t)(h & 0x8000u) << 16, exponent = h >> 10 & 31u, mantissa = h & 0x3ffu;
    uint32_t bits;
    float f;
    if (exponent == 0) {
        f = (float)mantissa * (1.0f / 16777216.0f); /* 2^-24; exact */
        return sign ? -f : f;
    }
    bits = sign | (exponent == 31 ? 0x7f800000u : (exponent + 112u) << 23) | mantissa << 13;
    memcpy(&f, &bits, sizeof f);
    return f;
}

static float component(const unsigned char* at, uint32_t code, uint32_t i) {
    uint16_t h;
    float f;
    if (code <= RTR_VERTEX_FLOAT2) {
        memcpy(&f, at + 4 * i, 4);
        return f;
    }
    memcpy(&h, at + 2 * i, 2);
    if (code <= RTR_VERTEX_HALF2) return half_to_float(h);
    f = (float)(int16_t)h / 32767.0f;
    return f < -1.0f ? -1.0f : f;
}

static void read_vertex(const VkGeometryTrianglesNV* t, const RtrHostGeometry* data, uint32_t code,
                        uint32_t index, float v[3]) {
    const unsigned char* at;
    float m[12], in[3];
    uint32_t k;
    const bool two = code == RTR_VERTEX_FLOAT2 || code == RTR_VERTEX_HALF2 || code == RTR_VERTEX_SNORM2;
    if (index >= t->vertexCount) index = t->vertexCount - 1; /* as the device does: never read outside */
    at = (const unsigned char*)data->pVertexData + t->vertexOffset + (size_t)index * t->vertexStride;
    for (k = 0; k < 3; k++) v[k] = k == 2 && two ? 0.0f : component(at, code, k);
    if (!data->pTransformData) return;
    memcpy(m, (const unsigned char*)data->pTransformData + t->transformOffset, sizeof m);
    memcpy(in, v, sizeof in);
    for (k = 0; k < 3; k++)
        v[k] = ((m[4 * k] * in[0] + m[4 * k + 1] * in[1]) + m[4 * k + 2] * in[2]) + m[4 * k + 3];
}

static uint32_t read_index(const VkGeometryTrianglesNV* t, const RtrHostGeometry* data, uint32_t i) {
    const unsigned char* at = (const unsigned char*)data->pIndexData + t->indexOffset;
    uint32_t wide;
    uint16_t narrow;
    if (t->indexType == VK_INDEX_TYPE_NONE_NV) return i;
    if (t->indexType == VK_INDEX_TYPE_UINT8_EXT) return at[i];
    if (t->indexType == VK_INDEX_TYPE_UINT16) {
        memcpy(&narrow, at + 2 * (size_t)i, 2);
        return narrow;
    }
    memcpy(&wide, at + 4 * (size_t)i, 4);
    return wide;
}

static void read_triangle(const HostBuild* b, uint32_t geometry, uint32_t index, float v[3][3]) {
    const VkGeometryTrianglesNV* t = &b->info->pGeometries[geometry].geometry.triangles;
    uint32_t code = 0, bytes, each, k;
    rtr_vertex_format(t->vertexFormat, &code, &bytes, &each);
    for (k = 0; k < 3; k++)
        read_vertex(t, &b->data[geometry], code, read_index(t, &b->data[geometry], 3 * index + k), v[k]);
}

static void read_aabb(const HostBuild* b, uint32_t geometry, uint32_t index, float v[6]) {
    const VkGeometryAABBNV* a = &b->info->pGeometries[geometry].geometry.aabbs;
    memcpy(v, (const unsigned char*)b->data[geometry].pAabbData + a->offset + (size_t)index * a->stride, 24);
}

static float clamp(float f) { return f > FLT_MAX ? FLT_MAX : f < -FLT_MAX ? -FLT_MAX : f; }

static void empty_box(Box* b) {
    uint32_t k;
    for (k = 0; k < 3; k++) {
        b->lo[k] = FLT_MAX;
        b->hi[k] = -FLT_MAX;
    }
}

static void grow(Box* b, const float lo[3], const float hi[3]) {
    uint32_t k;
    for (k = 0; k < 3; k++) {
        if (lo[k] < b->lo[k]) b->lo[k] = lo[k];
        if (hi[k] > b->hi[k]) b->hi[k] = hi[k];
    }
}

static bool same(const float a[3], const float b[3]) { return a[0] == b[0] && a[1] == b[1] && a[2] == b[2]; }

/* Box of a primitive; false when it is inactive. */
static bool primitive_box(const HostBuild* b, bool aabbs, Primitive* p) {
    float v[3][3], w[6];
    uint32_t i, k;
    empty_box(&p->box);
    if (aabbs) {
        read_aabb(b, p->geometry, p->index, w);
        for (k = 0; k < 6; k++)
            if (isnan(w[k])) return false;
        for (i = 0; i < 2; i++)
            for (k = 0; k < 3; k++) v[i][k] = clamp(w[3 * i + k]);
        grow(&p->box, v[0], v[0]);
        grow(&p->box, v[1], v[1]);
        return true;
    }
    read_triangle(b, p->geometry, p->index, v);
    for (i = 0; i < 3; i++)
        for (k = 0; k < 3; k++)
            if (isnan(v[i][k])) return false;
    if (!b->keep_degenerate && (same(v[0], v[1]) || same(v[1], v[2]) || same(v[0], v[2]))) return false;
    for (i = 0; i < 3; i++) {
        for (k = 0; k < 3; k++) v[i][k] = clamp(v[i][k]);
        grow(&p->box, v[i], v[i]);
    }
    return true;
}

/* ---- Splitting ------------------------------------------------------------------------ */

static double half_area(const Box* b) {
    const double x = (double)b->hi[0] - b->lo[0], y = (double)b->hi[1] - b->lo[1],
                 z = (double)b->hi[2] - b->lo[2];
    return x * y + y * z + z * x;
}

static float center(const Primitive* p, uint32_t axis) {
    return 0.5f * p->box.lo[axis] + 0.5f * p->box.hi[axis];
}

static uint32_t bin_of(float c, double lo, double scale) {
    const double at = ((double)c - lo) * scale;
    return at >= BINS - 1 ? BINS - 1 : (uint32_t)at;
}

typedef struct Split {
    double cost; /* of both sides as leaves; not divided by the parent's area */
    double lo, scale;
    uint32_t axis, bin; /* the left side ends with this bin */
} Split;

static void try_axis(const HostBuild* b, const Range* r, const Box* centers, uint32_t axis, Split* best) {
    Box boxes[BINS], side;
    uint32_t counts[BINS], i, n;
    double right[BINS], lo = centers->lo[axis], extent = (double)centers->hi[axis] - lo;
    const double scale = BINS / extent;
    if (!(extent > 0) || !(scale <= DBL_MAX)) return;
    for (i = 0; i < BINS; i++) {
        empty_box(&boxes[i]);
        counts[i] = 0;
    }
    for (i = r->begin; i < r->end; i++) {
        const Primitive* p = &b->primitives[i];
        const uint32_t bin = bin_of(center(p, axis), lo, scale);
        grow(&boxes[bin], p->box.lo, p->box.hi);
        counts[bin]++;
    }
    empty_box(&side);
    for (i = BINS - 1, n = 0; i > 0; i--) {
        if (counts[i]) grow(&side, boxes[i].lo, boxes[i].hi);
        n += counts[i];
        right[i - 1] = n ? half_area(&side) * n : -1;
    }
    empty_box(&side);
    for (i = 0, n = 0; i + 1 < BINS; i++) {
        double cost;
        if (counts[i]) grow(&side, boxes[i].lo, boxes[i].hi);
        n += counts[i];
        if (!n || right[i] < 0) continue;
        cost = COST_SLOT * (half_area(&side) * n + right[i]);
        if (cost < best->cost) {
            best->cost = cost;
            best->axis = axis;
            best->bin = i;
            best->lo = lo;
            best->scale = scale;
        }
    }
}

static uint32_t partition(HostBuild* b, const Range* r, const Split* s) {
    uint32_t i = r->begin, j = r->end;
    while (i < j) {
        if (bin_of(center(&b->primitives[i], s->axis), s->lo, s->scale) <= s->bin) {
            i++;
        } else {
            const Primitive p = b->primitives[i];
            b->primitives[i] = b->primitives[--j];
            b->primitives[j] = p;
        }
    }
    return i;
}

static uint32_t levels(uint32_t n) { /* of a balanced tree: ceil(log2 n) */
    uint32_t l = 0;
    while (l < 31 && (1u << l) < n) l++;
    return l;
}

/* Where the range is cut; its begin when it becomes a leaf. */
static uint32_t cut(HostBuild* b, const Range* r, const Box* box, const Box* centers, bool root) {
    const uint32_t n = r->end - r->begin;
    Split best = {.cost = DBL_MAX};
    uint32_t axis;
    if (n == 1) return r->begin;
    /* So deep that only halving stays within the bound. */
    if (r->depth + levels(n) >= RTC_MAX_DEPTH - 1) return !root && n <= RTC_MAX_LEAF_SLOTS ? r->begin : r->begin + n / 2;
    for (axis = 0; axis < 3; axis++) try_axis(b, r, centers, axis, &best);
    if (!root && n <= RTC_MAX_LEAF_SLOTS) {
        const double area = half_area(box);
        if (best.cost == DBL_MAX || COST_SLOT * area * n <= COST_NODE * area + best.cost) return r->begin;
    }
    return best.cost == DBL_MAX ? r->begin + n / 2 : partition(b, r, &best);
}

static void put_child(HostBuild* b, const Range* r, const Box* box, uint32_t reference) {
    uint32_t* at = b->block + 4 * (RTC_AS_HEADER_QUADS + RTC_NODE_QUADS * r->parent);
    memcpy(at + 8 * r->side, box->lo, 12);
    memcpy(at + 8 * r->side + 4, box->hi, 12);
    at[r->side ? 7 : 3] = reference;
}

static void build_nodes(HostBuild* b, Box* bounds) {
    Range stack[STACK];
    uint32_t top = 0, i;
    empty_box(bounds);
    /* The root is always a node; both children start empty, by their references. */
    memset(b->block + 4 * RTC_AS_HEADER_QUADS, 0, RTC_NODE_QUADS * RTC_QUAD_BYTES);
    b->block[4 * RTC_AS_HEADER_QUADS + 3] = b->block[4 * RTC_AS_HEADER_QUADS + 7] = RTC_REF_EMPTY;
    b->nodes = b->depth = 1;
    for (i = 0; i < b->active; i++) grow(bounds, b->primitives[i].box.lo, b->primitives[i].box.hi);
    if (b->active == 1) {
        const Range one = {0, 1, 1, 0, 0};
        put_child(b, &one, bounds, RTC_REF_LEAF | 1u << RTC_REF_COUNT_SHIFT);
    }
    if (b->active < 2) return;
    stack[top++] = (Range){0, b->active, 1, NO_PARENT, 0};
    while (top) {
        const Range r = stack[--top];
        Box box, centers;
        uint32_t at, node;
        empty_box(&box);
        empty_box(&centers);
        for (i = r.begin; i < r.end; i++) {
            const Primitive* p = &b->primitives[i];
            const float c[3] = {center(p, 0), center(p, 1), center(p, 2)};
            grow(&box, p->box.lo, p->box.hi);
            grow(&centers, c, c);
        }
        at = cut(b, &r, &box, &centers, r.parent == NO_PARENT);
        if (at == r.begin) {
            put_child(b, &r, &box, RTC_REF_LEAF | (r.end - r.begin) << RTC_REF_COUNT_SHIFT | r.begin);
            continue;
        }
        if (r.depth > b->depth) b->depth = r.depth;
        node = 0;
        if (r.parent != NO_PARENT) {
            node = b->nodes++;
            memset(b->block + 4 * (RTC_AS_HEADER_QUADS + RTC_NODE_QUADS * node), 0, RTC_NODE_QUADS * RTC_QUAD_BYTES);
            put_child(b, &r, &box, node);
        }
        /* The smaller side first off the stack keeps the stack shallow. */
        {
            const Range left = {r.begin, at, r.depth + 1, node, 0}, right = {at, r.end, r.depth + 1, node, 1};
            const bool left_larger = at - r.begin > r.end - at;
            stack[top++] = left_larger ? left : right;
            stack[top++] = left_larger ? right : left;
        }
    }
}

static void put_slots(HostBuild* b, bool aabbs) {
    uint32_t s;
    for (s = 0; s < b->active; s++) {
        const Primitive* p = &b->primitives[s];
        uint32_t* at = b->block + 4 * (b->slots_quad + (size_t)(aabbs ? RTC_AABB_QUADS : RTC_TRIANGLE_QUADS) * s);
        const uint32_t word = rtr_slot_word(&b->info->pGeometries[p->geometry], p->geometry);
        float v[3][3], w[6];
        if (aabbs) {
            read_aabb(b, p->geometry, p->index, w);
            memcpy(at, w, 12);
            memcpy(at + 4, w + 3, 12);
        } else {
            read_triangle(b, p->geometry, p->index, v);
            memcpy(at, v[0], 12);
            memcpy(at + 4, v[1], 12);
            memcpy(at + 8, v[2], 12);
            at[11] = 0;
        }
        at[3] = p->index;
        at[7] = word;
    }
}

static void put_header(const HostBuild* b, RtrAccelerationStructure dst, const Box* bounds, uint32_t total) {
    uint32_t* h = b->block;
    const uint32_t not_opaque = rtr_first_not_opaque(b->info);
    const bool opaque = not_opaque == 0xffffffffu;
    uint32_t w;
    memset(h, 0, RTC_AS_HEADER_QUADS * RTC_QUAD_BYTES);
    for (w = RTC_HDR_OFFENDERS; w < RTC_HDR_OFFENDERS_END; w++)
        h[w] = 1u << (w - RTC_HDR_OFFENDERS) == RTC_FACT_ALL_OPAQUE ? not_opaque : 0xffffffffu;
    h[RTC_HDR_SELF_LO] = (uint32_t)dst->base;
    h[RTC_HDR_SELF_HI] = (uint32_t)(dst->base >> 32);
    h[RTC_HDR_MAGIC] = RTC_AS_MAGIC;
    h[RTC_HDR_KIND] = RTC_AS_KIND_BOTTOM;
    h[RTC_HDR_FACTS] = (dst->aabbs ? RTC_FACT_AABBS : 0u) | (opaque ? RTC_FACT_ALL_OPAQUE : 0u) |
                       (dst->heap ? 0u : RTC_FACT_ADDRESSES);
    h[RTC_HDR_NODE_FORMAT] = RTC_NODE_FORMAT_BVH2;
    h[RTC_HDR_MAX_DEPTH] = b->depth;
    h[RTC_HDR_ACTIVE_COUNT] = b->active;
    memcpy(h + RTC_HDR_BOUNDS_MIN, bounds->lo, 12);
    memcpy(h + RTC_HDR_BOUNDS_MAX, bounds->hi, 12);
    h[RTC_HDR_GEOMETRY_COUNT] = b->info->geometryCount;
    h[RTC_HDR_SIZE_QUADS] =
        RTC_AS_HEADER_QUADS + ((b->nodes + 3u) & ~3u) * RTC_NODE_QUADS + b->active * rtr_slot_quads(dst);
    h[RTC_HDR_NODES] = RTC_AS_HEADER_QUADS;
    h[RTC_HDR_SLOTS] = b->slots_quad;
    h[RTC_HDR_NODE_COUNT] = b->nodes;
    h[RTC_HDR_SLOT_COUNT] = b->active;
    h[RTC_HDR_BUILD_FLAGS] = b->info->flags;
    h[RTC_HDR_PRIMITIVE_COUNT] = total;
    h[RTC_HDR_FIRST_OFFENDER] = 0xffffffffu;
}

static VkResult check(RtrDevice d, const VkAccelerationStructureInfoNV* info, const RtrHostGeometry* data,
                      RtrAccelerationStructure dst, const void* memory, uint32_t* total) {
    uint32_t g;
    VkResult r = rtr_check_structure(d, "VkAccelerationStructureInfoNV", info, VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV);
    if (r != VK_SUCCESS) return r;
    if (!dst || !dst->buffer || !memory || dst->compacted_size)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "not-bound",
                         "host build: needs memory, and a dst that is bound and was created without "
                         "compactedSize");
    if (info->type != VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV || dst->type != info->type ||
        info->flags != dst->flags)
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "as-info",
                         "host build: of bottom levels only, with the type and flags of dst's creation");
    if (info->geometryCount > dst->geometry_count || (info->geometryCount && !data))
        return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "as-counts",
                         "host build of %u geometries; created for %u", info->geometryCount,
                         dst->geometry_count);
    *total = 0;
    for (g = 0; g < info->geometryCount; g++) {
        const VkGeometryNV* geometry = &info->pGeometries[g];
        uint32_t n = 0, made = 0;
        bool missing;
        if ((r = rtr_check_geometry(d, geometry, g, &n)) != VK_SUCCESS) return r;
        rtr_check_geometry(d, &dst->geometries[g], g, &made);
        if (geometry->geometryType != dst->geometries[g].geometryType || n > made)
            return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "as-geometry",
                             "geometry %u: type or count (%u) do not fit its creation (%u)", g, n, made);
        missing = geometry->geometryType == VK_GEOMETRY_TYPE_AABBS_NV
                      ? !data[g].pAabbData
                      : !data[g].pVertexData || (!data[g].pIndexData && geometry->geometry.triangles.indexType !=
                                                                            VK_INDEX_TYPE_NONE_NV);
        if (n && missing)
            return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "geometry-data",
                             "geometry %u: a pointer of its RtrHostGeometry is missing", g);
        *total += n;
    }
    return VK_SUCCESS;
}

VkResult rtrBuildAccelerationStructureOnHost(RtrDevice d, const VkAccelerationStructureInfoNV* info,
                                             const RtrHostGeometry* data, RtrAccelerationStructure dst,
                                             void* memory, const VkAllocationCallbacks* allocator) {
    const VkAllocationCallbacks* a = rtr_pick(d, allocator);
    HostBuild b;
    Box bounds;
    uint32_t total = 0, g, i;
    VkResult r = check(d, info, data, dst, memory, &total);
    if (r != VK_SUCCESS) return r;
    memset(&b, 0, sizeof b);
    b.info = info;
    b.data = data;
    b.keep_degenerate = (info->flags & VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV) != 0;
    b.block = memory;
    b.slots_quad = rtr_slots_quad(dst->primitive_count);
    b.primitives = rtr_alloc(a, (size_t)total * sizeof *b.primitives);
    if (!b.primitives) return VK_ERROR_OUT_OF_HOST_MEMORY;
    for (g = 0; g < info->geometryCount; g++) {
        uint32_t n = 0;
        rtr_check_geometry(d, &info->pGeometries[g], g, &n);
        for (i = 0; i < n; i++) {
            Primitive* p = &b.primitives[b.active];
            p->geometry = g;
            p->index = i;
            if (primitive_box(&b, dst->aabbs, p)) b.active++;
        }
    }
    build_nodes(&b, &bounds);
    put_slots(&b, dst->aabbs);
    put_header(&b, dst, &bounds, total);
    rtr_free(a, b.primitives);
    return rtr_remember_built(dst, info);
}
