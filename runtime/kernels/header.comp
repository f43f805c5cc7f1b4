#version 450
#extension GL_GOOGLE_include_directive : require
// Last dispatch of a build: the header. Lane w writes word w.
#include "common.glsl"
#include "facts.glsl"

void main() {
    uint w = gl_LocalInvocationIndex;
    if (w >= RTC_AS_HEADER_QUADS * 4u) return;
    uint n = state[RTR_ST_ACTIVE];
    uint root = state[RTR_ST_ROOT];
    bool top = (p.flags & RTR_BUILD_TOP) != 0u;
    uint nodes = n < 2u ? 1u : state[RTR_ST_NODES];
    uint slots = top ? p.total : n;
    uint depth = n < 2u ? 1u : (floatBitsToUint(node_box[2u * root + 1u].w) >> RTR_ENCODED_SHIFT) & RTR_HEIGHT_MASK;
    vec3 lo = vec3(RTR_FLT_MAX), hi = vec3(-RTR_FLT_MAX);
    if (n == 1u) {
        uint prim = pairs_a[0].y;
        lo = leaf_box[2u * prim].xyz;
        hi = leaf_box[2u * prim + 1u].xyz;
    } else if (n >= 2u) {
        lo = node_box[2u * root].xyz;
        hi = node_box[2u * root + 1u].xyz;
    }
    uint facts = p.facts;
    if (top) facts = top_facts(n);
    uint v = 0u;
    if (w == RTC_HDR_SELF_LO) v = p.self_lo;
    else if (w == RTC_HDR_SELF_HI) v = p.self_hi;
    else if (w == RTC_HDR_MAGIC) v = RTC_AS_MAGIC;
    else if (w == RTC_HDR_KIND) v = top ? RTC_AS_KIND_TOP : RTC_AS_KIND_BOTTOM;
    else if (w == RTC_HDR_FACTS) v = facts;
    else if (w == RTC_HDR_NODE_FORMAT) v = RTC_NODE_FORMAT_BVH2;
    else if (w == RTC_HDR_MAX_DEPTH) v = depth;
    else if (w == RTC_HDR_ACTIVE_COUNT) v = n;
    else if (w >= RTC_HDR_BOUNDS_MIN && w < RTC_HDR_BOUNDS_MIN + 3u)
        v = floatBitsToUint(lo[w - RTC_HDR_BOUNDS_MIN]);
    else if (w >= RTC_HDR_BOUNDS_MAX && w < RTC_HDR_BOUNDS_MAX + 3u)
        v = floatBitsToUint(hi[w - RTC_HDR_BOUNDS_MAX]);
    else if (w == RTC_HDR_GEOMETRY_COUNT) v = p.geometry_count;
    else if (w == RTC_HDR_SIZE_QUADS)
        v = RTC_AS_HEADER_QUADS + ((nodes + 3u) & ~3u) * RTC_NODE_QUADS + slots * p.slot_quads;
    else if (w == RTC_HDR_NODES) v = RTC_AS_HEADER_QUADS;
    else if (w == RTC_HDR_SLOTS) v = p.slots_quad;
    else if (w == RTC_HDR_NODE_COUNT) v = nodes;
    else if (w == RTC_HDR_SLOT_COUNT) v = slots;
    else if (w == RTC_HDR_BUILD_FLAGS) v = p.build_flags;
    else if (w == RTC_HDR_PRIMITIVE_COUNT) v = p.total;
    else if (w == RTC_HDR_FIRST_OFFENDER) v = state[RTR_ST_OFFENDER];
    else if (w == RTC_HDR_SINGLE_INSTANCE) v = top && n == 1u ? pairs_a[0].y + 1u : 0u;
    else if (w >= RTC_HDR_OFFENDERS && w < RTC_HDR_OFFENDERS_END) v = offender(w - RTC_HDR_OFFENDERS, n);
    else if (w == RTC_HDR_BAD_INSTANCE) v = state[RTR_ST_BAD_INSTANCE] + 1u;
    dst_header[w] = v;
}
