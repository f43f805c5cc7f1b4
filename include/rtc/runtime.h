/* rtc runtime: VK_NV_ray_tracing's host side on plain Vulkan 1.1 compute.
 *
 * The shape is that of the extension: an engine ports by renaming functions.
 * Structures and enums of vulkan_core.h are reused where they are meaningful
 * without the extension. Differences from VK_NV_ray_tracing, all of them:
 *  - Acceleration structures live in a heap (RtrHeap, one range of a VkBuffer of
 *    the application) instead of their own VkDeviceMemory. Everything one launch
 *    can reach lies in one heap. Or, in address mode (devices with the feature
 *    bufferDeviceAddress, modules linked with rtc --addressing=address), anywhere in
 *    buffers with device addresses, as with VK_KHR_acceleration_structure.
 *  - Commands are recorded through an RtrRecorder, because ray tracing shares the
 *    compute bind point. AFTER ANY rtrCmd* CALL THE COMPUTE PIPELINE, DESCRIPTOR
 *    SETS AND PUSH CONSTANTS OF THE COMMAND BUFFER ARE UNDEFINED: bind your own
 *    again before your next vkCmdDispatch.
 *  - Queries write to a buffer (no query pool can be written by a shader).
 *  - Commands return a VkResult and report through the device's messenger.
 *
 * Memory, buffers, command buffers and submissions are the application's. The
 * runtime allocates host memory and small Vulkan objects (layouts, pipelines,
 * descriptor pools, buffer views) through the VkAllocationCallbacks it is given;
 * it allocates no device memory, submits nothing, keeps no global state, and
 * calls no Vulkan entry point except through vkGetInstanceProcAddr.
 *
 * Threads: functions on different objects may run at the same time. RtrDevice,
 * and a finished RtrPipeline, are immutable: any number of threads may use them.
 * RtrRecorder, RtrHeap and RtrAccelerationStructure are externally synchronised,
 * as VkCommandBuffer is; recording only reads heaps and acceleration structures
 * (except rtrBindAccelerationStructureMemory, the heap allocator, and what is recorded with a
 * structure as its destination, which remembers what it is built of).
 *
 * Errors: VkResult, with a text through the messenger that names the argument or
 * limit, what it was and what was expected. VK_ERROR_VALIDATION_FAILED_EXT: an
 * argument breaks a rule. VK_ERROR_FEATURE_NOT_PRESENT: a limit or feature of the
 * device, or something the runtime does not do yet. VK_ERROR_INCOMPATIBLE_DRIVER:
 * a module or blob of another ABI version. VK_ERROR_OUT_OF_POOL_MEMORY: the
 * recorder's control region is full. Nothing is recorded by a call that fails.
 *
 * Units: sizes and offsets are bytes unless a name says otherwise.
 */
#ifndef RTC_RUNTIME_H_
#define RTC_RUNTIME_H_

#include <stddef.h>
#include <stdint.h>
#include <vulkan/vulkan_core.h>

#if defined(RTR_STATIC)
#define RTR_API
#elif defined(_WIN32)
#if defined(RTR_BUILDING)
#define RTR_API __declspec(dllexport)
#else
#define RTR_API __declspec(dllimport)
#endif
#elif defined(__GNUC__)
#define RTR_API __attribute__((visibility("default")))
#else
#define RTR_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

#define RTR_VERSION_MAJOR 0
#define RTR_VERSION_MINOR 1

typedef struct RtrDevice_T* RtrDevice;
typedef struct RtrHeap_T* RtrHeap;
typedef struct RtrAccelerationStructure_T* RtrAccelerationStructure;
typedef struct RtrPipeline_T* RtrPipeline;
typedef struct RtrRecorder_T* RtrRecorder;

/* ABI version of this runtime (RTC_ABI_VERSION it was built with). No counterpart. */
RTR_API uint32_t rtrGetAbiVersion(void);

/* ---- What a device offers ----------------------------------------------------- */

typedef enum RtrFetch {
    RTR_FETCH_TEXEL = 0,           /* nodes through a uniform texel buffer; best on lavapipe */
    RTR_FETCH_STORAGE = 1,         /* nodes through a storage buffer */
    RTR_FETCH_DEFAULT = 0x7fffffff /* what the device recommends */
} RtrFetch;

#define RTR_DEFAULT 0xffffffffu /* "as the device recommends" in RtrTraceOptions */

/* How a module is specialised for a device; all values become specialisation
 * constants (RTC_SPEC_*). Start from RTR_TRACE_OPTIONS_DEFAULT. */
typedef struct RtrTraceOptions {
    RtrFetch fetch;
    uint32_t whileWhile;    /* 0: if-if loop, 1: while-while loop */
    uint32_t sharedStack;   /* traversal stack entries a lane keeps in shared memory; 0: local array */
    uint32_t workgroupSize; /* lanes of a workgroup, a multiple of 32 */
    uint32_t stepBudget;    /* loop turns before a lane suspends; 0: never. Only used by resumable modules */
} RtrTraceOptions;
#define RTR_TRACE_OPTIONS_DEFAULT \
    { RTR_FETCH_DEFAULT, RTR_DEFAULT, RTR_DEFAULT, RTR_DEFAULT, RTR_DEFAULT }

/* One thing the runtime needs of a device. */
typedef struct RtrRequirement {
    char name[72]; /* the Vulkan name: "maxPerStageDescriptorStorageBuffers", "apiVersion", ... */
    uint64_t required;
    uint64_t available;
    VkBool32 met;
} RtrRequirement;

#define RTR_MAX_REQUIREMENTS 24

typedef struct RtrPhysicalDeviceSupport {
    VkBool32 supported; /* every requirement is met */
    uint32_t requirementCount;
    RtrRequirement requirements[RTR_MAX_REQUIREMENTS];
    RtrTraceOptions recommended;     /* no field is a default */
    VkBool32 needsResumableModules;  /* the device ends or kills long loops: use modules compiled resumable */
    VkBool32 heapMode;               /* always true when supported */
    VkBool32 addressMode;            /* the feature bufferDeviceAddress is there, see RtrDeviceCreateInfo */
    VkBool32 recommendAddresses;     /* address mode is there and nodes are read faster by address than from a heap */
    VkDeviceSize maxHeapSizeTexel;   /* bytes of heap that RTR_FETCH_TEXEL can reach */
    VkDeviceSize maxHeapSizeStorage; /* bytes of heap that RTR_FETCH_STORAGE can reach */
    uint32_t subgroupSize;
    char deviceName[VK_MAX_PHYSICAL_DEVICE_NAME_SIZE];
    char driverName[VK_MAX_DRIVER_NAME_SIZE]; /* "" when the driver does not tell */
    char driverInfo[VK_MAX_DRIVER_INFO_SIZE];
} RtrPhysicalDeviceSupport;

/* Says whether rtc runs on a device, what is missing by name, and how modules
 * should be specialised for it. Needs no VkDevice. `instance` must have been
 * created for Vulkan 1.1 or later. Vulkan counterpart:
 * vkGetPhysicalDeviceFeatures2/Properties2 with VkPhysicalDeviceRayTracingPropertiesNV.
 * Errors: VK_ERROR_INITIALIZATION_FAILED when an entry point is missing. */
RTR_API VkResult rtrGetPhysicalDeviceSupport(VkInstance instance, VkPhysicalDevice physicalDevice,
                                             PFN_vkGetInstanceProcAddr pfnGetInstanceProcAddr,
                                             RtrPhysicalDeviceSupport* pSupport);

/* ---- Device --------------------------------------------------------------------- */

