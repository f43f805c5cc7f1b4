// Exact decisions in 128-bit integers, for the many cases that fit: floats are integers times a power of
// two, and coordinates that are near one another need few bits. What does not fit goes to rationals.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

namespace rtc::lab {

using DVec = std::array<double, 3>;

// Sign of det(d, c - o, b - o); where it is 0, `touched` is set and the sign is that of the moved ray
// (exact.glsl). Axes must be turned so that the ray moves fastest along the last one.
std::optional<int> integer_edge(const DVec& o, const DVec& d, const DVec& b, const DVec& c, bool* touched);

__extension__ typedef __int128 Int128;

// above / below * 2^exponent
struct Ratio {
    Int128 above = 0, below = 1;
    int exponent = 0;
    double value() const;
};

// t at which the ray meets the triangle's plane. Nullopt also where it never does.
std::optional<Ratio> integer_t(const DVec& o, const DVec& d, const std::array<DVec, 3>& v);
Ratio ratio_of(double finite);
// Sign of a - b. Nullopt when the powers of two are too far apart.
std::optional<int> compare(const Ratio& a, const Ratio& b);

}  // namespace rtc::lab
