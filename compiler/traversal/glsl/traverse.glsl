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
const uint RTC_STEP_UNDECIDED = 6u; // inside rtc_trace_step only: floats do not decide the triangle under the cursor

bool rtc_inner(uint reference) { return (reference & RTC_REF_LEAF) == 0u; }
uint rtc_count(uint reference) { return (reference >> RTC_REF_COUNT_SHIFT) & RTC_REF_COUNT_MASK; }

// Turns that one triangle can take in exact arithmetic at worst, where nothing can suspend: nine determinants of
// edges (wide.glsl: 18 + 3 * 37 + 2 turns each), two of t (one of them 6 more), and two comparisons of t (four
// determinants, 37^2 products of limbs and 74 columns each), a turn of rtc_settle for each determinant. Lavapipe 22.3
// counts the turns of all lanes of a group, which may take theirs one after another, and ends all loops without a
// word: budgets that have room for that many leave it.
#ifdef RTC_TIER_EXACT
const uint RTC_TURNS_OF_A_TRIANGLE = 5500u;
const uint RTC_WALK_BUDGET =
    RTC_STEP_BUDGET > RTC_TURNS_OF_A_TRIANGLE + 1024u ? RTC_STEP_BUDGET - RTC_TURNS_OF_A_TRIANGLE : RTC_STEP_BUDGET;
#else
#define RTC_WALK_BUDGET RTC_STEP_BUDGET
#endif

// A lane suspends only while its stack fits what rtc_trace_save keeps.
bool rtc_budget_spent() {
    return RTC_LINK_RESUMABLE && RTC_STEP_BUDGET != 0xffffffffu && rtc_turns >= RTC_WALK_BUDGET && rtc_sp() <= RTC_TRAVERSAL_STACK;
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
    RTC_CHECK(rtc_check_begin();)
    rtc_hit_t = rtc_ray_tmax;
    rtc_trav_tmin = 0.0;
    rtc_trav_tmax = 0.0;
#ifdef RTC_TIER_EXACT
    rtc_trav_low = 0.0;
    rtc_hit_slot = RTC_NONE;
#endif
    rtc_hit_packed = 0u;
    rtc_hit_instance = RTC_NONE;
    rtc_hit_primitive = 0u;
    rtc_hit_attr0 = 0u;
    rtc_hit_attr1 = 0u;
    rtc_hit_attr2 = 0u;
    rtc_hit_attr3 = 0u;
    rtc_hit_attr4 = 0u;
    rtc_hit_attr5 = 0u;
    rtc_hit_attr6 = 0u;
    rtc_hit_attr7 = 0u;
    rtc_trav_cur = RTC_REF_DONE;
    rtc_trav_word = 0u;
    rtc_trav_instance = RTC_NONE;
    // Undefined in Vulkan: NaN anywhere, infinite origin or direction, and the
    // null direction. All miss. A negative tmin acts as 0.
    vec3 o = rtc_ray_origin;
    vec3 d = rtc_ray_direction;
    bool finite = rtc_finite(o.x) && rtc_finite(o.y) && rtc_finite(o.z) && rtc_finite(d.x) &&
                  rtc_finite(d.y) && rtc_finite(d.z) && rtc_finite(rtc_ray_tmin);
    // An infinite tmax is legal; as bits it is below every NaN.
    bool ordered =
        (floatBitsToUint(rtc_ray_tmax) & 0x7fffffffu) <= 0x7f800000u && rtc_ray_tmin <= rtc_ray_tmax;
    bool there = !rtc_is_null(rtc_ray_root);
    RTC_CHECK(there = there && rtc_check_base(rtc_ray_root) != 0u;)
    if (there && finite && ordered && rtc_largest(d) > 0.0) {
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
                rtc_trav_word = rtc_scale_exponent() << RTC_WORD_SCALE_SHIFT;
                rtc_trav_cur = RTC_REF_ENTER;
                rtc_trav_tmin = max(rtc_ray_tmin, 0.0) * rtc_t_up();
                rtc_trav_tmax = rtc_ray_tmax * rtc_t_up();
#ifdef RTC_TIER_EXACT
                rtc_trav_low = rtc_trav_tmax;
#endif
            }
        }
    }
}

void rtc_trace_stop() { rtc_trav_cur = RTC_REF_DONE; }

