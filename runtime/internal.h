/* Inside of the runtime: object layouts and small helpers. */
#ifndef RTR_INTERNAL_H_
#define RTR_INTERNAL_H_

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "kernels/build_shared.h"
#include "rtc/abi.h"
#include "rtc/runtime.h"

/* ---- Entry points: everything the runtime calls, loaded by name --------------- */
#define RTR_INSTANCE_FUNCTIONS(X)         \
    X(GetPhysicalDeviceProperties2)       \
    X(GetPhysicalDeviceFeatures2)         \
    X(GetPhysicalDeviceFormatProperties)  \
    X(EnumerateDeviceExtensionProperties) \
    X(GetDeviceProcAddr)

#define RTR_DEVICE_FUNCTIONS(X)   \
    X(CreateBufferView)           \
    X(DestroyBufferView)          \
    X(CreateShaderModule)         \
    X(DestroyShaderModule)        \
    X(CreateComputePipelines)     \
    X(DestroyPipeline)            \
    X(CreatePipelineLayout)       \
    X(DestroyPipelineLayout)      \
    X(CreateDescriptorSetLayout)  \
    X(DestroyDescriptorSetLayout) \
    X(CreateDescriptorPool)       \
    X(DestroyDescriptorPool)      \
    X(ResetDescriptorPool)        \
    X(AllocateDescriptorSets)     \
    X(UpdateDescriptorSets)       \
    X(CmdBindPipeline)            \
    X(CmdBindDescriptorSets)      \
    X(CmdPushConstants)           \
    X(CmdDispatch)                \
    X(CmdDispatchIndirect)        \
    X(CmdPipelineBarrier)         \
    X(CmdUpdateBuffer)            \
    X(CmdFillBuffer)              \
    X(CmdCopyBuffer)

/* Only there with bufferDeviceAddress. */
typedef VkDeviceAddress(VKAPI_PTR* RtrGetBufferDeviceAddress)(VkDevice,
                                                              const VkBufferDeviceAddressInfo*);

typedef struct RtrInstanceTable {
#define X(name) PFN_vk##name name;
    RTR_INSTANCE_FUNCTIONS(X)
#undef X
} RtrInstanceTable;

typedef struct RtrDeviceTable {
#define X(name) PFN_vk##name name;
    RTR_DEVICE_FUNCTIONS(X)
#undef X
} RtrDeviceTable;

/* Names of the first missing function in *missing. */
bool rtr_load_instance_table(VkInstance instance, PFN_vkGetInstanceProcAddr get, RtrInstanceTable* table,
                             const char** missing);
bool rtr_load_device_table(const RtrInstanceTable* instance, VkDevice device, RtrDeviceTable* table,
                           const char** missing);
/* NULL when neither Vulkan 1.2 nor VK_KHR_buffer_device_address gives it. */
RtrGetBufferDeviceAddress rtr_load_buffer_device_address(const RtrInstanceTable* instance, VkDevice device);

/* ---- Kernels ------------------------------------------------------------------- */
#define RTR_KERNELS(X)  \
    X(init)             \
    X(ranges)           \
    X(leaf_triangles)   \
    X(leaf_aabbs)       \
    X(leaf_instances)   \
    X(morton)           \
    X(sort_count)       \
    X(sort_scan)        \
    X(sort_scatter)     \
    X(sort_fused)       \
    X(sort_small)       \
    X(lbvh_topology)    \
    X(lbvh_fit)         \
    X(lbvh_fit_first)   \
    X(lbvh_fit_level)   \
    X(number_count)     \
    X(number_scan)      \
    X(number)           \
    X(encode_nodes)     \
    X(encode_triangles) \
    X(encode_aabbs)     \
    X(header)           \
    X(copy)             \
    X(property)         \
    X(serialize)        \
    X(deserialize)      \
    X(refit_links)      \
    X(refit_triangles)  \
    X(refit_aabbs)      \
    X(refit_nodes)      \
    X(refit_boxes)      \
    X(refit_store)      \
    X(prepare_launch)   \
    X(finish_launch)    \
    X(validate_launch)  \
    X(check_instances)  \
    X(probe)                \
    RTR_ADDRESS_KERNELS(X)
/* Variants that follow device addresses; created only with bufferDeviceAddress. */
#define RTR_ADDRESS_KERNELS(X) \
    X(leaf_instances_address)  \
    X(check_instances_address) \
    X(copy_address)            \
    X(serialize_address)       \
    X(deserialize_address)

