#include "integers.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdlib>

namespace rtc::lab {
namespace {

__extension__ typedef unsigned __int128 UInt128;

// f = mantissa * 2^exponent, the mantissa odd or 0.
void split(double f, int64_t& mantissa, int& exponent) {
    const uint64_t bits = std::bit_cast<uint64_t>(f);
    uint64_t m = bits & ((uint64_t(1) << 52) - 1);
    const int biased = int(bits >> 52) & 2047;
    if (biased) m |= uint64_t(1) << 52;
    exponent = (biased ? biased : 1) - 1075;
    if (m) {
        const int zeros = std::countr_zero(m);
        m >>= zeros;
        exponent += zeros;
    }
    mantissa = bits >> 63 ? -int64_t(m) : int64_t(m);
}

// Integers that are the numbers over one power of two; `bits`: what the largest needs. False: more than 62.
template <size_t N>
bool common(const std::array<double, N>& numbers, std::array<int64_t, N>& out, int& exponent, int& bits) {
    int exponents[N], least = 10000;
    for (size_t i = 0; i < N; ++i) {
        split(numbers[i], out[i], exponents[i]);
        if (out[i]) least = std::min(least, exponents[i]);
    }
    exponent = least == 10000 ? 0 : least;
    bits = 0;
    for (size_t i = 0; i < N; ++i) {
        if (!out[i]) continue;
        const int shift = exponents[i] - exponent;
        const int width = std::bit_width(uint64_t(std::llabs(out[i]))) + shift;
        if (width > 62) return false;
        out[i] = out[i] < 0 ? -int64_t(uint64_t(-out[i]) << shift) : int64_t(uint64_t(out[i]) << shift);
        bits = std::max(bits, width);
    }
    return true;
}

using I3 = std::array<int64_t, 3>;

I3 minus(const int64_t* a, const int64_t* b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

Int128 determinant(const I3& x, const I3& y, const I3& z) {
    return x[0] * (Int128(y[1]) * z[2] - Int128(y[2]) * z[1]) + x[1] * (Int128(y[2]) * z[0] - Int128(y[0]) * z[2]) +
           x[2] * (Int128(y[0]) * z[1] - Int128(y[1]) * z[0]);
}

int sign(Int128 v) { return v > 0 ? 1 : (v < 0 ? -1 : 0); }

// Eight words are enough for a product of two and a shift of 255.
using Wide = std::array<uint64_t, 8>;

Wide product(UInt128 a, UInt128 b, int shift) {
    Wide p{};
    const uint64_t x[2] = {uint64_t(a), uint64_t(a >> 64)}, y[2] = {uint64_t(b), uint64_t(b >> 64)};
    for (int i = 0; i < 2; ++i) {
        uint64_t carry = 0;
        for (int j = 0; j < 2; ++j) {
            const UInt128 sum = UInt128(x[i]) * y[j] + p[i + j] + carry;
            p[i + j] = uint64_t(sum);
            carry = uint64_t(sum >> 64);
        }
        p[i + 2] += carry;
    }
    Wide out{};
    const int words = shift / 64, bits = shift % 64;
    for (int i = 7; i >= words; --i) {
        out[i] = p[i - words] << bits;
        if (bits && i > words) out[i] |= p[i - words - 1] >> (64 - bits);
    }
    return out;
}

UInt128 magnitude(Int128 v) { return v < 0 ? -UInt128(v) : UInt128(v); }

}  // namespace

std::optional<int> integer_edge(const DVec& o, const DVec& d, const DVec& b, const DVec& c, bool* touched) {
    std::array<int64_t, 9> p;
    I3 q;
    int exponent, p_bits, d_bits;
    if (!common<9>({o[0], o[1], o[2], b[0], b[1], b[2], c[0], c[1], c[2]}, p, exponent, p_bits) ||
        !common<3>(d, q, exponent, d_bits) || d_bits + 2 * (p_bits + 1) + 3 > 126)
        return std::nullopt;
    int side = sign(determinant(q, minus(&p[6], &p[0]), minus(&p[3], &p[0])));
    if (side != 0) return side;
    *touched = true;
    const I3 w = minus(&p[6], &p[3]);
    side = -sign(Int128(q[1]) * w[2] - Int128(q[2]) * w[1]);
    return side != 0 ? side : -sign(Int128(q[2]) * w[0] - Int128(q[0]) * w[2]);
}

double Ratio::value() const { return std::ldexp(double(above) / double(below), exponent); }

std::optional<Ratio> integer_t(const DVec& o, const DVec& d, const std::array<DVec, 3>& v) {
    std::array<int64_t, 12> p;
    I3 q;
    int p_exponent, d_exponent, p_bits, d_bits;
    if (!common<12>({o[0], o[1], o[2], v[0][0], v[0][1], v[0][2], v[1][0], v[1][1], v[1][2], v[2][0], v[2][1], v[2][2]},
                    p, p_exponent, p_bits) ||
        !common<3>(d, q, d_exponent, d_bits) || std::max(p_bits + 1, d_bits) + 2 * (p_bits + 1) + 3 > 126)
        return std::nullopt;
    Ratio t;
    t.above = determinant(minus(&p[3], &p[0]), minus(&p[6], &p[0]), minus(&p[9], &p[0]));
    t.below = determinant(q, minus(&p[6], &p[3]), minus(&p[9], &p[3]));
    t.exponent = p_exponent - d_exponent;
    if (t.below == 0) return std::nullopt;
    return t;
}

Ratio ratio_of(double finite) {
    Ratio r;
    int64_t mantissa;
    split(finite, mantissa, r.exponent);
    r.above = mantissa;
    return r;
}

std::optional<int> compare(const Ratio& a, const Ratio& b) {
    const int sa = sign(a.above) * sign(a.below), sb = sign(b.above) * sign(b.below);
    if (sa != sb || sa == 0) return sa == sb ? 0 : (sa < sb ? -1 : 1);
    const int shift = a.exponent - b.exponent;
    if (std::abs(shift) > 255) return std::nullopt;
    const Wide left = product(magnitude(a.above), magnitude(b.below), std::max(shift, 0));
    const Wide right = product(magnitude(b.above), magnitude(a.below), std::max(-shift, 0));
    for (int i = 7; i >= 0; --i)
        if (left[i] != right[i]) return left[i] < right[i] ? -sa : sa;
    return 0;
}

}  // namespace rtc::lab
