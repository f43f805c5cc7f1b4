/* What the build kernels and the C code that records them agree on. Included by
 * both C and GLSL; nothing here is visible outside the runtime. */
#ifndef RTR_BUILD_SHARED_H_
#define RTR_BUILD_SHARED_H_

#ifdef RTR_GLSL
#define RTR_UINT uint
#else
#include <stdint.h>
#define RTR_UINT uint32_t
#endif

#define RTR_GROUP 256u /* lanes of every build workgroup */

/* Set 0: inputs of one geometry. Set 1: the build's arrays. */
#define RTR_IN_DATA 0u      /* vertices, AABBs or instances, as words */
#define RTR_IN_INDEX 1u     /* indices, as words */
#define RTR_IN_TRANSFORM 2u /* 3x4 matrix */
#define RTR_IN_HEAP 3u      /* uniform texel buffer: AS heap */
#define RTR_IN_COUNT 4u

#define RTR_ARR_STATE 0u    /* RTR_ST_* words, then block sums and histograms */
#define RTR_ARR_LEAF_BOX 1u /* by primitive: min.xyz, active (0/1 as float); max.xyz, 0 */
#define RTR_ARR_NODE_BOX 2u /* by inner node: min.xyz, SAH cost; max.xyz, height | encoded height << 8 | primitives << 16 */
#define RTR_ARR_INFO 3u     /* by inner node: left, right, first slot, primitives (255: or more, once fitted) | collapsed << 31 */
#define RTR_ARR_PAIRS_A 4u  /* (Morton code, primitive), sorted after the sort */
#define RTR_ARR_PAIRS_B 5u
#define RTR_ARR_LINKS 6u    /* parents: of inner nodes, then of leaves by sorted position */
#define RTR_ARR_MARKS 7u    /* arrivals at inner nodes */
#define RTR_ARR_OUT 8u      /* by inner node: index of the encoded node */
#define RTR_ARR_SLOT_OF 9u  /* by primitive: sorted position, in the end its slot */
#define RTR_ARR_DST_NODES 10u
#define RTR_ARR_DST_SLOTS 11u
#define RTR_ARR_DST_HEADER 12u
#define RTR_ARR_COUNT 13u

/* LINKS of an update: parent << RTR_LINK_SHIFT, and: */
#define RTR_LINK_SHIFT 2u
#define RTR_LINK_TWO 2u   /* it has two inner children */
#define RTR_LINK_RIGHT 1u /* this is its second child */

/* Children of INFO: RTR_CHILD_LEAF | primitive, or an inner node. */
#define RTR_CHILD_LEAF 0x80000000u
#define RTR_COLLAPSED 0x80000000u
#define RTR_HEIGHT_MASK 0xffu
#define RTR_ENCODED_SHIFT 8u
#define RTR_COUNT_SHIFT 16u /* primitives, 255: or more */
#define RTR_HEIGHT_FREE 44u /* rotations may make nodes this high, in inner nodes */

/* State words. Floats that are reduced with atomics are order-preserving uints. */
#define RTR_ST_CENTER_MIN 0u /* 3: bounds of (min + max) of the active boxes */
#define RTR_ST_CENTER_MAX 3u
#define RTR_ST_ACTIVE 6u
#define RTR_ST_BROKEN 7u   /* RTC_FACT_* that do not hold */
#define RTR_ST_OFFENDER 8u
#define RTR_ST_HAS 9u      /* RTC_FACT_HAS_* */
#define RTR_ST_NODES 10u   /* encoded nodes */
#define RTR_ST_ROOT 11u    /* inner node that is the root */
#define RTR_ST_DEEP 12u    /* 1: deeper than RTC_MAX_DEPTH after rotating */
#define RTR_ST_BAD_INSTANCE 13u /* first instance whose reference leads to no structure; ~0: none */
#define RTR_ST_BAD_UPDATE 14u /* first primitive that an update made active or inactive; ~0: none */
#define RTR_ST_OFFENDERS 16u /* 12: words of RTC_HDR_OFFENDERS */
/* Levels of fitting passes (kernels/fit_list.glsl), RTR_FIT_LEVELS a pass. */
#define RTR_ST_LEVELS 64u
#define RTR_LEVEL_WORDS 4u
#define RTR_FIT_LEVELS 16u
#define RTR_FIT_PASSES 4u
#define RTR_ST_SUMS (RTR_ST_LEVELS + RTR_FIT_PASSES * RTR_FIT_LEVELS * RTR_LEVEL_WORDS) /* block sums and histograms start here */

#define RTR_SORT_ITEMS 8u
#define RTR_SORT_BLOCK (RTR_GROUP * RTR_SORT_ITEMS)
#define RTR_SORT_BITS 4u
#define RTR_SORT_BINS 16u
#define RTR_SORT_SMALL 4096u /* primitives that one workgroup sorts */
#define RTR_SORT_FUSED (64u * RTR_SORT_BLOCK) /* primitives up to which a dispatch a digit sorts (sort_fused.comp) */
#define RTR_SCAN_ITEMS 8u
#define RTR_SCAN_BLOCK (RTR_GROUP * RTR_SCAN_ITEMS)
#define RTR_SCAN_FEW 3u /* blocks up to which nodes are numbered in one dispatch; from 5 on that was slower on an H100 */

