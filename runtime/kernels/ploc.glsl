// Parallel locally ordered clustering (Meister and Bittner 2018). Clusters lie in Morton
// order; each looks RTR_PLOC_RADIUS to both sides for the one whose union with it has the
// least area; two that choose each other merge. Scenes that would grow chains do not: a
// merge by choice is refused above p.window_count encoded levels, and what is left when
// the iterations run out is paired by force, in log2(count) levels. The host sets the
// limit to RTC_MAX_DEPTH - log2(count).
//
// Ties: the key is (area, i xor j), which is the same seen from both ends and different
// for every j, so the least key of all is always mutual: each iteration merges something,
// and equal boxes pair off perfectly.
const uint ROLE_STAY = 0u, ROLE_LEAD = 1u, ROLE_VANISH = 2u;
const uint ROLE_SHIFT = 30u;
const uint NN_MASK = 0x3fffffffu;

uint iter_word(uint it, uint w) { return RTR_ST_ITER + it * RTR_ITER_WORDS + w; }

void write_args(uint at, uint groups) {
    state[at] = min(groups, RTC_MAX_GROUPS_X);
    state[at + 1u] = (groups + RTC_MAX_GROUPS_X - 1u) / RTC_MAX_GROUPS_X;
    state[at + 2u] = 1u;
}

uint groups_of(uint lanes) { return (lanes + RTR_GROUP - 1u) / RTR_GROUP; }
uint iteration_groups(uint count) { return count > RTR_PLOC_FINAL ? groups_of(count) : 0u; }

uint cluster_height(uint id) {
    if ((id & RTR_CHILD_LEAF) != 0u) return 0u;
    return floatBitsToUint(node_box[2u * id + 1u].w) >> RTR_HEIGHT_SHIFT;
}
bool low_enough(uint a, uint b) { return max(cluster_height(a), cluster_height(b)) < p.window_count; }
