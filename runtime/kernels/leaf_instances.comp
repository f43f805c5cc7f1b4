#version 450
#extension GL_GOOGLE_include_directive : require
#ifdef RTR_ADDRESS
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#endif
// Instances: the record traversal reads, the facts, and a conservative world box.
#include "common.glsl"
#include "leaf.glsl"
#include "block.glsl"
#include "range.glsl"
#include "refit.glsl"

// ---- two-float arithmetic (Dekker 1971, Knuth): hi + lo, |lo| <= ulp(hi) / 2 ----
// `precise` keeps drivers from rearranging it; fma() is not used because GLSL does not
// promise that it is fused.
vec2 two_sum(float a, float b) {
    precise float s = a + b;
    precise float bb = s - a;
    precise float e = (a - (s - bb)) + (b - bb);
    return vec2(s, e);
}
vec2 split(float a) {
    precise float c = 4097.0 * a; // 2^12 + 1
    precise float hi = c - (c - a);
    precise float lo = a - hi;
    return vec2(hi, lo);
}
vec2 two_product(float a, float b) {
    precise float x = a * b;
    vec2 s = split(a), t = split(b);
    precise float e = ((s.x * t.x - x) + s.x * t.y + s.y * t.x) + s.y * t.y;
    return vec2(x, e);
}
vec2 dd_add(vec2 a, vec2 b) {
    vec2 s = two_sum(a.x, b.x);
    precise float e = s.y + (a.y + b.y);
    return two_sum(s.x, e);
}
vec2 dd_mul(vec2 a, vec2 b) {
    vec2 m = two_product(a.x, b.x);
    precise float e = m.y + (a.x * b.y + a.y * b.x);
    return two_sum(m.x, e);
}
vec2 dd_neg(vec2 a) { return -a; }
vec2 dd_div(vec2 a, vec2 b) {
    precise float q0 = a.x / b.x;
    vec2 r = dd_add(a, dd_neg(dd_mul(b, vec2(q0, 0.0))));
    precise float q1 = r.x / b.x;
    r = dd_add(r, dd_neg(dd_mul(b, vec2(q1, 0.0))));
    precise float q2 = r.x / b.x;
    vec2 q = two_sum(q0, q1);
    return dd_add(q, vec2(q2, 0.0));
}

// a*b - c*d
vec2 det2(float a, float b, float c, float d) { return dd_add(two_product(a, b), dd_neg(two_product(c, d))); }

// Exponent of the largest magnitude, as a power of two near it, so that products neither
// overflow nor lose their low parts to underflow.
float power_near(float m) {
    uint e = clamp((floatBitsToUint(m) >> 23) & 0xffu, 1u, 253u);
    return uintBitsToFloat(e << 23);
}

// Inverse of rows m[r] = (linear, translation). Adjugate over determinant in two-float
// arithmetic on the linear part scaled to about 1; each entry is then within about one
// rounding of the exact inverse unless the matrix is singular to 40 bits.
void invert(vec4 m[3], out vec4 w[3]) {
    float biggest = 0.0;
    for (uint r = 0u; r < 3u; r++)
        biggest = max(biggest, max(abs(m[r].x), max(abs(m[r].y), abs(m[r].z))));
    float scale = power_near(biggest);
    float inv_scale = 1.0 / scale;
    precise vec3 a = m[0].xyz * inv_scale;
    precise vec3 b = m[1].xyz * inv_scale;
    precise vec3 c = m[2].xyz * inv_scale;
    vec2 adj[9];
    adj[0] = det2(b.y, c.z, b.z, c.y);
    adj[1] = det2(a.z, c.y, a.y, c.z);
    adj[2] = det2(a.y, b.z, a.z, b.y);
    adj[3] = det2(b.z, c.x, b.x, c.z);
    adj[4] = det2(a.x, c.z, a.z, c.x);
    adj[5] = det2(a.z, b.x, a.x, b.z);
    adj[6] = det2(b.x, c.y, b.y, c.x);
    adj[7] = det2(a.y, c.x, a.x, c.y);
    adj[8] = det2(a.x, b.y, a.y, b.x);
    vec2 det = dd_add(dd_add(dd_mul(vec2(a.x, 0.0), adj[0]), dd_mul(vec2(a.y, 0.0), adj[3])),
                      dd_mul(vec2(a.z, 0.0), adj[6]));
    // Translations are scaled apart: they may be far larger or smaller than the rest.
    float far = max(abs(m[0].w), max(abs(m[1].w), abs(m[2].w)));
    float t_scale = far > 0.0 ? power_near(far) : 1.0;
    float inv_t = 1.0 / t_scale;
    for (uint r = 0u; r < 3u; r++) {
        vec2 q0 = dd_div(adj[3u * r], det);
        vec2 q1 = dd_div(adj[3u * r + 1u], det);
        vec2 q2 = dd_div(adj[3u * r + 2u], det);
        vec2 t = dd_add(dd_add(dd_mul(q0, vec2(m[0].w * inv_t, 0.0)), dd_mul(q1, vec2(m[1].w * inv_t, 0.0))),
                        dd_mul(q2, vec2(m[2].w * inv_t, 0.0)));
        precise vec4 row = vec4(q0.x + q0.y, q1.x + q1.y, q2.x + q2.y, -(t.x + t.y)) *
                           vec4(vec3(inv_scale), inv_scale);
        row.w = row.w * t_scale;
        w[r] = row;
    }
}

