#version 450
#extension GL_GOOGLE_include_directive : require
// Update of a structure whose nodes no binding reaches: the way up the tree as refit_nodes.comp has it, but by
// what refit_links.comp kept of the nodes (pairs_a), into node_box. refit_store.comp brings them home.
#define RTR_COHERENT coherent
#include "common.glsl"
#include "refit.glsl"
#include "refit_tree.glsl"

bool inner(uint ref) { return (ref & RTC_REF_LEAF) == 0u; }

void add_child(uint ref, inout vec3 lo, inout vec3 hi) {
    vec3 child_lo, child_hi;
    if (inner(ref)) {
        child_lo = node_box[2u * ref].xyz;
        child_hi = node_box[2u * ref + 1u].xyz;
    } else {
        slots_box(ref, child_lo, child_hi);
    }
    lo = min(lo, child_lo);
    hi = max(hi, child_hi);
}

void main() {
    uint i = lane_index();
    uint node = 0xffffffffu;
    if (!fits()) {
        if (i == 0u) refuse_update();
        return;
    }
    uint children = 0u; // of `node`, inner ones
    if (i < dst_header[RTC_HDR_NODE_COUNT]) {
        node = i;
        children = (inner(pairs_a[i].x) ? 1u : 0u) + (inner(pairs_a[i].y) ? 1u : 0u);
    }
    for (uint turn = 0u; turn < 64u && node != 0xffffffffu; turn++) {
        uint next = 0xffffffffu;
        if (children == 0u || last_arrival(node, children)) {
            uvec2 refs = pairs_a[node];
            vec3 lo = vec3(RTR_FLT_MAX), hi = vec3(-RTR_FLT_MAX);
            add_child(refs.x, lo, hi);
            add_child(refs.y, lo, hi);
            node_box[2u * node] = vec4(lo, 0.0);
            node_box[2u * node + 1u] = vec4(hi, 0.0);
            uint link = links[node];
            if (link != 0xffffffffu) {
                next = link >> RTR_LINK_SHIFT;
                children = link_children(link);
            } else {
                finish_header(lo, hi);
            }
        }
        node = next;
    }
}
