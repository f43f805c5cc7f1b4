// A node survives when neither it nor an ancestor was collapsed. Collapsed subtrees have
// at most RTC_MAX_LEAF_SLOTS primitives, so at most two ancestors can be meant.
bool survives(uint node) {
    if (node + 1u >= state[RTR_ST_ACTIVE]) return false;
    for (uint k = 0u; k < RTC_MAX_LEAF_SLOTS; k++) {
        uint w = info[node].w;
        if ((w & RTR_COLLAPSED) != 0u) return false;
        if (w > RTC_MAX_LEAF_SLOTS) return true;
        node = links[node];
        if (node == 0xffffffffu) return true;
    }
    return true;
}
