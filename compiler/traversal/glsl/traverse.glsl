// The walk. rtc_trace_step runs to the next point where somebody else must
// decide and returns; called again it carries on. The stack is read in one
// place and written in one place, and each level is set up in one place:
// lavapipe's compile time grows with such places.
const uint RTC_STEP_DONE = 0u;
const uint RTC_STEP_TRIANGLE = 1u; // candidate triangle that is not opaque
const uint RTC_STEP_AABB = 2u; // candidate AABB: run the intersection shader
const uint RTC_STEP_SUSPEND = 3u; // budget exhausted
const uint RTC_STEP_OVERFLOW = 4u; // inside the loop only
const uint RTC_STEP_RUNNING = 5u;

bool rtc_inner(uint reference) { return (reference & RTC_REF_LEAF) == 0u; }
uint rtc_count(uint reference) { return (reference >> RTC_REF_COUNT_SHIFT) & RTC_REF_COUNT_MASK; }

// A lane suspends only while its stack fits what rtc_trace_save keeps.
bool rtc_budget_spent() {
    return RTC_LINK_RESUMABLE && RTC_STEP_BUDGET != 0xffffffffu && rtc_turns >= RTC_STEP_BUDGET && rtc_trav_sp <= RTC_TRAVERSAL_STACK;
}

// Is the scene what the module was told that scenes are? If not, the lane ends here (rtc_refused): whatever
// it would write, it would be wrong.
uint rtc_refused;

bool rtc_scene_accepted() {
    bool accepted = true;
    if (RTC_LINK_ASSUMED != 0u) {
        uint facts = rtc_quad(rtc_ray_root, RTC_HDR_FACTS / 4u)[RTC_HDR_FACTS & 3u];
        uint broken = RTC_LINK_ASSUMED & ~(facts ^ RTC_FACTS_OF_ABSENCE);
        if (broken != 0u) {
            uint word = RTC_HDR_OFFENDERS + uint(findLSB(broken));
            rtc_error(RTC_LAUNCH_ERROR_ASSUMPTION, broken & (~broken + 1u),
                      rtc_quad(rtc_ray_root, word / 4u)[word & 3u]);
            rtc_refused = 1u;
            accepted = false;
        }
    }
    return accepted;
}

void rtc_trace_begin() {
    rtc_refused = 0u;
    rtc_hit_t = rtc_ray_tmax;
    rtc_hit_kind = 0u;
    rtc_hit_instance = RTC_NONE;
    rtc_hit_primitive = 0u;
    rtc_hit_geometry = 0u;
    rtc_hit_record = 0u;
    rtc_hit_attr0 = 0u;
    rtc_hit_attr1 = 0u;
    rtc_hit_attr2 = 0u;
    rtc_hit_attr3 = 0u;
    rtc_hit_attr4 = 0u;
    rtc_hit_attr5 = 0u;
    rtc_hit_attr6 = 0u;
    rtc_hit_attr7 = 0u;
    rtc_trav_cur = RTC_REF_DONE;
    rtc_trav_sp = 0u;
    rtc_trav_floor = 0u;
    rtc_trav_instance = RTC_NONE;
    rtc_trav_setup = 0u;
    // Undefined in Vulkan: NaN anywhere, infinite origin or direction, and the
    // null direction. All miss. A negative tmin acts as 0.
    vec3 o = rtc_ray_origin;
    vec3 d = rtc_ray_direction;
    bool finite = rtc_finite(o.x) && rtc_finite(o.y) && rtc_finite(o.z) && rtc_finite(d.x) &&
                  rtc_finite(d.y) && rtc_finite(d.z) && rtc_finite(rtc_ray_tmin);
    // An infinite tmax is legal; as bits it is below every NaN.
    bool ordered =
        (floatBitsToUint(rtc_ray_tmax) & 0x7fffffffu) <= 0x7f800000u && rtc_ray_tmin <= rtc_ray_tmax;
    if (!rtc_is_null(rtc_ray_root) && finite && ordered && rtc_largest(d) > 0.0) {
        uvec4 header = rtc_quad(rtc_ray_root, 0u); // self low, self high, magic, kind
        if (header.z != RTC_AS_MAGIC || header.w != RTC_AS_KIND_TOP) {
            rtc_error(RTC_LAUNCH_ERROR_ABI, header.z, header.w);
        } else if (rtc_scene_accepted()) {
            // A top level of one instance has nothing to search: the walk starts inside.
            uint single = rtc_quad(rtc_ray_root, RTC_HDR_SINGLE_INSTANCE / 4u)[RTC_HDR_SINGLE_INSTANCE & 3u];
            if (single != 0u) {
                rtc_trav_instance = single - 1u;
            }
            if (RTC_LINK_LEVELS || single != 0u) {
                rtc_trav_setup = 1u;
                rtc_trav_cur = 0u;
            }
        }
    }
}

