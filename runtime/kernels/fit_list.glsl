// Lists of nodes to finish, one a level of the tree, in the place where encoded nodes will be: those of
// level k are as many as of level k - 1 or fewer, so two halves of it take turns. A level has
// RTR_LEVEL_WORDS state words: arguments of its dispatch, and how many nodes are listed.
layout(set = 1, binding = RTR_ARR_DST_NODES, std430) RTR_COHERENT buffer List { uint list[]; };

uint listed() { return state[p.first + 3u]; }

// Into the list of the level after the one whose words are at p.first.
void append(uint node) {
    uint level = p.first + RTR_LEVEL_WORDS;
    uint at = atomicAdd(state[level + 3u], 1u);
    list[p.window_count + at] = node;
    if (at % RTR_GROUP != 0u) return;
    uint groups = at / RTR_GROUP + 1u;
    atomicMax(state[level], min(groups, RTC_MAX_GROUPS_X));
    atomicMax(state[level + 1u], (groups + RTC_MAX_GROUPS_X - 1u) / RTC_MAX_GROUPS_X);
}

// A child of the node is finished.
void arrive(uint node) {
    if (node != 0xffffffffu && (atomicAdd(marks[node], 1u) & 1u) != 0u) append(node);
}
