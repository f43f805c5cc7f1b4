// Tier `exact`: which triangle is hit, and in which order, is what exact
// arithmetic says about these floats: the vertices in the slots and the ray of
// the level, which is the launch's ray (its direction times a power of two,
// rtc_t_down) after one rounding of each operation in
// rtc_transform_point and rtc_transform_vector.
//
// A ray that meets an edge or a vertex exactly is moved by (e, e^2) along
// kx, ky, with e > 0 infinitely small: so one triangle of a closed fan owns it,
// and it hits no triangle edge-on. Equal t go to the lowest (instance,
// geometry, primitive).
//
// Three stages, each for what the one before could not decide:
//   1. floats, with a bound on their error: nearly all tests end here, as misses or as hits at a t that lies
//      between two floats
//   2. pairs of floats, or doubles (RTC_EXACT_FLOAT64): edges, and t to an ulp
//   3. integers (wide.glsl): exact, hundreds of times slower
// The loop of the walk runs the first stage alone (exact_walk.glsl).
#include "padding.glsl"
#include "pairs.glsl"
#include "wide.glsl"

float rtc_trav_low; // the exact t of what is committed lies between this and rtc_trav_tmax, or an ulp beside

// Stage 1. With u = 2^-24 and truncating devices in mind (2u an operation), and
// m the largest |component| of the three v - o as computed:
//   fl(v - o):            2u |v - o|
//   S = fl(d.kx / d.kz):  5u, |S| <= 1
//   p = fl(S z):          9u |p| with what S and z bring along
//   x = fl(x' - p):       2u |x'| + 9u |p| + 2u (|x'| + |p|) <= 17u m = E
// and |x| <= 2m. An edge c.x b.y - c.y b.x moves by E l + 2 E^2, where l is the
// sum of the four |coordinates|, and its own three roundings cost at most
// 4u (|c.x b.y| + |c.y b.x|) <= 4u m l. Together
//   21u m l + 578u^2 m^2 <= 22u m (l + 28u m);
// one bound for all three edges takes all six coordinates for l.
// Products that vanish below 2^-126, flushed or not, cost less than 2^-123.
const float RTC_EXACT_EDGE = 1.31130219e-6; // 22u
const float RTC_EXACT_NEAR = 1.66893006e-6; // 28u
const float RTC_EXACT_FLUSH = 9.4039548e-38; // 2^-123
// t where all edges have the same sign for certain. Let T bound each edge's error, e be edges and det their
// sum as computed. Exact weights B = E / sum E lie in 0 .. 1, so from B sum E = E
//   |B - e / sum e| <= (T + 3T B) / |sum e| <= 4T / |det|, and the quotient's own roundings: 4u + 5u + 2u < 12u.
// The hit is at the sum of B z over the vertices, z = (v - o).kz: with D the two differences of z, |D| <= 2m,
//   4T / |det| (|D1| + |D2|) + 12u (4m) + (z, D, products and sums: below 20u m) <= ... + 68u m.
// 80u leaves room for what the bound itself loses. Over |d.kz|: 5u t more, and RTC_EXACT_TIE's half, 2^-22 t,
// also lies between t and an ulp beside it. m in 2^-50 .. 2^60 and |d.kz| in 2^-60 .. 2^50 keep the numbers
// in range: 1 / det above 2^-126, the bound above 2^-118, t below 2^122.
const float RTC_EXACT_Z = 4.76837158e-6; // 80u
const float RTC_EXACT_T = 9.5367432e-7; // 2^-20

