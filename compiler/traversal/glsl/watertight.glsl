// Tier `watertight`: Woop, Benthin and Wald, "Watertight Ray/Triangle
// Intersection" (JCGT 2013), with exact edges and boxes that contain what the
// triangle test can hit.
//
// u is 2^-24, half the distance between floats near 1. A rounding costs a
// factor (1 + u), or (1 + 2u) where the device rounds towards zero; Vulkan's
// division may cost 2.5 ulp = 5u.

uint rtc_trav_axis; // kz: the axis along which the ray moves fastest
vec3 rtc_trav_shear; // d.kx / d.kz, d.ky / d.kz, d.kz

// kx, ky, kz: cyclic, so that orientation is kept. (mix with booleans is a
// select, not arithmetic; `?:` of vectors would become a branch.)
vec3 rtc_axes(vec3 v) {
    return mix(mix(v, v.zxy, bvec3(rtc_trav_axis == 1u)), v.yzx, bvec3(rtc_trav_axis == 0u));
}

// Slabs compute t = fl(fl(b - o) * inverse) with |error| <= (1 or 2 + 5 + 1 or
// 2)u |t|, at most 9u. Near is compared with far, each off by 9u, and far's
// growth rounds once more: 9u + 9u + 2u = 20u, and 24u leaves second-order
// terms behind. Only far needs it, and only where t > 0: where far is
// negative its sign, which rounding keeps, decides.
const float RTC_SLAB_GROWTH = 1.00000143; // 1 + 24u

// How far the triangle test's idea of a vertex can be from the vertex.
//
// The test moves v to fl(v - o) and shears it to
//     x = fl(fl(v.kx - o.kx) - fl(S fl(v.kz - o.kz))),  S = fl(d.kx / d.kz).
// With D the largest |v - o| along an axis and r = |d| D.kz / |d.kz| the way
// the ray makes along it meanwhile (|S| |v.kz - o.kz| <= r):
//     from v - o: uD;  from S: 5u r;  from the product and its factor: 2u r;
//     from the last difference: u(D + r);  together 2u D + 8u r,
// 4u D + 11u r under truncation. The edge decisions made with x, y are exact
// (below), so a ray that hits does hit the triangle whose vertices are moved
// by no more than that. t = Az + b1 (Bz - Az) + b2 (Cz - Az), over d.kz, is
// off by at most 8u of D.kz / |d.kz|, which is 8u r along any axis, and t is
// compared with near of the box, itself 9u r off: 5u D + 28u r covers all.
//
// The padded origin fl(o + pad) must not round back: 2u |o| more. A direction
// that is (almost) 0 along an axis is replaced by 2^-48 of the largest, with
// its sign, which moves the ray by 2^-48 D.kz: 2^-47 D.kz more. Differences
// that a device flushes to zero lie under 2^-126: 2^-120 more.
//
// Boxes of the top level hold instances: the triangle test there runs on
// fl(W o), fl(W d), off by 4u (|W||o| + |w|) and 3u |W||d|, which M turns into
// world distance again with |M||W| <= 3 for rotations and uniform scales:
// 3 * (4u |o| + 4u (|o| + D)) + 3 * (3u + 2u + 8u) D = 24u |o| + 51u D, with
// the largest component of each since a rotation mixes axes. (Builders widen
// instance boxes for transforms that stretch more.)
const float RTC_PAD_D = 2.98023224e-7; // 5u
const float RTC_PAD_R = 1.66893005e-6; // 28u
const float RTC_PAD_ORIGIN = 1.49011612e-7; // 2.5u
const float RTC_PAD_TOP_ORIGIN = 1.90734863e-6; // 32u
const float RTC_PAD_TOP_D = 3.81469727e-6; // 64u
const float RTC_TINY = 3.5527136788e-15; // 2^-48
const float RTC_PAD_FLUSH = 7.52316385e-37; // 2^-120

