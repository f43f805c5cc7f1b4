// Tier `watertight`: Woop, Benthin and Wald, "Watertight Ray/Triangle
// Intersection" (JCGT 2013), with exact edges and boxes that contain what the
// triangle test can hit (padding.glsl, where u is explained).
#include "padding.glsl"
#include "pairs.glsl"

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

// The three vertices as the ray sees them: from its origin, sheared so that it runs along the last axis. The same
// expression for every vertex: two triangles that share one see it at the same place.
vec3 rtc_sheared(vec3 v) {
    vec3 a = rtc_axes(v - rtc_trav_origin);
    return vec3(a.x - rtc_trav_shear.x * a.z, a.y - rtc_trav_shear.y * a.z, a.z);
}

// Where a triangle is hit whose edges have these values. det is minus (normal . d) / d.kz, front faces have
// normal . d < 0.
void rtc_triangle_hit(vec3 z, float e1, float e2, float det, out float t, out float b1, out float b2, out bool front) {
    float inverse = 1.0 / det;
    b1 = e1 * inverse;
    b2 = e2 * inverse;
    t = ((z.x + b1 * (z.y - z.x)) + b2 * (z.z - z.x)) / rtc_trav_shear.z;
    front = (det > 0.0) == (rtc_trav_shear.z > 0.0);
}

// The test in floats. What it cannot decide, an edge of exactly 0 or numbers out of range, is rare and left to
// rtc_settle_triangle.
const uint RTC_VERDICT_MISS = 0u;
const uint RTC_VERDICT_HIT = 1u;
const uint RTC_VERDICT_UNDECIDED = 2u;

uint rtc_verdict(float e0, float e1, float e2, float det) {
    // An edge that is not 0 has its exact sign, products being monotone. NaN comes from overflow; whether min and max
    // pass it on or not, it is in det, which then is not in range: such a test is a miss only where two other edges
    // say so.
    float least = min(e0, min(e1, e2));
    float most = max(e0, max(e1, e2));
    float size = abs(det);
    bool decided = (least > 0.0 || most < 0.0) && size > 8.6736174e-19 && size < 1.1529215e18; // 2^-60, 2^60: det
                                                                                               // and 1 / det are safe
    bool miss = least < 0.0 && most > 0.0;
    return decided ? RTC_VERDICT_HIT : (miss ? RTC_VERDICT_MISS : RTC_VERDICT_UNDECIDED);
}