#ifdef RTC_EXACT_FLOAT64
// Stage 2 in double: an operation costs 2^-52. Coordinates x = x' d.kz - d.kx z
// are off by 3 roundings of at most 2m |d.kz| = 2w: E = 6w 2^-52; an edge by
// E l + 2 E^2 and its own 2 (|..| + |..|) <= 2 * 2w l / 2: 8w 2^-52 l + ...,
// so 2^-48 w (l + 2^-48 w) covers it. (Bounds themselves round: factor 2.)
#define RTC_REAL double
#define RTC_REAL_EDGE 3.5527136788005009e-15lf
#define RTC_REAL_DIGITS 5.9604644775390625e-08lf
double rtc_real_difference(float a, float b) { return double(a) - double(b); }
double rtc_real_sum(double a, double b) { return a + b; }
double rtc_real_product(double a, double b) { return a * b; }
double rtc_real_scaled(double a, float b) { return a * double(b); }
double rtc_real_shifted(double a, float power) { return a * double(power); }
double rtc_real_negated(double a) { return -a; }
double rtc_real_size(double a) { return abs(a); }
float rtc_real_float(double a) { return float(a); }
float rtc_real_quotient(double a, double b) { return float(a / b); }
#else
// Stage 2 in pairs: an operation costs 2^-43 (pairs.glsl), hence as for double
// 16w 2^-43 l, rounded up to 2^-38 w (l + 2^-38 w).
#define RTC_REAL vec2
#define RTC_REAL_EDGE 3.637978807e-12
#define RTC_REAL_DIGITS 6.103515625e-5
vec2 rtc_real_difference(float a, float b) { return rtc_two_sum(a, -b); }
vec2 rtc_real_sum(vec2 a, vec2 b) { return rtc_pair_sum(a, b); }
vec2 rtc_real_product(vec2 a, vec2 b) { return rtc_pair_product(a, b); }
vec2 rtc_real_scaled(vec2 a, float b) { return rtc_pair_scaled(a, b); }
vec2 rtc_real_shifted(vec2 a, float power) { return a * power; }
vec2 rtc_real_negated(vec2 a) { return vec2(-a.x, -a.y); }
float rtc_real_size(vec2 a) { return abs(a.x); }
float rtc_real_float(vec2 a) { return a.x; }
float rtc_real_quotient(vec2 a, vec2 b) { return rtc_pair_quotient(a, b); }
#endif

RTC_REAL rtc_real_minus(RTC_REAL a, RTC_REAL b) { return rtc_real_sum(a, rtc_real_negated(b)); }

// a b - c d
RTC_REAL rtc_real_minor(RTC_REAL a, RTC_REAL b, RTC_REAL c, RTC_REAL d) {
    return rtc_real_minus(rtc_real_product(a, b), rtc_real_product(c, d));
}

int rtc_sign(float v) { return v > 0.0 ? 1 : (v < 0.0 ? -1 : 0); }

uvec3 rtc_bits(vec3 v) { return floatBitsToUint(v); }

// Stage 3 of one edge: its exact sign, or where it is 0 the side on which the
// moved ray passes (see rtc_edge_side): with w = c - b and d the direction,
//     d.kz (c.x b.y - c.y b.x) = det(d, c, b),
//     d.kz (c.y - b.y) = -det(d, w, kx),   d.kz (b.x - c.x) = -det(d, w, ky).
int rtc_wide_side(vec3 b, vec3 c, vec3 o, vec3 d) {
    uvec3 none = uvec3(0u);
    uint one = floatBitsToUint(1.0);
    int side = 0;
    for (uint i = 0u; i < 3u && side == 0; ++i) {
        uvec3 y1 = rtc_bits(c), y2 = mix(rtc_bits(b), rtc_bits(o), bvec3(i == 0u));
        uvec3 z1 = mix(uvec3(i == 1u ? one : 0u, i == 2u ? one : 0u, 0u), rtc_bits(b), bvec3(i == 0u));
        uvec3 z2 = mix(none, rtc_bits(o), bvec3(i == 0u));
        rtc_wide_det(0u, rtc_bits(d), none, y1, y2, z1, z2);
        side = (i == 0u ? 1 : -1) * rtc_wide_sign[0];
        rtc_turns++;
    }
    return d.z < 0.0 ? -side : side;
}

