#version 450
#extension GL_GOOGLE_include_directive : require
// After the last round of a tile: lanes that asked for another one are an error. The
// state binding is the launch's control block, p.step the word of the arguments that the
// last round wrote, p.count the lanes of a workgroup.
#include "common.glsl"

void main() {
    if (gl_LocalInvocationIndex != 0u) return;
    uint lanes = state[p.step] * state[p.step + 1u] * p.count;
    if (lanes != 0u) {
        if (state[RTC_CTRL_ERROR] == RTC_LAUNCH_ERROR_NONE) {
            state[RTC_CTRL_ERROR] = RTC_LAUNCH_ERROR_UNFINISHED;
            state[RTC_CTRL_ERROR_DETAIL] = lanes;
        }
        state[RTC_CTRL_ERROR_COUNT] += 1u;
        state[RTC_CTRL_SUSPENDED] = lanes;
    } else if (state[RTC_CTRL_ERROR] != RTC_LAUNCH_ERROR_UNFINISHED) {
        // Until here the word counted suspensions, also of lanes that went on.
        state[RTC_CTRL_SUSPENDED] = 0u;
    }
}