typedef enum RtrKernel {
#define X(name) RTR_KERNEL_##name,
    RTR_KERNELS(X)
#undef X
        RTR_KERNEL_COUNT
} RtrKernel;

typedef struct RtrKernelCode {
    const char* name;
    const uint32_t* words;
    size_t bytes;
} RtrKernelCode;
const RtrKernelCode* rtr_kernel_code(RtrKernel kernel);

/* ---- Objects --------------------------------------------------------------------- */
struct RtrDevice_T {
    VkAllocationCallbacks allocator;
    bool has_allocator;
    VkInstance instance;
    VkPhysicalDevice physical_device;
    VkDevice device;
    RtrInstanceTable vki;
    RtrDeviceTable vk;
    VkDebugUtilsMessageSeverityFlagsEXT message_severities;
    VkDebugUtilsMessageTypeFlagsEXT message_types;
    PFN_vkDebugUtilsMessengerCallbackEXT message_callback;
    void* message_user_data;
    VkPhysicalDeviceLimits limits;
    uint8_t blob_version[2 * VK_UUID_SIZE]; /* driver UUID, then ours, see serialize.c */
    RtrPhysicalDeviceSupport support;
    /* What modules may need, see features.c: bits by the rows of its tables. */
    uint32_t api_version;
    uint64_t features, extensions;
    VkSubgroupFeatureFlags subgroup_operations; /* in compute shaders */
    bool spirv_1_4;
    bool features_told; /* by the application; otherwise what the physical device offers */

    VkDescriptorSetLayout input_layout; /* set 0 of the kernels */
    VkDescriptorSetLayout array_layout; /* set 1 */
    VkDescriptorSetLayout empty_layout;
    VkPipelineLayout kernel_layout;
    uint32_t level_nodes; /* levels of this many nodes are fitted in a dispatch each (build_phases.c) */
    atomic_uint heaps; /* created so far: their numbers */
    uint32_t few_blocks; /* of numbering, that take one dispatch: where a barrier costs more than counting again */
    bool validation;
    /* With validation: the structures that are bound and not destroyed (live.c). */
    atomic_flag live_lock;
    struct RtrAccelerationStructure_T* live;
    uint32_t live_count;
    RtrGetBufferDeviceAddress get_buffer_device_address; /* NULL: no address mode */
    VkPipeline kernels[RTR_KERNEL_COUNT];
};

typedef struct RtrHeapRange {
    VkDeviceSize offset, size;
} RtrHeapRange;

struct RtrHeap_T {
    RtrDevice device;
    VkAllocationCallbacks allocator;
    bool has_allocator;
    VkBuffer buffer;
    VkDeviceSize offset, size;
    uint32_t id; /* RTC_HEAP_TAG | its number: the upper half of handles */
    VkBufferView view;
    RtrHeapRange* used; /* sorted by offset */
    uint32_t used_count, used_capacity;
};

struct RtrAccelerationStructure_T {
    RtrDevice device;
    VkAccelerationStructureTypeNV type;
    VkBuildAccelerationStructureFlagsNV flags;
    VkDeviceSize compacted_size;
    uint32_t instance_count;
    uint32_t geometry_count;
    VkGeometryNV* geometries;
    uint32_t primitive_count; /* instances of a top level */
    bool aabbs;
    VkDeviceSize size; /* of the object */
    /* Where it lies; buffer is VK_NULL_HANDLE until it is bound. */
    VkBuffer buffer;
    VkDeviceSize offset; /* in the buffer */
    RtrHeap heap;        /* NULL in address mode */
    uint64_t base;       /* the handle: the heap's id, quads from its start; or a device address */
    struct RtrBuilt* built; /* built.c; NULL: not known */
    struct RtrAccelerationStructure_T *live_next, *live_before; /* in RtrDevice_T::live */
};

#define RTR_POOL_SETS 64u
typedef struct RtrPool {
    struct RtrPool* next;
    VkDescriptorPool pool;
} RtrPool;

typedef struct RtrSetCall {
    uint32_t first, count, dynamic_count;
    VkDescriptorSet* sets; /* in the recorder's arrays */
    uint32_t* dynamics;
} RtrSetCall;