// Numerator and denominator of t = det(v0 - o, v1 - o, v2 - o) /
// det(d, v1 - v0, v2 - v0) into two accumulators.
void rtc_wide_t(uint which, uvec3 v0, uvec3 v1, uvec3 v2, uvec3 o, uvec3 d) {
    for (uint i = 0u; i < 2u; ++i) {
        bool above = i == 0u;
        rtc_wide_det(which + i, mix(d, v0, bvec3(above)), mix(uvec3(0u), o, bvec3(above)), v1,
                     mix(v0, o, bvec3(above)), v2, mix(v0, o, bvec3(above)));
        rtc_turns++;
    }
}

// Stages 2 and 3. Edges whose sign stage 1 knows come as known.
bool rtc_exact_triangle(vec3 v0, vec3 v1, vec3 v2, ivec3 known, out float t, out float b1, out float b2,
                        out bool front) {
    vec3 o = rtc_axes(rtc_trav_origin);
    vec3 d = rtc_axes(rtc_trav_direction);
    vec3 p0 = rtc_axes(v0), p1 = rtc_axes(v1), p2 = rtc_axes(v2);
    RTC_REAL ax = rtc_real_difference(p0.x, o.x), ay = rtc_real_difference(p0.y, o.y);
    RTC_REAL az = rtc_real_difference(p0.z, o.z);
    RTC_REAL bx = rtc_real_difference(p1.x, o.x), by = rtc_real_difference(p1.y, o.y);
    RTC_REAL bz = rtc_real_difference(p1.z, o.z);
    RTC_REAL cx = rtc_real_difference(p2.x, o.x), cy = rtc_real_difference(p2.y, o.y);
    RTC_REAL cz = rtc_real_difference(p2.z, o.z);
    vec3 sizes = max(max(abs(p0 - o), abs(p1 - o)), abs(p2 - o));
    float m = max(sizes.x, max(sizes.y, sizes.z));
    // Pairs lose their low parts, and squares their lives, outside a range;
    // beyond it every decision is the integers'.
    bool sound = m > 8.6736174e-19 && m < 1.1529215e18; // 2^-60, 2^60
    // Powers of two that put m and |d.kz| into [1, 2).
    int m_exponent = int(floatBitsToUint(m) >> 23u) - 127;
    int d_exponent = int((floatBitsToUint(d.z) >> 23u) & 255u) - 127;
    float m_scale = rtc_power(127 - clamp(m_exponent, -60, 60));
    float d_scale = rtc_power(127 - d_exponent);
    float dx = d.x * d_scale, dy = d.y * d_scale, dz = d.z * d_scale;
    ax = rtc_real_shifted(ax, m_scale);
    ay = rtc_real_shifted(ay, m_scale);
    az = rtc_real_shifted(az, m_scale);
    bx = rtc_real_shifted(bx, m_scale);
    by = rtc_real_shifted(by, m_scale);
    bz = rtc_real_shifted(bz, m_scale);
    cx = rtc_real_shifted(cx, m_scale);
    cy = rtc_real_shifted(cy, m_scale);
    cz = rtc_real_shifted(cz, m_scale);
    float az_float = rtc_real_float(az);

    RTC_REAL x0 = rtc_real_minus(rtc_real_scaled(ax, dz), rtc_real_scaled(az, dx));
    RTC_REAL y0 = rtc_real_minus(rtc_real_scaled(ay, dz), rtc_real_scaled(az, dy));
    RTC_REAL x1 = rtc_real_minus(rtc_real_scaled(bx, dz), rtc_real_scaled(bz, dx));
    RTC_REAL y1 = rtc_real_minus(rtc_real_scaled(by, dz), rtc_real_scaled(bz, dy));
    RTC_REAL x2 = rtc_real_minus(rtc_real_scaled(cx, dz), rtc_real_scaled(cz, dx));
    RTC_REAL y2 = rtc_real_minus(rtc_real_scaled(cy, dz), rtc_real_scaled(cz, dy));
    RTC_REAL e0 = rtc_real_minor(x2, y1, y2, x1);
    RTC_REAL e1 = rtc_real_minor(x0, y2, y0, x2);
    RTC_REAL e2 = rtc_real_minor(x1, y0, y1, x0);
    ivec3 side = known;
    if (sound) {
        // w < 4, as m and |d.kz| are below 2. What is lost below 2^-126 costs
        // less than 2^-100.
        float l0 = float(rtc_real_size(x0)) + float(rtc_real_size(y0));
        float l1 = float(rtc_real_size(x1)) + float(rtc_real_size(y1));
        float l2 = float(rtc_real_size(x2)) + float(rtc_real_size(y2));
        float unit = 4.0 * float(RTC_REAL_EDGE);
        float extra = unit * unit + 7.888609e-31;
        float t0 = unit * (l1 + l2) + extra, t1 = unit * (l0 + l2) + extra, t2 = unit * (l0 + l1) + extra;
        float f0 = rtc_real_float(e0), f1 = rtc_real_float(e1), f2 = rtc_real_float(e2);
        side.x = side.x == 0 && abs(f0) > t0 ? rtc_sign(f0) : side.x;
        side.y = side.y == 0 && abs(f1) > t1 ? rtc_sign(f1) : side.y;
        side.z = side.z == 0 && abs(f2) > t2 ? rtc_sign(f2) : side.z;
    }
    bool both = min(side.x, min(side.y, side.z)) < 0 && max(side.x, max(side.y, side.z)) > 0;
    for (uint i = 0u; i < 3u && !both; ++i) {
        if ((i == 0u ? side.x : (i == 1u ? side.y : side.z)) == 0) {
            // Edge i runs between the two other vertices.
            vec3 b = mix(mix(p0, p2, bvec3(i == 1u)), p1, bvec3(i == 0u));
            vec3 c = mix(mix(p1, p0, bvec3(i == 1u)), p2, bvec3(i == 0u));
            // 0 when the edge is a point: no area. Any two signs then end it.
            int s = rtc_wide_side(b, c, o, d);
            both = both || s == 0;
            side.x = i == 0u ? s : side.x;
            side.y = i == 1u ? s : side.y;
            side.z = i == 2u ? s : side.z;
        }
        rtc_turns++;
        both = both || (min(side.x, min(side.y, side.z)) < 0 && max(side.x, max(side.y, side.z)) > 0);
    }
    bool hit = !both;
    t = 0.0;
    b1 = 0.0;
    b2 = 0.0;
    front = (side.x > 0) == (d.z > 0.0);
    if (hit) {
        float det = rtc_real_float(rtc_real_sum(rtc_real_sum(e0, e1), e2));
        // Where all three drown in rounding the weights are anything in range.
        bool weights = det != 0.0 && rtc_finite(det);
        float inverse = 1.0 / (weights ? det : 1.0);
        b1 = weights ? min(max(rtc_real_float(e1) * inverse, 0.0), 1.0) : 0.0;
        b2 = weights ? min(max(rtc_real_float(e2) * inverse, 0.0), 1.0 - b1) : 0.0;

        // t = n . (v0 - o) / n . d with n = (v1 - v0) x (v2 - v0), whose
        // differences are fresh: their size is the triangle's, not the distance's.
        RTC_REAL fx = rtc_real_shifted(rtc_real_difference(p1.x, p0.x), m_scale);
        RTC_REAL fy = rtc_real_shifted(rtc_real_difference(p1.y, p0.y), m_scale);
        RTC_REAL fz = rtc_real_shifted(rtc_real_difference(p1.z, p0.z), m_scale);
        RTC_REAL gx = rtc_real_shifted(rtc_real_difference(p2.x, p0.x), m_scale);
        RTC_REAL gy = rtc_real_shifted(rtc_real_difference(p2.y, p0.y), m_scale);
        RTC_REAL gz = rtc_real_shifted(rtc_real_difference(p2.z, p0.z), m_scale);
        RTC_REAL nx = rtc_real_minor(fy, gz, fz, gy);
        RTC_REAL ny = rtc_real_minor(fz, gx, fx, gz);
        RTC_REAL nz = rtc_real_minor(fx, gy, fy, gx);
        RTC_REAL above = rtc_real_sum(
            rtc_real_sum(rtc_real_product(nx, ax), rtc_real_product(ny, ay)), rtc_real_product(nz, az));
        RTC_REAL below = rtc_real_sum(rtc_real_sum(rtc_real_scaled(nx, dx), rtc_real_scaled(ny, dy)),
                                      rtc_real_scaled(nz, dz));
        // A minor and a dot product are off by at most 2 + 3 operations' errors
        // of the sum of all magnitudes: less than 2^-40 of it for pairs, 2^-49
        // for doubles. RTC_REAL_DIGITS, 2^-14 or 2^-24, asks that both be above
        // 2^26 or 2^25 of that error, so that t is off by less than an ulp.
        float ux = float(rtc_real_size(fy) * rtc_real_size(gz) + rtc_real_size(fz) * rtc_real_size(gy));
        float uy = float(rtc_real_size(fz) * rtc_real_size(gx) + rtc_real_size(fx) * rtc_real_size(gz));
        float uz = float(rtc_real_size(fx) * rtc_real_size(gy) + rtc_real_size(fy) * rtc_real_size(gx));
        float above_size = (ux * float(rtc_real_size(ax)) + uy * float(rtc_real_size(ay))) +
                           uz * float(rtc_real_size(az));
        float below_size = (ux * abs(dx) + uy * abs(dy)) + uz * abs(dz);
        float limit = float(RTC_REAL_DIGITS);
        float n = rtc_real_float(above), k = rtc_real_float(below);
        sound = sound && below_size > 7.888609e-31 && abs(k) > limit * below_size; // 2^-100
        // Behind the origin, however short of digits: common for rays that start on a surface.
        float slack = limit * limit * above_size;
        bool behind = sound && (k > 0.0 ? n : -n) < -slack;
        sound = sound && above_size > 7.888609e-31 && abs(n) > limit * above_size;
        if (behind) {
            hit = false;
        } else if (sound) {
            t = rtc_ldexp(rtc_real_quotient(above, below), m_exponent - d_exponent);
        } else {
            rtc_wide_t(0u, rtc_bits(p0), rtc_bits(p1), rtc_bits(p2), rtc_bits(o), rtc_bits(d));
            t = rtc_wide_quotient();
        }
    }
    return hit;
}

