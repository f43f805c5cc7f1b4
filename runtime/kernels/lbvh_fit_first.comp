#version 450
#extension GL_GOOGLE_include_directive : require
// The first level of a fitting pass by levels: nodes of two leaves are finished here, the rest listed when
// their children are. For devices whose lanes wait for each other: on lavapipe eight of them walk
// up in step, and lbvh_fit.comp has one of four at work.
#include "common.glsl"
#include "fit.glsl"
#include "fit_list.glsl"

void main() {
    uint node = lane_index();
    uint n = state[RTR_ST_ACTIVE];
    if (p.step == 2u && state[RTR_ST_DEEP] == 0u) return;
    if (n < 2u || node >= n - 1u) return;
    uint l = info[node].x, r = info[node].y;
    bool l_leaf = (l & RTR_CHILD_LEAF) != 0u, r_leaf = (r & RTR_CHILD_LEAF) != 0u;
    if (l_leaf && r_leaf) {
        // Later passes find them as the ones before left them.
        if ((p.flags & RTR_FIT_KEPT) == 0u) {
            Subtree whole = join(load_leaf(l), load_leaf(r), node != 0u && (p.flags & RTR_BUILD_TOP) == 0u);
            store_subtree(node, l, r, whole);
        }
        arrive(links[node]);
    } else if (l_leaf || r_leaf) {
        arrive(node);
    }
}