// What follows from ray and root rather than from the walk.
void rtc_ray_setup() {
    rtc_choose_scale();
    rtc_trav_tmin = max(rtc_ray_tmin, 0.0) * rtc_trav_t_up;
    rtc_trav_tmax = rtc_hit_t * rtc_trav_t_up;
    rtc_trav_records = rtc_advance(rtc_ray_root, rtc_quad(rtc_ray_root, RTC_HDR_SLOTS / 4u)[RTC_HDR_SLOTS & 3u]);
}

void rtc_trace_stop() { rtc_trav_cur = RTC_REF_DONE; }

void rtc_trace_accept() {
    rtc_hit_t = rtc_cand_t;
    rtc_hit_kind = rtc_cand_kind;
    rtc_hit_instance = rtc_cand_instance;
    rtc_hit_primitive = rtc_cand_primitive;
    rtc_hit_geometry = rtc_cand_geometry;
    rtc_hit_record = rtc_cand_record;
    rtc_hit_attr0 = rtc_cand_attr0;
    rtc_hit_attr1 = rtc_cand_attr1;
    if (RTC_LINK_AABBS) { // only intersection shaders fill the rest
        rtc_hit_attr2 = rtc_cand_attr2;
        rtc_hit_attr3 = rtc_cand_attr3;
        rtc_hit_attr4 = rtc_cand_attr4;
        rtc_hit_attr5 = rtc_cand_attr5;
        rtc_hit_attr6 = rtc_cand_attr6;
        rtc_hit_attr7 = rtc_cand_attr7;
    }
    rtc_accepted();
    rtc_trav_tmax = rtc_cand_t * rtc_trav_t_up;
    if ((rtc_ray_flags & RTC_RAY_TERMINATE_ON_FIRST_HIT) != 0u) {
        rtc_trav_cur = RTC_REF_DONE;
    }
}

// Effective opacity of a slot, 2 when the ray flags drop it.
uint rtc_opacity(uint slot_flags) {
    uint opaque = !RTC_LINK_NON_OPAQUE || (slot_flags & RTC_SLOT_OPAQUE) != 0u ? 1u : 0u;
    if ((rtc_trav_bits & RTC_LEVEL_FORCE) != 0u) {
        opaque = (rtc_trav_bits & RTC_LEVEL_OPAQUE) != 0u ? 1u : 0u;
    }
    uint drop = opaque != 0u ? RTC_RAY_CULL_OPAQUE : RTC_RAY_CULL_NO_OPAQUE;
    return (rtc_ray_flags & drop) != 0u ? 2u : opaque;
}

// reportIntersection: an intersection shader may report any t in the closed
// interval. Opacity was settled when the box became a candidate.
bool rtc_report_begin(float t, uint kind) {
    rtc_cand_t = t;
    rtc_cand_kind = kind;
    return rtc_cand_opaque != 2u && rtc_report_in_range(t);
}

// Entry distance of a box, and whether the ray meets it in [tmin, tmax].
bool rtc_slab(vec3 low, vec3 high, out float near) {
    vec3 t0 = (low - rtc_trav_low) * rtc_trav_inverse;
    vec3 t1 = (high - rtc_trav_high) * rtc_trav_inverse;
    vec3 enter = min(t0, t1);
    vec3 leave = max(t0, t1);
    near = max(max(enter.x, enter.y), max(enter.z, rtc_trav_tmin));
    float far = min(leave.x, min(leave.y, leave.z)) * RTC_SLAB_GROWTH;
    return near <= min(far, rtc_trav_tmax);
}

void rtc_candidate(uint primitive, uint geometry_flags, uint opacity) {
    rtc_cand_instance = rtc_trav_instance;
    rtc_cand_primitive = primitive;
    rtc_cand_geometry = geometry_flags & RTC_SLOT_GEOMETRY_MASK;
    rtc_cand_record = rtc_trav_record + rtc_cand_geometry * (rtc_ray_sbt_stride & 15u);
    rtc_cand_opaque = opacity;
}

