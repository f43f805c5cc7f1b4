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
