#version 450
#extension GL_GOOGLE_include_directive : require
// One iteration, second part: where each block's clusters and new nodes go, and the size
// of the next iteration. With few clusters left the iterations idle until the last kernel.
#include "common.glsl"
#include "ploc.glsl"
#include "sums.glsl"

void main() {
    uint it = p.step;
    uint count = state[iter_word(it, RTR_ITER_COUNT)];
    uint nodes = state[iter_word(it, RTR_ITER_NODES)];
    uint parity = state[iter_word(it, RTR_ITER_PARITY)];
    uint blocks = iteration_groups(count);
    uint made = 0u;
    if (blocks != 0u) {
        count = scan_words(RTR_ST_SUMS, blocks);
        made = scan_words(RTR_ST_SUMS + blocks, blocks);
        parity ^= 1u;
    }
    if (gl_LocalInvocationIndex == 0u) {
        write_args(iter_word(it + 1u, RTR_ITER_ARGS), iteration_groups(count));
        state[iter_word(it + 1u, RTR_ITER_COUNT)] = count;
        state[iter_word(it + 1u, RTR_ITER_PARITY)] = parity;
        state[iter_word(it + 1u, RTR_ITER_NODES)] = nodes + made;
        write_args(RTR_ST_LEVEL + 4u * it, groups_of(made));
    }
}
