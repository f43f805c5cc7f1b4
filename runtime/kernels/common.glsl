// Declarations shared by the build kernels: one pipeline layout for all of them,
// each kernel uses the bindings it names.
// Combined with a sampler, buffer images are an error from SPIR-V 1.6 on and a warning of the layers before.
#extension GL_EXT_samplerless_texture_functions : require
#define RTR_GLSL 1
#include "rtc/abi.h"
#include "build_shared.h"

layout(push_constant, std430) uniform PushBlock { RtrBuildPush p; };

layout(set = 0, binding = RTR_IN_DATA, std430) readonly buffer InData { uint in_data[]; };
layout(set = 0, binding = RTR_IN_INDEX, std430) readonly buffer InIndex { uint in_index[]; };
layout(set = 0, binding = RTR_IN_TRANSFORM, std430) readonly buffer InTransform { uint in_transform[]; };
#ifdef RTR_ADDRESS
// A block somewhere in device memory, by its address.
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Quads { uvec4 quads[]; };
uvec4 block_quad(uint base_lo, uint base_hi, uint quad) { return Quads(uvec2(base_lo, base_hi)).quads[quad]; }
#else
layout(set = 0, binding = RTR_IN_HEAP) uniform utextureBuffer in_heap;
// A texel index has 31 bits; heaps are smaller than 2^31 quads.
uvec4 block_quad(uint base_lo, uint base_hi, uint quad) { return texelFetch(in_heap, int(base_lo + quad)); }
#endif

#ifndef RTR_COHERENT
#define RTR_COHERENT
#endif
layout(set = 1, binding = RTR_ARR_STATE, std430) RTR_COHERENT buffer State { uint state[]; };
layout(set = 1, binding = RTR_ARR_LEAF_BOX, std430) buffer LeafBox { vec4 leaf_box[]; };
layout(set = 1, binding = RTR_ARR_NODE_BOX, std430) RTR_COHERENT buffer NodeBox { vec4 node_box[]; };
layout(set = 1, binding = RTR_ARR_INFO, std430) RTR_COHERENT buffer Info { uvec4 info[]; };
layout(set = 1, binding = RTR_ARR_PAIRS_A, std430) RTR_COHERENT buffer PairsA { uvec2 pairs_a[]; };
layout(set = 1, binding = RTR_ARR_PAIRS_B, std430) RTR_COHERENT buffer PairsB { uvec2 pairs_b[]; };
layout(set = 1, binding = RTR_ARR_LINKS, std430) RTR_COHERENT buffer Links { uint links[]; };
layout(set = 1, binding = RTR_ARR_MARKS, std430) RTR_COHERENT buffer Marks { uint marks[]; };
layout(set = 1, binding = RTR_ARR_OUT, std430) RTR_COHERENT buffer Out { uint out_index[]; };
layout(set = 1, binding = RTR_ARR_SLOT_OF, std430) RTR_COHERENT buffer SlotOf { uint slot_of[]; };
layout(set = 1, binding = RTR_ARR_DST_NODES, std430) RTR_COHERENT buffer DstNodes { uvec4 dst_nodes[]; };
layout(set = 1, binding = RTR_ARR_DST_SLOTS, std430) buffer DstSlots { uvec4 dst_slots[]; };
layout(set = 1, binding = RTR_ARR_DST_HEADER, std430) buffer DstHeader { uint dst_header[]; };

layout(local_size_x = 256, local_size_y = 1, local_size_z = 1) in;

// llvmpipe of Mesa 22.3 compiles a memory barrier like a control barrier (25 no longer
// does, tried with this very kernel): a workgroup whose lanes do
// not all reach it stops there for good. Its atomics are sequentially consistent, so it
// needs no fence around them and gets none.
layout(constant_id = 0) const bool RTR_FENCES = true;
void device_fence() {
    if (RTR_FENCES) memoryBarrierBuffer();
}

const float RTR_FLT_MAX = 3.402823466e38;

// Groups beyond 65535 continue in y.
uint group_index() { return gl_WorkGroupID.x + gl_WorkGroupID.y * RTC_MAX_GROUPS_X; }
uint lane_index() { return group_index() * RTR_GROUP + gl_LocalInvocationIndex; }

// Floats as uints that compare in the same order (-0 below +0; no NaN here).
uint order_encode(float f) {
    uint u = floatBitsToUint(f);
    return (u & 0x80000000u) != 0u ? ~u : (u | 0x80000000u);
}
float order_decode(uint u) {
    return uintBitsToFloat((u & 0x80000000u) != 0u ? (u & 0x7fffffffu) : ~u);
}

// NaN by its bits: comparisons with NaN may be optimised away without
// SignedZeroInfNanPreserve.
bool is_nan(float f) { return (floatBitsToUint(f) & 0x7fffffffu) > 0x7f800000u; }
bool any_nan(vec3 v) { return is_nan(v.x) || is_nan(v.y) || is_nan(v.z); }

float half_area(vec3 lo, vec3 hi) {
    precise vec3 e = hi - lo;
    precise float a = e.x * e.y + e.y * e.z + e.z * e.x;
    // inf * 0 of boxes near FLT_MAX is NaN; every area must compare.
    return (floatBitsToUint(a) & 0x7fffffffu) >= 0x7f800000u ? RTR_FLT_MAX : a;
}

// SAH weights: visiting a node fetches and tests two boxes, a slot one primitive.
const float RTR_COST_NODE = 1.2;
const float RTR_COST_SLOT = 1.0;
