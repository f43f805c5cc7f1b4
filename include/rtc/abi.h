/* The contract between rtc's compiler, its runtime and its GLSL kernels.
 *
 * This one file is included by C (runtime), C++ (compiler) and GLSL (traversal
 * and build kernels), so that a layout is written down exactly once. Anything
 * in it that changes meaning bumps RTC_ABI_VERSION; modules and runtimes whose
 * versions differ refuse each other with VK_ERROR_INCOMPATIBLE_DRIVER.
 *
 * Units: a "quad" is 16 bytes (one uvec4, one RGBA32UI texel). Acceleration
 * structure memory is addressed in quads.
 */
#ifndef RTC_ABI_H_
#define RTC_ABI_H_

#define RTC_ABI_VERSION 2u

/* ---- Acceleration structures ------------------------------------------------
 *
 * An acceleration structure (AS) is one contiguous, relocatable block:
 *
 *   header (RTC_AS_HEADER_QUADS)
 *   nodes  (RTC_NODE_QUADS each; node 0 is the root)           at HDR_NODES
 *   slots  (triangles, AABBs: leaves point here)               at HDR_SLOTS
 *     -- or, in a top level, instance records in instance order
 *
 * All references inside the block are relative to its base, except the
 * references of instance records to their bottom-level structures.
 * The base of a block is, in address mode, its device address. In heap mode its lower
 * half is the distance from the start of the AS heap in quads, its upper half the heap's
 * id: RTC_HEAP_TAG | 1 for the first heap of an RtrDevice, and so on, so that neither a
 * structure of another heap nor one at a device address is taken for it. Base 0 means
 * "null acceleration structure": every ray misses it. Heap quad 0 is never given out.
 */
#define RTC_HEAP_TAG 0x80000000u /* no device address has it */
#define RTC_QUAD_BYTES 16u
#define RTC_AS_ALIGNMENT 256u /* bytes */
#define RTC_AS_HEADER_QUADS 16u /* 256 bytes */

/* Header words (uint index from the base). The AS descriptor of an application
 * is a storage buffer onto this header. */
#define RTC_HDR_SELF_LO 0u /* base of this AS (0: null or never built) */
#define RTC_HDR_SELF_HI 1u
#define RTC_HDR_MAGIC 2u /* RTC_AS_MAGIC */
#define RTC_HDR_KIND 3u /* RTC_AS_KIND_* */
#define RTC_HDR_FACTS 4u /* RTC_FACT_* */
#define RTC_HDR_NODE_FORMAT 5u /* RTC_NODE_FORMAT_* */
#define RTC_HDR_MAX_DEPTH 6u /* longest root-to-leaf path, in nodes */
#define RTC_HDR_ACTIVE_COUNT 7u /* primitives or instances that can be hit */
#define RTC_HDR_BOUNDS_MIN 8u /* 3 floats; min > max when empty */
#define RTC_HDR_GEOMETRY_COUNT 11u
#define RTC_HDR_BOUNDS_MAX 12u /* 3 floats */
#define RTC_HDR_SIZE_QUADS 15u /* quads in use: the compacted size */
#define RTC_HDR_NODES 16u /* quads from the base to node 0 */
#define RTC_HDR_SLOTS 17u /* quads from the base to slot 0 / instance 0 */
#define RTC_HDR_NODE_COUNT 18u
#define RTC_HDR_SLOT_COUNT 19u
#define RTC_HDR_BUILD_FLAGS 20u /* VkBuildAccelerationStructureFlagsNV */
#define RTC_HDR_PRIMITIVE_COUNT 21u /* as given to the build, inactive ones included */
#define RTC_HDR_FIRST_OFFENDER 22u /* first instance/primitive that breaks a fact; ~0 if none */
#define RTC_HDR_SINGLE_INSTANCE 23u /* top level with one active instance: its index + 1; otherwise 0 */
#define RTC_HDR_OFFENDERS 24u /* 12 words, by the bit number of the fact: see RTC_OFFENDER_* */
#define RTC_HDR_OFFENDERS_END 36u
#define RTC_HDR_BAD_INSTANCE 36u /* top level: 1 + the first instance whose reference led to no structure; 0: none */
#define RTC_HDR_BAD_UPDATE 37u /* 1 + the first primitive or instance that an update made active or inactive; 0: none; RTC_BAD_UPDATE_* */
#define RTC_BAD_UPDATE_ACTIVE 0xffffffffu /* more or fewer are active than were; not known which */
#define RTC_BAD_UPDATE_COUNTS 0xfffffffeu /* it was built with other counts, or without ALLOW_UPDATE: left as it was */

