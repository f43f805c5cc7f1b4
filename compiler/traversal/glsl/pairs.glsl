// Two-float arithmetic: a pair (high, low) is the unrounded sum of its parts.
// Nothing here assumes a rounding mode: what a pair loses against the exact
// value is bounded for rounding to nearest and for truncation alike.

// 2^(biased - 127).
float rtc_power(int biased) { return uintBitsToFloat(uint(clamp(biased, 0, 254)) << 23u); }

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

// a + b = x + y: Knuth, exact when rounding to nearest; truncation loses at
// most 2u |y|, which is 4u^2 of the sum.
vec2 rtc_two_sum(float a, float b) {
    float s = a + b;
    float bb = s - a;
    return vec2(s, (a - (s - bb)) + (b - bb));
}

// The same where |a| >= |b| (or a = 0).
vec2 rtc_quick_sum(float a, float b) {
    float s = a + b;
    return vec2(s, b - (s - a));
}

vec2 rtc_two_product(float a, float b) {
    float p = a * b;
    return vec2(p, rtc_product_error(rtc_split(a), rtc_split(b), p));
}

// Sums and products of pairs are off by less than 2^-43 of the sum of the
// magnitudes that go in. (Low parts are at most 2u of high ones. A product
// drops low times low, 4u^2, and rounds the low part's three terms, together
// below 6u, at most twice by 2u each: 4u^2 + 24u^2 < 2^-43. A sum rounds less.)
vec2 rtc_pair_sum(vec2 a, vec2 b) {
    vec2 s = rtc_two_sum(a.x, b.x);
    return rtc_quick_sum(s.x, s.y + (a.y + b.y));
}

vec2 rtc_pair_product(vec2 a, vec2 b) {
    vec2 p = rtc_two_product(a.x, b.x);
    return rtc_quick_sum(p.x, p.y + (a.x * b.y + a.y * b.x));
}

vec2 rtc_pair_scaled(vec2 a, float b) {
    vec2 p = rtc_two_product(a.x, b);
    return rtc_quick_sum(p.x, p.y + a.y * b);
}

// a / b as a float: the division's 2.5 ulp are put right by the remainder.
float rtc_pair_quotient(vec2 a, vec2 b) {
    float q = a.x / b.x;
    vec2 r = rtc_pair_sum(a, rtc_pair_scaled(vec2(-b.x, -b.y), q));
    return q + r.x / b.x;
}
