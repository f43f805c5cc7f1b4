// A node survives when neither it nor an ancestor was collapsed. Collapsed subtrees have
// at most RTC_MAX_LEAF_SLOTS primitives, so at most two ancestors can be meant.
bool survives(uint node) {
    if (node + 1u >= state[RTR_ST_ACTIVE]) return false;
    bool alive = true;
    for (uint k = 0u; k < RTC_MAX_LEAF_SLOTS && node != 0xffffffffu; k++) {
        uint w = info[node].w;
        if ((w & RTR_COLLAPSED) != 0u) alive = false;
        node = w > RTC_MAX_LEAF_SLOTS ? 0xffffffffu : links[node];
    }
    return alive;
}

// Slots in the leaves that hang on a surviving node.
uint own_slots(uint node) {
    uint sum = 0u;
    for (uint c = 0u; c < 2u; c++) {
        uint child = info[node][c];
        if ((child & RTR_CHILD_LEAF) != 0u) sum += 1u;
        else if ((info[child].w & RTR_COLLAPSED) != 0u) sum += info[child].w & ~RTR_COLLAPSED;
    }
    return sum;
}