typedef struct RtrDeviceCreateInfo {
    const void* pNext; /* must be NULL */
    VkInstance instance;
    VkPhysicalDevice physicalDevice;
    VkDevice device; /* needs no extension and no feature beyond Vulkan 1.1 */
    PFN_vkGetInstanceProcAddr pfnGetInstanceProcAddr;
    VkPipelineCache pipelineCache; /* for the build kernels; may be VK_NULL_HANDLE */
    /* Where messages go; NULL: nowhere. Only the filters, callback and user data are
     * used; VK_EXT_debug_utils itself is not needed. The callback may be called from
     * any thread that calls the runtime. */
    const VkDebugUtilsMessengerCreateInfoEXT* pMessenger;
    /* Address mode: `device` was created with the feature bufferDeviceAddress (of Vulkan
     * 1.2 or VK_KHR_buffer_device_address). Acceleration structures can then be bound to
     * buffers, and modules linked for address mode run; heap mode stays available. */
    VkBool32 bufferDeviceAddress;
    /* Deeper checks, at the cost of some dispatches a launch. Before each launch the device
     * looks at its shader binding table: regions must end within their buffers, and the raygen
     * record and every record of a region whose size is given (rtrCmdTraceRaysRegions) must be
     * null or a handle of the pipeline. A launch that breaks this traces nothing and has the
     * launch error SBT_RANGE or BAD_HANDLE with the region and record; and where sizes are not
     * given (rtrCmdTraceRays), records outside the buffer act as null instead of being read.
     * References of instances must be those of bottom levels that are bound and not destroyed
     * when the build of the top level is recorded, and built when it runs: others become inactive,
     * in address mode without being followed. A launch traces nothing and has the launch error
     * BAD_INSTANCE, with the first such instance, when this happened in a top level that the same
     * recording built or that rtrCmdDeclareScene names; the latter's references are looked at
     * again, for bottom levels that have been destroyed since. Updates that changed what is active are
     * told of likewise (BAD_UPDATE). Scratch of top levels then needs
     * TRANSFER_DST, and launches more of the control region (rtrGetRecorderControlSize).
     * Damage inside of structures is the module's to find: rtc --checked links a traversal that
     * follows nothing it has not checked (launch error BAD_MEMORY); it is told with each launch
     * which structures are bound and not destroyed, and reads no other memory.
     * rtrCreateRayTracingPipelineFromStages links that one by itself; pipelines of other modules
     * get the warning not-checked. */
    VkBool32 validation;
    /* What `device` was created with, read during this call: a pipeline whose module needs a
     * feature or extension that is not in it is then refused by name. NULL: only what the
     * physical device does not have is refused, and enabling the rest is up to you. */
    const VkDeviceCreateInfo* pDeviceCreateInfo;
} RtrDeviceCreateInfo;

/* Prepares the runtime on a VkDevice: builds its kernels (some 30 small compute
 * pipelines). The VkDevice must outlive it. `pAllocator` (may be NULL: malloc) is
 * used for this object and everything made from it when their own is NULL, and
 * passed on to Vulkan.
 * Errors: VK_ERROR_FEATURE_NOT_PRESENT with the missing limits by name, or when
 * bufferDeviceAddress is asked for and the physical device does not have it. */
RTR_API VkResult rtrCreateDevice(const RtrDeviceCreateInfo* pCreateInfo,
                                 const VkAllocationCallbacks* pAllocator, RtrDevice* pDevice);
/* Objects made from the device must be gone. NULL is ignored. */
RTR_API void rtrDestroyDevice(RtrDevice device, const VkAllocationCallbacks* pAllocator);

/* The support structure the device was created with. */
RTR_API const RtrPhysicalDeviceSupport* rtrGetDeviceSupport(RtrDevice device);

/* Fills sType-tagged VkPhysicalDeviceRayTracingPropertiesNV (pNext is left alone):
 * handle size 32, max recursion 31, base alignment 64, max stride 4096, ...
 * Counterpart: vkGetPhysicalDeviceProperties2. */
RTR_API void rtrGetRayTracingProperties(RtrDevice device,
                                        VkPhysicalDeviceRayTracingPropertiesNV* pProperties);
/* The same for VK_KHR_ray_tracing_pipeline's structure. Counterpart: vkGetPhysicalDeviceProperties2. */
RTR_API void rtrGetRayTracingPipelineProperties(RtrDevice device,
                                                VkPhysicalDeviceRayTracingPipelinePropertiesKHR* pProperties);
/* Fills VkPhysicalDeviceAccelerationStructurePropertiesKHR (pNext is left alone).
 * Counterpart: vkGetPhysicalDeviceProperties2. */
RTR_API void rtrGetAccelerationStructureProperties(
    RtrDevice device, VkPhysicalDeviceAccelerationStructurePropertiesKHR* pProperties);

/* Whether the device was created with RtrDeviceCreateInfo::validation. No counterpart. */
RTR_API VkBool32 rtrIsValidating(RtrDevice device);

/* Sends a message to the device's messenger, for code that sits on top of the runtime.
 * severity: ERROR or WARNING; id: a stable name. */
RTR_API void rtrReportMessage(RtrDevice device, VkDebugUtilsMessageSeverityFlagBitsEXT severity,
                              const char* id, const char* text);

/* ---- Enums of the extension, turned into valid Vulkan 1.1 ones --------------------
 * Without VK_NV_ray_tracing its enums must not reach vkCreateBuffer and friends. Each
 * function maps the ray tracing values to what the runtime uses and keeps the rest. */
/* RAY_TRACING_BIT_NV (SHADER_BINDING_TABLE_BIT_KHR) -> STORAGE | INDIRECT | TRANSFER_SRC | TRANSFER_DST;
 * KHR's BUILD_INPUT_READ_ONLY -> STORAGE, ACCELERATION_STRUCTURE_STORAGE -> STORAGE | TRANSFER_SRC | TRANSFER_DST
 * (for address mode; heaps need RTR_HEAP_BUFFER_USAGE) */
RTR_API VkBufferUsageFlags rtrTranslateBufferUsage(VkBufferUsageFlags usage);
/* RAY_TRACING_SHADER, ACCELERATION_STRUCTURE_BUILD -> COMPUTE_SHADER (and TRANSFER for the latter) */
RTR_API VkPipelineStageFlags rtrTranslatePipelineStages(VkPipelineStageFlags stages);
/* ACCELERATION_STRUCTURE_READ/WRITE -> SHADER_READ / SHADER_WRITE | TRANSFER_READ / TRANSFER_WRITE */
RTR_API VkAccessFlags rtrTranslateAccess(VkAccessFlags access);
/* any ray tracing stage -> COMPUTE_BIT */
RTR_API VkShaderStageFlags rtrTranslateShaderStages(VkShaderStageFlags stages);
/* ACCELERATION_STRUCTURE_NV/KHR -> STORAGE_BUFFER */
RTR_API VkDescriptorType rtrTranslateDescriptorType(VkDescriptorType type);
/* RAY_TRACING -> COMPUTE */
RTR_API VkPipelineBindPoint rtrTranslateBindPoint(VkPipelineBindPoint bindPoint);
/* The same for VK_KHR_synchronization2 (also AS copy, and SBT reads) */
RTR_API VkPipelineStageFlags2 rtrTranslatePipelineStages2(VkPipelineStageFlags2 stages);
/* The same for VK_KHR_synchronization2: AS reads and writes, and SBT reads -> SHADER_READ */
RTR_API VkAccessFlags2 rtrTranslateAccess2(VkAccessFlags2 access);
/* Arrays of structures: `count` elements of pIn with their types and stages translated.
 * pOut may be pIn. A pool may name one type several times. */
RTR_API void rtrTranslatePoolSizes(uint32_t count, const VkDescriptorPoolSize* pIn,
                                   VkDescriptorPoolSize* pOut);
/* The same of set layouts' bindings: descriptor types and stages. pOut may be pIn. */
RTR_API void rtrTranslateLayoutBindings(uint32_t count, const VkDescriptorSetLayoutBinding* pIn,
                                        VkDescriptorSetLayoutBinding* pOut);
