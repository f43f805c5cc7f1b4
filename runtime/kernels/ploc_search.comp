#version 450
#extension GL_GOOGLE_include_directive : require
// One iteration, first part: neighbours and roles. A tile of RTR_GROUP clusters looks at
// its own and, to know whether a choice is mutual, redoes the search for the R clusters
// on either side: the same code, so the same answer in both tiles.
#include "common.glsl"
#include "ploc.glsl"

const uint R = RTR_PLOC_RADIUS;
shared float box_lo[3 * 288]; // RTR_GROUP + 4 R
shared float box_hi[3 * 288];
shared uint nearest[272]; // RTR_GROUP + 2 R
shared uint survivors;
shared uint merges;

void main() {
    uint lane = gl_LocalInvocationIndex;
    uint count = state[iter_word(p.step, RTR_ITER_COUNT)];
    uint list = state[iter_word(p.step, RTR_ITER_PARITY)] * p.total;
    bool forced = p.blocks != 0u;
    int base = int(group_index() * RTR_GROUP);
    if (lane == 0u) {
        survivors = 0u;
        merges = 0u;
    }
    if (!forced) {
        for (uint k = lane; k < RTR_GROUP + 4u * R; k += RTR_GROUP) {
            int at = base + int(k) - int(2u * R);
            if (at < 0 || at >= int(count)) continue;
            uint id = links[list + uint(at)];
            vec3 lo, hi;
            if ((id & RTR_CHILD_LEAF) != 0u) {
                id &= ~RTR_CHILD_LEAF;
                lo = leaf_box[2u * id].xyz;
                hi = leaf_box[2u * id + 1u].xyz;
            } else {
                lo = node_box[2u * id].xyz;
                hi = node_box[2u * id + 1u].xyz;
            }
            for (uint c = 0u; c < 3u; c++) {
                box_lo[c * 288u + k] = lo[c];
                box_hi[c * 288u + k] = hi[c];
            }
        }
    }
    barrier();
    for (uint k = lane; k < RTR_GROUP + 2u * R; k += RTR_GROUP) {
        int at = base + int(k) - int(R);
        uint best = 0xffffffffu;
        if (at >= 0 && at < int(count)) {
            if (forced) {
                best = uint(at ^ 1);
            } else {
                uint me = k + R;
                vec3 lo = vec3(box_lo[me], box_lo[288u + me], box_lo[576u + me]);
                vec3 hi = vec3(box_hi[me], box_hi[288u + me], box_hi[576u + me]);
                float least = 0.0;
                for (int d = -int(R); d <= int(R); d++) {
                    int other = at + d;
                    if (d == 0 || other < 0 || other >= int(count)) continue;
                    uint o = uint(int(me) + d);
                    vec3 l = min(lo, vec3(box_lo[o], box_lo[288u + o], box_lo[576u + o]));
                    vec3 h = max(hi, vec3(box_hi[o], box_hi[288u + o], box_hi[576u + o]));
                    float area = half_area(l, h);
                    if (best == 0xffffffffu || area < least ||
                        (area == least && uint(at ^ other) < (uint(at) ^ best))) {
                        best = uint(other);
                        least = area;
                    }
                }
            }
        }
        nearest[k] = best;
    }
    barrier();
    uint at = uint(base) + lane;
    if (at < count) {
        uint nn = nearest[lane + R];
        bool mutual = nn < count && nearest[nn - uint(base) + R] == at;
        if (mutual && !forced) mutual = low_enough(links[list + at], links[list + nn]);
        uint role = !mutual ? ROLE_STAY : at < nn ? ROLE_LEAD : ROLE_VANISH;
        marks[at] = (nn & NN_MASK) | (role << ROLE_SHIFT);
        if (role != ROLE_VANISH) atomicAdd(survivors, 1u);
        if (role == ROLE_LEAD) atomicAdd(merges, 1u);
    }
    barrier();
    uint blocks = groups_of(count);
    if (lane == 0u && group_index() < blocks) {
        state[RTR_ST_SUMS + group_index()] = survivors;
        state[RTR_ST_SUMS + blocks + group_index()] = merges;
    }
}