#define RTR_INACTIVE_KEY 0x7fffffffu

#define RTR_INDEX_NONE 0u
#define RTR_INDEX_16 1u
#define RTR_INDEX_32 2u
#define RTR_INDEX_8 3u

/* Two or three components; a missing z is 0. */
#define RTR_VERTEX_FLOAT3 0u
#define RTR_VERTEX_FLOAT2 1u
#define RTR_VERTEX_HALF3 2u
#define RTR_VERTEX_HALF2 3u
#define RTR_VERTEX_SNORM3 4u
#define RTR_VERTEX_SNORM2 5u

#define RTR_BUILD_TOP 1u
#define RTR_BUILD_AABBS 2u
#define RTR_BUILD_KEEP_DEGENERATE 4u /* ALLOW_UPDATE: only NaN drops a primitive */
#define RTR_BUILD_LOW_MEMORY 8u      /* as few nodes as leaves allow */
#define RTR_BUILD_HAS_TRANSFORM 16u
#define RTR_BUILD_UPDATE 64u
#define RTR_BUILD_COUNTED 128u /* an update that counted the active primitives */
#define RTR_FIT_LISTED 256u /* lbvh_fit starts at a list of nodes */
#define RTR_FIT_KEPT 512u   /* a pass before has finished all nodes */
#define RTR_REFIT_INIT 1024u     /* refit_links sets the state words */
#define RTR_REFIT_WINDOWS 2048u  /* nodes are seen through several windows */
#define RTR_BUILD_CHECKED 32u /* check_instances left in MARKS whether a reference is good */

struct RtrBuildPush {
    RTR_UINT count;          /* primitives of this dispatch */
    RTR_UINT total;          /* primitives of the build */
    RTR_UINT first;          /* of this dispatch among the build's */
    RTR_UINT primitive_base; /* of this dispatch within its geometry */
    RTR_UINT geometry;       /* index | RTC_SLOT_* */
    RTR_UINT data_offset;    /* bytes into RTR_IN_DATA of primitive_base's input (AABBs, instances) or of vertex 0 */
    RTR_UINT data_stride;    /* bytes */
    RTR_UINT vertex_count;
    RTR_UINT index_offset;   /* bytes into RTR_IN_INDEX of the geometry's first index */
    RTR_UINT index_type;
    RTR_UINT transform_offset; /* bytes into RTR_IN_TRANSFORM */
    RTR_UINT flags;          /* RTR_BUILD_* */
    RTR_UINT step;           /* sort: bit shift; fit: rotate; others: see the kernel */
    RTR_UINT blocks;
    RTR_UINT window_first;   /* first node or slot of the window */
    RTR_UINT window_count;
    RTR_UINT self_lo;        /* base of the destination, in quads */
    RTR_UINT self_hi;
    RTR_UINT facts;          /* header: facts as far as the host knows them */
    RTR_UINT geometry_count;
    RTR_UINT build_flags;    /* header: VkBuildAccelerationStructureFlagsNV */
    RTR_UINT slots_quad;     /* quads from the base to slot 0 */
    RTR_UINT slot_quads;     /* quads of a slot */
    RTR_UINT src_lo;         /* copy and refit: base of the source */
    RTR_UINT src_hi;
    RTR_UINT heap_quads;     /* size of the heap: instance references are checked against it */
    RTR_UINT vertex_format;  /* RTR_VERTEX_* */
    RTR_UINT not_opaque;     /* header of a bottom level: its word of RTC_HDR_OFFENDERS */
    RTR_UINT ranges;         /* indirect: word of STATE where this geometry's range is; 0: not indirect */
};

/* Words of a range in STATE: VkAccelerationStructureBuildRangeInfoKHR. */
#define RTR_RANGE_COUNT 0u
#define RTR_RANGE_OFFSET 1u
#define RTR_RANGE_FIRST_VERTEX 2u
#define RTR_RANGE_TRANSFORM 3u
#define RTR_RANGE_WORDS 4u

/* What the property kernel answers (p.count). */
#define RTR_PROPERTY_COMPACTED_SIZE 0u
#define RTR_PROPERTY_SIZE 1u /* in p.first, p.total */
#define RTR_PROPERTY_SERIALIZED_SIZE 2u
#define RTR_PROPERTY_HANDLES 3u

/* ---- Serialised structures: word indices in a blob, the layout of KHR -----------------
 * version (driver UUID, compatibility UUID: 8 words), bytes of the blob, bytes of the
 * structure, number of handles (64 bits each), the handles; at the next multiple of 256
 * bytes the structure, compacted, its base and those of its instances' bottom levels
 * taken out (1 where an instance was active). */
#define RTR_BLOB_SIZE 8u
#define RTR_BLOB_STRUCTURE_SIZE 10u
#define RTR_BLOB_HANDLE_COUNT 12u
#define RTR_BLOB_HANDLES 14u
/* Quads from the start of the blob to the structure. */
#define RTR_BLOB_DATA_QUAD(handles) ((RTR_BLOB_HANDLES * 4u + 8u * (handles) + 255u) / 256u * 16u)

#endif /* RTR_BUILD_SHARED_H_ */