/* All ray tracing stages are one stage now, and a layout has one range a stage: theirs and
 * compute's become one range that covers them. Returns the number of ranges in pOut, which
 * must have room for count + 1 and must not be pIn. */
RTR_API uint32_t rtrTranslatePushConstantRanges(uint32_t count, const VkPushConstantRange* pIn,
                                                VkPushConstantRange* pOut);

/* ---- Heap ------------------------------------------------------------------------- */

/* Buffer usages a heap needs. Device-local memory is best. */
#define RTR_HEAP_BUFFER_USAGE                                                        \
    (VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT | \
     VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT)
/* Buffer usages of a buffer that acceleration structures are bound to in address mode. Its
 * memory needs VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT. */
#define RTR_ADDRESS_BUFFER_USAGE                                                       \
    (VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT | \
     VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT)
/* Buffer usages of build and update scratch (TRANSFER_DST: with validation only). */
#define RTR_SCRATCH_BUFFER_USAGE                                              \
    (VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT | \
     VK_BUFFER_USAGE_TRANSFER_DST_BIT)
/* Vertex, index, transform, AABB and instance buffers, and SBT buffers. Indices and vertex
 * components of 8 and 16 bits are read by whole words: pad such a buffer to a multiple of 4 bytes. */
#define RTR_INPUT_BUFFER_USAGE VK_BUFFER_USAGE_STORAGE_BUFFER_BIT
/* Buffer usages of a recorder's control region. */
#define RTR_CONTROL_BUFFER_USAGE                                               \
    (VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT | VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | \
     VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT |  \
     VK_BUFFER_USAGE_TRANSFER_SRC_BIT)
/* Launch scratch (rtrCmdSetLaunchScratch). */
#define RTR_LAUNCH_SCRATCH_BUFFER_USAGE VK_BUFFER_USAGE_STORAGE_BUFFER_BIT

typedef struct RtrHeapCreateInfo {
    const void* pNext;   /* must be NULL */
    VkBuffer buffer;     /* bound to memory, created with RTR_HEAP_BUFFER_USAGE */
    VkDeviceSize offset; /* a multiple of 256 */
    VkDeviceSize size;   /* at least 512; at most RtrPhysicalDeviceSupport::maxHeapSizeTexel */
} RtrHeapCreateInfo;

/* Makes a heap of a buffer range. Its first 256 bytes are the runtime's: they hold
 * the null acceleration structure once rtrCmdInitializeHeap ran.
 * No counterpart: it stands where NV binds VkDeviceMemory. */
RTR_API VkResult rtrCreateHeap(RtrDevice device, const RtrHeapCreateInfo* pCreateInfo,
                               const VkAllocationCallbacks* pAllocator, RtrHeap* pHeap);
/* Structures bound to it must be gone; its buffer stays. NULL is ignored. No counterpart. */
RTR_API void rtrDestroyHeap(RtrDevice device, RtrHeap heap, const VkAllocationCallbacks* pAllocator);

/* Records the zeroing of the heap's first 256 bytes, with the barrier that makes it
 * visible to shaders. Once per heap, outside a render pass, before any launch. */
RTR_API VkResult rtrCmdInitializeHeap(RtrRecorder recorder, RtrHeap heap);

/* Arena allocator over the heap, for those who want one: first fit, offsets relative
 * to the heap's start, as rtrBindAccelerationStructureMemory takes them. Do not mix
 * with offsets chosen by hand. `alignment` 0 means 256.
 * Errors: VK_ERROR_OUT_OF_DEVICE_MEMORY when no free range is large enough. */
RTR_API VkResult rtrAllocateHeapRange(RtrHeap heap, VkDeviceSize size, VkDeviceSize alignment,
                                      VkDeviceSize* pOffset);
/* Gives a range back; the device must have finished with it. Unknown offsets are ignored with a message. */
RTR_API void rtrFreeHeapRange(RtrHeap heap, VkDeviceSize offset);

/* ---- Acceleration structures ------------------------------------------------------- */

/* Counterpart: vkCreateAccelerationStructureNV. With compactedSize != 0 the object is
 * the target of a compacting copy or of a clone and info's counts are 0. Geometry
 * structures are copied; buffers named in them are only used by the build.
 * Limits: 2^26 primitives, 2^24 instances, 2^24-1 geometries; vertex formats
 * R32G32B32 and R32G32 SFLOAT, R16G16B16 and R16G16 SFLOAT and SNORM (also with an
 * alpha that is ignored; a missing z is 0); index types NONE_NV, UINT8_EXT, UINT16, UINT32. One
 * kind of geometry per bottom level.
 * Errors: VALIDATION_FAILED for counts, formats, mixed geometry types, unknown pNext and flags, another sType. */
RTR_API VkResult rtrCreateAccelerationStructure(RtrDevice device,
                                                const VkAccelerationStructureCreateInfoNV* pCreateInfo,
                                                const VkAllocationCallbacks* pAllocator,
                                                RtrAccelerationStructure* pAccelerationStructure);
/* The device has finished with it; its memory is free for others. NULL is ignored.
 * Counterpart: vkDestroyAccelerationStructureNV. */
RTR_API void rtrDestroyAccelerationStructure(RtrDevice device, RtrAccelerationStructure accelerationStructure,
                                             const VkAllocationCallbacks* pAllocator);

/* Size and alignment (256) of the object, its build scratch or its update scratch.
 * memoryTypeBits is all ones: the memory is a buffer of yours. VkMemoryDedicatedRequirements behind
 * pNext says no twice. An unknown type gives size 0 and a message.
 * Counterpart: vkGetAccelerationStructureMemoryRequirementsNV. */
RTR_API void rtrGetAccelerationStructureMemoryRequirements(
    RtrDevice device, VkAccelerationStructureMemoryRequirementsTypeNV type,
    RtrAccelerationStructure accelerationStructure, VkMemoryRequirements2* pMemoryRequirements);

typedef struct RtrBindAccelerationStructureMemoryInfo {
    const void* pNext; /* must be NULL */
    RtrAccelerationStructure accelerationStructure;
    RtrHeap heap;
    VkDeviceSize heapOffset; /* from the heap's start; a multiple of 256, not 0 */
    /* Address mode: heap is NULL, and the structure lies at bufferOffset (a multiple of
     * 256) of a buffer with RTR_ADDRESS_BUFFER_USAGE that is bound to memory. */
    VkBuffer buffer;
    VkDeviceSize bufferOffset;
} RtrBindAccelerationStructureMemoryInfo;

/* Counterpart: vkBindAccelerationStructureMemoryNV; with a buffer, where
 * VkAccelerationStructureCreateInfoKHR names it. Once per object. A bottom level and every
 * top level that refers to it must be in the same heap, or both bound to buffers: an instance
 * of a bottom level elsewhere becomes inactive when the top level is built, and the header's
 * RTC_HDR_BAD_INSTANCE names it (with RtrDeviceCreateInfo::validation so do launches).
 * Errors: VALIDATION_FAILED for ranges, for both or neither of heap and buffer;
 * FEATURE_NOT_PRESENT for a buffer on a device without bufferDeviceAddress. */
RTR_API VkResult rtrBindAccelerationStructureMemory(RtrDevice device, uint32_t bindInfoCount,
                                                    const RtrBindAccelerationStructureMemoryInfo* pBindInfos);

/* The 64-bit reference for VkAccelerationStructureInstanceNV::accelerationStructureReference:
 * in address mode the device address of the structure, otherwise a number only the runtime
 * understands, different for any two structures of all the device's heaps. dataSize must be 8 or more. Counterpart: vkGetAccelerationStructureHandleNV. */
RTR_API VkResult rtrGetAccelerationStructureHandle(RtrDevice device,
                                                   RtrAccelerationStructure accelerationStructure,
                                                   size_t dataSize, void* pData);

