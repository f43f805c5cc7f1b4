#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// A texel buffer without a sampler: SPIR-V 1.6 knows no sampled image of a buffer.
#extension GL_EXT_samplerless_texture_functions : require
// Traversal alone: one lane traces one ray from a buffer and writes what it
// found. The any-hit and intersection shaders are modes below.
#include "traversal.glsl"
#ifdef RTC_LAB_NODES
#include "lab_nodes.glsl"
#endif
#ifdef RTC_LAB_T64
#include "lab_t64.glsl"
#endif

struct LabRay {
    vec3 origin;
    float tmin;
    vec3 direction;
    float tmax;
    uint flags;
    uint mask;
    uint sbt; // offset | stride << 4 | LAB_* << 8
    float report_t; // what the intersection shader reports
};

struct LabResult {
    float t;
    uint kind, instance, primitive, geometry, record;
    uint attr0, attr1, attr7;
    uint front, back, boxes; // candidates seen
    uint turns, suspensions; // LAB_PENDING: to be continued
    uint mismatches; // candidates whose object ray differs from traversal's
    uint last_opaque;
};

layout(set = 1, binding = 0, std430) readonly buffer LabRays { LabRay lab_rays[]; };
layout(set = 1, binding = 1, std430) buffer LabResults { LabResult lab_results[]; };

const uint LAB_IGNORE = 1u; // any-hit: ignore all
const uint LAB_TERMINATE = 2u; // any-hit: terminateRay
const uint LAB_NO_REPORT = 4u; // intersection: report nothing
const uint LAB_ROOT_NULL = 8u;
const uint LAB_ROOT_BOTTOM = 16u; // a root that is no top level
const uint LAB_PAUSE = 32u; // a suspended lane ends, and a later dispatch goes on

const uint LAB_PENDING = 0x80000000u; // in `suspensions`

void lab_check_object_ray(inout uint mismatches) {
    vec3 o = rtc_object_ray_origin(rtc_ray_root, rtc_cand_instance, rtc_ray_origin);
    vec3 d = rtc_object_ray_direction(rtc_ray_root, rtc_cand_instance, rtc_ray_direction);
    vec3 scaled = rtc_trav_direction * rtc_t_up();
    if (floatBitsToUint(o) != floatBitsToUint(rtc_trav_origin) || floatBitsToUint(d) != floatBitsToUint(scaled)) {
        mismatches++;
    }
}

void main() {
    if (rtc_launch_begin()) {
        LabRay r = lab_rays[rtc_launch_id.x];
        uint mode = r.sbt >> 8u;
        rtc_ray_root = rtc_param(RTC_PARAM_RAYGEN_OFFSET); // the lab's use of this word
        rtc_ray_root = (mode & LAB_ROOT_NULL) != 0u ? 0u : rtc_ray_root;
        rtc_ray_root = (mode & LAB_ROOT_BOTTOM) != 0u ? 16u : rtc_ray_root;
        rtc_ray_flags = r.flags;
        rtc_ray_mask = r.mask;
        rtc_ray_sbt_offset = r.sbt & 15u;
        rtc_ray_sbt_stride = (r.sbt >> 4u) & 15u;
        rtc_ray_miss = 0u;
        rtc_ray_origin = r.origin;
        rtc_ray_tmin = r.tmin;
        rtc_ray_direction = r.direction;
        rtc_ray_tmax = r.tmax;
        uint front = 0u, back = 0u, boxes = 0u, suspensions = 0u, mismatches = 0u, turns = 0u;
        uint step = RTC_STEP_RUNNING;
        if (rtc_param(RTC_PARAM_ROUND) == 0u) {
            rtc_trace_begin();
        } else if ((lab_results[rtc_launch_id.x].suspensions & LAB_PENDING) == 0u) {
            step = RTC_STEP_DONE;
        } else {
            LabResult before = lab_results[rtc_launch_id.x];
            front = before.front;
            back = before.back;
            boxes = before.boxes;
            turns = before.turns;
            mismatches = before.mismatches;
            suspensions = before.suspensions & ~LAB_PENDING;
            rtc_trace_restore(0u);
        }
        bool asleep = step == RTC_STEP_DONE;
        while (step != RTC_STEP_DONE) {
            step = rtc_trace_step();
            if (step == RTC_STEP_TRIANGLE) {
                lab_check_object_ray(mismatches);
                if (rtc_cand_kind == RTC_HIT_KIND_FRONT) {
                    front++;
                } else {
                    back++;
                }
                if ((mode & LAB_IGNORE) == 0u) {
                    rtc_trace_accept();
                    if ((mode & LAB_TERMINATE) != 0u) {
                        rtc_trace_stop();
                    }
                }
            } else if (step == RTC_STEP_AABB) {
                lab_check_object_ray(mismatches);
                boxes++;
                rtc_cand_attr0 = rtc_cand_primitive + 100u;
                rtc_cand_attr1 = rtc_cand_geometry;
                rtc_cand_attr2 = 0u;
                rtc_cand_attr3 = 0u;
                rtc_cand_attr4 = 0u;
                rtc_cand_attr5 = 0u;
                rtc_cand_attr6 = 0u;
                rtc_cand_attr7 = 77u;
                if ((mode & LAB_NO_REPORT) == 0u && rtc_report_begin(r.report_t, 5u)) {
                    if (rtc_cand_opaque != 0u || (mode & LAB_IGNORE) == 0u) {
                        rtc_trace_accept();
                        if (rtc_cand_opaque == 0u && (mode & LAB_TERMINATE) != 0u) {
                            rtc_trace_stop();
                        }
                    }
                }
            } else if (step == RTC_STEP_SUSPEND) {
                // As if the lane ended here and another one took over.
                suspensions++;
                rtc_trace_save(0u);
                if ((mode & LAB_PAUSE) != 0u) {
                    suspensions |= LAB_PENDING;
                    rtc_suspend();
                    break;
                }
                turns += rtc_turns;
                rtc_ray_root = 0xdeadu;
                rtc_hit_t = -1.0;
                rtc_trav_word = 77u;
                rtc_trav_cur = 5u;
                rtc_trav_base = 0u;
                rtc_trav_tmin = 0.0;
                rtc_trav_tmax = 0.0;
                rtc_hit_kind = 99u;
                rtc_trav_slots = 0u;
                rtc_trav_origin = vec3(1e30);
                rtc_trav_direction = vec3(0.0);
                rtc_trav_inverse = vec3(1.0);
                rtc_trace_restore(0u);
                rtc_turns = 0u;
            }
        }
        LabResult result;
        result.t = rtc_hit_instance != RTC_NONE ? rtc_hit_t : rtc_ray_tmax;
        result.kind = rtc_hit_kind;
        result.instance = rtc_hit_instance;
        result.primitive = rtc_hit_primitive;
        result.geometry = rtc_hit_geometry;
        result.record = rtc_hit_record;
        result.attr0 = rtc_hit_attr0;
        result.attr1 = rtc_hit_attr1;
        result.attr7 = rtc_hit_attr7;
        result.front = front;
        result.back = back;
        result.boxes = boxes;
        result.turns = rtc_turns + turns;
        result.suspensions = suspensions;
        result.mismatches = mismatches;
        result.last_opaque = rtc_cand_opaque;
        if (!asleep) {
            lab_results[rtc_launch_id.x] = result;
        }
    }
}