/* A word of RTC_HDR_OFFENDERS in a top level: the first instance for which the fact does not
 * hold (for RTC_FACT_HAS_*: the first instance of that kind), and, where it is a geometry's
 * doing, the first such geometry of its bottom level (at most 254); for RTC_FACT_SINGLE_LEVEL
 * the number of active instances. In a bottom level: the geometry alone. ~0: none. */
#define RTC_OFFENDER_INSTANCE_SHIFT 8u
#define RTC_OFFENDER_GEOMETRY_MASK 0xffu
#define RTC_OFFENDER_NO_GEOMETRY 0xffu

#define RTC_AS_MAGIC (0x52540000u | RTC_ABI_VERSION)
#define RTC_AS_KIND_TOP 0u
#define RTC_AS_KIND_BOTTOM 1u

/* Facts, true for the whole structure. */
#define RTC_FACT_AABBS 1u /* leaves are AABBs, not triangles */
#define RTC_FACT_ALL_OPAQUE 2u /* every geometry (and, in a TLAS, every effective instance) is opaque */
#define RTC_FACT_IDENTITY_TRANSFORMS 4u /* every instance transform is the identity */
#define RTC_FACT_FULL_MASKS 8u /* every instance mask is 0xff */
#define RTC_FACT_NO_INSTANCE_FLAGS 16u /* every instance's flags are 0 */
#define RTC_FACT_HAS_TRIANGLES 32u /* TLAS: some instance is of triangles */
#define RTC_FACT_HAS_AABBS 64u /* TLAS: some instance is of AABBs */
#define RTC_FACT_ADDRESSES 128u /* address mode: SELF and instance references are device addresses */
#define RTC_FACT_SINGLE_LEVEL 256u /* TLAS: one active instance, or none */

/* Assumptions of a module (RtcModuleHeader.assumptions) are bits of facts. These facts say that
 * something is there; the assumption is that it is not: HAS_AABBS set means "triangles only".
 * Broken assumptions of a top level: assumptions & ~(facts ^ RTC_FACTS_OF_ABSENCE). */
#define RTC_FACTS_OF_ABSENCE (RTC_FACT_HAS_TRIANGLES | RTC_FACT_HAS_AABBS)

/* Binary node, 64 bytes, both children's boxes (conservative):
 *   quad 0: child0.min.xyz, child 0 reference
 *   quad 1: child0.max.xyz, child 1 reference
 *   quad 2: child1.min.xyz, 0
 *   quad 3: child1.max.xyz, 0
 * Reference: RTC_REF_LEAF clear: index of an inner node.
 *   Set: bits 28..30 = number of slots (0: empty child, never entered),
 *        bits 0..27 = first slot (BLAS) or instance index (TLAS, count 1). */
#define RTC_NODE_FORMAT_BVH2 0u
#define RTC_NODE_QUADS 4u
#define RTC_REF_LEAF 0x80000000u
#define RTC_REF_COUNT_SHIFT 28u
#define RTC_REF_COUNT_MASK 7u
#define RTC_REF_INDEX_MASK 0x0fffffffu
#define RTC_REF_EMPTY 0x80000000u
#define RTC_MAX_LEAF_SLOTS 4u
/* Builders keep every root-to-leaf path at or below this many inner nodes. */
#define RTC_MAX_DEPTH 60u
/* Traversal keeps one stack for both levels. */
#define RTC_TRAVERSAL_STACK 64u

/* Triangle slot, 48 bytes:
 *   quad 0: v0.xyz, primitive index (within its geometry)
 *   quad 1: v1.xyz, geometry index | RTC_SLOT_* flags
 *   quad 2: v2.xyz, 0
 * Vertices are in object space, after the geometry's transform.
 * AABB slot, 32 bytes:
 *   quad 0: min.xyz, primitive index
 *   quad 1: max.xyz, geometry index | RTC_SLOT_* flags */
#define RTC_TRIANGLE_QUADS 3u
#define RTC_AABB_QUADS 2u
#define RTC_SLOT_OPAQUE 0x80000000u
#define RTC_SLOT_NO_DUPLICATE 0x40000000u
#define RTC_SLOT_GEOMETRY_MASK 0x00ffffffu