/* What to write into a VK_DESCRIPTOR_TYPE_STORAGE_BUFFER descriptor where the shader
 * declares accelerationStructureNV/EXT. Counterpart: VkWriteDescriptorSetAccelerationStructureNV.
 * Errors: VALIDATION_FAILED for a structure that is not bound. */
RTR_API VkResult rtrGetAccelerationStructureDescriptor(RtrDevice device,
                                                       RtrAccelerationStructure accelerationStructure,
                                                       VkDescriptorBufferInfo* pInfo);
/* The same for no structure: rays traced into it miss. Any heap that was initialised has one. (256
 * zero bytes of any STORAGE buffer are a null structure too, in both modes.) Counterpart:
 * VK_NULL_HANDLE in VkWriteDescriptorSetAccelerationStructureNV, with nullDescriptor. */
RTR_API VkResult rtrGetNullAccelerationStructureDescriptor(RtrDevice device, RtrHeap heap,
                                                           VkDescriptorBufferInfo* pInfo);
/* Writes `count` structures into array elements from dstArrayElement on of such a
 * descriptor. The null structure of `nullHeap` stands for NULL ones (nullHeap may be NULL
 * when there are none). Counterpart: vkUpdateDescriptorSets with
 * VkWriteDescriptorSetAccelerationStructureNV. */
RTR_API VkResult rtrUpdateAccelerationStructureDescriptors(
    RtrDevice device, VkDescriptorSet dstSet, uint32_t dstBinding, uint32_t dstArrayElement, uint32_t count,
    const RtrAccelerationStructure* pAccelerationStructures, RtrHeap nullHeap);

/* ---- Assumptions about scenes (rtc --assume, docs/specialisation.md) -----------------
 * A module may have been told what scenes are: opaque, of one instance, and so on. Whether
 * they are is checked when rays begin, by what the build kernels found: a launch that meets
 * another scene traces nothing into it and sets the launch error RTC_LAUNCH_ERROR_ASSUMPTION,
 * which names the assumption and the instance. */

/* Tells the recorder which acceleration structures the launches that follow reach, so that
 * what the host knows of them is checked when a launch is recorded (kinds of geometry, and
 * opacity where the module assumes no instance flags), rather than by the device alone.
 * Optional; replaces what was declared before; forgotten by rtrBeginRecorder. With
 * RtrDeviceCreateInfo::validation the device looks at its top levels before each launch. count 0:
 * nothing is declared. Structures made by copies tell the host nothing of their geometry. A launch
 * that cannot be right fails with VALIDATION_FAILED and is not recorded: "assumption", or
 * "other-heap" when one of them lies in another heap than that of rtrCmdSetHeap (or the module is of
 * the other addressing mode). No counterpart. */
RTR_API VkResult rtrCmdDeclareScene(RtrRecorder recorder, uint32_t count,
                                    const RtrAccelerationStructure* pAccelerationStructures);

/* Bytes of a header that rtrWriteSceneProfile reads: the start of the range that
 * rtrGetAccelerationStructureDescriptor gives. */
#define RTR_SCENE_PROFILE_HEADER_BYTES 256u

/* What is true of all these built top levels, as JSON for `rtc --scene-profile`: the
 * assumptions they meet. ppHeaders: their headers, copied from the device after the build.
 * Two-call idiom: pText NULL stores the size in *pSize; otherwise *pSize bytes are there (no
 * terminator is written) and receives the size; VK_INCOMPLETE when they do not suffice.
 * Errors: VALIDATION_FAILED for a header that is not that of a built top level. */
RTR_API VkResult rtrWriteSceneProfile(RtrDevice device, uint32_t headerCount, const void* const* ppHeaders,
                                      size_t* pSize, char* pText);

/* ---- Recorder --------------------------------------------------------------------- */

typedef struct RtrRecorderCreateInfo {
    const void* pNext; /* must be NULL */
    /* Launch parameters and control blocks live here: a range of a buffer created with
     * RTR_CONTROL_BUFFER_USAGE. Host-visible memory lets you read launch errors without
     * a copy. offset: a multiple of 256. size: see rtrGetRecorderControlSize. May be
     * VK_NULL_HANDLE / 0 for a recorder that only builds. */
    VkBuffer controlBuffer;
    VkDeviceSize controlOffset;
    VkDeviceSize controlSize;
} RtrRecorderCreateInfo;

/* Bytes of control region for `launchCount` launches between two resets, each of at
 * most `tileCount` tiles (1 unless you set a tile size or little launch scratch) and
 * `roundCount` rounds (1 for modules that are not resumable). An upper bound. With validation
 * it also holds a table of the acceleration structures that are bound at the time of this call. */
RTR_API VkDeviceSize rtrGetRecorderControlSize(RtrDevice device, uint32_t launchCount, uint32_t tileCount,
                                               uint32_t roundCount);

/* A recorder stands beside one command buffer at a time: it tracks ray tracing
 * bindings and owns the descriptor sets and control-region pieces of what was
 * recorded. Counterpart: the ray tracing state of a VkCommandBuffer. */
RTR_API VkResult rtrCreateRecorder(RtrDevice device, const RtrRecorderCreateInfo* pCreateInfo,
                                   const VkAllocationCallbacks* pAllocator, RtrRecorder* pRecorder);
/* The device has finished with all that was recorded. NULL is ignored. Counterpart: vkFreeCommandBuffers,
 * of that state. */
RTR_API void rtrDestroyRecorder(RtrDevice device, RtrRecorder recorder,
                                const VkAllocationCallbacks* pAllocator);

/* Records into `commandBuffer` from now on; it must be in the recording state, of a
 * compute-capable queue family, outside a render pass. Ray tracing bindings start
 * empty; heap, launch scratch and launch limits stay. Pieces given out earlier stay
 * taken, so that several command buffers can be recorded one after the other.
 * Counterpart: vkBeginCommandBuffer, of the ray tracing state. */
RTR_API VkResult rtrBeginRecorder(RtrRecorder recorder, VkCommandBuffer commandBuffer);
/* The device has finished with (or will never execute) all that was recorded: sets
 * and control pieces are free again. Contents of control blocks stay readable until
 * the next command buffer runs. Counterpart: what vkResetCommandBuffer gives back. */
RTR_API VkResult rtrRetireRecorder(RtrRecorder recorder);
/* rtrRetireRecorder, and forgets the command buffer, bindings, heap and scratch.
 * Counterpart: vkResetCommandBuffer. */
RTR_API VkResult rtrResetRecorder(RtrRecorder recorder);

/* ---- Build, copy, query ------------------------------------------------------------ */

/* Builds, or updates (refits), an acceleration structure on the device.
 * Counterpart: vkCmdBuildAccelerationStructureNV; same arguments, a recorder in place
 * of the command buffer. instanceData holds VkAccelerationStructureInstanceNV (64
 * bytes each, offset a multiple of 16). scratchOffset: a multiple of 256. Scratch
 * contents need no initialisation. `src` is read only for updates: NULL or `dst`
 * refits in place.
 * Builds recorded one after another need no barrier between them, even with one scratch:
 * each ends with its own (compute to compute), so a top level may follow its bottom levels.
 * Otherwise synchronisation is the application's, as in Vulkan: reads of inputs and reads and
 * writes of `dst` and scratch happen in COMPUTE_SHADER with SHADER_READ / SHADER_WRITE
 * (rtrTranslatePipelineStages/Access of the NV masks say the same).
 * PREFER_FAST_BUILD takes a Morton tree as it is; otherwise two passes of rotations bring it
 * near a SAH tree, and with PREFER_FAST_TRACE a third over bottom levels. LOW_MEMORY fills leaves, whether or not that makes tracing cheaper: the
 * compacted size is smaller by 12 to 22 percent, that of the object and of scratch stays.
 * An update may move vertices, boxes and instances, nothing else: geometries, their types,
 * flags, formats and counts, and which primitives are active (for instances: a reference that is
 * not 0, a transform that can be inverted) stay. It is compared with the build of `src` recorded
 * last; of a deserialised structure the device compares the counts, and leaves it as it is when
 * they differ. What became active or inactive stands in the header (RTC_HDR_BAD_UPDATE) and, with
 * RtrDeviceCreateInfo::validation, makes the launch error BAD_UPDATE of launches of the same
 * recording or of scenes declared. Compacted and deserialised structures can be updated when
 * they were created with the flags of their source.
 * Errors: VALIDATION_FAILED (counts above those of creation, unbound objects, update
 * without ALLOW_UPDATE or with changed geometry, misaligned offsets);
 * FEATURE_NOT_PRESENT naming the device limit an input exceeds. */