#define RTR_MAX_SET_CALLS 32u
#define RTR_MAX_SETS_PER_CALL 32u
#define RTR_MAX_DYNAMICS_PER_CALL 64u
#define RTR_MAX_PUSH_BYTES 4096u
#define RTR_DEFAULT_ROUNDS 64u

typedef struct RtrBoundSets {
    uint32_t first, count, dynamic_count;
    VkDescriptorSet sets[RTR_MAX_SETS_PER_CALL];
    uint32_t dynamics[RTR_MAX_DYNAMICS_PER_CALL];
} RtrBoundSets;

typedef struct RtrLaunchPlace {
    VkDeviceSize offset, size; /* in the control buffer */
} RtrLaunchPlace;

/* Indices into the list of rtrCmdDeclareScene of the first bottom level that is so; ~0: none. */
typedef struct RtrDeclaredScene {
    uint32_t triangles, aabbs, not_opaque;
    uint32_t not_opaque_geometry;
    bool bound;    /* some of it */
    uint32_t heap; /* id of the heap of the first that is bound; 0: bound to a buffer */
    uint32_t at;   /* the first that is bound, and the first that lies elsewhere than that */
    uint32_t elsewhere;
} RtrDeclaredScene;
#define RTR_NOTHING_DECLARED \
    ((RtrDeclaredScene){.triangles = ~0u, .aabbs = ~0u, .not_opaque = ~0u, .elsewhere = ~0u})

/* A structure of the declared scene (its index there), or one that this recording built
 * (RTC_ERROR_BUILT). */
typedef struct RtrChecked {
    RtrAccelerationStructure as;
    uint32_t index;
} RtrChecked;

struct RtrRecorder_T {
    RtrDevice device;
    VkAllocationCallbacks allocator;
    bool has_allocator;
    VkCommandBuffer cmd;
    VkBuffer control;
    VkDeviceSize control_offset, control_size, control_used;
    RtrPool* pools;        /* all, newest use first */
    RtrPool* current_pool; /* sets come from here; later ones are unused */
    RtrLaunchPlace* launches;
    uint32_t launch_count, launch_capacity;

    RtrPipeline pipeline;
    RtrHeap heap;
    VkBuffer scratch;
    VkDeviceSize scratch_offset, scratch_size;
    uint64_t max_tile_lanes;
    uint32_t max_rounds;
    uint32_t stack_size; /* set by the application; 0: not set */
    RtrDeclaredScene scene;
    /* With validation: structures whose headers and instances launches look at. */
    struct RtrChecked* checked;
    uint32_t checked_count, checked_capacity;
    uint32_t set_call_count;
    RtrBoundSets set_calls[RTR_MAX_SET_CALLS];
    uint32_t push_size;
    uint32_t push_words[RTR_MAX_PUSH_BYTES / 4];
};

/* What a deferred compilation needs, copied from the application. */
typedef struct RtrDeferred {
    VkPipelineCache cache;
    VkPipelineCreateFlags flags;
    uint32_t* code;
    size_t code_size;
    VkSpecializationMapEntry* entries;
    void* data;
    VkSpecializationInfo specialization;
} RtrDeferred;

struct RtrPipeline_T {
    RtrDevice device;
    RtcModuleHeader header;
    RtcModuleGroup* groups;
    char* json;
    RtrTraceOptions options;
    bool reserved_in_app_set;
    uint32_t set_layout_count;
    uint32_t push_size;
    VkDescriptorSetLayout reserved_layout;
    VkPipelineLayout layout;
    VkPipeline pipeline;   /* VK_NULL_HANDLE until a deferred one is compiled */
    RtrDeferred* deferred; /* NULL when it is compiled */
};

/* ---- Memory and messages ---------------------------------------------------------- */
/* The allocator in force: the given one, else the device's, else malloc. */
void* rtr_alloc(const VkAllocationCallbacks* allocator, size_t size);
void rtr_free(const VkAllocationCallbacks* allocator, void* memory);
const VkAllocationCallbacks* rtr_pick(RtrDevice device, const VkAllocationCallbacks* allocator);

#if defined(__GNUC__)
#define RTR_PRINTF(f, a) __attribute__((format(__printf__, f, a)))
#else
#define RTR_PRINTF(f, a)
#endif
/* Sends an error with a stable name through the messenger and returns `result`. */
VkResult rtr_error(RtrDevice device, VkResult result, const char* id, const char* format, ...)
    RTR_PRINTF(4, 5);
