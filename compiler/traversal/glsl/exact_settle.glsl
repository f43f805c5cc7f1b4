// Tier `exact`, stages 2 and 3: the undecided triangle under the cursor, and at the end of the walk t and weights of
// the committed one.
//
// One loop with one place for each thing that is done: reading a triangle and its ray, an edge or t in stage 2, a
// determinant. Drivers
// copy functions to where they are called; some run code whose lanes are all off (lavapipe 22.3); and the second turn
// is rare.
const uint RTC_JOB_T2 = 0u; // t and weights in stage 2; at the end of the walk that is all, nearly always
const uint RTC_JOB_EDGES2 = 1u; // and 2 more: edges in stage 2
const uint RTC_JOB_EDGES = 4u; // and 8 more: three attempts at each of three edges
const uint RTC_JOB_T = 13u; // t's numerator and denominator
const uint RTC_JOB_SAME = 15u; // the committed triangle, then the candidate: the same?
const uint RTC_JOB_ORDER = 17u; // the candidate's numerator and denominator, then what it is compared with
const uint RTC_JOB_DONE = 21u;
const uint RTC_JOB_NONE = 22u;

int rtc_least(ivec3 v) { return min(v.x, min(v.y, v.z)); }
int rtc_most(ivec3 v) { return max(v.x, max(v.y, v.z)); }

// The first edge whose side is not known, as a job.
uint rtc_open_edge(ivec3 side) {
    uint edge = side.x == 0 ? 0u : (side.y == 0 ? 1u : 2u);
    return side.x != 0 && side.y != 0 && side.z != 0 ? RTC_JOB_NONE : RTC_JOB_EDGES + 3u * edge;
}

// Five vectors in what determinants use afterwards, and whether five others are the same.
void rtc_note(uvec3 v0, uvec3 v1, uvec3 v2, uvec3 o, uvec3 d) {
    for (int i = 0; i < 3; ++i) {
        rtc_wide[i] = int(v0[i]);
        rtc_wide[i + 3] = int(v1[i]);
        rtc_wide[i + 6] = int(v2[i]);
        rtc_wide[i + 9] = int(o[i]);
        rtc_wide[i + 12] = int(d[i]);
    }
}

bool rtc_noted(uvec3 v0, uvec3 v1, uvec3 v2, uvec3 o, uvec3 d) {
    uint differ = 0u;
    for (int i = 0; i < 3; ++i) {
        differ |= (uint(rtc_wide[i]) ^ v0[i]) | (uint(rtc_wide[i + 3]) ^ v1[i]) | (uint(rtc_wide[i + 6]) ^ v2[i]);
        differ |= (uint(rtc_wide[i + 9]) ^ o[i]) | (uint(rtc_wide[i + 12]) ^ d[i]);
    }
    return differ == 0u;
}

