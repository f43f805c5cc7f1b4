// Buffers every pipeline shares. The linker moves them to the reserved set.
layout(set = 0, binding = RTC_BINDING_PARAMS, std140) uniform RtcParams {
    uvec4 q[RTC_PARAM_QUADS];
} rtc_params;
#ifndef RTC_ADDRESS_MODE
layout(set = 0, binding = RTC_BINDING_HEAP_TEXELS) uniform utextureBuffer rtc_heap_texels;
layout(set = 0, binding = RTC_BINDING_HEAP, std430) readonly buffer RtcHeap {
    uvec4 q[];
} rtc_heap;
#endif
layout(set = 0, binding = RTC_BINDING_SBT_RAYGEN, std430) readonly buffer RtcSbtRaygen {
    uint w[];
} rtc_sbt_raygen;
layout(set = 0, binding = RTC_BINDING_SBT_MISS, std430) readonly buffer RtcSbtMiss {
    uint w[];
} rtc_sbt_miss;
layout(set = 0, binding = RTC_BINDING_SBT_HIT, std430) readonly buffer RtcSbtHit {
    uint w[];
} rtc_sbt_hit;
layout(set = 0, binding = RTC_BINDING_SBT_CALLABLE, std430) readonly buffer RtcSbtCallable {
    uint w[];
} rtc_sbt_callable;
layout(set = 0, binding = RTC_BINDING_CONTROL, std430) buffer RtcControl { uint w[]; } rtc_control;
layout(set = 0, binding = RTC_BINDING_SCRATCH, std430) buffer RtcScratch { uint w[]; } rtc_scratch;

#ifdef RTC_CHECKED
uint rtc_bad; // 1: this ray met what cannot be (checked.glsl)
#endif

// Where acceleration structure memory is (abi.h): a base, and quads from it.
// Heap mode: quads from the start of the heap, which is bound. Address mode
// (RTC_ADDRESS_MODE): a device address; nothing is bound.
#ifdef RTC_ADDRESS_MODE
#define RtcBase uvec2
struct RtcQuads4 {
    uvec4 q0, q1, q2, q3;
};
layout(buffer_reference, buffer_reference_align = 16, std430) readonly buffer RtcQuadsAt { uvec4 q[]; };
layout(buffer_reference, buffer_reference_align = 16, std430) readonly buffer RtcNodesAt { RtcQuads4 q[]; };

uvec4 rtc_quad(RtcBase base, uint index) { return RtcQuadsAt(base).q[index]; }

RtcBase rtc_base(uint low, uint high) { return uvec2(low, high); }
bool rtc_is_null(RtcBase base) { return (base.x | base.y) == 0u; }
// No structure is larger than 4 GiB: its sizes are counted in quads of 32 bits, its memory in a buffer range.
RtcBase rtc_advance(RtcBase base, uint quads) {
    uint carry;
    uint low = uaddCarry(base.x, quads << 4u, carry);
    return uvec2(low, base.y + (quads >> 28u) + carry);
}
#else
#define RtcBase uint
#ifdef RTC_CHECKED
void rtc_bad_memory(uint what, uint number);
uvec4 rtc_quad(RtcBase base, uint index) {
    uint at = base + index;
    uvec4 quad = uvec4(0u);
    if (at < base || at >= rtc_params.q[RTC_PARAM_HEAP_QUADS >> 2u][RTC_PARAM_HEAP_QUADS & 3u]) {
        rtc_bad_memory(RTC_BAD_ADDRESS, at);
    } else if (RTC_FETCH == RTC_FETCH_TEXEL) {
        quad = texelFetch(rtc_heap_texels, int(at));
    } else {
        quad = rtc_heap.q[at];
    }
    return quad;
}
#else
uvec4 rtc_quad(RtcBase base, uint index) {
    uvec4 quad;
    if (RTC_FETCH == RTC_FETCH_TEXEL) {
        quad = texelFetch(rtc_heap_texels, int(base + index));
    } else {
        quad = rtc_heap.q[base + index];
    }
    return quad;
}
#endif

RtcBase rtc_base(uint low, uint high) { return low; }
bool rtc_is_null(RtcBase base) { return base == 0u; }
RtcBase rtc_advance(RtcBase base, uint quads) { return base + quads; }
#endif

// `word` is one of RTC_PARAM_*: a constant at every call, so this folds to one
// uniform load.
uint rtc_param(uint word) { return rtc_params.q[word >> 2u][word & 3u]; }
