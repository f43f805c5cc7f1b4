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
// The loop of the walk runs the first stage alone (exact_walk.glsl); the others follow it (exact_settle.glsl).
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

// Stage 2, with everything turned so that the ray moves fastest along z. Powers of two put m, the largest |v - o|,
// and |d.kz| into [1, 2). Pairs lose their low parts, and squares their lives, outside a range; beyond it (`sound` is
// false) every decision is the integers'.
struct RtcStage2 {
    int m_exponent, d_exponent;
    float m_scale, d_scale;
    bool sound;
};

RtcStage2 rtc_stage2(vec3 p0, vec3 p1, vec3 p2, vec3 o, vec3 d) {
    RtcStage2 scaled;
    vec3 sizes = max(max(abs(p0 - o), abs(p1 - o)), abs(p2 - o));
    float m = max(sizes.x, max(sizes.y, sizes.z));
    scaled.sound = m > 8.6736174e-19 && m < 1.1529215e18; // 2^-60, 2^60
    scaled.m_exponent = int(floatBitsToUint(m) >> 23u) - 127;
    scaled.d_exponent = int((floatBitsToUint(d.z) >> 23u) & 255u) - 127;
    scaled.m_scale = rtc_power(127 - clamp(scaled.m_exponent, -60, 60));
    scaled.d_scale = rtc_power(127 - scaled.d_exponent);
    return scaled;
}

// The side of one edge, 0: not known.
int rtc_stage2_edge(RtcStage2 scaled, vec3 b, vec3 c, vec3 o, vec3 d) {
    vec3 way = d * scaled.d_scale;
    RTC_REAL bx = rtc_real_shifted(rtc_real_difference(b.x, o.x), scaled.m_scale);
    RTC_REAL by = rtc_real_shifted(rtc_real_difference(b.y, o.y), scaled.m_scale);
    RTC_REAL bz = rtc_real_shifted(rtc_real_difference(b.z, o.z), scaled.m_scale);
    RTC_REAL cx = rtc_real_shifted(rtc_real_difference(c.x, o.x), scaled.m_scale);
    RTC_REAL cy = rtc_real_shifted(rtc_real_difference(c.y, o.y), scaled.m_scale);
    RTC_REAL cz = rtc_real_shifted(rtc_real_difference(c.z, o.z), scaled.m_scale);
    bx = rtc_real_minus(rtc_real_scaled(bx, way.z), rtc_real_scaled(bz, way.x));
    by = rtc_real_minus(rtc_real_scaled(by, way.z), rtc_real_scaled(bz, way.y));
    cx = rtc_real_minus(rtc_real_scaled(cx, way.z), rtc_real_scaled(cz, way.x));
    cy = rtc_real_minus(rtc_real_scaled(cy, way.z), rtc_real_scaled(cz, way.y));
    float e = rtc_real_float(rtc_real_minor(cx, by, cy, bx));
    // w < 4, as m and |d.kz| are below 2. What is lost below 2^-126 costs
    // less than 2^-100.
    float l = (float(rtc_real_size(bx)) + float(rtc_real_size(by))) + (float(rtc_real_size(cx)) + float(rtc_real_size(cy)));
    float unit = 4.0 * float(RTC_REAL_EDGE);
    return scaled.sound && abs(e) > unit * l + (unit * unit + 7.888609e-31) ? rtc_sign(e) : 0;
}

// Weights of a triangle that is hit, not more exact than floats.
vec2 rtc_stage2_weights(RtcStage2 scaled, vec3 p0, vec3 p1, vec3 p2, vec3 o, vec3 d) {
    vec3 a = (p0 - o) * scaled.m_scale, b = (p1 - o) * scaled.m_scale, c = (p2 - o) * scaled.m_scale;
    vec3 way = d * scaled.d_scale;
    vec2 x0 = a.xy * way.z - a.z * way.xy;
    vec2 x1 = b.xy * way.z - b.z * way.xy;
    vec2 x2 = c.xy * way.z - c.z * way.xy;
    float e0 = x2.x * x1.y - x2.y * x1.x;
    float e1 = x0.x * x2.y - x0.y * x2.x;
    float e2 = x1.x * x0.y - x1.y * x0.x;
    float det = (e0 + e1) + e2;
    // Where all three drown in rounding the weights are anything in range.
    bool known = det != 0.0 && rtc_finite(det);
    float inverse = 1.0 / (known ? det : 1.0);
    float b1 = known ? min(max(e1 * inverse, 0.0), 1.0) : 0.0;
    return vec2(b1, known ? min(max(e2 * inverse, 0.0), 1.0 - b1) : 0.0);
}

