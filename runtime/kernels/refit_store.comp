#version 450
#extension GL_GOOGLE_include_directive : require
// Update of a structure whose nodes no binding reaches, last part: the boxes that refit_boxes.comp found, into a
// window of the nodes, p.window_count from p.window_first on.
#include "common.glsl"
#include "refit.glsl"
#include "refit_tree.glsl"

void store_child(uint at, uint ref) {
    vec3 lo, hi;
    if ((ref & RTC_REF_LEAF) == 0u) {
        lo = node_box[2u * ref].xyz;
        hi = node_box[2u * ref + 1u].xyz;
    } else if (!slots_box(ref, lo, hi)) {
        return;
    }
    dst_nodes[at].xyz = floatBitsToUint(lo);
    dst_nodes[at + 1u].xyz = floatBitsToUint(hi);
}

void main() {
    uint i = lane_index();
    if (!fits() || i >= p.window_count || p.window_first + i >= dst_header[RTC_HDR_NODE_COUNT]) return;
    uint left = dst_nodes[4u * i].w, right = dst_nodes[4u * i + 1u].w;
    store_child(4u * i, left);
    store_child(4u * i + 2u, right);
}