// What becomes of a candidate whose t is rtc_trav_tmax by now.
void rtc_commit() {
    rtc_hit_packed = rtc_cand_geometry | (rtc_cand_kind << 24u);
    rtc_hit_instance = rtc_cand_instance;
    rtc_hit_primitive = rtc_cand_primitive;
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
    if ((rtc_ray_flags & RTC_RAY_TERMINATE_ON_FIRST_HIT) != 0u) {
        rtc_trav_cur = RTC_REF_DONE;
    }
}

void rtc_trace_accept() {
    rtc_hit_t = rtc_cand_t;
    rtc_trav_tmax = rtc_cand_t * rtc_t_up();
    rtc_commit();
}

// Index of the hit record: Vulkan, "Hit Shader Binding Table Record Addressing".
uint rtc_record_index(uint instance, uint geometry) {
    uint offset = rtc_quad(rtc_instance_record(rtc_ray_root, instance), 6u).w & 0x00ffffffu;
    return offset + (rtc_ray_sbt_offset & 15u) + geometry * (rtc_ray_sbt_stride & 15u);
}

void rtc_hit_unpack() {
    // Reports are compared with rtc_hit_t meanwhile, so that with AABBs it is kept.
    if (!RTC_LINK_AABBS) {
        rtc_hit_t = rtc_hit_distance(rtc_trav_tmax);
    }
    rtc_hit_kind = rtc_hit_packed >> 24u;
    rtc_hit_geometry = rtc_hit_packed & RTC_SLOT_GEOMETRY_MASK;
}

// What hit shaders are told, once for the ray.
void rtc_hit_finish() {
    rtc_hit_unpack();
    rtc_hit_record = 0u;
    if (rtc_hit_instance != RTC_NONE) {
        rtc_hit_record = rtc_record_index(rtc_hit_instance, rtc_hit_geometry);
    }
}

// Effective opacity of a slot, 2 when the ray flags drop it.
uint rtc_opacity(uint slot_flags) {
    uint opaque = !RTC_LINK_NON_OPAQUE || (slot_flags & RTC_SLOT_OPAQUE) != 0u ? 1u : 0u;
    if ((rtc_trav_word & RTC_LEVEL_FORCE) != 0u) {
        opaque = (rtc_trav_word & RTC_LEVEL_OPAQUE) != 0u ? 1u : 0u;
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
    vec3 t0 = (low - (rtc_trav_origin + vec3(rtc_trav_pad))) * rtc_trav_inverse;
    vec3 t1 = (high - (rtc_trav_origin - vec3(rtc_trav_pad))) * rtc_trav_inverse;
    vec3 enter = min(t0, t1);
    vec3 leave = max(t0, t1);
    near = max(max(enter.x, enter.y), max(enter.z, rtc_trav_tmin));
    float far = min(leave.x, min(leave.y, leave.z));
    return near <= min(far, rtc_trav_tmax);
}

void rtc_candidate(uint primitive, uint geometry_flags, uint opacity) {
    rtc_cand_instance = rtc_trav_instance;
    rtc_cand_primitive = primitive;
    rtc_cand_geometry = geometry_flags & RTC_SLOT_GEOMETRY_MASK;
    rtc_cand_opaque = opacity;
}

#ifdef RTC_LAB_T64
float rtc_lab_t(uint slot); // the laboratory's t in double (tools/accuracy/lab/lab_t64.glsl)
#endif

// A triangle that the ray meets at t, in units of the scaled direction: whether it counts, and what follows.
uint rtc_meet_triangle(uint slot, uint primitive, uint flags, float t, float b1, float b2, bool front) {
    uint result = RTC_STEP_RUNNING;
#ifdef RTC_LAB_T64
    t = rtc_lab_t(slot);
#endif
    if (rtc_in_range(t, slot, primitive, flags)) {
        front = front != ((rtc_trav_word & RTC_LEVEL_FLIP) != 0u);
        uint opacity = rtc_opacity(flags);
        uint cull = front ? RTC_LEVEL_CULL_FRONT : RTC_LEVEL_CULL_BACK;
        if ((rtc_trav_word & cull) == 0u && opacity != 2u) {
            rtc_candidate(primitive, flags, opacity);
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
                rtc_cand_t = rtc_hit_distance(t);
                rtc_cand_record = rtc_record_index(rtc_cand_instance, rtc_cand_geometry);
                result = RTC_STEP_TRIANGLE;
            } else {
                rtc_trav_tmax = t;
                if (RTC_LINK_AABBS) {
                    rtc_hit_t = rtc_hit_distance(t);
                }
                rtc_commit();
            }
        }
    }
    return result;
}

