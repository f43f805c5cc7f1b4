#version 450
#extension GL_GOOGLE_include_directive : require
// A hand-written resumable module: every lane needs its own number of turns, STEP_BUDGET
// at most in one dispatch, and keeps its count in scratch between rounds. What it writes
// lets the test check lanes, parameters and the shader binding table.
#define RESERVED_SET 0
#define RESERVED_BINDING 20
#ifndef RESERVED_SET
#define RESERVED_SET 1
#define RESERVED_BINDING 0
#endif
#include "reserved_set.glsl"

layout(set = 0, binding = 0, std430) buffer Result { uvec4 result[]; };
layout(push_constant) uniform Push { uint turns_base; uint turns_mask; };
layout(constant_id = 7) const uint APP_CONSTANT = 1u;

void main() {
    uint lane;
    uvec3 id;
    if (!launch_id(lane, id)) return;
    uint count = param(RTC_PARAM_LANE_COUNT), local = lane - param(RTC_PARAM_LANE_BASE);
    uint at = param(RTC_PARAM_SCRATCH_WORD) + local;
    uint round = param(RTC_PARAM_ROUND);
    uint done = 0u;
    if (round != 0u) {
        if (scratch[at] == 0xffffffffu) return;
        done = scratch[at];
    }
    uint goal = turns_base + (id.x * 7u + id.y * 3u & turns_mask);
    uint budget = STEP_BUDGET;
    while (done < goal && budget != 0u) {
        done++;
        budget--;
    }
    if (done < goal) {
        scratch[at] = done;
        uint args = param(RTC_PARAM_CONTROL_WORD) + RTC_CTRL_ARGS + 4u * (round + 1u);
        atomicAdd(control[param(RTC_PARAM_CONTROL_WORD) + RTC_CTRL_SUSPENDED], 1u);
        atomicMax(control[args], gl_NumWorkGroups.x);
        atomicMax(control[args + 1u], gl_NumWorkGroups.y);
        atomicMax(control[args + 2u], 1u);
        return;
    }
    scratch[at] = 0xffffffffu;
    uint index = id.x + param(RTC_PARAM_WIDTH) * (id.y + param(RTC_PARAM_HEIGHT) * id.z);
    // A record's handle word and its data, in the regions given.
    uint handle = sbt_raygen[param(RTC_PARAM_RAYGEN_OFFSET) / 4u];
    uint data = sbt_hit[(param(RTC_PARAM_HIT_OFFSET) + param(RTC_PARAM_HIT_STRIDE)) / 4u + RTC_HANDLE_WORDS];
    atomicAdd(result[index].x, 1u);
    result[index].y = done * APP_CONSTANT;
    result[index].z = handle;
    result[index].w = data;
    if (count == 0u) result[index].w = 0u;
}