uint rtc_test_triangle(uint slot) {
#ifdef RTC_ADDRESS_MODE
    uvec4 q0 = RtcTrianglesAt(rtc_trav_slots).q[slot].q0;
    uvec4 q1 = RtcTrianglesAt(rtc_trav_slots).q[slot].q1;
    uvec4 q2 = RtcTrianglesAt(rtc_trav_slots).q[slot].q2;
#else
    uint at = rtc_trav_slots + slot * RTC_TRIANGLE_QUADS;
    uvec4 q0 = rtc_quad(at, 0u);
    uvec4 q1 = rtc_quad(at, 1u);
    uvec4 q2 = rtc_quad(at, 2u);
#endif
    float t, b1, b2;
    bool front;
    uint result = RTC_STEP_RUNNING;
    vec3 v0 = uintBitsToFloat(q0.xyz);
    vec3 v1 = uintBitsToFloat(q1.xyz);
    vec3 v2 = uintBitsToFloat(q2.xyz);
    if (rtc_triangle(v0, v1, v2, t, b1, b2, front) && rtc_in_range(t, slot, q0.w, q1.w)) {
        front = front != ((rtc_trav_bits & RTC_LEVEL_FLIP) != 0u);
        uint opacity = rtc_opacity(q1.w);
        uint cull = front ? RTC_LEVEL_CULL_FRONT : RTC_LEVEL_CULL_BACK;
        if ((rtc_trav_bits & cull) == 0u && opacity != 2u) {
            rtc_candidate(q0.w, q1.w, opacity);
            rtc_cand_t = t * rtc_trav_t_down;
            rtc_cand_kind = front ? RTC_HIT_KIND_FRONT : RTC_HIT_KIND_BACK;
            rtc_cand_attr0 = floatBitsToUint(b1);
            rtc_cand_attr1 = floatBitsToUint(b2);
            if (RTC_LINK_AABBS) {
                rtc_cand_attr2 = 0u;
                rtc_cand_attr3 = 0u;
                rtc_cand_attr4 = 0u;
                rtc_cand_attr5 = 0u;
                rtc_cand_attr6 = 0u;
                rtc_cand_attr7 = 0u;
            }
            if (RTC_LINK_ANY_HIT && opacity == 0u) {
                result = RTC_STEP_TRIANGLE;
            } else {
                rtc_trace_accept();
            }
        }
    }
    return result;
}

uint rtc_test_aabb(uint slot) {
    uvec4 q0 = rtc_quad(rtc_trav_slots, slot * RTC_AABB_QUADS);
    uvec4 q1 = rtc_quad(rtc_trav_slots, slot * RTC_AABB_QUADS + 1u);
    uint opacity = rtc_opacity(q1.w);
    float near;
    uint result = RTC_STEP_RUNNING;
    if (rtc_slab(uintBitsToFloat(q0.xyz), uintBitsToFloat(q1.xyz), near) && opacity != 2u) {
        rtc_candidate(q0.w, q1.w, opacity);
        result = RTC_STEP_AABB;
    }
    return result;
}

// Both children of the node under the cursor; the nearer becomes the cursor.
// (mix with a boolean is a select.)
uint rtc_test_node() {
#ifdef RTC_ADDRESS_MODE
    uvec4 q0 = RtcNodesAt(rtc_trav_nodes).q[rtc_trav_cur].q0;
    uvec4 q1 = RtcNodesAt(rtc_trav_nodes).q[rtc_trav_cur].q1;
    uvec4 q2 = RtcNodesAt(rtc_trav_nodes).q[rtc_trav_cur].q2;
    uvec4 q3 = RtcNodesAt(rtc_trav_nodes).q[rtc_trav_cur].q3;
#else
    uint at = rtc_trav_nodes + rtc_trav_cur * RTC_NODE_QUADS;
    uvec4 q0 = rtc_quad(at, 0u);
    uvec4 q1 = rtc_quad(at, 1u);
    uvec4 q2 = rtc_quad(at, 2u);
    uvec4 q3 = rtc_quad(at, 3u);
#endif
    float near0, near1;
    bool hit0 = rtc_slab(uintBitsToFloat(q0.xyz), uintBitsToFloat(q1.xyz), near0);
    bool hit1 = rtc_slab(uintBitsToFloat(q2.xyz), uintBitsToFloat(q3.xyz), near1);
    hit0 = hit0 && (q0.w >> RTC_REF_COUNT_SHIFT) != (RTC_REF_EMPTY >> RTC_REF_COUNT_SHIFT);
    hit1 = hit1 && (q1.w >> RTC_REF_COUNT_SHIFT) != (RTC_REF_EMPTY >> RTC_REF_COUNT_SHIFT);
    bool second = hit1 && (!hit0 || near1 < near0);
    rtc_trav_cur = mix(mix(RTC_REF_POP, q0.w, hit0), q1.w, second);
    uint result = RTC_STEP_RUNNING;
    if (hit0 && hit1) {
        if (rtc_trav_sp < RTC_STACK_ENTRIES) {
            rtc_stack_set(rtc_trav_sp, mix(q1.w, q0.w, second));
            rtc_trav_sp++;
        } else {
            result = RTC_STEP_OVERFLOW;
        }
    }
    return result;
}