// Stage 1: RTC_FILTER_*. `front` as rtc_exact_triangle has it. The exact t of a hit lies between low and high.
const uint RTC_FILTER_MISS = 0u;
const uint RTC_FILTER_HIT = 1u;
const uint RTC_FILTER_UNDECIDED = 2u;

uint rtc_filter_triangle(vec3 v0, vec3 v1, vec3 v2, out float low, out float high, out bool front) {
    vec3 a = rtc_axes(v0 - rtc_trav_origin);
    vec3 b = rtc_axes(v1 - rtc_trav_origin);
    vec3 c = rtc_axes(v2 - rtc_trav_origin);
    float sx = rtc_trav_shear.x;
    float sy = rtc_trav_shear.y;
    float ax = a.x - sx * a.z, ay = a.y - sy * a.z;
    float bx = b.x - sx * b.z, by = b.y - sy * b.z;
    float cx = c.x - sx * c.z, cy = c.y - sy * c.z;
    float e0 = cx * by - cy * bx;
    float e1 = ax * cy - ay * cx;
    float e2 = bx * ay - by * ax;
    vec3 sizes = max(max(abs(a), abs(b)), abs(c));
    float m = max(sizes.x, max(sizes.y, sizes.z));
    float l = ((abs(ax) + abs(ay)) + (abs(bx) + abs(by))) + (abs(cx) + abs(cy));
    float bound = (RTC_EXACT_EDGE * m) * (l + RTC_EXACT_NEAR * m) + RTC_EXACT_FLUSH;
    float least = min(e0, min(e1, e2));
    float most = max(e0, max(e1, e2));
    // Products above 2^126 might be infinite, and so might the shear: then
    // nothing is known.
    float speed = abs(rtc_trav_shear.z);
    bool bounded = m < 4.6116860e18 && speed > 7.5231638e-37 && speed < 1.3292280e36; // 2^62, 2^-120, 2^120
    uint verdict = bounded && most > bound && least < -bound ? RTC_FILTER_MISS : RTC_FILTER_UNDECIDED;
    low = 0.0;
    high = 0.0;
    front = false;
    bool ordinary = m > 8.8817842e-16 && m < 1.1529215e18 && speed > 8.6736174e-19 && speed < 1.1258999e15;
    if (ordinary && (least > bound || most < -bound)) {
        verdict = RTC_FILTER_HIT;
        float det = (e0 + e1) + e2;
        float inverse = 1.0 / det;
        float dy = b.z - a.z, dz = c.z - a.z;
        float z = (a.z + (e1 * inverse) * dy) + (e2 * inverse) * dz;
        float off = (4.0 * bound) * abs(inverse) * (abs(dy) + abs(dz)) + RTC_EXACT_Z * m;
        float t = z / rtc_trav_shear.z;
        off = off / speed + RTC_EXACT_T * abs(t);
        low = t - off;
        high = t + off;
        front = (det > 0.0) == (rtc_trav_shear.z > 0.0);
    }
    return verdict;
}