RTR_API VkResult rtrCmdBuildAccelerationStructure(RtrRecorder recorder,
                                                  const VkAccelerationStructureInfoNV* pInfo,
                                                  VkBuffer instanceData, VkDeviceSize instanceOffset,
                                                  VkBool32 update, RtrAccelerationStructure dst,
                                                  RtrAccelerationStructure src, VkBuffer scratch,
                                                  VkDeviceSize scratchOffset);

/* One of several builds or updates, and where ranges on the device are given. */
typedef struct RtrAccelerationStructureBuildInfo {
    const void* pNext; /* must be NULL */
    /* The arguments of rtrCmdBuildAccelerationStructure. */
    const VkAccelerationStructureInfoNV* pInfo;
    VkBuffer instanceData;
    VkDeviceSize instanceOffset;
    VkBool32 update;
    RtrAccelerationStructure dst, src;
    VkBuffer scratch;
    VkDeviceSize scratchOffset;
    /* Unless it is VK_NULL_HANDLE, a STORAGE buffer with a VkAccelerationStructureBuildRangeInfoKHR
     * for each geometry (one for the instances of a top level), indirectStride bytes apart from
     * indirectOffset on (multiples of 4), read in COMPUTE_SHADER with SHADER_READ. pInfo's counts
     * are then the largest there may be, and primitiveCount says how many there are; primitiveOffset
     * (bytes into indices, into vertices without indices, AABBs or instances), firstVertex (added to
     * indices, and to the number of the vertex) and transformOffset (bytes) are as KHR has them, with
     * its alignments: added to the offsets of pInfo, whose vertexCount bounds every vertex number.
     * Buffers of geometry end within maxStorageBufferRange of those offsets. */
    VkBuffer indirectBuffer;
    VkDeviceSize indirectOffset;
    uint32_t indirectStride;
} RtrAccelerationStructureBuildInfo;

/* Any number of builds and updates in one call, with a barrier a phase for all of them instead of
 * each its own: many small ones then fill a device. First the bottom levels, then the top levels,
 * which may refer to them (those in a heap one after the other). Each needs scratch of its own. Otherwise as
 * rtrCmdBuildAccelerationStructure. What an indirect build leaves out counts as inactive: an update
 * has the same largest counts and the same primitives. The time of an indirect build is that of the
 * largest counts.
 * Counterpart: vkCmdBuildAccelerationStructuresKHR and -IndirectKHR.
 * Errors: those of rtrCmdBuildAccelerationStructure; VALIDATION_FAILED when two of them write the
 * same memory, or for misaligned indirect data. */
RTR_API VkResult rtrCmdBuildAccelerationStructures(RtrRecorder recorder, uint32_t infoCount,
                                                   const RtrAccelerationStructureBuildInfo* pInfos);

/* Where a geometry's data lies for a build on the host, in place of the buffers that its
 * VkGeometryNV names (which are ignored). Its offsets count from these pointers. */
typedef struct RtrHostGeometry {
    const void* pVertexData;
    const void* pIndexData;     /* NULL without indices */
    const void* pTransformData; /* NULL: none */
    const void* pAabbData;
} RtrHostGeometry;

/* Builds a bottom level on the host, by the surface area heuristic: slower than the device
 * but, for static geometry, a better tree. pHostGeometries has info's geometryCount elements.
 * dst is bound; pMemory receives its block: dst's place in mapped memory, or as many bytes
 * (memory requirements of the object) elsewhere, which the application then copies to dst's
 * place. Everything after works as with a structure built on the device: instances, copies,
 * compaction, updates. Uses one thread, and host memory of 32 bytes a primitive.
 * Thread-safe for different dst. Counterpart: vkBuildAccelerationStructuresKHR.
 * Errors: VALIDATION_FAILED for top levels, counts, missing pointers; OUT_OF_HOST_MEMORY. */
RTR_API VkResult rtrBuildAccelerationStructureOnHost(RtrDevice device,
                                                     const VkAccelerationStructureInfoNV* pInfo,
                                                     const RtrHostGeometry* pHostGeometries,
                                                     RtrAccelerationStructure dst, void* pMemory,
                                                     const VkAllocationCallbacks* pAllocator);

/* Clone or compact. dst must be large enough: for COMPACT created with the
 * compactedSize that the query returned. Only the device knows that size: a COMPACT into
 * less leaves a null structure (every ray misses it; an instance of it is a bad one, see
 * RTC_HDR_BAD_INSTANCE), whose header says in RTC_HDR_SIZE_QUADS how many quads it needs.
 * Both must be in the same heap, or both be bound to buffers.
 * Errors: VALIDATION_FAILED for types, heaps, modes, and a clone into less than its source has.
 * Counterpart: vkCmdCopyAccelerationStructureNV. Stage COMPUTE_SHADER. */
RTR_API VkResult rtrCmdCopyAccelerationStructure(RtrRecorder recorder, RtrAccelerationStructure dst,
                                                 RtrAccelerationStructure src,
                                                 VkCopyAccelerationStructureModeNV mode);

/* Writes one uint64_t per structure at dstOffset (a multiple of 8) of a buffer with
 * STORAGE usage. queryType is VK_QUERY_TYPE_ACCELERATION_STRUCTURE_COMPACTED_SIZE_NV (or
 * _KHR: bytes after compaction), _SIZE_KHR (bytes of the object), _SERIALIZATION_SIZE_KHR
 * (bytes of its blob) or _SERIALIZATION_BOTTOM_LEVEL_POINTERS_KHR (handles in its blob).
 * Written in COMPUTE_SHADER; the structures are read there and must have been built.
 * Counterpart: vkCmdWriteAccelerationStructuresPropertiesNV and -KHR, with a buffer in
 * place of the query pool. */
RTR_API VkResult rtrCmdWriteAccelerationStructuresProperties(
    RtrRecorder recorder, uint32_t accelerationStructureCount,
    const RtrAccelerationStructure* pAccelerationStructures, VkQueryType queryType, VkBuffer dstBuffer,
    VkDeviceSize dstOffset);

/* ---- Serialisation ------------------------------------------------------------------
 * A structure as bytes that can be kept and given back to the same device, driver and
 * version of rtc. The blob has KHR's layout: driver UUID and compatibility UUID (16 bytes
 * each), uint64_t serializedSize, deserializedSize, handleCount; at byte 56 the handles of
 * the bottom levels (one an instance, in order; 0 for inactive ones), which the application
 * replaces by those of the bottom levels in their new places; then data of ours. Structures
 * of both addressing modes can be read into either. */

#define RTR_SERIALIZED_HANDLES_OFFSET 56u /* bytes */

/* Writes `src` into a blob at dstOffset (a multiple of 256) of a STORAGE buffer. dstSize:
 * bytes there are for it, at least what the query SERIALIZATION_SIZE_KHR answered; when the
 * blob does not fit, its UUIDs are 0 and nothing reads it. Stage COMPUTE_SHADER.
 * Counterpart: vkCmdCopyAccelerationStructureToMemoryKHR. */
