#version 450
#extension GL_GOOGLE_include_directive : require
#ifdef RTR_ADDRESS
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#endif
// Clone and compact: one quad a lane, from the heap's texels (address mode: by address) into a window of the
// destination (RTR_ARR_DST_SLOTS, from quad p.window_first on). Compacting moves the slots
// down behind the nodes in use; nothing inside a structure refers to its own base.
#include "common.glsl"

uvec4 source(uint quad) { return block_quad(p.src_lo, p.src_hi, quad); }

void main() {
    uint i = lane_index();
    if (i >= p.window_count) return;
    uint at = p.window_first + i;
    uvec4 nodes = source(RTC_HDR_NODES / 4u); // NODES, SLOTS, NODE_COUNT, SLOT_COUNT
    uint in_use = source(RTC_HDR_SIZE_QUADS / 4u).w;
    uint slot_quads = p.slot_quads;
    // A compacted object is created before its kind of leaf is known to the host.
    uvec4 h0 = source(0u), h1 = source(1u);
    if (h0.w == RTC_AS_KIND_TOP) slot_quads = RTC_INSTANCE_QUADS;
    else slot_quads = (h1.x & RTC_FACT_AABBS) != 0u ? RTC_AABB_QUADS : RTC_TRIANGLE_QUADS;
    bool compact = p.step != 0u;
    uint src_slots = nodes.y;
    uint dst_slots_quad = compact ? RTC_AS_HEADER_QUADS + ((nodes.z + 3u) & ~3u) * RTC_NODE_QUADS : src_slots;
    uint end = dst_slots_quad + nodes.w * slot_quads;
    if (at >= end) return;
    uvec4 v;
    if (at >= dst_slots_quad) v = source(src_slots + (at - dst_slots_quad));
    else v = source(at);
    if (at == 0u) v.xy = uvec2(p.self_lo, p.self_hi);
    if (at == RTC_HDR_NODES / 4u) v.y = dst_slots_quad;
    dst_slots[i] = v;
}