// t, known to an ulp if `sound`; `behind`: the hit lies behind the origin.
float rtc_stage2_t(RtcStage2 scaled, vec3 p0, vec3 p1, vec3 p2, vec3 o, vec3 d, out bool sound, out bool behind) {
    vec3 way = d * scaled.d_scale;
    // t = n . (v0 - o) / n . d with n = (v1 - v0) x (v2 - v0), whose
    // differences are fresh: their size is the triangle's, not the distance's.
    RTC_REAL fx = rtc_real_shifted(rtc_real_difference(p1.x, p0.x), scaled.m_scale);
    RTC_REAL fy = rtc_real_shifted(rtc_real_difference(p1.y, p0.y), scaled.m_scale);
    RTC_REAL fz = rtc_real_shifted(rtc_real_difference(p1.z, p0.z), scaled.m_scale);
    RTC_REAL gx = rtc_real_shifted(rtc_real_difference(p2.x, p0.x), scaled.m_scale);
    RTC_REAL gy = rtc_real_shifted(rtc_real_difference(p2.y, p0.y), scaled.m_scale);
    RTC_REAL gz = rtc_real_shifted(rtc_real_difference(p2.z, p0.z), scaled.m_scale);
    // A minor and a dot product are off by at most 2 + 3 operations' errors
    // of the sum of all magnitudes: less than 2^-40 of it for pairs, 2^-49
    // for doubles. RTC_REAL_DIGITS, 2^-14 or 2^-24, asks that both be above
    // 2^26 or 2^25 of that error, so that t is off by less than an ulp.
    RTC_REAL n = rtc_real_minor(fy, gz, fz, gy);
    float size = float(rtc_real_size(fy) * rtc_real_size(gz) + rtc_real_size(fz) * rtc_real_size(gy));
    RTC_REAL a = rtc_real_shifted(rtc_real_difference(p0.x, o.x), scaled.m_scale);
    RTC_REAL above = rtc_real_product(n, a), below = rtc_real_scaled(n, way.x);
    float above_size = size * float(rtc_real_size(a)), below_size = size * abs(way.x);
    n = rtc_real_minor(fz, gx, fx, gz);
    size = float(rtc_real_size(fz) * rtc_real_size(gx) + rtc_real_size(fx) * rtc_real_size(gz));
    a = rtc_real_shifted(rtc_real_difference(p0.y, o.y), scaled.m_scale);
    above = rtc_real_sum(above, rtc_real_product(n, a));
    below = rtc_real_sum(below, rtc_real_scaled(n, way.y));
    above_size += size * float(rtc_real_size(a));
    below_size += size * abs(way.y);
    n = rtc_real_minor(fx, gy, fy, gx);
    size = float(rtc_real_size(fx) * rtc_real_size(gy) + rtc_real_size(fy) * rtc_real_size(gx));
    a = rtc_real_shifted(rtc_real_difference(p0.z, o.z), scaled.m_scale);
    above = rtc_real_sum(above, rtc_real_product(n, a));
    below = rtc_real_sum(below, rtc_real_scaled(n, way.z));
    above_size += size * float(rtc_real_size(a));
    below_size += size * abs(way.z);
    float limit = float(RTC_REAL_DIGITS);
    float numerator = rtc_real_float(above), k = rtc_real_float(below);
    sound = scaled.sound && below_size > 7.888609e-31 && abs(k) > limit * below_size; // 2^-100
    // Behind the origin, however short of digits: common for rays that start on a surface.
    float slack = limit * limit * above_size;
    behind = sound && (k > 0.0 ? numerator : -numerator) < -slack;
    sound = sound && above_size > 7.888609e-31 && abs(numerator) > limit * above_size;
    return rtc_ldexp(rtc_real_quotient(above, below), scaled.m_exponent - scaled.d_exponent);
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

bool rtc_comes_first(uint instance, uint geometry, uint primitive) {
    uint committed = rtc_hit_packed & RTC_SLOT_GEOMETRY_MASK;
    return instance != rtc_hit_instance   ? instance < rtc_hit_instance
           : geometry != committed ? geometry < committed
                                          : primitive < rtc_hit_primitive;
}

// Whoever calls rtc_meet_triangle in this tier has compared t already (rtc_settle).
bool rtc_in_range(float t, uint slot, uint primitive, uint geometry) {
    rtc_cand_slot = slot;
    return true;
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
