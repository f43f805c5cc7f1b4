#version 450
#extension GL_GOOGLE_include_directive : require
// Validation of a launch, before it runs. One dispatch a region of the shader binding table
// (p.flags 0): the size in the parameters becomes what the buffer really holds, so that the
// module never reads outside it; and records must be null or of this pipeline. Then one
// dispatch (p.flags 1) that takes the lanes away from a launch with an error.
//   in_data from p.data_offset: the region, p.count records p.data_stride apart to look at,
//   p.total bytes as the application says (~0: it does not); state: the parameter slots,
//   p.blocks of them p.step words apart, p.window_first: word of the size in them (0: none);
//   dst_header: the control block; p.first: the region; p.facts: identity of the pipeline.
#include "common.glsl"

void report(uint code, uint word, uint record) {
    if (atomicCompSwap(dst_header[RTC_CTRL_ERROR], RTC_LAUNCH_ERROR_NONE, code) == RTC_LAUNCH_ERROR_NONE) {
        dst_header[RTC_CTRL_ERROR_DETAIL] = word;
        dst_header[RTC_CTRL_ERROR_DETAIL2] = RTC_ERROR_RECORD | (p.first << RTC_ERROR_REGION_SHIFT) | record;
    }
    atomicAdd(dst_header[RTC_CTRL_ERROR_COUNT], 1u);
}

void main() {
    uint i = lane_index();
    if (p.flags != 0u) {
        if (i < p.blocks && dst_header[RTC_CTRL_ERROR] != RTC_LAUNCH_ERROR_NONE)
            state[i * p.step + RTC_PARAM_LANE_COUNT] = 0u;
        return;
    }
    uint words = in_data.length(), begin = p.data_offset >> 2;
    // Bytes behind the region's start; a binding has fewer than 2^32.
    uint there = words > begin ? (words - begin) * 4u : 0u;
    if (i < p.blocks && p.window_first != 0u) {
        state[i * p.step + p.window_first] = min(p.total, there);
        state[i * p.step + p.window_first + 1u] = 0u;
    }
    if (i == 0u && p.total != 0xffffffffu && p.total > there) report(RTC_LAUNCH_ERROR_SBT_RANGE, there, 0u);
    if (i >= p.count) return;
    uint high, at;
    umulExtended(i, p.data_stride, high, at);
    if (high != 0u || there < RTC_HANDLE_BYTES || at > there - RTC_HANDLE_BYTES) {
        report(RTC_LAUNCH_ERROR_SBT_RANGE, there, i);
        return;
    }
    uint w = begin + (at >> 2);
    bool null = (in_data[w] | in_data[w + 1u] | in_data[w + 2u]) == 0u;
    if (!null && in_data[w + RTC_HANDLE_WORDS - 1u] != p.facts) report(RTC_LAUNCH_ERROR_BAD_HANDLE, in_data[w], i);
}
