#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// A texel buffer without a sampler: SPIR-V 1.6 knows no sampled image of a buffer.
#extension GL_EXT_samplerless_texture_functions : require
#ifdef RTC_ADDRESS_MODE
#extension GL_EXT_buffer_reference2 : require
#extension GL_EXT_buffer_reference_uvec2 : require
#endif
#include "traversal.glsl"

// Never linked: names every export, so that none is dropped.
void main() {
    bool inside = rtc_launch_begin();
#ifdef RTC_ADDRESS_MODE
    RtcBase root = uvec2(1u, 0u);
#else
    RtcBase root = 1u;
#endif
    rtc_ray_root = rtc_root(rtc_lane, 1u);
    rtc_trace_begin();
    uint sum = rtc_trace_step();
    rtc_trace_accept();
    rtc_trace_stop();
    inside = inside || rtc_report_begin(1.0, 0u);
    mat4x3 m = rtc_object_to_world(root, 0u);
    m = rtc_world_to_object(root, 0u);
    sum += rtc_instance_custom_index(root, 0u);
    mat3 positions = rtc_hit_positions(root, 0u, rtc_hit_slot);
    m[3] += positions[0];
    vec3 o = rtc_object_ray_origin(root, 0u, m[3]);
    vec3 d = rtc_object_ray_direction(root, 0u, o);
    sum += floatBitsToUint(d.x) + rtc_sbt_raygen_word(0u) + rtc_sbt_miss_word(0u) + rtc_sbt_hit_word(0u) +
           rtc_sbt_callable_word(0u) + rtc_miss_record(0u) + rtc_hit_record_base(0u) + rtc_callable_record(0u) +
           rtc_scratch_base() + rtc_scratch_load(0u);
    rtc_trace_save(0u);
    rtc_trace_restore(0u);
    rtc_scratch_store(0u, sum);
    rtc_suspend();
    rtc_error(inside ? 1u : 0u, sum, 0u);
}
