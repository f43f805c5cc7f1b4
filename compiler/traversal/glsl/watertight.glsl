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

// The walk leaves its loop for undecided triangles: see rtc_settle_triangle.
#define RTC_TIER_DEFERS

// The test in floats. What it cannot decide, an edge of exactly 0 or numbers out of range, is rare and left to
// rtc_exact_side.
bool rtc_triangle(vec3 v0, vec3 v1, vec3 v2, out float t, out float b1, out float b2, out bool front,
                  out bool undecided) {
    vec3 a = rtc_sheared(v0), b = rtc_sheared(v1), c = rtc_sheared(v2);
    float e0 = c.x * b.y - c.y * b.x;
    float e1 = a.x * c.y - a.y * c.x;
    float e2 = b.x * a.y - b.y * a.x;
    float det = (e0 + e1) + e2;
    bool negative = e0 < 0.0 || e1 < 0.0 || e2 < 0.0;
    bool positive = e0 > 0.0 || e1 > 0.0 || e2 > 0.0;
    // An edge that is not 0 has its exact sign, products being monotone (NaN
    // comes from overflow and counts as undecided).
    bool hit = !(negative && positive);
    float size = abs(det);
    bool decided = (e0 < 0.0 || e0 > 0.0) && (e1 < 0.0 || e1 > 0.0) && (e2 < 0.0 || e2 > 0.0) &&
                   size > 8.6736174e-19 && size < 1.1529215e18; // 2^-60, 2^60: det and 1 / det are safe
    undecided = hit && !decided;
    hit = hit && decided;
    t = 0.0;
    b1 = 0.0;
    b2 = 0.0;
    front = false;
    if (hit) { // few tests hit: two divisions less for the others
        rtc_triangle_hit(vec3(a.z, b.z, c.z), e1, e2, det, t, b1, b2, front);
    }
    return hit;
}

// Whether the triangle is hit, exactly: +1 or -1, the side on which the ray passes all three edges; 0: it does not.
// Each vertex is scaled by a power of two that puts its larger coordinate near 2^50; the signs of edges do not change,
// and depend on their two vertices only. One edge a turn, then a, b, c change places: that takes fewer registers than
// three at once.
float rtc_exact_side(vec2 a, vec2 b, vec2 c, out uint turns) {
    float side = 0.0;
    bool hit = true, area = false;
    turns = 0u;
    [[dont_unroll]] while (turns < 3u && hit) {
        float pb = rtc_power(304 - rtc_vertex_exponent(b.x, b.y)), pc = rtc_power(304 - rtc_vertex_exponent(c.x, c.y));
        float e = rtc_exact_edge(c.x * pc, c.y * pc, b.x * pb, b.y * pb);
        float s = rtc_edge_side(e, c.x, c.y, b.x, b.y);
        hit = s != 0.0 && (turns == 0u || s == side);
        area = area || e != 0.0;
        side = s;
        vec2 first = a;
        a = b;
        b = c;
        c = first;
        turns++;
        rtc_turns++;
    }
    return hit && area ? side : 0.0;
}

// What is hit is decided; where, is not more exact than in floats. An edge's value is 0 or has the exact sign.
void rtc_triangle_at(vec3 v0, vec3 v1, vec3 v2, float side, out float t, out float b1, out float b2, out bool front) {
    vec3 a = rtc_sheared(v0), b = rtc_sheared(v1), c = rtc_sheared(v2);
    int top = max(rtc_vertex_exponent(a.x, a.y), max(rtc_vertex_exponent(b.x, b.y), rtc_vertex_exponent(c.x, c.y)));
    float scale = rtc_power(304 - top);
    a.xy *= scale;
    b.xy *= scale;
    c.xy *= scale;
    float e0 = c.x * b.y - c.y * b.x;
    float e1 = a.x * c.y - a.y * c.x;
    float e2 = b.x * a.y - b.y * a.x;
    float det = (e0 + e1) + e2;
    // Where all three vanish any point of the triangle will do.
    det = det != 0.0 ? det : side;
    rtc_triangle_hit(vec3(a.z, b.z, c.z), e1, e2, det, t, b1, b2, front);
}