uint rtc_settle(uint result) {
    bool last = result != RTC_STEP_UNDECIDED;
    uint slot = last ? rtc_hit_slot : rtc_next_slot();
    uint instance = last ? rtc_hit_instance : rtc_trav_instance;
    bool committed = rtc_hit_instance != RTC_NONE && rtc_hit_slot != RTC_NONE; // a triangle
    uint primitive = 0u, flags = 0u;
    ivec3 side = ivec3(last ? 1 : 0); // 0: not known
    float t = 0.0;
    vec2 weights = vec2(0.0);
    bool sound = false; // t is known
    vec2 above = vec2(0.0); // of t's numerator
    bool hit = false, upwards = false;
    bool against_min = false, against_max = false; // what t is still to be compared with
    uint job = RTC_JOB_T2;
    rtc_make_level_again();
    // Not kept while rays walk.
    rtc_wide_sign = ivec4(0);
    rtc_wide_low = uvec4(0u);
    rtc_wide_high = uvec4(0u);
    [[dont_unroll]] do {
        bool other = job == RTC_JOB_SAME || (job >= RTC_JOB_ORDER + 2u && committed && !against_min);
        uint at_instance = other ? rtc_hit_instance : instance;
        uvec4 ids = rtc_quad(rtc_instance_record(rtc_ray_root, at_instance), 6u);
        RtcBase base = rtc_base(ids.x, ids.y);
        uint slots = rtc_quad(base, RTC_HDR_NODES / 4u).y; // nodes, slots, ...
        RtcBase at = rtc_advance(base, slots + (other ? rtc_hit_slot : slot) * RTC_TRIANGLE_QUADS);
        uvec4 q0 = rtc_quad(at, 0u);
        uvec4 q1 = rtc_quad(at, 1u);
        uvec4 q2 = rtc_quad(at, 2u);
        vec3 o = rtc_object_ray_origin(rtc_ray_root, at_instance, rtc_ray_origin);
        vec3 d = rtc_object_ray_direction(rtc_ray_root, at_instance, rtc_ray_direction * rtc_t_down());
        uint axis = rtc_fastest_axis(d);
        o = rtc_turned(o, axis);
        d = rtc_turned(d, axis);
        vec3 v0 = rtc_turned(uintBitsToFloat(q0.xyz), axis);
        vec3 v1 = rtc_turned(uintBitsToFloat(q1.xyz), axis);
        vec3 v2 = rtc_turned(uintBitsToFloat(q2.xyz), axis);
        uvec3 p0 = rtc_bits(v0), p1 = rtc_bits(v1), p2 = rtc_bits(v2), origin = rtc_bits(o), way = rtc_bits(d);
        bool edges_known = false, t_known = false, ordered = false;
        int order = 0;
        if (job < RTC_JOB_EDGES) {
            RtcStage2 scaled = rtc_stage2(v0, v1, v2, o, d);
            if (job == RTC_JOB_T2) {
                primitive = q0.w;
                flags = q1.w;
                upwards = d.z > 0.0;
                bool behind;
                weights = rtc_stage2_weights(scaled, v0, v1, v2, o, d);
                t = rtc_stage2_t(scaled, v0, v1, v2, o, d, sound, behind);
                // Infinite vertices have no exact answer: missed.
                vec3 far = max(max(abs(v0), abs(v1)), abs(v2));
                hit = rtc_finite(far.x) && rtc_finite(far.y) && rtc_finite(far.z) && !behind;
                job = hit ? (last ? RTC_JOB_EDGES : RTC_JOB_EDGES2) : RTC_JOB_DONE;
            } else {
                bvec2 is = equal(uvec2(job), uvec2(RTC_JOB_EDGES2, RTC_JOB_EDGES2 + 1u));
                vec3 b = mix(mix(v0, v2, bvec3(is.y)), v1, bvec3(is.x));
                vec3 c = mix(mix(v1, v0, bvec3(is.y)), v2, bvec3(is.x));
                int s = rtc_stage2_edge(scaled, b, c, o, d);
                side = mix(side, ivec3(s), bvec3(is.x, is.y, !is.x && !is.y));
                hit = !(rtc_least(side) < 0 && rtc_most(side) > 0);
                job = hit ? job + 1u : RTC_JOB_DONE;
            }
            if (job == RTC_JOB_EDGES) {
                job = rtc_open_edge(side);
                edges_known = job == RTC_JOB_NONE;
            }
        } else if (job == RTC_JOB_SAME) {
            rtc_note(p0, p1, p2, origin, way);
            job++;
        } else if (job == RTC_JOB_SAME + 1u) {
            // Duplicates need no arithmetic: there may be thousands.
            ordered = rtc_noted(p0, p1, p2, origin, way);
            job++;
        } else {
            // A determinant. Edges: exact sign, or where it is 0 the side on which the moved ray passes (see
            // rtc_edge_side): with w = c - b and d the direction,
            //     d.kz (c.x b.y - c.y b.x) = det(d, c, b),
            //     d.kz (c.y - b.y) = -det(d, w, kx),   d.kz (b.x - c.x) = -det(d, w, ky).
            // t = det(v0 - o, v1 - o, v2 - o) / det(d, v1 - v0, v2 - v0). A float f of the ray's own units is
            // det(f, 0, 0; 0, t_up, 0; 0, 0, 1) over 1.
            bool edges = job < RTC_JOB_T;
            uint edge = (job - RTC_JOB_EDGES) / 3u;
            uint attempt = job - RTC_JOB_EDGES - 3u * edge;
            uint which = edges ? 0u : (job < RTC_JOB_ORDER ? job - RTC_JOB_T : job - RTC_JOB_ORDER);
            bool numerator = (which & 1u) == 0u;
            uvec3 none = uvec3(0u);
            uint one = floatBitsToUint(1.0);
            uvec3 x1 = mix(way, p0, bvec3(numerator)), x2 = mix(none, origin, bvec3(numerator));
            uvec3 y1 = p1, y2 = mix(p0, origin, bvec3(numerator));
            uvec3 z1 = p2, z2 = y2;
            if (edges) {
                uvec3 b = mix(mix(p0, p2, bvec3(edge == 1u)), p1, bvec3(edge == 0u));
                uvec3 c = mix(mix(p1, p0, bvec3(edge == 1u)), p2, bvec3(edge == 0u));
                bvec3 first = bvec3(attempt == 0u);
                x1 = way;
                x2 = none;
                y1 = c;
                y2 = mix(b, origin, first);
                z1 = mix(uvec3(attempt == 1u ? one : 0u, attempt == 2u ? one : 0u, 0u), b, first);
                z2 = mix(none, origin, first);
            } else if (job >= RTC_JOB_ORDER + 2u && !other) {
                // With AABBs rtc_hit_t is what is committed, or tmax.
                float f = against_min ? max(rtc_ray_tmin, 0.0) : (RTC_LINK_AABBS ? rtc_hit_t : rtc_ray_tmax);
                x1 = uvec3(numerator ? floatBitsToUint(f) : one, 0u, 0u);
                y1 = uvec3(0u, numerator ? floatBitsToUint(rtc_t_up()) : one, 0u);
                z1 = uvec3(0u, 0u, one);
                x2 = none;
                y2 = none;
                z2 = none;
            }
            rtc_wide_set(0u, x1);
            rtc_wide_set(3u, x2);
            rtc_wide_set(6u, y1);
            rtc_wide_set(9u, y2);
            rtc_wide_set(12u, z1);
            rtc_wide_set(15u, z2);
            uint bottom = rtc_wide_bottom_scale(x1, x2) + rtc_wide_bottom_scale(y1, y2) + rtc_wide_bottom_scale(z1, z2);
            uint top = rtc_wide_top_scale(x1, x2) + rtc_wide_top_scale(y1, y2) + rtc_wide_top_scale(z1, z2);
            rtc_wide_det(which, bottom, top, ((x2.x | x2.y | x2.z) << 1u) == 0u);
            if (edges) {
                int s = (attempt == 0u) == (d.z > 0.0) ? rtc_wide_sign.x : -rtc_wide_sign.x;
                side = mix(side, ivec3(s), equal(uvec3(edge), uvec3(0u, 1u, 2u)));
                // 0 in all three attempts: the edge is a point, there is no area.
                hit = (s != 0 || attempt < 2u) && !(rtc_least(side) < 0 && rtc_most(side) > 0);
                job = hit ? (s != 0 ? rtc_open_edge(side) : job + 1u) : RTC_JOB_DONE;
                edges_known = job == RTC_JOB_NONE;
            } else if (job == RTC_JOB_T + 1u) {
                t = rtc_wide_quotient(above);
                t_known = true;
            } else {
                above = rtc_wide_leading;
                job++;
                ordered = job == RTC_JOB_DONE;
                if (ordered) {
                    order = rtc_wide_compare();
                }
            }
        }
        // What is known now, and what is to be asked next.
        if (edges_known) {
            t_known = sound;
            job = RTC_JOB_T;
        }
        bool next = t_known || ordered;
        if (t_known && !last) {
            bool before = t < rtc_trav_low * (1.0 - RTC_EXACT_TIE);
            against_min = rtc_tied(t, rtc_trav_tmin);
            against_max = !before && t <= rtc_trav_tmax * (1.0 + RTC_EXACT_TIE);
            hit = (against_min || t > rtc_trav_tmin) && (against_max || before);
        } else if (ordered && against_min) {
            hit = order > 0;
            against_min = false;
        } else if (ordered) {
            bool wins = order == 0 && rtc_hit_instance != RTC_NONE &&
                        rtc_comes_first(instance, flags & RTC_SLOT_GEOMETRY_MASK, primitive);
            hit = order < 0 || wins;
            against_max = false;
        }
        if (next) {
            uint question = against_min || !committed ? RTC_JOB_ORDER : RTC_JOB_SAME;
            job = hit && (against_min || against_max) ? question : RTC_JOB_DONE;
        }
        rtc_turns++;
    } while (job != RTC_JOB_DONE);
    if (last) {
        rtc_trav_tmax = t;
        rtc_trav_low = t;
        rtc_hit_attr0 = floatBitsToUint(weights.x);
        rtc_hit_attr1 = floatBitsToUint(weights.y);
    } else {
        result = RTC_STEP_RUNNING;
        if (hit) {
            bool front = (side.x > 0) == upwards;
            result = rtc_meet_triangle(slot, primitive, flags, t, weights.x, weights.y, front);
        }
    }
    return result;
}

// Whether something is left for rtc_settle when the loop has ended this way.
bool rtc_unsettled(uint result) {
    bool committed = !RTC_LINK_AABBS && rtc_hit_instance != RTC_NONE && rtc_hit_slot != RTC_NONE;
    return RTC_LINK_TRIANGLES && (result == RTC_STEP_UNDECIDED || (result == RTC_STEP_DONE && committed));
}
