// Exact sums of products of three floats, in integers: no float property of
// the device matters here, neither rounding nor flushing nor range.
//
// A float is m 2^(s - 149) with an integer m < 2^24 and s = 0 .. 253, so a
// product of three is an integer below 2^72 times 2^(s - 447), s = 0 .. 759.
// An accumulator (Kulisch) holds such products in limbs of 24 bits, each in a
// signed word of its own: 48 products add at most 48 * 2^24 < 2^30 to a limb,
// so carries wait until the end. 759 / 24 + 4 limbs reach the highest bit, two
// more take the carries. Only limbs within the operands' exponents are touched.
const uint RTC_WIDE_LIMBS = 37u;
const uint RTC_WIDE_MASK = 0x00ffffffu;

int rtc_wide[4u * RTC_WIDE_LIMBS];

// After rtc_wide_det, per accumulator: sign and range of limbs that are not 0 (no array: an index that differs between
// lanes is dear); and of the last one the leading 49 to 72 bits as a pair, in units of 2^(24 (high - 1)).
ivec4 rtc_wide_sign;
uvec4 rtc_wide_low;
uvec4 rtc_wide_high;
vec2 rtc_wide_leading;

uint rtc_mantissa(uint bits) {
    uint fraction = bits & 0x007fffffu;
    return (bits & 0x7f800000u) == 0u ? fraction : fraction | 0x00800000u;
}

uint rtc_scale(uint bits) { return max((bits >> 23u) & 255u, 1u) - 1u; }

// accumulator += x y z, or -= where `negate` is the sign bit.
void rtc_wide_add(uint base, uint x, uint y, uint z, uint negate) {
    uint mx = rtc_mantissa(x), my = rtc_mantissa(y), mz = rtc_mantissa(z);
    if (mx != 0u && my != 0u && mz != 0u) {
        uint shift = rtc_scale(x) + rtc_scale(y) + rtc_scale(z);
        uint limb = shift / 24u;
        uint r = shift - 24u * limb;
        uint h0, l0, h1, l1, h2, l2, carry;
        umulExtended(mx, my, h0, l0); // 48 bits
        umulExtended(l0, mz, h1, l1);
        umulExtended(h0, mz, h2, l2); // 72 bits: l1, h1 + l2, h2 + carry
        uint w1 = uaddCarry(h1, l2, carry);
        uint w2 = h2 + carry;
        // 95 bits when shifted by r <= 23; a shift by 32 would be undefined.
        w2 = (w2 << r) | ((w1 >> 1u) >> (31u - r));
        w1 = (w1 << r) | ((l1 >> 1u) >> (31u - r));
        uint w0 = l1 << r;
        int sign = ((x ^ y ^ z ^ negate) & 0x80000000u) != 0u ? -1 : 1;
        uint at = base + limb;
        rtc_wide[at] += sign * int(w0 & RTC_WIDE_MASK);
        rtc_wide[at + 1u] += sign * int(((w0 >> 24u) | (w1 << 8u)) & RTC_WIDE_MASK);
        rtc_wide[at + 2u] += sign * int(((w1 >> 16u) | (w2 << 16u)) & RTC_WIDE_MASK);
        rtc_wide[at + 3u] += sign * int(w2 >> 8u);
    }
}

// Largest scale of six numbers, or smallest of those that are not 0 (255: none).
uint rtc_wide_top_scale(uvec3 a, uvec3 b) {
    uint high = max(max(rtc_scale(a.x), rtc_scale(a.y)), rtc_scale(a.z));
    return max(max(max(high, rtc_scale(b.x)), rtc_scale(b.y)), rtc_scale(b.z));
}

uint rtc_wide_scale(uint bits) { return mix(rtc_scale(bits), 255u, (bits << 1u) == 0u); }

uint rtc_wide_bottom_scale(uvec3 a, uvec3 b) {
    uint low = min(min(rtc_wide_scale(a.x), rtc_wide_scale(a.y)), rtc_wide_scale(a.z));
    return min(min(min(low, rtc_wide_scale(b.x)), rtc_wide_scale(b.y)), rtc_wide_scale(b.z));
}

// What a determinant is made of, bits of floats: x1, x2, y1, y2, z1, z2. In an array, for the sake of the registers
// that everything that settles a triangle would need.
uint rtc_wide_operand[18];

void rtc_wide_set(uint at, uvec3 v) {
    rtc_wide_operand[at] = v.x;
    rtc_wide_operand[at + 1u] = v.y;
    rtc_wide_operand[at + 2u] = v.z;
}

