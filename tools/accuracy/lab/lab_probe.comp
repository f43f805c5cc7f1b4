#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_samplerless_texture_functions : require
// What traversal tells a lane about itself and about records; no rays.
#include "traversal.glsl"

struct LabProbe {
    uint inside;
    uint lane;
    uint x, y, z;
    uint width;
    uint miss, hit, callable; // records of this index
    uint miss_word, hit_word, callable_word, raygen_word;
    uint loaded; // lane storage after a store by every lane
    uint pad0, pad1;
};

layout(set = 1, binding = 0, std430) readonly buffer LabIndices { uint lab_indices[]; };
layout(set = 1, binding = 1, std430) writeonly buffer LabResults { LabProbe lab_results[]; };

void main() {
    uint at = (gl_WorkGroupID.x + 65535u * gl_WorkGroupID.y) * gl_WorkGroupSize.x + gl_LocalInvocationIndex;
    LabProbe p;
    p.inside = rtc_launch_begin() ? 1u : 0u;
    p.lane = rtc_lane;
    p.x = rtc_launch_id.x;
    p.y = rtc_launch_id.y;
    p.z = rtc_launch_id.z;
    p.width = rtc_launch_size.x;
    uint index = lab_indices[at];
    p.miss = rtc_miss_record(index);
    p.hit = rtc_hit_record_base(index);
    p.callable = rtc_callable_record(index);
    p.miss_word = p.miss == RTC_NONE ? 0u : rtc_sbt_miss_word(p.miss);
    p.hit_word = p.hit == RTC_NONE ? 0u : rtc_sbt_hit_word(p.hit);
    p.callable_word = p.callable == RTC_NONE ? 0u : rtc_sbt_callable_word(p.callable);
    p.raygen_word = rtc_sbt_raygen_word(1u);
    rtc_scratch_store(0u, 7u);
    rtc_scratch_store(1u, rtc_lane);
    p.loaded = rtc_scratch_load(0u) + rtc_scratch_load(1u);
    p.pad0 = rtc_scratch_base();
    p.pad1 = 0u;
    if (p.inside != 0u && p.x == 0u) {
        rtc_suspend();
    }
    lab_results[at] = p;
}