RTR_API VkResult rtrCmdCopyAccelerationStructureToMemory(RtrRecorder recorder, RtrAccelerationStructure src,
                                                         VkBuffer dstBuffer, VkDeviceSize dstOffset,
                                                         VkDeviceSize dstSize);
/* Makes `dst` of a blob of srcSize bytes at srcOffset (a multiple of 256) of a STORAGE
 * buffer. dst was created with compactedSize = the blob's deserializedSize (or larger) and
 * the type of what was serialised. Bottom levels named by the blob's handles must be there
 * before; an instance whose handle leads nowhere is never hit. A blob that the device cannot
 * take (another version, another type, damaged sizes) leaves a null structure: every ray
 * misses it. So ask rtrGetSerializedAccelerationStructureInfo first. Stage COMPUTE_SHADER.
 * Counterpart: vkCmdCopyMemoryToAccelerationStructureKHR. */
RTR_API VkResult rtrCmdCopyMemoryToAccelerationStructure(RtrRecorder recorder, RtrAccelerationStructure dst,
                                                         VkBuffer srcBuffer, VkDeviceSize srcOffset,
                                                         VkDeviceSize srcSize);

typedef struct RtrSerializedInfo {
    VkDeviceSize serializedSize;   /* bytes of the blob */
    VkDeviceSize deserializedSize; /* compactedSize of the structure to make of it */
    uint64_t handleCount;
} RtrSerializedInfo;

/* Reads a blob in host memory (dataSize bytes, or at least its first 56).
 * Errors: INCOMPATIBLE_DRIVER naming what differs (driver, device or rtc version);
 * VALIDATION_FAILED when it is no blob, or shorter than it says (dataSize > 56 only). */
RTR_API VkResult rtrGetSerializedAccelerationStructureInfo(RtrDevice device, const void* pData,
                                                           size_t dataSize, RtrSerializedInfo* pInfo);
/* Counterpart: vkGetDeviceAccelerationStructureCompatibilityKHR. pVersionData: the first 32
 * bytes of a blob. */
RTR_API void rtrGetDeviceAccelerationStructureCompatibility(
    RtrDevice device, const uint8_t* pVersionData, VkAccelerationStructureCompatibilityKHR* pCompatibility);

/* ---- Copies on the host ---------------------------------------------------------------
 * The same on memory that the host sees: pDstMemory and pSrcMemory are the places of structures in
 * mapped memory (where they are bound), or copies of as many bytes elsewhere. The device has
 * finished writing what is read, and what is written is made visible to it as any host write is.
 * Thread-safe for different destinations. */

/* Clone or compact. Counterpart: vkCopyAccelerationStructureKHR.
 * Errors: VALIDATION_FAILED for memory that holds no built structure, types, heaps, sizes. */
RTR_API VkResult rtrCopyAccelerationStructureOnHost(RtrDevice device, RtrAccelerationStructure dst,
                                                    void* pDstMemory, RtrAccelerationStructure src,
                                                    const void* pSrcMemory,
                                                    VkCopyAccelerationStructureModeNV mode);

/* Writes a blob (dataSize bytes, at least what the query SERIALIZATION_SIZE answers) as
 * rtrCmdCopyAccelerationStructureToMemory does. Counterpart: vkCopyAccelerationStructureToMemoryKHR.
 * Errors: VALIDATION_FAILED for memory that holds no built structure, or too few bytes. */
RTR_API VkResult rtrCopyAccelerationStructureToMemoryOnHost(RtrDevice device, RtrAccelerationStructure src,
                                                            const void* pSrcMemory, size_t dataSize,
                                                            void* pData);

/* Makes a bottom level of a blob; top levels are read on the device, which sees their bottom
 * levels. Counterpart: vkCopyMemoryToAccelerationStructureKHR.
 * Errors: those of rtrGetSerializedAccelerationStructureInfo; VALIDATION_FAILED for top levels,
 * damaged blobs, and a dst that is too small. */
RTR_API VkResult rtrCopyMemoryToAccelerationStructureOnHost(RtrDevice device, size_t dataSize,
                                                            const void* pData, RtrAccelerationStructure dst,
                                                            void* pDstMemory);

/* Writes one uint64_t per structure, `stride` bytes apart, as
 * rtrCmdWriteAccelerationStructuresProperties does. ppMemory: the memory of each.
 * Counterpart: vkWriteAccelerationStructuresPropertiesKHR.
 * Errors: FEATURE_NOT_PRESENT for other queries; VALIDATION_FAILED for memory that holds no built
 * structure, or too few bytes for the answers. */
RTR_API VkResult rtrWriteAccelerationStructuresPropertiesOnHost(
    RtrDevice device, uint32_t accelerationStructureCount,
    const RtrAccelerationStructure* pAccelerationStructures, const void* const* ppMemory,
    VkQueryType queryType, size_t dataSize, void* pData, size_t stride);

/* ---- Pipelines ---------------------------------------------------------------------- */

typedef struct RtrRayTracingPipelineCreateInfo {
    const void* pNext;           /* must be NULL */
    VkPipelineCreateFlags flags; /* e.g. DISABLE_OPTIMIZATION, DEFER_COMPILE_NV; no DERIVATIVE */
    const uint32_t* pCode;       /* a module that rtc linked, with its reflection */
    size_t codeSize;             /* bytes */
    /* The application's set layouts, 0 to setLayoutCount-1. Ray tracing descriptors
     * have stageFlags with COMPUTE; acceleration structures are STORAGE_BUFFER. When the
     * module's reserved set is one of these, that layout must contain the bindings of
     * rtrGetReservedBindings; otherwise the runtime adds its own set. VK_NULL_HANDLE
     * entries become empty layouts. */
    uint32_t setLayoutCount;
    const VkDescriptorSetLayout* pSetLayouts;
    uint32_t pushConstantRangeCount;
    const VkPushConstantRange* pPushConstantRanges; /* stageFlags are taken as COMPUTE */
    /* Specialisation of the application's constants, by the ids in the module's
     * reflection. Ids from RTC_SPEC_BASE are the runtime's; giving one is an error. */
    const VkSpecializationInfo* pSpecializationInfo;
    const RtrTraceOptions* pOptions; /* NULL: as the device recommends */
} RtrRayTracingPipelineCreateInfo;

/* Counterpart: vkCreateRayTracingPipelinesNV (one pipeline a call).
 * Checks the module's ABI version (VK_ERROR_INCOMPATIBLE_DRIVER), its limits by name
 * (descriptors of one stage: all ray tracing stages are one compute shader now), that its
 * reflection is whole, and that the device has what it needs: VK_ERROR_FEATURE_NOT_PRESENT with
 * a message for each missing feature ("shaderFloat64"), extension, subgroup operation or version
 * of SPIR-V, before Vulkan sees the module. See RtrDeviceCreateInfo::pDeviceCreateInfo. */
RTR_API VkResult rtrCreateRayTracingPipeline(RtrDevice device, VkPipelineCache pipelineCache,
                                             const RtrRayTracingPipelineCreateInfo* pCreateInfo,
                                             const VkAllocationCallbacks* pAllocator, RtrPipeline* pPipeline);
/* The device has finished with it. NULL is ignored. Counterpart: vkDestroyPipeline. */
RTR_API void rtrDestroyPipeline(RtrDevice device, RtrPipeline pipeline,
                                const VkAllocationCallbacks* pAllocator);

/* Compiles a pipeline that was created with VK_PIPELINE_CREATE_DEFER_COMPILE_BIT_NV, with the
 * pipeline cache given then; until then launches with it are errors. The stages are one
 * shader, so any `shader` compiles all of it, and later calls do nothing. pAllocator: as
 * given to the creation. May run in another thread than the creation; not twice at once for
 * one pipeline. Counterpart: vkCompileDeferredNV. */