#ifdef RTC_TIER_FAST
uint rtc_test_triangle(uint slot) {
    RTC_CHECK(slot = rtc_checked_slot(slot);)
    RtcBase at = rtc_advance(rtc_trav_base, rtc_trav_slots + slot * RTC_TRIANGLE_QUADS);
    uvec4 q0 = rtc_quad(at, 0u);
    uvec4 q1 = rtc_quad(at, 1u);
    uvec4 q2 = rtc_quad(at, 2u);
    float t, b1, b2;
    bool front;
    uint result = RTC_STEP_RUNNING;
    if (rtc_triangle(uintBitsToFloat(q0.xyz), uintBitsToFloat(q1.xyz), uintBitsToFloat(q2.xyz), t, b1, b2, front)) {
        result = rtc_meet_triangle(slot, q0.w, q1.w, t, b1, b2, front);
    }
    return result;
}
#endif

uint rtc_test_aabb(uint slot) {
    RTC_CHECK(slot = rtc_checked_slot(slot);)
    uvec4 q0 = rtc_quad(rtc_trav_base, rtc_trav_slots + slot * RTC_AABB_QUADS);
    uvec4 q1 = rtc_quad(rtc_trav_base, rtc_trav_slots + slot * RTC_AABB_QUADS + 1u);
    uint opacity = rtc_opacity(q1.w);
    float near;
    uint result = RTC_STEP_RUNNING;
    if (rtc_slab(uintBitsToFloat(q0.xyz), uintBitsToFloat(q1.xyz), near) && opacity != 2u) {
        rtc_candidate(q0.w, q1.w, opacity);
        rtc_cand_record = rtc_record_index(rtc_cand_instance, rtc_cand_geometry);
        result = RTC_STEP_AABB;
    }
    return result;
}

#ifdef RTC_LAB_NODES
uint rtc_test_node(); // the laboratory's nodes of smaller boxes (tools/accuracy/lab/lab_nodes.glsl)
#else
// Both children of the node under the cursor; the nearer becomes the cursor.
// (mix with a boolean is a select.)
uint rtc_test_node() {
    RTC_CHECK(rtc_trav_cur = rtc_checked_node(rtc_trav_cur);)
#ifdef RTC_ADDRESS_MODE
    uvec4 q0 = RtcNodesAt(rtc_trav_base).q[rtc_trav_cur + RTC_AS_HEADER_QUADS / RTC_NODE_QUADS].q0;
    uvec4 q1 = RtcNodesAt(rtc_trav_base).q[rtc_trav_cur + RTC_AS_HEADER_QUADS / RTC_NODE_QUADS].q1;
    uvec4 q2 = RtcNodesAt(rtc_trav_base).q[rtc_trav_cur + RTC_AS_HEADER_QUADS / RTC_NODE_QUADS].q2;
    uvec4 q3 = RtcNodesAt(rtc_trav_base).q[rtc_trav_cur + RTC_AS_HEADER_QUADS / RTC_NODE_QUADS].q3;
#else
    uint at = rtc_trav_base + (RTC_AS_HEADER_QUADS + rtc_trav_cur * RTC_NODE_QUADS);
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
        if (rtc_sp() < RTC_STACK_ENTRIES) {
            rtc_stack_set(rtc_sp(), mix(q1.w, q0.w, second));
            rtc_trav_word++;
        } else {
            result = RTC_STEP_OVERFLOW;
        }
    }
    return result;
}
#endif

// Takes the slot under the cursor, a leaf's.
uint rtc_next_slot() {
    uint slot = rtc_trav_cur & RTC_REF_INDEX_MASK;
    rtc_trav_cur += 1u - (1u << RTC_REF_COUNT_SHIFT);
    rtc_trav_cur = rtc_count(rtc_trav_cur) == 0u ? RTC_REF_POP : rtc_trav_cur;
    return slot;
}

// The level's data need not be kept from here on: they are made again, and then the walk goes on where it was.
void rtc_make_level_again() {
    if (rtc_trav_cur != RTC_REF_DONE) {
        if (rtc_trav_cur != RTC_REF_POP && rtc_trav_cur != RTC_REF_SETUP) {
            rtc_stack_set(rtc_sp(), rtc_trav_cur);
            rtc_trav_word++;
        }
        rtc_trav_cur = RTC_REF_SETUP;
    }
    // Said so, or compilers keep them.
    rtc_trav_base = rtc_ray_root;
    rtc_trav_slots = 0u;
    rtc_trav_origin = vec3(0.0);
    rtc_trav_direction = vec3(0.0);
    rtc_trav_inverse = vec3(0.0);
    rtc_trav_pad = 0.0;
#ifndef RTC_TIER_FAST
    rtc_trav_shear = vec3(0.0);
#endif
}

