#version 450
#extension GL_GOOGLE_include_directive : require
// One iteration, third part: new nodes, and the next list of clusters.
#include "common.glsl"
#include "ploc.glsl"
#include "tree.glsl"

shared uint sums[256];

void main() {
    uint lane = gl_LocalInvocationIndex;
    uint count = state[iter_word(p.step, RTR_ITER_COUNT)];
    uint parity = state[iter_word(p.step, RTR_ITER_PARITY)];
    uint blocks = groups_of(count);
    uint at = group_index() * RTR_GROUP + lane;
    uint mark = at < count ? marks[at] : ROLE_VANISH << ROLE_SHIFT;
    uint role = mark >> ROLE_SHIFT;
    // Survivors in the low half, merges in the high half.
    uint own = (role != ROLE_VANISH ? 1u : 0u) | (role == ROLE_LEAD ? 0x10000u : 0u);
    sums[lane] = own;
    barrier();
    for (uint d = 1u; d < RTR_GROUP; d <<= 1u) {
        uint v = lane >= d ? sums[lane - d] : 0u;
        barrier();
        sums[lane] += v;
        barrier();
    }
    if (role == ROLE_VANISH) return;
    uint before = sums[lane] - own;
    uint id = links[parity * p.total + at];
    if (role == ROLE_LEAD) {
        uint other = links[parity * p.total + (mark & NN_MASK)];
        uint node = state[iter_word(p.step, RTR_ITER_NODES)] + state[RTR_ST_SUMS + blocks + group_index()] +
                    (before >> 16);
        uint w = store_node(node, subtree_of(id), subtree_of(other), false);
        info[node] = uvec4(id, other, 0u, w);
        id = node;
    }
    links[(parity ^ 1u) * p.total + state[RTR_ST_SUMS + group_index()] + (before & 0xffffu)] = id;
}
