#version 450
#extension GL_GOOGLE_include_directive : require
// Update, first part: parents of the encoded nodes (RTR_LINK_*), arrival counters, empty leaf boxes; and the state words
// (RTR_REFIT_INIT), where nothing needed them before. Nodes are seen through a window of p.window_count from
// p.window_first on. Where there are several (RTR_REFIT_WINDOWS) pairs_a keeps the children for refit_boxes.
#include "common.glsl"
#include "init.glsl"
#include "refit.glsl"

void main() {
    uint i = lane_index();
    uint count = dst_header[RTC_HDR_NODE_COUNT];
    if ((p.flags & RTR_REFIT_INIT) != 0u && group_index() == 0u)
        for (uint word = i; word < RTR_ST_SUMS; word += RTR_GROUP) state[word] = first_state(word);
    if (!fits()) return;
    if (p.window_first == 0u && i < dst_header[RTC_HDR_SLOT_COUNT]) {
        leaf_box[2u * i] = vec4(vec3(RTR_FLT_MAX), 0.0);
        leaf_box[2u * i + 1u] = vec4(vec3(-RTR_FLT_MAX), 0.0);
    }
    uint node = p.window_first + i;
    if (i >= p.window_count || node >= count) return;
    if (node == 0u) links[0] = 0xffffffffu;
    uint left = dst_nodes[4u * i].w, right = dst_nodes[4u * i + 1u].w;
    bool left_inner = (left & RTC_REF_LEAF) == 0u, right_inner = (right & RTC_REF_LEAF) == 0u;
    uint link = node << RTR_LINK_SHIFT | (left_inner && right_inner ? RTR_LINK_TWO : 0u);
    if (left_inner) links[left] = link;
    if (right_inner) links[right] = link | RTR_LINK_RIGHT;
    marks[node] = 0u;
    if ((p.flags & RTR_REFIT_WINDOWS) != 0u) pairs_a[node] = uvec2(left, right);
}
