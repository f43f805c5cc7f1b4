#version 450
#extension GL_GOOGLE_include_directive : require
#ifdef RTR_ADDRESS
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#endif
// Clone and compact: one quad a lane, from the source into a window of the destination
// (RTR_ARR_DST_SLOTS, from quad p.window_first on). Compacting moves the slots down behind
// the nodes in use; nothing inside a structure refers to its own base. What does not fit the destination (p.slots_quad:
// its quads) leaves a null structure there, whose SIZE_QUADS says how many it would have taken.
#include "common.glsl"
#include "block.glsl"

void main() {
    uint i = lane_index();
    if (i >= p.window_count) return;
    uint at = p.window_first + i;
    // A compacted object is created before its kind of leaf is known to the host.
    Compacted c = read_source(p.step != 0u);
    if (c.end > p.slots_quad) {
        if (at < RTC_AS_HEADER_QUADS) dst_slots[i] = uvec4(0u, 0u, 0u, at == RTC_HDR_SIZE_QUADS / 4u ? c.end : 0u);
        return;
    }
    if (at >= c.end) return;
    uvec4 v = compacted_quad(c, at);
    if (at == 0u) v.xy = uvec2(p.self_lo, p.self_hi);
    dst_slots[i] = v;
}
