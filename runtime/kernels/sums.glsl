// Exclusive scan of `count` words at state[RTR_ST_SUMS + first], by one workgroup; every
// lane takes a contiguous run. Returns the total in all lanes.
shared uint sums_shared[256];

uint scan_words(uint at, uint count) {
    uint lane = gl_LocalInvocationIndex;
    uint run = (count + RTR_GROUP - 1u) / RTR_GROUP;
    uint begin = min(lane * run, count);
    uint end = min(begin + run, count);
    uint sum = 0u;
    for (uint i = begin; i < end; i++) sum += state[at + i];
    barrier();
    sums_shared[lane] = sum;
    barrier();
    for (uint d = 1u; d < RTR_GROUP; d <<= 1u) {
        uint v = lane >= d ? sums_shared[lane - d] : 0u;
        barrier();
        sums_shared[lane] += v;
        barrier();
    }
    uint total = sums_shared[RTR_GROUP - 1u];
    uint before = sums_shared[lane] - sum;
    for (uint i = begin; i < end; i++) {
        uint v = state[at + i];
        state[at + i] = before;
        before += v;
    }
    return total;
}