void main() {
    uint i = lane_index();
    bool in_range = i < p.count;
    // The window of records starts at this dispatch's first instance; see refit.glsl for updates.
    uint rec = i * RTC_INSTANCE_QUADS;
    if ((p.flags & RTR_BUILD_UPDATE) != 0u) {
        rec = dst_header[RTC_HDR_SLOTS] + (p.first + i) * RTC_INSTANCE_QUADS;
        in_range = in_range && fits() && rec >= p.window_first && rec - p.window_first < p.window_count;
        rec -= p.window_first;
    }
    bool active_ = false;
    vec3 lo = vec3(0.0), hi = vec3(0.0);
    if (in_range) {
        // Beyond an indirect count nothing is read, and the record is that of an inactive instance.
        bool given = in_range_of_geometry(i);
        uint at = ((p.data_offset + range_offset()) >> 2) + i * 16u;
        vec4 m[3];
        for (uint r = 0u; r < 3u; r++)
            for (uint k = 0u; k < 4u; k++) m[r][k] = given ? uintBitsToFloat(in_data[at + 4u * r + k]) : 0.0;
        uint id_mask = given ? in_data[at + 12u] : 0u;
        uint sbt_flags = given ? in_data[at + 13u] : 0u;
        uint base_lo = given ? in_data[at + 14u] : 0u;
        uint base_hi = given ? in_data[at + 15u] : 0u;
        active_ = (base_lo | base_hi) != 0u;
        // A reference to nothing that was built here is never followed; the header tells
        // which instance it was.
        bool there = true;
        if (active_) {
            if ((p.flags & RTR_BUILD_CHECKED) != 0u) there = marks[p.first + i] != 0u;
            else there = is_structure(base_lo, base_hi);
        }
        if (!there) {
            active_ = false;
            atomicMin(state[RTR_ST_OFFENDER], p.first + i);
            atomicMin(state[RTR_ST_BAD_INSTANCE], p.first + i);
        }
        for (uint r = 0u; r < 3u; r++) active_ = active_ && !any_nan(m[r].xyz) && !is_nan(m[r].w);

        uint facts = 0u, slots = 0u, nodes = 0u;
        vec4 w[3];
        w[0] = vec4(0.0); w[1] = vec4(0.0); w[2] = vec4(0.0);
        if (active_) {
            uvec4 h1 = block_quad(base_lo, base_hi, RTC_HDR_FACTS / 4u);
            uvec4 h2 = block_quad(base_lo, base_hi, RTC_HDR_BOUNDS_MIN / 4u);
            uvec4 h3 = block_quad(base_lo, base_hi, RTC_HDR_BOUNDS_MAX / 4u);
            uvec4 h4 = block_quad(base_lo, base_hi, RTC_HDR_NODES / 4u);
            facts = h1.x;
            nodes = h4.x;
            slots = h4.y;
            vec3 blo = uintBitsToFloat(h2.xyz), bhi = uintBitsToFloat(h3.xyz);
            // h1.w: ACTIVE_COUNT. An empty bottom level can never be hit: it gets a
            // point at its origin, so that it still counts and costs nothing.
            if (h1.w == 0u) { blo = vec3(0.0); bhi = vec3(0.0); }

            // World box (Arvo 1990): per row, each entry times the bound it prefers.
            // Widening: a hit found in object space at p lies within the box of the
            // bottom level as traversal sees it; what it may miss in world space is the
            // rounding of (1) this sum: 4 operations, <= 4u (|M||p| + |t|), twice, since
            // traversal rounds its own transform of the ray the same way, and (2) the
            // world-to-object matrix, entries within u relative, and its product with
            // points as far away as the translation: <= 4u |M||W| (|M||p| + |t|) mapped
            // back to world. u = 2^-24. The factor 8 + 4K covers both with slack for the
            // roundings of this bound itself.
            invert(m, w);
            // A singular transform breaks a rule of the API; such an instance is never hit.
            for (uint r = 0u; r < 3u; r++)
                for (uint k = 0u; k < 4u; k++)
                    active_ = active_ && (floatBitsToUint(w[r][k]) & 0x7f800000u) != 0x7f800000u;
            vec3 reach = max(abs(blo), abs(bhi));
            vec3 size;
            for (uint r = 0u; r < 3u; r++) {
                size[r] = abs(m[r].x) * reach.x + abs(m[r].y) * reach.y + abs(m[r].z) * reach.z + abs(m[r].w);
            }
            vec3 back; // |W| size
            for (uint r = 0u; r < 3u; r++)
                back[r] = abs(w[r].x) * size.x + abs(w[r].y) * size.y + abs(w[r].z) * size.z;
            for (uint r = 0u; r < 3u; r++) {
                precise float l = m[r].w, h = m[r].w;
                for (uint k = 0u; k < 3u; k++) {
                    precise float a = m[r][k] * blo[k];
                    precise float b = m[r][k] * bhi[k];
                    l += min(a, b);
                    h += max(a, b);
                }
                float k_size = abs(m[r].x) * back.x + abs(m[r].y) * back.y + abs(m[r].z) * back.z;
                // An inverse that overflowed (singular matrix) widens by the plain terms only.
                if (!(k_size < RTR_FLT_MAX)) k_size = size[r];
                float pad = (8.0 * size[r] + 4.0 * k_size) * 5.9604645e-8 + 1.1754944e-38;
                lo[r] = l - pad;
                hi[r] = h + pad;
            }
            for (uint r = 0u; r < 3u; r++) {
                if (is_nan(lo[r])) lo[r] = -RTR_FLT_MAX;
                if (is_nan(hi[r])) hi[r] = RTR_FLT_MAX;
            }
        }

        if ((p.flags & RTR_BUILD_UPDATE) != 0u && active_ != ((dst_slots[rec + 6u].x | dst_slots[rec + 6u].y) != 0u))
            changed_activity(p.first + i);
        for (uint r = 0u; r < 3u; r++) {
            dst_slots[rec + r] = floatBitsToUint(w[r]);
            dst_slots[rec + 3u + r] = uvec4(0u);
            if (given)
                dst_slots[rec + 3u + r] = uvec4(in_data[at + 4u * r], in_data[at + 4u * r + 1u],
                                                in_data[at + 4u * r + 2u], in_data[at + 4u * r + 3u]);
        }
        dst_slots[rec + 6u] = uvec4(active_ ? base_lo : 0u, active_ ? base_hi : 0u, id_mask, sbt_flags);
        bool identity = m[0] == vec4(1.0, 0.0, 0.0, 0.0) && m[1] == vec4(0.0, 1.0, 0.0, 0.0) &&
                        m[2] == vec4(0.0, 0.0, 1.0, 0.0);
        dst_slots[rec + 7u] = uvec4(facts | (identity ? RTC_FACT_IDENTITY_TRANSFORMS : 0u), slots, nodes, 0u);

        if (active_) {
            uint flags = sbt_flags >> 24;
            uint broken = 0u;
            bool opaque = (flags & RTC_INSTANCE_FORCE_OPAQUE) != 0u ||
                          ((facts & RTC_FACT_ALL_OPAQUE) != 0u && (flags & RTC_INSTANCE_FORCE_NO_OPAQUE) == 0u);
            if (!opaque) broken |= RTC_FACT_ALL_OPAQUE;
            if ((id_mask >> 24) != 0xffu) broken |= RTC_FACT_FULL_MASKS;
            if (flags != 0u) broken |= RTC_FACT_NO_INSTANCE_FLAGS;
            if (!identity) broken |= RTC_FACT_IDENTITY_TRANSFORMS;
            if (broken != 0u) {
                atomicOr(state[RTR_ST_BROKEN], broken);
                atomicMin(state[RTR_ST_OFFENDER], p.first + i);
            }
            uint has = (facts & RTC_FACT_AABBS) != 0u ? RTC_FACT_HAS_AABBS : RTC_FACT_HAS_TRIANGLES;
            atomicOr(state[RTR_ST_HAS], has);
            // The first of each kind, for launches that assumed otherwise.
            uint word = (p.first + i) << RTC_OFFENDER_INSTANCE_SHIFT;
            for (uint left = broken | has; left != 0u; left &= left - 1u) {
                uint bit = findLSB(left);
                uint geometry = RTC_OFFENDER_NO_GEOMETRY;
                if ((1u << bit) == RTC_FACT_ALL_OPAQUE && (flags & RTC_INSTANCE_FORCE_NO_OPAQUE) == 0u) {
                    uint first = block_quad(base_lo, base_hi, (RTC_HDR_OFFENDERS + bit) / 4u)[(RTC_HDR_OFFENDERS + bit) & 3u];
                    geometry = min(first, RTC_OFFENDER_NO_GEOMETRY);
                }
                if (state[RTR_ST_OFFENDERS + bit] > (word | geometry))
                    atomicMin(state[RTR_ST_OFFENDERS + bit], word | geometry);
            }
        }
    }
    store_leaf(in_range, p.first + i, active_, lo, hi);
}
