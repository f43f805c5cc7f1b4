#version 450
#extension GL_GOOGLE_include_directive : require
// Update, first part: parents of the encoded nodes, arrival counters, empty leaf boxes.
#include "common.glsl"
#include "refit.glsl"

void main() {
    uint i = lane_index();
    uint count = dst_header[RTC_HDR_NODE_COUNT];
    if (!fits()) return;
    if (i < dst_header[RTC_HDR_SLOT_COUNT]) {
        leaf_box[2u * i] = vec4(vec3(RTR_FLT_MAX), 0.0);
        leaf_box[2u * i + 1u] = vec4(vec3(-RTR_FLT_MAX), 0.0);
    }
    if (i >= count) return;
    marks[i] = 0u;
    if (i == 0u) links[0] = 0xffffffffu;
    uint left = dst_nodes[4u * i].w, right = dst_nodes[4u * i + 1u].w;
    if ((left & RTC_REF_LEAF) == 0u) links[left] = i;
    if ((right & RTC_REF_LEAF) == 0u) links[right] = i;
}
