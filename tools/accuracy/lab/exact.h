// What exact arithmetic says about a ray and triangles given as floats.
#pragma once

#include <gmpxx.h>

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "host_scene.h"

namespace rtc::lab {

struct ExactRay {
    Vec3 origin, direction;
    float tmin = 0, tmax = 0;
};

enum class Verdict { Miss, Hit, Boundary };  // Boundary: on an edge or vertex

// Rational test of one triangle (closed; facing and interval not considered).
// `t` is exact. Degenerate and parallel triangles are missed.
Verdict intersect(const ExactRay& ray, const Triangle& triangle, mpq_class* t);

// A point with rational coordinates.
struct ExactPoint {
    mpq_class x, y, z;
};

// The same test for corners that are no floats: of an instance's triangle in the world, say.
Verdict intersect(const ExactRay& ray, const std::array<ExactPoint, 3>& triangle, mpq_class* t);

struct ExactHit {
    uint32_t triangle = 0;
    double t = 0;           // correctly rounded from the rational
    bool boundary = false;  // some triangle at or before this hit is touched only on its boundary
};

// Nearest hit with tmin < t < tmax. A double-precision filter decides what it
// can with its error bound; the rest is decided in rationals.
std::optional<ExactHit> nearest(const ExactRay& ray, const std::vector<Triangle>& triangles);

// A filter in double: true only where the ray's line misses the triangle's inside and edges.
bool surely_missed(const ExactRay& ray, const Triangle& triangle);

// Smallest barycentric weight of the ray's point in the triangle's plane, in
// double: how far inside (or outside: negative) it passes.
double inside_margin(const ExactRay& ray, const Triangle& triangle);

}  // namespace rtc::lab
