#version 450
#extension GL_GOOGLE_include_directive : require
// The binary radix tree over the sorted Morton codes (Karras 2012): every inner node
// finds its range and its split alone. Equal codes are told apart by their position, so
// a path has at most 30 + log2(count) nodes, below RTC_MAX_DEPTH for 2^28 primitives.
// With p.step 2: only if the rotations made the tree too deep.
#include "common.glsl"

int prefix(int i, int j, int n) {
    if (j < 0 || j >= n) return -1;
    uint a = pairs_a[i].x, b = pairs_a[j].x;
    if (a != b) return 31 - findMSB(a ^ b);
    return 32 + 31 - findMSB(uint(i ^ j));
}

void main() {
    int i = int(lane_index());
    int n = int(state[RTR_ST_ACTIVE]);
    if (p.step == 2u && state[RTR_ST_DEEP] == 0u) return;
    if (i < n) slot_of[pairs_a[i].y] = uint(i);
    if (i == 0) state[RTR_ST_ROOT] = 0u;
    if (i >= n - 1) return;

    int d = prefix(i, i + 1, n) > prefix(i, i - 1, n) ? 1 : -1;
    int least = prefix(i, i - d, n);
    int bound = 2;
    while (prefix(i, i + bound * d, n) > least) bound *= 2;
    int len = 0;
    for (int t = bound / 2; t > 0; t /= 2) {
        if (prefix(i, i + (len + t) * d, n) > least) len += t;
    }
    int j = i + len * d;
    int node_prefix = prefix(i, j, n);
    int s = 0;
    int t = len;
    do {
        t = (t + 1) / 2;
        if (prefix(i, i + (s + t) * d, n) > node_prefix) s += t;
    } while (t > 1);
    int split = i + s * d + min(d, 0);
    int first = min(i, j), last = max(i, j);

    uint left = first == split ? RTR_CHILD_LEAF | pairs_a[split].y : uint(split);
    uint right = last == split + 1 ? RTR_CHILD_LEAF | pairs_a[split + 1].y : uint(split + 1);
    info[i] = uvec4(left, right, uint(first), uint(last - first + 1));
    // Parents: of inner nodes by node, of leaves by sorted position behind them.
    uint n_total = p.total;
    links[first == split ? n_total + uint(split) : uint(split)] = uint(i);
    links[last == split + 1 ? n_total + uint(split + 1) : uint(split + 1)] = uint(i);
    if (i == 0) links[0] = 0xffffffffu;
}