/* Instance record, 128 bytes, in the order of the instance buffer:
 *   quads 0..2: world-to-object, 3 rows of 4 (row r: m[r][0..2], translation)
 *   quads 3..5: object-to-world, 3 rows of 4 (bit-exact copy of the input)
 *   quad 6: BLAS base low, BLAS base high, custom index | mask << 24,
 *           SBT record offset | instance flags << 24
 *   quad 7: BLAS facts (and RTC_FACT_IDENTITY_TRANSFORMS where this instance's transform
 *           is the identity), quads from BLAS base to its slots,
 *           quads from BLAS base to its nodes, 0
 * An inactive instance (reference 0) has BLAS base 0. */
#define RTC_INSTANCE_QUADS 8u
#define RTC_INSTANCE_TRIANGLE_CULL_DISABLE 1u
#define RTC_INSTANCE_TRIANGLE_FRONT_CCW 2u
#define RTC_INSTANCE_FORCE_OPAQUE 4u
#define RTC_INSTANCE_FORCE_NO_OPAQUE 8u

/* ---- Shader binding table --------------------------------------------------
 * A handle is 32 bytes = 8 words, all zero for a null group:
 *   word 0: entry state of the general or closest-hit shader (0: none)
 *   word 1: entry state of the any-hit shader (0: none)
 *   word 2: entry state of the intersection shader (0: none)
 *   word 3: RTC_GROUP_* kind + 1
 *   words 4..6: 0
 *   word 7: pipeline identity (hash of the module), for checking
 * Application data of a record follows its handle. */
#define RTC_HANDLE_BYTES 32u
#define RTC_HANDLE_WORDS 8u
#define RTC_SBT_BASE_ALIGNMENT 64u
#define RTC_SBT_HANDLE_ALIGNMENT 32u
#define RTC_SBT_MAX_STRIDE 4096u
#define RTC_GROUP_GENERAL 0u
#define RTC_GROUP_TRIANGLES 1u
#define RTC_GROUP_PROCEDURAL 2u

/* ---- Reserved descriptor bindings, relative to the reserved base binding -----
 * Only those a module uses are declared in it (RtcModuleHeader.used_bindings). */
#define RTC_BINDING_PARAMS 0u /* uniform buffer: dispatch parameters */
#define RTC_BINDING_HEAP_TEXELS 1u /* uniform texel buffer RGBA32UI: AS heap */
#define RTC_BINDING_HEAP 2u /* storage buffer uvec4[]: AS heap */
#define RTC_BINDING_SBT_RAYGEN 3u /* storage buffers uint[]: SBT regions */
#define RTC_BINDING_SBT_MISS 4u
#define RTC_BINDING_SBT_HIT 5u
#define RTC_BINDING_SBT_CALLABLE 6u
#define RTC_BINDING_CONTROL 7u /* storage buffer uint[]: launch error, resume counters */
#define RTC_BINDING_SCRATCH 8u /* storage buffer uint[]: suspended lanes, deep stacks */
#define RTC_BINDING_COUNT 9u

/* Specialisation constants of ours. */
#define RTC_SPEC_BASE 0x52540000u
#define RTC_SPEC_WORKGROUP_SIZE 0x52540000u /* x; y = z = 1; a multiple of 32; default 64 */
#define RTC_SPEC_FETCH 0x52540001u /* RTC_FETCH_*; default RTC_FETCH_TEXEL */
#define RTC_SPEC_WHILE_WHILE 0x52540002u /* 1: while-while loop form; default 0 */
#define RTC_SPEC_STEP_BUDGET 0x52540003u /* loop turns before a lane suspends; default ~0: never */
#define RTC_SPEC_SHARED_STACK 0x52540004u /* entries of traversal stack a lane keeps in shared memory; 0: none */
#define RTC_FETCH_TEXEL 0u
#define RTC_FETCH_STORAGE 1u

/* ---- Dispatch parameters: a std140 uniform block of uvec4[RTC_PARAM_QUADS] ----
 * Words 0..25 mirror VkTraceRaysIndirectCommand2KHR (without its last padding);
 * in heap mode its addresses are byte offsets into the bound SBT buffers. */
