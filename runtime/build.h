/* Recording of builds: shared between build, update and copy. */
#ifndef RTR_BUILD_H_
#define RTR_BUILD_H_

#include "internal.h"

/* Where reading the input has come to. */
typedef struct RtrInputCursor {
    uint32_t geometry, at; /* the next primitive of it */
    uint32_t first;        /* primitives of the geometries before */
} RtrInputCursor;

/* A build or update being recorded. */
typedef struct RtrBuild {
    RtrRecorder recorder;
    RtrDevice device;
    RtrAccelerationStructure dst, src;
    const VkAccelerationStructureInfoNV* info;
    VkBuffer scratch;
    VkDeviceSize scratch_offset;
    RtrScratchLayout layout;
    VkBuffer instance_data;
    VkDeviceSize instance_offset;
    VkBuffer indirect; /* ranges of the geometries; NULL: as the host says */
    VkDeviceSize indirect_offset;
    uint32_t indirect_stride;
    const VkGeometryNV* geometries;
    uint32_t geometry_count;
    uint32_t primitives; /* of this build: at most those of dst */
    uint32_t slots_quad;
    struct RtrBuildPush push;
    bool update; /* DST_SLOTS is then a window of the whole structure, see kernels/refit.glsl */
    uint32_t node_window, slot_window; /* nodes, slots one binding reaches */
    VkDescriptorSet arrays, whole;     /* bound last; the one without windows */
    /* How far it is recorded. */
    uint32_t phase, window, level;
    RtrInputCursor cursor;
    bool dispatched; /* in this phase */
    bool done;
} RtrBuild;

static inline RtrKernel rtr_instance_kernel(RtrAccelerationStructure dst) {
    return dst->heap ? RTR_KERNEL_leaf_instances : RTR_KERNEL_leaf_instances_address;
}

VkResult rtr_check_geometry(RtrDevice d, const VkGeometryNV* g, unsigned index, uint32_t* primitives);

static inline uint32_t rtr_index_size(VkIndexType type) {
    return type == VK_INDEX_TYPE_UINT8_EXT ? 1 : type == VK_INDEX_TYPE_UINT16 ? 2 : 4;
}

/* Geometry index and flags as slots hold them. */
static inline uint32_t rtr_slot_word(const VkGeometryNV* g, uint32_t index) {
    uint32_t word = index;
    if (g->flags & VK_GEOMETRY_OPAQUE_BIT_NV) word |= RTC_SLOT_OPAQUE;
    if (g->flags & VK_GEOMETRY_NO_DUPLICATE_ANY_HIT_INVOCATION_BIT_NV) word |= RTC_SLOT_NO_DUPLICATE;
    return word;
}

/* How a vertex format is read; false when the extension does not list it. */
bool rtr_vertex_format(VkFormat format, uint32_t* code, uint32_t* bytes, uint32_t* component_bytes);

/* Set 1 with node window `nodes_at` and slot window `slots_at` (first node, first slot; of an
 * update the quad the window starts at);
 * arrays of size 0 in the layout are left out. */
VkResult rtr_bind_arrays(RtrBuild* b, uint32_t nodes_at, uint32_t slots_at);
void rtr_dispatch(RtrBuild* b, RtrKernel kernel, uint64_t groups);
/* The same with the arrays bound without windows. */
VkResult rtr_dispatch_whole(RtrBuild* b, RtrKernel kernel, uint64_t groups);

/* Binds the next piece of the input that one set of bindings reaches as set 0 and fills in the
 * push constants. *more is false when there is none; the cursor is then at the start again. */
VkResult rtr_next_input(RtrBuild* b, bool* more);
/* Of an indirect build: brings the ranges into the state words. */
VkResult rtr_load_ranges(RtrBuild* b);

/* One buffer of set 0 (RTR_IN_*) or 1 (RTR_ARR_*). */
typedef struct RtrBinding {
    uint32_t set, binding;
    VkDescriptorBufferInfo info;
} RtrBinding;
/* Binds both sets with these buffers and, unless it is NULL, the heap's texels. */
VkResult rtr_bind_sets(RtrRecorder recorder, RtrHeap heap, const RtrBinding* bindings, uint32_t count);
void rtr_dispatch_kernel(RtrRecorder recorder, RtrKernel kernel, const struct RtrBuildPush* push,
                         uint32_t groups);
/* The groups are in a buffer. */
void rtr_dispatch_kernel_indirect(RtrRecorder recorder, RtrKernel kernel, const struct RtrBuildPush* push,
                                  VkBuffer buffer, VkDeviceSize offset);

/* With validation: fills MARKS with which instance references are good. The bytes of scratch
 * from LEAF_BOX up to `end` are used meanwhile. */
VkResult rtr_check_build_instances(RtrBuild* b, uint32_t end);

/* What a structure is made of, as far as updates may not change it. */
typedef struct RtrBuiltGeometry {
    uint32_t type, flags, format, index_type, vertices, primitives, transform;
} RtrBuiltGeometry;
VkResult rtr_remember_built(RtrAccelerationStructure as, const VkAccelerationStructureInfoNV* info);
void rtr_share_built(RtrAccelerationStructure dst, RtrAccelerationStructure src);
void rtr_forget_built(RtrAccelerationStructure as);
/* Whether an update of what `src` was built of may be this. */
VkResult rtr_check_update(RtrAccelerationStructure src, const VkAccelerationStructureInfoNV* info);

/* RTR_PROPERTY_* that a query asks for. */
VkResult rtr_property_of_query(RtrDevice d, VkQueryType type, uint32_t* what);

/* Boxes of the primitives of a piece of the input. */
VkResult rtr_emit_leaves(RtrBuild* b);
/* Nodes there may be in a structure, compacted or not. */
uint32_t rtr_most_nodes(const struct RtrAccelerationStructure_T* as);
/* Record the next part of a build or an update; may find that there is nothing to do in it. */
VkResult rtr_record_build_phase(RtrBuild* b);
VkResult rtr_record_update_phase(RtrBuild* b);

#endif /* RTR_BUILD_H_ */
