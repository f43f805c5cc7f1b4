#version 450
#extension GL_GOOGLE_include_directive : require
#ifdef RTR_ADDRESS
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#endif
// A structure out of a blob (build_shared.h, RTR_BLOB_*). First the header (p.step 0), then
// the rest (p.step 1), a quad a lane, into windows of the destination. The blob's first
// words and handles are RTR_IN_INDEX; RTR_IN_DATA starts p.data_offset quads into the blob.
// p.total: quads of the blob, p.blocks: of them in RTR_IN_INDEX, p.slots_quad: room in the
// destination. A blob of another version or kind, or one that does not fit, leaves a null structure.
// Active instances whose handle was patched to nothing get mask 0: they are never hit.
#include "common.glsl"
#include "block.glsl"

uint data_quad_at; // of the structure, in the blob

uvec4 blob_quad(uint at) {
    uint w = 4u * (data_quad_at + at - p.data_offset);
    return uvec4(in_data[w], in_data[w + 1u], in_data[w + 2u], in_data[w + 3u]);
}
uvec4 blob_header(uint quad) {
    uint w = 4u * (data_quad_at + quad);
    return uvec4(in_index[w], in_index[w + 1u], in_index[w + 2u], in_index[w + 3u]);
}

bool acceptable(uint handles, uint quads) {
    for (uint w = 0u; w < RTR_BLOB_SIZE; w++)
        if (in_index[w] != blob_version(w)) return false;
    if (in_index[RTR_BLOB_HANDLE_COUNT + 1u] != 0u || handles > (1u << 24)) return false;
    if (in_index[RTR_BLOB_STRUCTURE_SIZE + 1u] >= 16u || quads < RTC_AS_HEADER_QUADS || quads > p.slots_quad) return false;
    if (data_quad_at + RTC_AS_HEADER_QUADS > p.blocks || quads > p.total - data_quad_at) return false;
    uvec4 h0 = blob_header(0u), nodes = blob_header(RTC_HDR_NODES / 4u);
    bool top = h0.w == RTC_AS_KIND_TOP;
    if (h0.z != RTC_AS_MAGIC || top != ((p.flags & RTR_BUILD_TOP) != 0u)) return false;
    // What a damaged blob may not do: lead the copy or a trace out of the structure.
    uint slot_quads = top ? RTC_INSTANCE_QUADS : (blob_header(1u).x & RTC_FACT_AABBS) != 0u ? RTC_AABB_QUADS : RTC_TRIANGLE_QUADS;
    return nodes.x == RTC_AS_HEADER_QUADS && nodes.y == RTC_AS_HEADER_QUADS + ((nodes.z + 3u) & ~3u) * RTC_NODE_QUADS &&
           nodes.z < 0x08000000u && nodes.w < 0x08000000u && nodes.y + nodes.w * slot_quads == quads && (!top || nodes.w == handles);
}

void main() {
    uint i = lane_index();
    if (i >= p.window_count) return;
    uint at = p.window_first + i;
    uint handles = in_index[RTR_BLOB_HANDLE_COUNT];
    uint quads = in_index[RTR_BLOB_STRUCTURE_SIZE] >> 4 | in_index[RTR_BLOB_STRUCTURE_SIZE + 1u] << 28;
    data_quad_at = RTR_BLOB_DATA_QUAD(min(handles, 1u << 24));
    if (!acceptable(handles, quads)) {
        if (p.step == 0u && at < RTC_AS_HEADER_QUADS) dst_slots[i] = uvec4(0u);
        return;
    }
    if (at >= quads || (p.step == 0u) != (at < RTC_AS_HEADER_QUADS)) return;
    uvec4 v = p.step == 0u ? blob_header(at) : blob_quad(at);
    if (at == 0u) v.xy = uvec2(p.self_lo, p.self_hi);
    if (at == RTC_HDR_FACTS / 4u) v.x = (v.x & ~RTC_FACT_ADDRESSES) | p.facts;
    uint slots = blob_header(RTC_HDR_NODES / 4u).y;
    if ((p.flags & RTR_BUILD_TOP) != 0u && at >= slots) {
        uint record = (at - slots) / RTC_INSTANCE_QUADS, q = (at - slots) % RTC_INSTANCE_QUADS;
        if (q >= 6u && blob_quad(slots + record * RTC_INSTANCE_QUADS + 6u).x != 0u) {
            uvec2 base = uvec2(in_index[RTR_BLOB_HANDLES + 2u * record], in_index[RTR_BLOB_HANDLES + 2u * record + 1u]);
            bool there = base != uvec2(0u) && is_structure(base.x, base.y);
            if (!there) {
                if (q == 6u) {
                    v.xy = uvec2(0u);
                    v.z &= 0x00ffffffu;
                    atomicAnd(dst_header[RTC_HDR_FACTS], ~RTC_FACT_FULL_MASKS);
                    atomicMin(dst_header[RTC_HDR_FIRST_OFFENDER], record);
                }
            } else if (q == 6u) {
                v.xy = base;
            } else {
                // The bottom level may have been laid out anew.
                uvec4 h4 = block_quad(base.x, base.y, RTC_HDR_NODES / 4u);
                v.xyz = uvec3(block_quad(base.x, base.y, RTC_HDR_FACTS / 4u).x, h4.y, h4.x);
            }
        }
    }
    dst_slots[i] = v;
}