#define RTC_PARAM_QUADS 10u
#define RTC_PARAM_RAYGEN_OFFSET 0u /* + 1: high word */
#define RTC_PARAM_RAYGEN_SIZE 2u
#define RTC_PARAM_MISS_OFFSET 4u
#define RTC_PARAM_MISS_SIZE 6u
#define RTC_PARAM_MISS_STRIDE 8u
#define RTC_PARAM_HIT_OFFSET 10u
#define RTC_PARAM_HIT_SIZE 12u
#define RTC_PARAM_HIT_STRIDE 14u
#define RTC_PARAM_CALLABLE_OFFSET 16u
#define RTC_PARAM_CALLABLE_SIZE 18u
#define RTC_PARAM_CALLABLE_STRIDE 20u
#define RTC_PARAM_WIDTH 22u
#define RTC_PARAM_HEIGHT 23u
#define RTC_PARAM_DEPTH 24u
#define RTC_PARAM_LANE_BASE 26u /* first lane of this dispatch (tiled launches), see rtc_lane_to_pixel */
#define RTC_PARAM_LANE_COUNT 27u /* lanes of this dispatch, a multiple of 32 */
#define RTC_PARAM_ROUND 28u /* 0: lanes start; n: lanes resume from scratch */
#define RTC_PARAM_CONTROL_WORD 29u /* word in the control buffer where this launch's control block starts */
#define RTC_PARAM_SCRATCH_WORD 30u /* word in the scratch buffer where lane storage starts */
#define RTC_PARAM_HEAP_QUADS 31u /* size of the AS heap in quads, for checking traversal */
#define RTC_PARAM_FLAGS 32u /* RTC_LAUNCH_* */
#define RTC_PARAM_LIVE_TABLE 33u /* checking traversal: word in the control buffer where the table of live structures starts; 0: none */
#define RTC_PARAM_LIVE_COUNT 34u /* its entries: base low, high, quads of the object, 0; sorted by base */
#define RTC_PARAM_HEAP_ID 35u /* upper half of the bases in the heap that is set; 0: none */
#define RTC_LAUNCH_TILE_8X4 1u /* lanes walk 8x4 pixel tiles; otherwise rows */

/* Lanes: lane = LANE_BASE + gl_WorkGroupID (x + 65535 y, linearised) * workgroup
 * size + local index. With RTC_LAUNCH_TILE_8X4, 32 consecutive lanes are an 8x4 tile:
 *   tile = lane / 32, x = (tile % tilesX) * 8 + lane % 8,
 *   y = (tile / tilesX % tilesY) * 4 + lane / 8 % 4, z = tile / (tilesX * tilesY)
 * with tilesX = ceil(width / 8), tilesY = ceil(height / 4). Otherwise
 *   x = lane % W, y = lane / W % height, z = lane / (W * height), W = width rounded up to 32.
 * A lane outside width x height x depth does nothing. */
#define RTC_MAX_GROUPS_X 65535u

/* ---- Control block: per launch, in the control buffer ------------------------
 * Words relative to RTC_PARAM_CONTROL_WORD. */
#define RTC_CTRL_ERROR 0u /* RTC_LAUNCH_ERROR_*, the first one seen; 0: none */
#define RTC_CTRL_ERROR_COUNT 1u /* events, all kinds together */
#define RTC_CTRL_ERROR_LANE 2u /* 3 words: launch id of the first */
#define RTC_CTRL_ERROR_DETAIL 5u /* by kind: state id, record index, instance, ... */
#define RTC_CTRL_ERROR_DETAIL2 6u
#define RTC_CTRL_SUSPENDED 7u /* lanes still suspended after the last round */
#define RTC_CTRL_ARGS 8u /* 4 words a round: indirect dispatch x, y, z, and padding */
#define RTC_CTRL_HEADER_WORDS 8u