void rtc_level_numbers(RtcBase base, vec3 o, vec3 d, bool top) {
    vec3 bounds_min = uintBitsToFloat(rtc_quad(base, RTC_HDR_BOUNDS_MIN / 4u).xyz);
    vec3 bounds_max = uintBitsToFloat(rtc_quad(base, RTC_HDR_BOUNDS_MAX / 4u).xyz);
    vec3 a = abs(d);
    rtc_trav_axis = a.x > a.y ? (a.x > a.z ? 0u : 2u) : (a.y > a.z ? 1u : 2u);
    vec3 k = rtc_axes(d);
    rtc_trav_shear = vec3(k.x / k.z, k.y / k.z, k.z);

    float speed = abs(k.z);
    float tiny = speed * RTC_TINY;
    uvec3 signs = floatBitsToUint(d) & uvec3(0x80000000u);
    a = max(a, vec3(tiny));
    vec3 safe = uintBitsToFloat(floatBitsToUint(a) | signs);
    rtc_trav_inverse = vec3(1.0 / safe.x, 1.0 / safe.y, 1.0 / safe.z);

    vec3 distance = max(abs(bounds_min - o), abs(bounds_max - o));
    float reach = rtc_axes(distance).z;
    float longest = reach / speed;
    vec3 pad = distance * RTC_PAD_D + a * (longest * RTC_PAD_R);
    if (top) {
        pad = max(pad, vec3(rtc_largest(o) * RTC_PAD_TOP_ORIGIN + rtc_largest(distance) * RTC_PAD_TOP_D));
    }
    pad = (pad + abs(o) * RTC_PAD_ORIGIN) + vec3(reach * (2.0 * RTC_TINY) + RTC_PAD_FLUSH);
    rtc_trav_low = o + pad;
    rtc_trav_high = o - pad;
}

// a * b = p + result, where p = fl(a * b). Dekker's product with factors split
// by truncation to 12 bits: every partial product has at most 24 bits and is
// exact in any rounding mode, and so are the sums in this order.
float rtc_product_error(vec2 a, vec2 b, float p) {
    return (((a.x * b.x - p) + a.x * b.y) + a.y * b.x) + a.y * b.y;
}

// High and low part of a factor.
vec2 rtc_split(float v) {
    float high = uintBitsToFloat(floatBitsToUint(v) & 0xfffff000u);
    return vec2(high, v - high);
}

// c.x b.y - c.y b.x with the exact sign. The four numbers must be 0 or lie in
// about 2^-80 .. 2^60, see rtc_vertex_exponent.
float rtc_exact_edge(float cx, float cy, float bx, float by) {
    float p = cx * by;
    float q = cy * bx;
    float pe = rtc_product_error(rtc_split(cx), rtc_split(by), p);
    float qe = rtc_product_error(rtc_split(cy), rtc_split(bx), q);
    // Rounding is monotone: p > q proves the sign, and then |p - q| is at
    // least an ulp of p, which |pe - qe| does not reach.
    return (p - q) + (pe - qe);
}

// Which side of a zero edge? As if the ray were moved by (e, e^2), e > 0
// infinitely small (simulation of simplicity): c.x b.y - c.y b.x then changes
// by e (c.y - b.y) + e^2 (b.x - c.x). Every point of a closed fan around a
// vertex so has exactly one owner. 0: the edge is a point, the triangle has no
// area.
float rtc_edge_side(float edge, float cx, float cy, float bx, float by) {
    float rise = cy > by ? 1.0 : (cy < by ? -1.0 : (bx > cx ? 1.0 : (bx < cx ? -1.0 : 0.0)));
    return edge > 0.0 ? 1.0 : (edge < 0.0 ? -1.0 : rise);
}

// Biased exponent of the larger of two numbers. Below 50 the power that
// belongs to it would overflow: such vertices stay smaller than 2^50.
int rtc_vertex_exponent(float x, float y) {
    return max(int(floatBitsToUint(max(abs(x), abs(y))) >> 23u), 50);
}

