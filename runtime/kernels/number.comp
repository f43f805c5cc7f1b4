#version 450
#extension GL_GOOGLE_include_directive : require
// Encoded index of each surviving inner node, in Morton order (the root gets 0), and the
// slots of the leaves that hang on it. The sums of the blocks before come from number_count and
// number_scan; where blocks are few (p.step 1) each workgroup finds them itself.
#include "common.glsl"
#include "survive.glsl"

shared uint sums[256];
shared uint slot_sums[256];
shared uint nodes_before;
shared uint slots_before;

// Survivors of the blocks before, and the slots on them.
void count_before(uint lane) {
    uint nodes = 0u, slots = 0u;
    for (uint node = lane; node < group_index() * RTR_SCAN_BLOCK; node += RTR_GROUP) {
        if (!survives(node)) continue;
        nodes++;
        slots += own_slots(node);
    }
    if (nodes != 0u) {
        atomicAdd(nodes_before, nodes);
        atomicAdd(slots_before, slots);
    }
}

// The primitives of a collapsed subtree, at most RTC_MAX_LEAF_SLOTS, from slot `at` on.
void place_leaf(uint node, uint at) {
    info[node].z = at;
    uint stack[4];
    stack[0] = node;
    uint top = 1u;
    for (uint turn = 0u; turn < 8u && top != 0u; turn++) {
        uint child = stack[--top];
        if ((child & RTR_CHILD_LEAF) != 0u) {
            slot_of[child & ~RTR_CHILD_LEAF] = at++;
        } else {
            stack[top++] = info[child].y;
            stack[top++] = info[child].x;
        }
    }
}

void main() {
    uint lane = gl_LocalInvocationIndex;
    uint first = group_index() * RTR_SCAN_BLOCK + lane * RTR_SCAN_ITEMS;
    if (lane == 0u) {
        nodes_before = 0u;
        slots_before = 0u;
    }
    barrier();
    if (p.step == 1u) count_before(lane);
    bool alive[RTR_SCAN_ITEMS];
    uint own = 0u, own_s = 0u;
    for (uint k = 0u; k < RTR_SCAN_ITEMS; k++) {
        alive[k] = survives(first + k);
        if (alive[k]) {
            own++;
            own_s += own_slots(first + k);
        }
    }
    sums[lane] = own;
    slot_sums[lane] = own_s;
    barrier();
    for (uint d = 1u; d < RTR_GROUP; d <<= 1u) {
        uint v = lane >= d ? sums[lane - d] : 0u;
        uint w = lane >= d ? slot_sums[lane - d] : 0u;
        barrier();
        sums[lane] += v;
        slot_sums[lane] += w;
        barrier();
    }
    if (group_index() >= p.blocks) return;
    uint at = sums[lane] - own, slot = slot_sums[lane] - own_s;
    if (p.step != 1u) {
        at += state[RTR_ST_SUMS + group_index()];
        slot += state[RTR_ST_SUMS + p.blocks + group_index()];
    } else {
        at += nodes_before;
        slot += slots_before;
        if (group_index() + 1u == p.blocks && lane == RTR_GROUP - 1u) state[RTR_ST_NODES] = nodes_before + sums[lane];
    }
    for (uint k = 0u; k < RTR_SCAN_ITEMS; k++) {
        uint node = first + k;
        if (alive[k]) {
            out_index[node] = at;
            at++;
            for (uint c = 0u; c < 2u; c++) {
                uint child = info[node][c];
                if ((child & RTR_CHILD_LEAF) != 0u) {
                    slot_of[child & ~RTR_CHILD_LEAF] = slot;
                    slot++;
                } else if ((info[child].w & RTR_COLLAPSED) != 0u) {
                    place_leaf(child, slot);
                    slot += info[child].w & ~RTR_COLLAPSED;
                }
            }
        } else if (node + 1u < state[RTR_ST_ACTIVE]) {
            out_index[node] = 0xffffffffu;
        }
    }
}