RTR_API VkResult rtrCompileDeferred(RtrDevice device, RtrPipeline pipeline, uint32_t shader,
                                    const VkAllocationCallbacks* pAllocator);

/* The stack is part of the compiled shader, sized by --max-recursion-depth and
 * --max-callable-depth: for general groups its bytes a lane (0 when the pipeline needs none),
 * 0 for hit groups. Counterpart: vkGetRayTracingShaderGroupStackSizeKHR. */
RTR_API VkDeviceSize rtrGetRayTracingShaderGroupStackSize(RtrDevice device, RtrPipeline pipeline,
                                                          uint32_t group,
                                                          VkShaderGroupShaderKHR groupShader);
/* Remembered until the next begin; launches of pipelines whose stack is larger are then
 * errors. Nothing needs it. Counterpart: vkCmdSetRayTracingPipelineStackSizeKHR. */
RTR_API VkResult rtrCmdSetRayTracingPipelineStackSize(RtrRecorder recorder, uint32_t pipelineStackSize);

/* dataSize >= groupCount * 32. Counterpart: vkGetRayTracingShaderGroupHandlesNV. */
RTR_API VkResult rtrGetRayTracingShaderGroupHandles(RtrDevice device, RtrPipeline pipeline,
                                                    uint32_t firstGroup, uint32_t groupCount, size_t dataSize,
                                                    void* pData);

typedef struct RtrPipelineInfo {
    uint32_t moduleFlags; /* RTC_MODULE_* */
    uint32_t groupCount;
    uint32_t stateCount;
    uint32_t maxRecursionDepth;
    uint32_t maxCallableDepth;
    uint32_t stackWords;
    uint32_t scratchWords; /* words a lane in launch scratch */
    uint32_t payloadWords;
    uint32_t attributeWords;
    uint32_t callableWords;
    uint32_t reservedSet;
    uint32_t reservedBinding;
    uint32_t usedBindings;       /* bit n: RTC_BINDING n */
    VkBool32 reservedInAppSet;   /* the reserved bindings are in one of the application's sets */
    RtrTraceOptions options;     /* in force; no defaults */
    const char* pReflectionJson; /* UTF-8, not terminated; lives as long as the pipeline */
    size_t reflectionJsonSize;
    VkPipelineLayout layout; /* the runtime's; for debugging and descriptor update templates */
    VkPipeline pipeline;
} RtrPipelineInfo;

/* What the pipeline's module says of itself, and the Vulkan objects made of it. No counterpart. */
RTR_API void rtrGetPipelineInfo(RtrPipeline pipeline, RtrPipelineInfo* pInfo);

/* ---- Reserved bindings inside a set of the application (rtc --reserved=SET.BINDING) -- */

/* The bindings to append to the layout of the set the module names. Two-call idiom:
 * pBindings NULL returns the count (at most 9); *pSet receives the set index. The
 * dispatch parameters are a UNIFORM_BUFFER_DYNAMIC, so such a set cannot be
 * update-after-bind. Works on module words: the pipeline does not exist yet. */
RTR_API VkResult rtrGetReservedBindings(RtrDevice device, const uint32_t* pCode, size_t codeSize,
                                        uint32_t* pSet, uint32_t* pBindingCount,
                                        VkDescriptorSetLayoutBinding* pBindings);

typedef struct RtrReservedDescriptors {
    RtrHeap heap;
    RtrRecorder recorder;                                         /* its control region is bound */
    VkBuffer raygenBuffer, missBuffer, hitBuffer, callableBuffer; /* SBT buffers, bound whole; NULL: none */
    VkBuffer launchScratch; /* may be VK_NULL_HANDLE when scratchWords is 0 */
    VkDeviceSize launchScratchOffset, launchScratchSize;
} RtrReservedDescriptors;

/* Writes them into `set` (vkUpdateDescriptorSets). Launches that use the set must then
 * use these SBT buffers, heap and scratch. */
RTR_API VkResult rtrWriteReservedDescriptors(RtrDevice device, RtrPipeline pipeline, VkDescriptorSet set,
                                             const RtrReservedDescriptors* pDescriptors);

/* ---- Shader binding table helper ------------------------------------------------------ */

#define RTR_NULL_GROUP 0xffffffffu

typedef struct RtrSbtRecord {
    uint32_t group;    /* index of a group of the pipeline; RTR_NULL_GROUP: an all-zero handle */
    uint32_t dataSize; /* bytes of application data after the handle */
    const void* pData; /* NULL with dataSize > 0: space is reserved and zeroed */
} RtrSbtRecord;

typedef struct RtrSbtRegion {
    VkDeviceSize offset; /* from the start of the table */
    VkDeviceSize stride; /* of the records; 0 for an empty region */
    VkDeviceSize size;   /* recordCount * stride */
} RtrSbtRegion;

typedef struct RtrSbtInfo {
    uint32_t raygenCount;
    const RtrSbtRecord* pRaygen; /* each one starts at a multiple of 64: add index * stride to the offset */
    uint32_t missCount;
    const RtrSbtRecord* pMiss;
    uint32_t hitCount;
    const RtrSbtRecord* pHit;
    uint32_t callableCount;
    const RtrSbtRecord* pCallable;
} RtrSbtInfo;

typedef struct RtrSbtLayout {
    RtrSbtRegion raygen, miss, hit, callable;
    VkDeviceSize size; /* of the whole table */
} RtrSbtLayout;

/* Strides, offsets and sizes of a table that holds these records; every region starts
 * at a multiple of 64, the stride of a region fits its largest record.
 * Errors: VALIDATION_FAILED when a record is larger than 4096 bytes. */
RTR_API VkResult rtrGetSbtLayout(RtrDevice device, const RtrSbtInfo* pInfo, RtrSbtLayout* pLayout);
/* Writes handles and data into `pData` (pLayout->size bytes of mapped or host memory).
 * Errors: VALIDATION_FAILED for a group the pipeline does not have. */
RTR_API VkResult rtrWriteSbt(RtrDevice device, RtrPipeline pipeline, const RtrSbtInfo* pInfo,
                             const RtrSbtLayout* pLayout, void* pData);

/* ---- Trace ---------------------------------------------------------------------------- */

/* Counterpart: vkCmdBindPipeline(RAY_TRACING). */
RTR_API VkResult rtrCmdBindPipeline(RtrRecorder recorder, RtrPipeline pipeline);
/* Counterpart: vkCmdBindDescriptorSets(RAY_TRACING). Remembered, and bound at each trace
 * with the layout of the pipeline of that moment. A set that holds the reserved bindings
 * must be the last of its call, and the dynamic offsets given here are those of the
 * application's own bindings only. */
RTR_API VkResult rtrCmdBindDescriptorSets(RtrRecorder recorder, uint32_t firstSet,
                                          uint32_t descriptorSetCount, const VkDescriptorSet* pDescriptorSets,
                                          uint32_t dynamicOffsetCount, const uint32_t* pDynamicOffsets);
/* Counterpart: vkCmdPushConstants. offset and size are multiples of 4. Remembered. */
RTR_API VkResult rtrCmdPushConstants(RtrRecorder recorder, uint32_t offset, uint32_t size,
                                     const void* pValues);
/* The heap whose acceleration structures the following launches use. Modules linked for
 * address mode need none and ignore it. */
RTR_API VkResult rtrCmdSetHeap(RtrRecorder recorder, RtrHeap heap);
/* Device memory for suspended lanes and deep stacks; see rtrGetLaunchScratchSize.
 * offset: a multiple of 256. Launches that use the same scratch need a barrier between
 * them (COMPUTE_SHADER, SHADER_READ | SHADER_WRITE). */
RTR_API VkResult rtrCmdSetLaunchScratch(RtrRecorder recorder, VkBuffer buffer, VkDeviceSize offset,
                                        VkDeviceSize size);