// t of two triangles, or of a triangle and a float, cannot be told apart by
// floats that are off by an ulp (2^-23) each.
const float RTC_EXACT_TIE = 4.76837158e-7; // 2^-21

bool rtc_tied(float a, float b) { return abs(a - b) <= RTC_EXACT_TIE * max(abs(a), abs(b)); }

uvec3 rtc_slot_vertex(RtcBase slots, uint slot, uint i) {
    return rtc_quad(slots, slot * RTC_TRIANGLE_QUADS + i).xyz;
}

// Sign of the candidate's exact t less that of the committed triangle
// (`slot`, in the committed instance) or, without one, of `other` (in the
// ray's own units).
int rtc_wide_order(uint candidate, uint slot, float other) {
    uvec3 o = rtc_bits(rtc_trav_origin);
    uvec3 d = rtc_bits(rtc_trav_direction);
    uvec3 v0 = rtc_slot_vertex(rtc_advance(rtc_trav_base, rtc_trav_slots), candidate, 0u);
    uvec3 v1 = rtc_slot_vertex(rtc_advance(rtc_trav_base, rtc_trav_slots), candidate, 1u);
    uvec3 v2 = rtc_slot_vertex(rtc_advance(rtc_trav_base, rtc_trav_slots), candidate, 2u);
    bool same = false;
    uvec3 w0 = uvec3(0u), w1 = uvec3(0u), w2 = uvec3(0u), o2 = uvec3(0u), d2 = uvec3(0u);
    if (slot != RTC_NONE) {
        RtcBase record = rtc_instance_record(rtc_ray_root, rtc_hit_instance);
        uvec4 ids = rtc_quad(record, 6u);
        RtcBase base = rtc_base(ids.x, ids.y);
        RtcBase slots = rtc_advance(base, rtc_quad(base, RTC_HDR_NODES / 4u).y); // nodes, slots, ...
        w0 = rtc_slot_vertex(slots, slot, 0u);
        w1 = rtc_slot_vertex(slots, slot, 1u);
        w2 = rtc_slot_vertex(slots, slot, 2u);
        o2 = rtc_bits(rtc_object_ray_origin(rtc_ray_root, rtc_hit_instance, rtc_ray_origin));
        d2 = rtc_bits(rtc_object_ray_direction(rtc_ray_root, rtc_hit_instance,
                                               rtc_ray_direction * rtc_t_down()));
        // Duplicates need no arithmetic: there may be thousands.
        same = v0 == w0 && v1 == w1 && v2 == w2 && o == o2 && d == d2;
    }
    int order = 0;
    if (!same) {
        uvec3 none = uvec3(0u);
        uint one = floatBitsToUint(1.0);
        for (uint i = 0u; i < 4u; ++i) {
            // As rtc_wide_t; a float f is det(f, 0, 0; 0, t_up, 0; 0, 0, 1) over 1.
            bool above = (i & 1u) == 0u;
            bool second = i >= 2u;
            uvec3 p0 = mix(v0, w0, bvec3(second)), p1 = mix(v1, w1, bvec3(second)),
                  p2 = mix(v2, w2, bvec3(second));
            uvec3 origin = mix(o, o2, bvec3(second)), direction = mix(d, d2, bvec3(second));
            uvec3 x1 = mix(direction, p0, bvec3(above)), x2 = mix(none, origin, bvec3(above));
            uvec3 y2 = mix(p0, origin, bvec3(above)), z2 = y2;
            if (second && slot == RTC_NONE) {
                x1 = uvec3(above ? floatBitsToUint(other) : one, 0u, 0u);
                p1 = uvec3(0u, above ? floatBitsToUint(rtc_t_up()) : one, 0u);
                p2 = uvec3(0u, 0u, one);
                x2 = none;
                y2 = none;
                z2 = none;
            }
            rtc_wide_det(i, x1, x2, p1, y2, p2, z2);
            rtc_turns++;
        }
        order = rtc_wide_compare();
    }
    return order;
}

