#version 450
#extension GL_GOOGLE_include_directive : require
// The last RTR_PLOC_FINAL clusters in one workgroup: iterations until one cluster is
// left, p.blocks of them by search and the rest by force, then the top of the top-down pass.
#define RTR_COHERENT coherent
#include "common.glsl"
#include "ploc.glsl"
#include "tree.glsl"
#include "ploc_down.glsl"

const int R = 16;
shared float box_lo[3 * 256];
shared float box_hi[3 * 256];
shared uint ids[256];
shared uint nearest[256];
shared uint sums[256];
shared uint level[65];

void main() {
    uint lane = gl_LocalInvocationIndex;
    uint count = state[iter_word(p.step, RTR_ITER_COUNT)];
    uint list = state[iter_word(p.step, RTR_ITER_PARITY)] * p.total;
    uint nodes = state[iter_word(p.step, RTR_ITER_NODES)];
    uint id = 0u;
    if (lane < count) id = links[list + lane];
    uint levels = 0u;
    bool forced = false;
    // `count` is the same in all lanes: barriers are reached by all or none.
    while (count > 1u && levels < 64u) {
        vec3 lo = vec3(0.0), hi = vec3(0.0);
        if (lane < count) {
            if ((id & RTR_CHILD_LEAF) != 0u) {
                lo = leaf_box[2u * (id & ~RTR_CHILD_LEAF)].xyz;
                hi = leaf_box[2u * (id & ~RTR_CHILD_LEAF) + 1u].xyz;
            } else {
                lo = node_box[2u * id].xyz;
                hi = node_box[2u * id + 1u].xyz;
            }
        }
        for (uint c = 0u; c < 3u; c++) {
            box_lo[c * 256u + lane] = lo[c];
            box_hi[c * 256u + lane] = hi[c];
        }
        ids[lane] = id;
        barrier();
        uint best = 0xffffffffu;
        if (lane < count) {
            if (forced) {
                best = lane ^ 1u;
            } else {
                float least = 0.0;
                int begin = max(int(lane) - R, 0), end = min(int(lane) + R, int(count) - 1);
                for (int o = begin; o <= end; o++) {
                    if (o == int(lane)) continue;
                    vec3 l = min(lo, vec3(box_lo[o], box_lo[256 + o], box_lo[512 + o]));
                    vec3 h = max(hi, vec3(box_hi[o], box_hi[256 + o], box_hi[512 + o]));
                    float area = half_area(l, h);
                    if (best == 0xffffffffu || area < least ||
                        (area == least && (lane ^ uint(o)) < (lane ^ best))) {
                        best = uint(o);
                        least = area;
                    }
                }
            }
        }
        nearest[lane] = best;
        barrier();
        uint role = ROLE_VANISH;
        if (lane < count) {
            bool mutual = best < count && nearest[best] == lane;
            if (mutual && !forced) mutual = low_enough(id, ids[best]);
            role = !mutual ? ROLE_STAY : lane < best ? ROLE_LEAD : ROLE_VANISH;
        }
        uint own = (role != ROLE_VANISH ? 1u : 0u) | (role == ROLE_LEAD ? 0x10000u : 0u);
        sums[lane] = own;
        barrier();
        for (uint d = 1u; d < RTR_GROUP; d <<= 1u) {
            uint v = lane >= d ? sums[lane - d] : 0u;
            barrier();
            sums[lane] += v;
            barrier();
        }
        uint before = sums[lane] - own, total = sums[RTR_GROUP - 1u];
        if (lane == 0u) level[levels] = nodes;
        if (role == ROLE_LEAD) {
            uint other = ids[best];
            uint node = nodes + (before >> 16);
            uint w = store_node(node, subtree_of(id), subtree_of(other), count == 2u);
            info[node] = uvec4(id, other, 0u, w);
            id = node;
        }
        barrier();
        if (role != ROLE_VANISH) ids[before & 0xffffu] = id;
        nodes += total >> 16;
        count = total & 0xffffu;
        levels++;
        forced = levels >= p.blocks || total >> 16 == 0u;
        memoryBarrierBuffer();
        barrier();
        id = ids[lane];
        barrier();
    }
    if (state[RTR_ST_ACTIVE] < 2u) return;
    uint root = nodes - 1u;
    if (lane == 0u) {
        level[levels] = nodes;
        state[RTR_ST_ROOT] = root;
        state[RTR_ST_NODES] = floatBitsToUint(node_box[2u * root + 1u].w) & RTR_INNER_MASK;
        out_index[root] = 0u;
        info[root].z = 0u;
    }
    for (uint l = levels; l-- > 0u;) {
        memoryBarrierBuffer();
        barrier();
        uint node = level[l] + lane;
        if (node < level[l + 1u]) hand_down(node);
    }
}