#if defined(RTC_TIER_EXACT)
#include "exact_walk.glsl"
#include "exact_settle.glsl"
#elif !defined(RTC_TIER_FAST)
#include "watertight_walk.glsl"
#endif

uint rtc_trace_step() {
    uint result = RTC_STEP_RUNNING;
    do {
        result = RTC_STEP_RUNNING;
        do {
            // Not between choosing an instance and entering it: one that is not entered goes on in the
            // top level, whose data a resumed lane would not have.
            if (rtc_budget_spent() && (rtc_trav_cur < RTC_REF_SETUP || rtc_trav_cur == RTC_REF_POP)) {
                result = RTC_STEP_SUSPEND;
            } else {
                rtc_turns++;
                if ((rtc_trav_cur | 1u) == RTC_REF_ENTER) {
                    rtc_level_setup();
                }
                do {
                    if (rtc_trav_cur == RTC_REF_POP) {
                        if (rtc_sp() == rtc_floor()) {
                            rtc_trav_cur = RTC_REF_EMPTY; // this level is finished
                        } else {
                            rtc_trav_word--;
                            rtc_trav_cur = rtc_stack_get(rtc_sp());
                        }
                    }
                    if (rtc_inner(rtc_trav_cur)) {
                        result = rtc_test_node();
                        RTC_CHECK(rtc_trav_cur = rtc_bad != 0u ? RTC_REF_DONE : rtc_trav_cur;)
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
                        bool top = !RTC_LINK_LEVELS || rtc_trav_instance == RTC_NONE || rtc_floor() == 0u;
                        rtc_trav_cur = top ? RTC_REF_DONE : RTC_REF_SETUP;
                        rtc_trav_instance = RTC_NONE;
                        rtc_set_floor(0u);
                        result = top ? RTC_STEP_DONE : RTC_STEP_RUNNING;
                    } else if (RTC_LINK_LEVELS && rtc_trav_instance == RTC_NONE) {
                        rtc_trav_instance = rtc_trav_cur & RTC_REF_INDEX_MASK;
                        rtc_set_floor(rtc_sp());
                        rtc_trav_cur = RTC_REF_ENTER;
                    } else {
                        do {
                            uint here = rtc_trav_cur;
                            uint slot = rtc_next_slot();
                            if (RTC_LINK_AABBS &&
                                (!RTC_LINK_TRIANGLES || (rtc_trav_word & RTC_LEVEL_AABBS) != 0u)) {
                                result = rtc_test_aabb(slot);
                            } else if (RTC_LINK_TRIANGLES) {
                                result = rtc_test_triangle(slot);
                            }
                            if (result == RTC_STEP_UNDECIDED) {
                                rtc_trav_cur = here;
                            }
                            RTC_CHECK(if (rtc_bad != 0u) { rtc_trav_cur = RTC_REF_DONE; result = RTC_STEP_RUNNING; })
                            rtc_turns++;
                        } while (result == RTC_STEP_RUNNING && rtc_trav_cur < RTC_REF_DONE);
                    }
                }
            }
        } while (result == RTC_STEP_RUNNING);
        // Outside the loop that nearly all time goes to: what this needs is not kept in registers there.
#if defined(RTC_TIER_EXACT)
        if (rtc_unsettled(result)) {
            result = rtc_settle(result);
        }
#elif defined(RTC_TIER_DEFERS)
        if (RTC_LINK_TRIANGLES && result == RTC_STEP_UNDECIDED) {
            result = rtc_settle_triangle(rtc_next_slot());
            rtc_make_level_again();
        }
#endif
        rtc_turns++;
    } while (result == RTC_STEP_RUNNING);
    if (result == RTC_STEP_OVERFLOW) {
        rtc_error(RTC_LAUNCH_ERROR_STACK, rtc_trav_instance, RTC_STACK_ENTRIES);
        rtc_trav_cur = RTC_REF_DONE;
        result = RTC_STEP_DONE;
    }
    if (result == RTC_STEP_DONE) {
        RTC_CHECK(if (rtc_bad != 0u) { rtc_hit_instance = RTC_NONE; })
        rtc_hit_finish();
    }
    return result;
}