bool rtc_comes_first(uint instance, uint geometry, uint primitive) {
    uint committed = rtc_hit_packed & RTC_SLOT_GEOMETRY_MASK;
    return instance != rtc_hit_instance   ? instance < rtc_hit_instance
           : geometry != committed ? geometry < committed
                                          : primitive < rtc_hit_primitive;
}

bool rtc_in_range(float t, uint slot, uint primitive, uint geometry) {
    rtc_cand_slot = slot;
    bool before = t < rtc_trav_low * (1.0 - RTC_EXACT_TIE);
    bool near_min = rtc_tied(t, rtc_trav_tmin);
    bool near_max = !before && t <= rtc_trav_tmax * (1.0 + RTC_EXACT_TIE);
    bool inside = (near_min || t > rtc_trav_tmin) && (near_max || before);
    if (inside && (near_min || near_max)) {
        uint against = rtc_hit_instance != RTC_NONE ? rtc_hit_slot : RTC_NONE;
        for (uint i = 0u; i < 2u && inside; ++i) {
            bool low = i == 0u;
            if (low ? near_min : near_max) {
                int order = rtc_wide_order(slot, low ? RTC_NONE : against, low ? max(rtc_ray_tmin, 0.0) : rtc_ray_tmax);
                bool wins = order == 0 && rtc_hit_instance != RTC_NONE &&
                            rtc_comes_first(rtc_trav_instance, geometry & RTC_SLOT_GEOMETRY_MASK, primitive);
                inside = low ? order > 0 : order < 0 || wins;
            }
            rtc_turns++;
        }
    }
    return inside;
}

// A report at the very float that a committed triangle's t rounds to comes
// after it: which of the two the exact t favours cannot be asked by then.
bool rtc_report_in_range(float t) {
    bool tie = t == rtc_hit_t && rtc_hit_instance != RTC_NONE;
    bool wins = rtc_hit_slot == RTC_NONE && rtc_comes_first(rtc_cand_instance, rtc_cand_geometry, rtc_cand_primitive);
    rtc_cand_slot = RTC_NONE;
    return t >= rtc_ray_tmin && t <= rtc_hit_t && (!tie || wins);
}

// As in range.glsl. The exact t lies strictly between tmin and tmax, but what it rounds to may be one of them: then its
// neighbour inside is as near. (Where no float lies between the two it is tmax.)
float rtc_hit_distance(float t) {
    t *= rtc_t_down();
    int bits = t > 0.0 ? floatBitsToInt(t) : 0x00800000;
    int least = max(floatBitsToInt(rtc_ray_tmin), 0) + 1;
    return intBitsToFloat(max(min(bits, floatBitsToInt(rtc_ray_tmax) - 1), least));
}

void rtc_accepted() {
    rtc_hit_slot = rtc_cand_slot;
    rtc_trav_low = rtc_trav_tmax;
}