void rtr_warning(RtrDevice device, const char* id, const char* format, ...) RTR_PRINTF(3, 4);

/* Success for NULL; else an error that names the structure found behind `owner`::pNext. */
VkResult rtr_check_chain(RtrDevice device, const char* owner, const void* next);
/* A structure of Vulkan's: its sType, and nothing behind it. */
VkResult rtr_check_structure(RtrDevice device, const char* owner, const void* structure, VkStructureType type);
VkResult rtr_not_begun(RtrRecorder recorder, const char* function);

/* ---- Assumptions (assumptions.c) -------------------------------------------------------- */
/* A broken assumption as text: RTC_FACT_* and a word of RTC_HDR_OFFENDERS. */
void rtr_format_assumption(uint32_t fact, uint32_t offender, char* text, size_t size);
/* A bottom level's word of RTC_HDR_OFFENDERS for RTC_FACT_ALL_OPAQUE. */
uint32_t rtr_first_not_opaque(const VkAccelerationStructureInfoNV* info);
/* Whether the declared scene is what the pipeline's module assumes, as far as the host can see. */
VkResult rtr_check_scene(RtrRecorder recorder, const struct RtrPipeline_T* pipeline);
/* Whether it lies where the pipeline's rays look for it: in the heap that is set, or at device addresses. */
VkResult rtr_check_scene_heap(RtrRecorder recorder, const struct RtrPipeline_T* pipeline);

/* ---- Recording helpers ---------------------------------------------------------------- */
VkResult rtr_allocate_set(RtrRecorder recorder, VkDescriptorSetLayout layout, VkDescriptorSet* set);
void rtr_barrier(RtrRecorder recorder, VkPipelineStageFlags src, VkAccessFlags src_access,
                 VkPipelineStageFlags dst, VkAccessFlags dst_access);
/* Compute writes to compute reads and writes, and to indirect arguments. */
void rtr_compute_barrier(RtrRecorder recorder);

static inline VkDeviceSize rtr_align(VkDeviceSize value, VkDeviceSize alignment) {
    return (value + alignment - 1) / alignment * alignment;
}
static inline VkDeviceSize rtr_min_size(VkDeviceSize a, VkDeviceSize b) { return a < b ? a : b; }
static inline uint32_t rtr_groups(uint64_t lanes, uint32_t group) {
    return (uint32_t)((lanes + group - 1) / group);
}

/* Scratch of a build: offset and size of each RTR_ARR_* array (0 size: of the destination). */
typedef struct RtrScratchLayout {
    VkDeviceSize offset[RTR_ARR_COUNT];
    VkDeviceSize size[RTR_ARR_COUNT];
    VkDeviceSize total;
    uint32_t ranges; /* word of STATE where the ranges of indirect builds start */
} RtrScratchLayout;
void rtr_build_scratch(uint32_t primitives, uint32_t geometries, RtrScratchLayout* layout);
uint32_t rtr_built_geometries(const struct RtrAccelerationStructure_T* as); /* 0: not known */
void rtr_update_scratch(const struct RtrAccelerationStructure_T* as, RtrScratchLayout* layout);

static inline uint32_t rtr_slot_quads(const struct RtrAccelerationStructure_T* as) {
    if (as->type == VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV) return RTC_INSTANCE_QUADS;
    return as->aabbs ? RTC_AABB_QUADS : RTC_TRIANGLE_QUADS;
}
/* Nodes a structure of n primitives is given room for: a binary tree's inner nodes,
 * rounded to 256 bytes so that the slots behind them can be bound as a window. */
static inline uint32_t rtr_node_room(uint32_t primitives) {
    return ((primitives > 2 ? primitives - 1 : 1) + 3u) & ~3u;
}
/* Quads from the base to slot 0 in a structure that was built, not compacted. */
static inline uint32_t rtr_slots_quad(uint32_t primitives) {
    return RTC_AS_HEADER_QUADS + RTC_NODE_QUADS * rtr_node_room(primitives);
}

/* What the reflection of a module says; strings point into one allocation. */
typedef struct RtrModule {
    RtcModuleHeader header;
    RtcModuleGroup* groups;
    char* json;
    /* Descriptors the module declares, by kind, and push-constant bytes. */
    uint32_t storage_buffers, uniform_buffers, sampled_images, storage_images, samplers, input_attachments,
        total;
} RtrModule;

