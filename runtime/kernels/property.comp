#version 450
#extension GL_GOOGLE_include_directive : require
// One property of a structure (RTR_PROPERTY_*), as a 64-bit number at word p.step of
// RTR_ARR_OUT.
#include "common.glsl"

void main() {
    if (gl_LocalInvocationIndex != 0u) return;
    uint quads = dst_header[RTC_HDR_SIZE_QUADS];
    uint handles = dst_header[RTC_HDR_KIND] == RTC_AS_KIND_TOP ? dst_header[RTC_HDR_SLOT_COUNT] : 0u;
    if (p.count == RTR_PROPERTY_SERIALIZED_SIZE) quads += RTR_BLOB_DATA_QUAD(handles);
    uvec2 v = uvec2(quads << 4, quads >> 28);
    if (p.count == RTR_PROPERTY_HANDLES) v = uvec2(handles, 0u);
    if (p.count == RTR_PROPERTY_SIZE) v = uvec2(p.first, p.total);
    out_index[p.step] = v.x;
    out_index[p.step + 1u] = v.y;
}
