#version 450
#extension GL_GOOGLE_include_directive : require
// The surviving inner nodes as 64-byte nodes, into one window of the destination.
#include "common.glsl"

// No primitive has this index (2^26 at most).
const uint NO_CHILD = 0xffffffffu;

uint child_reference(uint child) {
    if ((child & RTR_CHILD_LEAF) != 0u) {
        uint prim = child & ~RTR_CHILD_LEAF;
        uint index = (p.flags & RTR_BUILD_TOP) != 0u ? prim : state[RTR_ST_ACTIVE] == 1u ? 0u : slot_of[prim];
        return RTC_REF_LEAF | (1u << RTC_REF_COUNT_SHIFT) | index;
    }
    uvec4 v = info[child];
    if ((v.w & RTR_COLLAPSED) == 0u) return out_index[child];
    return RTC_REF_LEAF | ((v.w & ~RTR_COLLAPSED) << RTC_REF_COUNT_SHIFT) | v.z;
}

void child_box(uint child, out vec3 lo, out vec3 hi) {
    if ((child & RTR_CHILD_LEAF) != 0u) {
        uint prim = child & ~RTR_CHILD_LEAF;
        lo = leaf_box[2u * prim].xyz;
        hi = leaf_box[2u * prim + 1u].xyz;
    } else {
        lo = node_box[2u * child].xyz;
        hi = node_box[2u * child + 1u].xyz;
    }
}

void write_node(uint at, uint left, uint right) {
    vec3 lo, hi;
    child_box(left, lo, hi);
    dst_nodes[4u * at] = uvec4(floatBitsToUint(lo), child_reference(left));
    uvec4 second = uvec4(floatBitsToUint(hi), RTC_REF_EMPTY);
    vec3 lo1 = vec3(0.0), hi1 = vec3(0.0);
    if (right != NO_CHILD) {
        child_box(right, lo1, hi1);
        second.w = child_reference(right);
    }
    dst_nodes[4u * at + 1u] = second;
    dst_nodes[4u * at + 2u] = uvec4(floatBitsToUint(lo1), 0u);
    dst_nodes[4u * at + 3u] = uvec4(floatBitsToUint(hi1), 0u);
}

void main() {
    uint i = lane_index();
    uint n = state[RTR_ST_ACTIVE];
    if (n < 2u) {
        // No inner node: the root has one leaf, or none. Empty children are marked by
        // their reference alone; their boxes are zero and never looked at.
        if (i != 0u || p.window_first != 0u) return;
        if (n == 1u) {
            write_node(0u, RTR_CHILD_LEAF | pairs_a[0].y, NO_CHILD);
        } else {
            dst_nodes[0] = uvec4(0u, 0u, 0u, RTC_REF_EMPTY);
            dst_nodes[1] = uvec4(0u, 0u, 0u, RTC_REF_EMPTY);
            dst_nodes[2] = uvec4(0u);
            dst_nodes[3] = uvec4(0u);
        }
        return;
    }
    if (i >= n - 1u) return;
    uint at = out_index[i];
    if (at == 0xffffffffu || at < p.window_first || at - p.window_first >= p.window_count) return;
    write_node(at - p.window_first, info[i].x, info[i].y);
}