uint rtc_trace_step() {
    uint result = RTC_STEP_RUNNING;
    do {
        // Not between choosing an instance and entering it: one that is not entered goes on in the
        // top level, whose data a resumed lane would not have.
        if (rtc_budget_spent() && rtc_trav_cur != RTC_REF_DONE && rtc_trav_setup != 2u) {
            result = RTC_STEP_SUSPEND;
        } else {
            rtc_turns++;
            if (rtc_trav_setup != 0u) {
                if (rtc_trav_setup == 1u) {
                    rtc_ray_setup();
                }
                rtc_level_setup();
            }
            do {
                if (rtc_trav_cur == RTC_REF_POP) {
                    if (rtc_trav_sp == rtc_trav_floor) {
                        rtc_trav_cur = RTC_REF_EMPTY; // this level is finished
                    } else {
                        rtc_trav_sp--;
                        rtc_trav_cur = rtc_stack_get(rtc_trav_sp);
                    }
                }
                if (rtc_inner(rtc_trav_cur)) {
                    result = rtc_test_node();
                }
                rtc_turns++;
            } while (RTC_WHILE_WHILE != 0u && result == RTC_STEP_RUNNING && !rtc_budget_spent() &&
                     (rtc_inner(rtc_trav_cur) || rtc_trav_cur == RTC_REF_POP));

            if (!rtc_inner(rtc_trav_cur) && rtc_trav_cur != RTC_REF_POP && result == RTC_STEP_RUNNING) {
                if (rtc_trav_cur == RTC_REF_DONE) {
                    result = RTC_STEP_DONE;
                } else if (rtc_count(rtc_trav_cur) == 0u) {
                    // Out of nodes. An instance goes back to the top level, whose data is made
                    // anew.
                    // Nothing waits there when it was the last entry: the ray is finished.
                    bool top = !RTC_LINK_LEVELS || rtc_trav_instance == RTC_NONE || rtc_trav_floor == 0u;
                    rtc_trav_cur = top ? RTC_REF_DONE : RTC_REF_POP;
                    rtc_trav_instance = RTC_NONE;
                    rtc_trav_floor = 0u;
                    rtc_trav_setup = top ? 0u : 2u;
                    result = top ? RTC_STEP_DONE : RTC_STEP_RUNNING;
                } else if (RTC_LINK_LEVELS && rtc_trav_instance == RTC_NONE) {
                    rtc_trav_instance = rtc_trav_cur & RTC_REF_INDEX_MASK;
                    rtc_trav_floor = rtc_trav_sp;
                    rtc_trav_cur = 0u;
                    rtc_trav_setup = 2u;
                } else {
                    do {
                        uint slot = rtc_trav_cur & RTC_REF_INDEX_MASK;
                        rtc_trav_cur += 1u - (1u << RTC_REF_COUNT_SHIFT);
                        rtc_trav_cur = rtc_count(rtc_trav_cur) == 0u ? RTC_REF_POP : rtc_trav_cur;
                        if (RTC_LINK_AABBS &&
                            (!RTC_LINK_TRIANGLES || (rtc_trav_bits & RTC_LEVEL_AABBS) != 0u)) {
                            result = rtc_test_aabb(slot);
                        } else if (RTC_LINK_TRIANGLES) {
                            result = rtc_test_triangle(slot);
                        }
                        rtc_turns++;
                    } while (result == RTC_STEP_RUNNING && rtc_trav_cur < RTC_REF_DONE);
                }
            }
        }
    } while (result == RTC_STEP_RUNNING);
    if (result == RTC_STEP_OVERFLOW) {
        rtc_error(RTC_LAUNCH_ERROR_STACK, rtc_trav_instance, RTC_STACK_ENTRIES);
        rtc_trav_cur = RTC_REF_DONE;
        result = RTC_STEP_DONE;
    }
    return result;
}
