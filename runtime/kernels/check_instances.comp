#version 450
#extension GL_GOOGLE_include_directive : require
#ifdef RTR_ADDRESS
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#endif
// Validation: whether references of instances are those of bottom levels that are alive, by a
// table of the host's. A lane a record. The table comes in pieces, sorted by reference:
// in_index holds p.total entries (reference low, high, quads of the object, 0), and this
// dispatch is about the references from (p.self_lo, p.self_hi) to (p.src_lo, p.src_hi).
// Before a build (p.step 0) the records are instances, 64 bytes each from p.data_offset of
// in_data on, and marks tells of each from p.first on whether it is good. Before a launch
// (p.step 1 + RTC_AS_KIND_*) they are those of a top level, or of a bottom level none, whose header is in_transform, in_data starts
// p.window_first quads behind its base and ends p.window_count quads later (its base is p.index_offset, p.index_type,
// its size p.vertex_count quads); dst_header is the
// control block, p.geometry what detail2 is to say, p.facts: look at the header too.
#include "common.glsl"
#include "block.glsl"
#include "range.glsl"

void report(uint code, uint detail, uint detail2) {
    if (atomicCompSwap(dst_header[RTC_CTRL_ERROR], RTC_LAUNCH_ERROR_NONE, code) == RTC_LAUNCH_ERROR_NONE) {
        dst_header[RTC_CTRL_ERROR_DETAIL] = detail;
        dst_header[RTC_CTRL_ERROR_DETAIL2] = detail2;
    }
    atomicAdd(dst_header[RTC_CTRL_ERROR_COUNT], 1u);
}

bool below(uvec2 a, uvec2 b) { return a.y < b.y || (a.y == b.y && a.x < b.x); }

// Whether what a header says of nodes and slots (NODES, SLOTS, NODE_COUNT, SLOT_COUNT) lies in an object of so many
// quads. A traversal that checks (rtc --checked) takes the header at its word.
bool fits(uvec4 h, uint slot_quads, uint quads) {
    return h.x == RTC_AS_HEADER_QUADS && h.y >= h.x && h.y <= quads && h.z <= (h.y - h.x) / RTC_NODE_QUADS &&
           h.w <= (quads - h.y) / slot_quads;
}

bool good(uvec2 reference) {
    uint lo = 0u, hi = p.total;
    for (uint turn = 0u; turn < 32u && lo < hi; turn++) {
        uint middle = (lo + hi) / 2u;
        if (below(uvec2(in_index[4u * middle], in_index[4u * middle + 1u]), reference)) lo = middle + 1u;
        else hi = middle;
    }
    if (lo >= p.total || in_index[4u * lo] != reference.x || in_index[4u * lo + 1u] != reference.y) return false;
    // Alive; so what lies there may be read. Was it built?
    uvec4 h0 = block_quad(reference.x, reference.y, 0u);
    if (h0.xy != reference || h0.z != RTC_AS_MAGIC || h0.w != RTC_AS_KIND_BOTTOM) return false;
    bool aabbs = (block_quad(reference.x, reference.y, RTC_HDR_FACTS / 4u)[RTC_HDR_FACTS & 3u] & RTC_FACT_AABBS) != 0u;
    return fits(block_quad(reference.x, reference.y, RTC_HDR_NODES / 4u), aabbs ? RTC_AABB_QUADS : RTC_TRIANGLE_QUADS,
                in_index[4u * lo + 2u]);
}

void main() {
    uint i = lane_index();
    uint at;
    if (p.step == 0u) {
        if (i >= p.count || (p.ranges != 0u && p.first + i >= state[p.ranges + RTR_RANGE_COUNT])) return;
        at = ((p.data_offset + range_offset()) >> 2) + i * 16u + 14u;
    } else {
        if (i == 0u && p.facts != 0u) {
            uvec4 places = uvec4(in_transform[RTC_HDR_NODES], in_transform[RTC_HDR_SLOTS],
                                 in_transform[RTC_HDR_NODE_COUNT], in_transform[RTC_HDR_SLOT_COUNT]);
            bool self = in_transform[RTC_HDR_SELF_LO] == p.index_offset && in_transform[RTC_HDR_SELF_HI] == p.index_type;
            if (in_transform[RTC_HDR_MAGIC] != RTC_AS_MAGIC || in_transform[RTC_HDR_KIND] != p.step - 1u)
                report(RTC_LAUNCH_ERROR_ABI, in_transform[RTC_HDR_MAGIC], p.geometry);
            else if (p.step == 1u + RTC_AS_KIND_TOP && !(self && fits(places, RTC_INSTANCE_QUADS, p.vertex_count)))
                report(RTC_LAUNCH_ERROR_BAD_MEMORY, p.geometry,
                       RTC_BAD_HEADER << RTC_BAD_SHIFT | RTC_BAD_INSTANCE_MASK);
            else if (in_transform[RTC_HDR_BAD_INSTANCE] != 0u)
                report(RTC_LAUNCH_ERROR_BAD_INSTANCE, in_transform[RTC_HDR_BAD_INSTANCE] - 1u, p.geometry);
            else if (in_transform[RTC_HDR_BAD_UPDATE] != 0u)
                report(RTC_LAUNCH_ERROR_BAD_UPDATE, in_transform[RTC_HDR_BAD_UPDATE], p.geometry);
        }
        if (i >= p.count || p.step != 1u + RTC_AS_KIND_TOP || in_transform[RTC_HDR_MAGIC] != RTC_AS_MAGIC || i >= in_transform[RTC_HDR_SLOT_COUNT]) return;
        uint quad = in_transform[RTC_HDR_SLOTS] + i * RTC_INSTANCE_QUADS + 6u;
        if (quad < p.window_first || quad - p.window_first >= p.window_count) return;
        at = (quad - p.window_first) * 4u;
    }
    uvec2 reference = uvec2(in_data[at], in_data[at + 1u]);
    if (below(reference, uvec2(p.self_lo, p.self_hi)) || below(uvec2(p.src_lo, p.src_hi), reference)) return;
    bool is_good = reference == uvec2(0u) || good(reference);
    if (p.step == 0u) marks[p.first + i] = is_good ? 1u : 0u;
    else if (!is_good) report(RTC_LAUNCH_ERROR_BAD_INSTANCE, i, p.geometry);
}