/* scopes.c: a copy of a module whose memory scopes are the subgroup's; NULL: out of memory. */
uint32_t* rtr_narrow_scopes(const uint32_t* code, size_t* size, const VkAllocationCallbacks* allocator);
VkResult rtr_parse_module(RtrDevice device, const uint32_t* code, size_t size,
                          const VkAllocationCallbacks* allocator, RtrModule* module);
/* Features and extensions (features.c): what the device was created with, or (NULL) what the
 * physical device offers; then whether a parsed module can run with that, each thing missing
 * reported by name. */
VkResult rtr_learn_features(RtrDevice device, const VkDeviceCreateInfo* made);
VkResult rtr_check_features(RtrDevice device, const uint32_t* code, size_t size);
void rtr_free_module(const VkAllocationCallbacks* allocator, RtrModule* module);

/* Layout bindings of the reserved set that `used` names, at `base`; returns their number. */
uint32_t rtr_reserved_bindings(uint32_t used, uint32_t base, VkDescriptorSetLayoutBinding* bindings);

#define RTR_PARAM_BYTES (RTC_PARAM_QUADS * RTC_QUAD_BYTES)
/* What the reserved bindings are to show, by RTC_BINDING_*. */
typedef struct RtrReservedInfo {
    VkDescriptorBufferInfo buffers[RTC_BINDING_COUNT];
    VkBufferView texels;
} RtrReservedInfo;
void rtr_reserved_heap(RtrDevice device, RtrHeap heap, RtrReservedInfo* info);
void rtr_write_reserved(RtrDevice device, const struct RtrPipeline_T* pipeline, VkDescriptorSet set,
                        const RtrReservedInfo* info);

/* What a binding of `as`'s header is. */
static inline VkDescriptorBufferInfo rtr_header_info(const struct RtrAccelerationStructure_T* as) {
    VkDescriptorBufferInfo info;
    info.buffer = as->buffer;
    info.offset = as->offset;
    info.range = RTC_AS_HEADER_QUADS * RTC_QUAD_BYTES;
    return info;
}


/* The version that serialised structures of this device and runtime carry. */
void rtr_make_blob_version(const VkPhysicalDeviceIDProperties* id, uint8_t version[2 * VK_UUID_SIZE]);

/* A launch whose parameters and control block are written, for validation. */
typedef struct RtrLaunchCheck {
    const RtrStridedBufferRegion* regions;  /* 4: raygen, miss, hit, callable */
    VkDescriptorBufferInfo params, control; /* slots of parameters; the control block */
    VkDeviceSize table; /* at least RTR_CHECK_BYTES of the control buffer; not there without checked structures */
    uint32_t slots, slot_words;
    uint32_t identity;
} RtrLaunchCheck;
/* Records the checks; afterwards a launch with an error has no lanes. */
VkResult rtr_validate_launch(RtrRecorder recorder, const RtrLaunchCheck* check);

/* ---- What is alive, with validation (live.c) --------------------------------------------------- */
typedef struct RtrLive { /* as RTC_PARAM_LIVE_TABLE has it */
    uint32_t lo, hi, quads, unused;
} RtrLive;
static inline uint64_t rtr_live_base(const RtrLive* e) { return (uint64_t)e->hi << 32 | e->lo; }
void rtr_add_live(RtrAccelerationStructure as);
void rtr_remove_live(RtrAccelerationStructure as);
uint32_t rtr_count_live(RtrDevice device);
/* Those in `heap` (NULL: in address mode), sorted by base; rtr_free with the recorder's allocator. */
VkResult rtr_list_live(RtrRecorder recorder, RtrHeap heap, bool bottom_only, RtrLive** list, uint32_t* count);

/* ---- References of instances, with validation (validate_instances.c) ------------------------ */
#define RTR_CHECK_BYTES 16384u /* of the control region: a piece of the table of live bottom levels */
/* From now on launches of this recorder look at the structure. */
VkResult rtr_add_checked(RtrRecorder recorder, RtrAccelerationStructure as, uint32_t index);
/* Forgets those of the declared scene. */
void rtr_forget_declared(RtrRecorder recorder);
/* Records the checks of what the launch reaches. */
VkResult rtr_check_launch_instances(RtrRecorder recorder, const RtrLaunchCheck* check);

#endif /* RTR_INTERNAL_H_ */