float rtc_power(int biased) { return uintBitsToFloat(uint(clamp(biased, 0, 254)) << 23u); }

bool rtc_triangle(vec3 v0, vec3 v1, vec3 v2, out float t, out float b1, out float b2, out bool front) {
    vec3 a = rtc_axes(v0 - rtc_trav_origin);
    vec3 b = rtc_axes(v1 - rtc_trav_origin);
    vec3 c = rtc_axes(v2 - rtc_trav_origin);
    float sx = rtc_trav_shear.x;
    float sy = rtc_trav_shear.y;
    // The same expression for every vertex: two triangles that share one see
    // it at the same place.
    float ax = a.x - sx * a.z, ay = a.y - sy * a.z;
    float bx = b.x - sx * b.z, by = b.y - sy * b.z;
    float cx = c.x - sx * c.z, cy = c.y - sy * c.z;
    float e0 = cx * by - cy * bx;
    float e1 = ax * cy - ay * cx;
    float e2 = bx * ay - by * ax;
    float det = (e0 + e1) + e2;
    bool negative = e0 < 0.0 || e1 < 0.0 || e2 < 0.0;
    bool positive = e0 > 0.0 || e1 > 0.0 || e2 > 0.0;
    // An edge that is not 0 has its exact sign, products being monotone (NaN
    // comes from overflow and counts as undecided).
    bool hit = !(negative && positive);
    float size = abs(det);
    bool decided = (e0 < 0.0 || e0 > 0.0) && (e1 < 0.0 || e1 > 0.0) && (e2 < 0.0 || e2 > 0.0) &&
                   size > 8.6736174e-19 && size < 1.1529215e18; // 2^-60, 2^60: det and 1 / det are safe
    if (hit && !decided) {
        // Each vertex times a power of two that puts its larger coordinate
        // near 2^50; the signs of edges do not change, and depend on their two
        // vertices only.
        int ea = rtc_vertex_exponent(ax, ay);
        int eb = rtc_vertex_exponent(bx, by);
        int ec = rtc_vertex_exponent(cx, cy);
        float pa = rtc_power(304 - ea), pb = rtc_power(304 - eb), pc = rtc_power(304 - ec);
        e0 = rtc_exact_edge(cx * pc, cy * pc, bx * pb, by * pb);
        e1 = rtc_exact_edge(ax * pa, ay * pa, cx * pc, cy * pc);
        e2 = rtc_exact_edge(bx * pb, by * pb, ax * pa, ay * pa);
        float s0 = rtc_edge_side(e0, cx, cy, bx, by);
        float s1 = rtc_edge_side(e1, ax, ay, cx, cy);
        float s2 = rtc_edge_side(e2, bx, by, ax, ay);
        hit = s0 == s1 && s1 == s2 && s0 != 0.0;
        // Bring the three to one scale, that of the largest vertex.
        int top = max(ea, max(eb, ec));
        float fa = rtc_power(127 + ea - top), fb = rtc_power(127 + eb - top), fc = rtc_power(127 + ec - top);
        e0 = (e0 * fb) * fc;
        e1 = (e1 * fc) * fa;
        e2 = (e2 * fa) * fb;
        det = (e0 + e1) + e2;
        hit = hit && det != 0.0;
    }
    t = 0.0;
    b1 = 0.0;
    b2 = 0.0;
    if (hit) { // few tests hit: two divisions less for the others
        float inverse = 1.0 / det;
        b1 = e1 * inverse;
        b2 = e2 * inverse;
        t = ((a.z + b1 * (b.z - a.z)) + b2 * (c.z - a.z)) / rtc_trav_shear.z;
    }
    // det is minus (normal . d) / d.kz, front faces have normal . d < 0.
    front = (det > 0.0) == (rtc_trav_shear.z > 0.0);
    return hit;
}
