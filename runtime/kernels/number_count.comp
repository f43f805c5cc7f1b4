#version 450
#extension GL_GOOGLE_include_directive : require
// Surviving inner nodes and the slots of their leaves, counted by block of RTR_SCAN_BLOCK.
#include "common.glsl"
#include "survive.glsl"

shared uint nodes;
shared uint slots;

void main() {
    uint lane = gl_LocalInvocationIndex;
    if (lane == 0u) {
        nodes = 0u;
        slots = 0u;
    }
    barrier();
    uint first = group_index() * RTR_SCAN_BLOCK + lane * RTR_SCAN_ITEMS;
    uint own_nodes = 0u, own = 0u;
    for (uint k = 0u; k < RTR_SCAN_ITEMS; k++) {
        if (!survives(first + k)) continue;
        own_nodes++;
        own += own_slots(first + k);
    }
    atomicAdd(nodes, own_nodes);
    atomicAdd(slots, own);
    barrier();
    if (lane == 0u && group_index() < p.blocks) {
        state[RTR_ST_SUMS + group_index()] = nodes;
        state[RTR_ST_SUMS + p.blocks + group_index()] = slots;
    }
}
