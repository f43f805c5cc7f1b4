#version 450
#extension GL_GOOGLE_include_directive : require
#ifdef RTR_ADDRESS
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#endif
// A structure into a blob (build_shared.h, RTR_BLOB_*): one quad a lane, into a window
// (RTR_ARR_DST_SLOTS, from quad p.window_first on) of p.total quads. A blob that does not
// fit stays without its version, so that nothing takes it for one.
#include "common.glsl"
#include "block.glsl"

void main() {
    uint i = lane_index();
    if (i >= p.window_count) return;
    uint at = p.window_first + i;
    Compacted c = read_source(true);
    uint handles = c.top ? source(RTC_HDR_NODES / 4u).w : 0u;
    uint data = RTR_BLOB_DATA_QUAD(handles);
    bool fits = source(0u).z == RTC_AS_MAGIC && data + c.end <= p.total;
    if (at >= data) {
        if (!fits || at - data >= c.end) return;
        uvec4 v = compacted_quad(c, at - data);
        if (at == data) v.xy = uvec2(0u);
        // Where a bottom level lies is the handle's matter.
        if (c.top && at - data >= c.dst_slots && (at - data - c.dst_slots) % RTC_INSTANCE_QUADS == 6u)
            v.xy = uvec2((v.x | v.y) != 0u ? 1u : 0u, 0u);
        dst_slots[i] = v;
        return;
    }
    uvec4 v = uvec4(0u);
    for (uint k = 0u; k < 4u; k++) {
        uint w = 4u * at + k;
        if (w < RTR_BLOB_SIZE) v[k] = fits ? blob_version(w) : 0u;
        else if (w == RTR_BLOB_SIZE) v[k] = (data + c.end) << 4;
        else if (w == RTR_BLOB_SIZE + 1u) v[k] = (data + c.end) >> 28;
        else if (w == RTR_BLOB_STRUCTURE_SIZE) v[k] = c.end << 4;
        else if (w == RTR_BLOB_STRUCTURE_SIZE + 1u) v[k] = c.end >> 28;
        else if (w == RTR_BLOB_HANDLE_COUNT) v[k] = handles;
        else if (fits && w >= RTR_BLOB_HANDLES && (w - RTR_BLOB_HANDLES) / 2u < handles) {
            uint h = w - RTR_BLOB_HANDLES;
            v[k] = source(c.src_slots + (h / 2u) * RTC_INSTANCE_QUADS + 6u)[h % 2u];
        }
    }
    dst_slots[i] = v;
}