#define RTC_LAUNCH_ERROR_NONE 0u
#define RTC_LAUNCH_ERROR_RECURSION_DEPTH 1u /* a trace below the recursion limit was dropped */
#define RTC_LAUNCH_ERROR_CALLABLE_DEPTH 2u /* a callable below its limit was dropped */
#define RTC_LAUNCH_ERROR_BAD_HANDLE 3u /* SBT record holds no state of this module; detail: word read */
#define RTC_LAUNCH_ERROR_ABI 4u /* acceleration structure of another ABI version; detail: its magic */
#define RTC_LAUNCH_ERROR_ASSUMPTION 5u /* a compiled assumption is broken; detail: RTC_FACT_*, detail2: word of RTC_HDR_OFFENDERS */
#define RTC_LAUNCH_ERROR_UNFINISHED 6u /* lanes were still suspended when rounds ran out; detail: lanes */
#define RTC_LAUNCH_ERROR_STACK 7u /* internal: traversal or word stack overflow */
#define RTC_LAUNCH_ERROR_SBT_RANGE 8u /* validation: an SBT region ends behind its buffer; detail: bytes there */
#define RTC_LAUNCH_ERROR_BAD_INSTANCE 9u /* validation: detail: instance; detail2: structure of the declared scene, or RTC_ERROR_BUILT */
#define RTC_LAUNCH_ERROR_BAD_UPDATE 10u /* validation: detail: RTC_HDR_BAD_UPDATE; detail2 as for BAD_INSTANCE */
#define RTC_LAUNCH_ERROR_BAD_MEMORY 11u /* modules linked --checked: acceleration structure memory is damaged; detail: number read */
#define RTC_LAUNCH_ERROR_HEAP 12u /* a structure elsewhere than in the heap that is set; detail: upper half of its base; detail2: id of the heap that is set, 0 by device address */
/* DETAIL2 of BAD_MEMORY: what the number is, and the instance the ray was in (its lower bits; all ones: the top level). */
#define RTC_BAD_SHIFT 28u
#define RTC_BAD_INSTANCE_MASK 0x0fffffffu
#define RTC_BAD_ADDRESS 1u /* a quad beyond the heap */
#define RTC_BAD_HEADER 2u /* an instance (or ~0: the top level) whose structure's header cannot be one */
#define RTC_BAD_NODE 3u /* a node that the structure does not have */
#define RTC_BAD_SLOT 4u /* a slot that it does not have */
#define RTC_BAD_INSTANCE_INDEX 5u /* an instance that the top level does not have */
#define RTC_BAD_CYCLE 6u /* a node or instance that was visited before: nodes form no tree */
#define RTC_BAD_BASE 7u /* a base (its low word) where no structure is that is bound and not destroyed */
/* DETAIL2 of errors found in the table before the launch: this bit, the region (0 raygen, 1
 * miss, 2 hit, 3 callable), the record. */
#define RTC_ERROR_RECORD 0x80000000u
#define RTC_ERROR_REGION_SHIFT 28u
#define RTC_ERROR_RECORD_MASK 0x0fffffffu
/* DETAIL2 of BAD_INSTANCE: not of a declared scene but built in the same recording. */
#define RTC_ERROR_BUILT 0xffffffffu

/* ---- Reflection carried by a module ------------------------------------------
 * OpString "rtc.reflection:<index>/<count>:<base64>"; the decoded chunks joined
 * are RtcModuleHeader, RtcModuleGroup[group_count], then JSON text (json_bytes). */
#define RTC_MODULE_MAGIC 0x464d5452u /* "RTMF" */
#define RTC_MODULE_RESUMABLE 1u /* lanes can suspend: needs CONTROL and SCRATCH */
#define RTC_MODULE_ADDRESS_MODE 2u /* AS memory by device address */
#define RTC_MODULE_CHECKED 4u /* the traversal checks what it reads (RTC_LAUNCH_ERROR_BAD_MEMORY) */

#if defined(__cplusplus) || defined(__STDC_VERSION__)
#include <stdint.h>

typedef struct RtcModuleHeader {
    uint32_t magic; /* RTC_MODULE_MAGIC */
    uint32_t abi_version;
    uint32_t flags; /* RTC_MODULE_* */
    uint32_t identity; /* word 7 of this module's handles */
    uint32_t reserved_set;
    uint32_t reserved_binding;
    uint32_t used_bindings; /* bit n: RTC_BINDING n is declared */
    uint32_t group_count;
    uint32_t state_count;
    uint32_t max_recursion_depth;
    uint32_t max_callable_depth;
    uint32_t stack_words; /* word stack a lane, inside the shader */
    uint32_t scratch_words; /* words a lane needs in RTC_BINDING_SCRATCH; 0: none */
    uint32_t payload_words;
    uint32_t attribute_words;
    uint32_t callable_words;
    uint32_t json_bytes;
    uint32_t assumptions; /* bits of RTC_FACT_*: what scenes must be, see RTC_FACTS_OF_ABSENCE */
    uint32_t reserved[6];
} RtcModuleHeader;

typedef struct RtcModuleGroup {
    uint32_t kind; /* RTC_GROUP_* */
    uint32_t handle[RTC_HANDLE_WORDS];
} RtcModuleGroup;
#endif

#endif /* RTC_ABI_H_ */
