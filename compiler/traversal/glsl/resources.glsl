// Buffers every pipeline shares. The linker moves them to the reserved set.
layout(set = 0, binding = RTC_BINDING_PARAMS, std140) uniform RtcParams {
    uvec4 q[RTC_PARAM_QUADS];
} rtc_params;
layout(set = 0, binding = RTC_BINDING_HEAP_TEXELS) uniform utextureBuffer rtc_heap_texels;
layout(set = 0, binding = RTC_BINDING_HEAP, std430) readonly buffer RtcHeap {
    uvec4 q[];
} rtc_heap;
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

uvec4 rtc_quad(uint index) {
    uvec4 quad;
    if (RTC_FETCH == RTC_FETCH_TEXEL) {
        quad = texelFetch(rtc_heap_texels, int(index));
    } else {
        quad = rtc_heap.q[index];
    }
    return quad;
}

// `word` is one of RTC_PARAM_*: a constant at every call, so this folds to one
// uniform load.
uint rtc_param(uint word) { return rtc_params.q[word >> 2u][word & 3u]; }