/* maxTileLanes: lanes of one dispatch, against driver watchdogs; 0: no limit.
 * maxRounds: dispatches of a resumable launch after which lanes still suspended are a
 * launch error (RTC_LAUNCH_ERROR_UNFINISHED); 0: 64. An unused round costs an empty
 * indirect dispatch. */
RTR_API VkResult rtrCmdSetLaunchLimits(RtrRecorder recorder, uint64_t maxTileLanes, uint32_t maxRounds);

/* Bytes of launch scratch the pipeline needs with the given extent. *pMinimum (may be
 * NULL) is what one workgroup needs: any size between the two works, in more tiles.
 * Both 0 when the module needs none. */
RTR_API VkDeviceSize rtrGetLaunchScratchSize(RtrDevice device, RtrPipeline pipeline, uint32_t width,
                                             uint32_t height, uint32_t depth, VkDeviceSize* pMinimum);

/* Tiles such a launch is cut into with this much launch scratch and this limit of lanes a
 * tile (rtrCmdSetLaunchLimits; 0: none), for rtrGetRecorderControlSize. 1 when nothing
 * limits it, 0 when the launch is empty or too large to be recorded. */
RTR_API uint32_t rtrGetLaunchTileCount(RtrDevice device, RtrPipeline pipeline, uint32_t width,
                                       uint32_t height, uint32_t depth, VkDeviceSize scratchSize,
                                       uint64_t maxTileLanes);

/* Counterpart: vkCmdTraceRaysNV, same arguments. Buffers need STORAGE usage; offsets are
 * multiples of 64, strides of 32 and at most 4096; a NULL buffer is an empty region. Of
 * each buffer at most maxStorageBufferRange bytes from the offset can be reached
 * (whole-buffer range: use rtrCmdTraceRaysRegions for a part of a larger buffer).
 * Zero extents trace nothing. The dispatch runs in COMPUTE_SHADER; parameters and the
 * control block are written by the runtime in TRANSFER with its own barriers.
 * width * height * depth, rounded up to whole tiles of 8x4, must be below 2^32. */
RTR_API VkResult rtrCmdTraceRays(RtrRecorder recorder, VkBuffer raygenBuffer, VkDeviceSize raygenOffset,
                                 VkBuffer missBuffer, VkDeviceSize missOffset, VkDeviceSize missStride,
                                 VkBuffer hitBuffer, VkDeviceSize hitOffset, VkDeviceSize hitStride,
                                 VkBuffer callableBuffer, VkDeviceSize callableOffset,
                                 VkDeviceSize callableStride, uint32_t width, uint32_t height,
                                 uint32_t depth);

/* VkStridedDeviceAddressRegionKHR with a buffer in place of the address. */
typedef struct RtrStridedBufferRegion {
    VkBuffer buffer; /* VK_NULL_HANDLE: empty */
    VkDeviceSize offset;
    VkDeviceSize stride;
    VkDeviceSize size;
} RtrStridedBufferRegion;

/* Counterpart: vkCmdTraceRaysKHR. NULL regions are empty; raygen must not be. */
RTR_API VkResult rtrCmdTraceRaysRegions(RtrRecorder recorder, const RtrStridedBufferRegion* pRaygen,
                                        const RtrStridedBufferRegion* pMiss,
                                        const RtrStridedBufferRegion* pHit,
                                        const RtrStridedBufferRegion* pCallable, uint32_t width,
                                        uint32_t height, uint32_t depth);

/* Counterpart: vkCmdTraceRaysIndirectKHR, with a buffer and offset (STORAGE usage; a
 * multiple of 4) that hold a VkTraceRaysIndirectCommandKHR, read in COMPUTE_SHADER with
 * SHADER_READ. The largest extents size scratch, tiles and the dispatch; extents with more
 * lanes than those trace nothing and set the launch error UNFINISHED. */
RTR_API VkResult rtrCmdTraceRaysIndirect(RtrRecorder recorder, const RtrStridedBufferRegion* pRaygen,
                                         const RtrStridedBufferRegion* pMiss,
                                         const RtrStridedBufferRegion* pHit,
                                         const RtrStridedBufferRegion* pCallable, VkBuffer indirectBuffer,
                                         VkDeviceSize indirectOffset, uint32_t maxWidth, uint32_t maxHeight,
                                         uint32_t maxDepth);

/* ---- Launch errors ----------------------------------------------------------------------
 * Each launch has a control block in the recorder's control region: the shader counts
 * what went wrong there (depth overflows, bad handles, broken assumptions, lanes that
 * did not finish). The application reads the block when the launch is complete, from
 * mapped memory (with a COMPUTE_SHADER|TRANSFER -> HOST barrier, or after the fence and
 * an invalidate if not coherent) or after copying it to a readable buffer. */

/* Launches recorded since the last reset or retire. */
RTR_API uint32_t rtrGetLaunchCount(RtrRecorder recorder);
/* Where launch `index`'s block lies (buffer, offset in the buffer, bytes); only its first
 * RTR_LAUNCH_ERROR_BYTES are needed to decode. */
RTR_API VkResult rtrGetLaunchErrorLocation(RtrRecorder recorder, uint32_t index,
                                           VkDescriptorBufferInfo* pInfo);
#define RTR_LAUNCH_ERROR_BYTES 32u

typedef struct RtrLaunchError {
    uint32_t code;           /* RTC_LAUNCH_ERROR_*; the first one seen */
    uint32_t count;          /* events of all kinds */
    uint32_t launchId[3];    /* of the first */
    uint32_t detail[2];      /* by code, see abi.h */
    uint32_t suspendedLanes; /* lanes (an upper bound) that did not finish */
} RtrLaunchError;

/* `words`: the first 8 words of a control block. Returns VK_SUCCESS when there was no
 * error, VK_ERROR_UNKNOWN (with *pError filled) when there was one. */
RTR_API VkResult rtrDecodeLaunchError(const uint32_t* words, RtrLaunchError* pError);
/* One line of English for an error; truncated to `size` bytes, always terminated. */
RTR_API void rtrFormatLaunchError(const RtrLaunchError* pError, char* text, size_t size);
/* The same from mapped memory: `pMapped` is the mapped start of the control BUFFER.
 * Reports an error through the messenger too. */
RTR_API VkResult rtrGetLaunchError(RtrRecorder recorder, uint32_t index, const void* pMapped,
                                   RtrLaunchError* pError);

/* ---- Float probe ------------------------------------------------------------------------
 * What the device's float arithmetic does, for rtc-info and bug reports. */

typedef struct RtrFloatProbe {
    VkBool32 contractsUnmarked; /* a*b+c without NoContraction is fused */
    VkBool32 contractsPrecise;  /* with NoContraction: must be false, or watertightness is lost */
    VkBool32 fmaIsFused;
    VkBool32 flushesDenormals;    /* denormal results become 0 */
    VkBool32 roundsToNearestEven; /* add and mul */
    VkBool32 exactDivision;       /* 1/3, 1/7, ... correctly rounded */
    VkBool32 keepsSignedZero;
    VkBool32 nanFailsComparison; /* NaN < 1 and NaN >= 1 are both false */
} RtrFloatProbe;
#define RTR_FLOAT_PROBE_BYTES 64u

/* Records the probe; writes RTR_FLOAT_PROBE_BYTES at dstOffset (multiple of 256) of a
 * STORAGE buffer, in COMPUTE_SHADER. */
RTR_API VkResult rtrCmdProbeFloat(RtrRecorder recorder, VkBuffer dstBuffer, VkDeviceSize dstOffset);
/* What those bytes, read after the device has finished, mean. No counterpart. */
RTR_API void rtrDecodeFloatProbe(const void* pData, RtrFloatProbe* pProbe);

#ifdef __cplusplus
}
#endif

#endif /* RTC_RUNTIME_H_ */