// det(x1 - x2, y1 - y2, z1 - z2) into an accumulator, where
// at least two of x2, y2, z2 are equal or all but one 0, so that a
// determinant with two of them is 0: four choices of vectors times six
// permutations, one a turn. Limbs are left as magnitude. Each vector's smallest and largest scale come along.
void rtc_wide_det(uint which, uint bottom, uint top, bool x2_zero) {
    uint base = which * RTC_WIDE_LIMBS;
    bottom = min(bottom, top) / 24u;
    top = top / 24u + 5u; // four limbs of a product, and carries
    [[dont_unroll]] for (uint i = bottom; i <= top; ++i) {
        rtc_wide[base + i] = 0;
    }
    uint turns = x2_zero ? 18u : 24u; // but for t's numerator
    [[dont_unroll]] for (uint i = 0u; i < turns; ++i) {
        uint choice = i / 6u;
        uint p = (i >> 1u) - 3u * choice;
        bool swapped = (i & 1u) != 0u;
        uint next = p == 2u ? 0u : p + 1u;
        uint last = p == 0u ? 2u : p - 1u;
        uint negate = (choice == 0u) == swapped ? 0x80000000u : 0u;
        uint x = rtc_wide_operand[p + (choice == 3u ? 3u : 0u)];
        uint y = rtc_wide_operand[(swapped ? last : next) + (choice == 1u ? 9u : 6u)];
        uint z = rtc_wide_operand[(swapped ? next : last) + (choice == 2u ? 15u : 12u)];
        rtc_wide_add(base, x, y, z, negate);
    }
    // Carries; the last one tells the sign. A negative number's limbs are its
    // two's complement, which the second round turns into the magnitude.
    int sign = 1;
    uint low = RTC_WIDE_LIMBS;
    uint high = 0u;
    ivec3 leading = ivec3(0); // the highest limb that is not 0, and the two below it
    [[dont_unroll]] for (uint round = 0u; round < 2u; ++round) {
        int carry = 0, one_below = 0, two_below = 0;
        int flip = round == 0u ? 1 : -1;
        low = RTC_WIDE_LIMBS;
        high = 0u;
        [[dont_unroll]] for (uint i = bottom; i <= top; ++i) {
            int limb = flip * rtc_wide[base + i] + carry;
            carry = limb >> 24;
            limb = limb & int(RTC_WIDE_MASK);
            rtc_wide[base + i] = limb;
            low = limb != 0 ? min(low, i) : low;
            high = limb != 0 ? i : high;
            leading = mix(leading, ivec3(limb, one_below, two_below), bvec3(limb != 0));
            two_below = one_below;
            one_below = limb;
        }
        if (round == 0u) {
            sign = carry < 0 ? -1 : 1;
            round += carry < 0 ? 0u : 1u;
        }
    }
    bvec4 here = equal(uvec4(which), uvec4(0u, 1u, 2u, 3u));
    rtc_wide_sign = mix(rtc_wide_sign, ivec4(low == RTC_WIDE_LIMBS ? 0 : sign), here);
    rtc_wide_low = mix(rtc_wide_low, uvec4(low), here);
    rtc_wide_high = mix(rtc_wide_high, uvec4(high), here);
    vec2 sum = rtc_two_sum(float(leading.x) * 16777216.0, float(leading.y));
    rtc_wide_leading = rtc_quick_sum(sum.x, sum.y + float(leading.z) * 5.9604644775e-8);
    rtc_turns += turns + 3u * (top + 1u - bottom) + 2u;
}

// q 2^e, also where 2^e alone is no float.
float rtc_ldexp(float q, int e) {
    int half_way = clamp(e, -500, 500) / 4;
    float step = rtc_power(127 + half_way);
    return (((q * step) * step) * step) * rtc_power(127 + clamp(e, -500, 500) - 3 * half_way);
}

// Accumulator 0, whose leading bits come along, over accumulator 1, the last one; off by less than an ulp.
float rtc_wide_quotient(vec2 above) {
    float q = rtc_pair_quotient(above, rtc_wide_leading);
    q = rtc_ldexp(q, 24 * (int(rtc_wide_high.x) - int(rtc_wide_high.y)));
    return rtc_wide_sign.x * rtc_wide_sign.y < 0 ? -q : (rtc_wide_sign.x == 0 ? 0.0 : q);
}

// A limb of a number, 0 outside it.
uint rtc_wide_limb(uint which, uint low, uint high, uint i) {
    uint limb = uint(rtc_wide[which * RTC_WIDE_LIMBS + i]);
    return i >= low && i <= high ? limb : 0u;
}

// Sign of 0 / 1 - 2 / 3, the divisors not being 0.
int rtc_wide_compare() {
    int left = rtc_wide_sign.x * rtc_wide_sign.y;
    int right = rtc_wide_sign.z * rtc_wide_sign.w;
    int result = left > right ? 1 : (left < right ? -1 : 0);
    if (left == right && left != 0) {
        // |0| |3| - |2| |1|, column by column. The halves of 37 products of 48
        // bits sum up to less than 2^30.
        uint first = min(rtc_wide_low.x, rtc_wide_low.z), last = max(rtc_wide_high.x, rtc_wide_high.z);
        uint low = min(rtc_wide_low.y, rtc_wide_low.w), high = max(rtc_wide_high.y, rtc_wide_high.w);
        int carry = 0, above = 0;
        int any = 0;
        [[dont_unroll]] for (uint k = first + low; k <= last + high; ++k) {
            int lows = 0, highs = 0;
            uint from = k > high ? max(first, k - high) : first;
            uint to = min(last, k - low);
            [[dont_unroll]] for (uint i = from; i <= to; ++i) {
                uint a_high, a_low, b_high, b_low;
                umulExtended(rtc_wide_limb(0u, rtc_wide_low.x, rtc_wide_high.x, i),
                             rtc_wide_limb(3u, rtc_wide_low.w, rtc_wide_high.w, k - i), a_high, a_low);
                umulExtended(rtc_wide_limb(2u, rtc_wide_low.z, rtc_wide_high.z, i),
                             rtc_wide_limb(1u, rtc_wide_low.y, rtc_wide_high.y, k - i), b_high, b_low);
                lows += int(a_low & RTC_WIDE_MASK) - int(b_low & RTC_WIDE_MASK);
                highs += int((a_low >> 24u) | (a_high << 8u)) - int((b_low >> 24u) | (b_high << 8u));
                rtc_turns++;
            }
            int column = (lows + above) + carry;
            any |= column & int(RTC_WIDE_MASK);
            carry = column >> 24;
            above = highs;
            rtc_turns++;
        }
        carry += above;
        result = carry < 0 ? -1 : (carry > 0 || any != 0 ? 1 : 0);
        result = result * left;
    }
    return result;
}
