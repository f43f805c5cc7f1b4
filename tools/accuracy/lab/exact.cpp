#include "exact.h"

#include <algorithm>
#include <cmath>

namespace rtc::lab {
namespace {

using Q3 = ExactPoint;

// A bare mpq from float: mpq_set_d is exact.
mpq_class q(float f) { return mpq_class(double(f)); }

Q3 difference(const Q3& a, const Vec3& b) { return {a.x - q(b.x), a.y - q(b.y), a.z - q(b.z)}; }

Q3 cross(const Q3& a, const Q3& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

mpq_class dot(const Q3& a, const Q3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

struct D3 {
    double x, y, z;
};

D3 sub(const Vec3& a, const Vec3& b) { return {double(a.x) - b.x, double(a.y) - b.y, double(a.z) - b.z}; }

// Triple product d . (a x b), with a bound on its error: each component
// difference is off by 2^-53 relative, and at most 8 roundings follow.
double triple(const D3& d, const D3& a, const D3& b, double& error) {
    const double px = a.y * b.z, qx = a.z * b.y, py = a.z * b.x, qy = a.x * b.z, pz = a.x * b.y,
                 qz = a.y * b.x;
    const double magnitude = std::fabs(d.x) * (std::fabs(px) + std::fabs(qx)) +
                             std::fabs(d.y) * (std::fabs(py) + std::fabs(qy)) +
                             std::fabs(d.z) * (std::fabs(pz) + std::fabs(qz));
    error = magnitude * 2e-15 + 1e-290;
    return d.x * (px - qx) + d.y * (py - qy) + d.z * (pz - qz);
}

}  // namespace

bool surely_missed(const ExactRay& ray, const Triangle& v) {
    const D3 d = {ray.direction.x, ray.direction.y, ray.direction.z};
    const D3 a = sub(v[0], ray.origin), b = sub(v[1], ray.origin), c = sub(v[2], ray.origin);
    double e[3];
    const double s[3] = {triple(d, b, c, e[0]), triple(d, c, a, e[1]), triple(d, a, b, e[2])};
    bool positive = false, negative = false;
    for (int i = 0; i < 3; ++i) {
        positive = positive || s[i] > e[i];
        negative = negative || s[i] < -e[i];
    }
    return positive && negative;
}

Verdict intersect(const ExactRay& ray, const Triangle& v, mpq_class* t) {
    std::array<ExactPoint, 3> corners;
    for (int i = 0; i < 3; ++i) corners[i] = {q(v[i].x), q(v[i].y), q(v[i].z)};
    return intersect(ray, corners, t);
}

Verdict intersect(const ExactRay& ray, const std::array<ExactPoint, 3>& v, mpq_class* t) {
    const Q3 d = {q(ray.direction.x), q(ray.direction.y), q(ray.direction.z)};
    const Q3 a = difference(v[0], ray.origin), b = difference(v[1], ray.origin),
             c = difference(v[2], ray.origin);
    const mpq_class s0 = dot(d, cross(b, c)), s1 = dot(d, cross(c, a)), s2 = dot(d, cross(a, b));
    const mpq_class sum = s0 + s1 + s2;
    const int side = sgn(sum);
    if (side == 0) return Verdict::Miss;
    if (sgn(s0) * side < 0 || sgn(s1) * side < 0 || sgn(s2) * side < 0) return Verdict::Miss;
    if (t) {
        // The point is the weighted mean of the vertices; any axis the ray moves along gives t.
        const Q3 p = {(s0 * a.x + s1 * b.x + s2 * c.x) / sum, (s0 * a.y + s1 * b.y + s2 * c.y) / sum,
                      (s0 * a.z + s1 * b.z + s2 * c.z) / sum};
        *t = sgn(d.x) ? mpq_class(p.x / d.x) : (sgn(d.y) ? mpq_class(p.y / d.y) : mpq_class(p.z / d.z));
    }
    return sgn(s0) && sgn(s1) && sgn(s2) ? Verdict::Hit : Verdict::Boundary;
}

std::optional<ExactHit> nearest(const ExactRay& ray, const std::vector<Triangle>& triangles) {
    std::optional<ExactHit> best;
    mpq_class best_t;
    std::vector<mpq_class> touched;
    const mpq_class tmin = q(ray.tmin);
    const bool bounded = std::isfinite(ray.tmax);
    const mpq_class tmax = bounded ? q(ray.tmax) : mpq_class(0);
    for (uint32_t i = 0; i < triangles.size(); ++i) {
        if (surely_missed(ray, triangles[i])) continue;
        mpq_class t;
        const Verdict verdict = intersect(ray, triangles[i], &t);
        if (verdict == Verdict::Miss || t <= tmin || (bounded && t >= tmax)) continue;
        if (verdict == Verdict::Boundary) touched.push_back(t);
        if (!best || t < best_t) {
            best_t = t;
            best = ExactHit{i, 0.0, false};
        }
    }
    if (best) {
        best->t = best_t.get_d();
        for (const mpq_class& t : touched) best->boundary = best->boundary || t <= best_t;
    }
    return best;
}

double inside_margin(const ExactRay& ray, const Triangle& v) {
    const D3 d = {ray.direction.x, ray.direction.y, ray.direction.z};
    const D3 a = sub(v[0], ray.origin), b = sub(v[1], ray.origin), c = sub(v[2], ray.origin);
    double e;
    const double s0 = triple(d, b, c, e), s1 = triple(d, c, a, e), s2 = triple(d, a, b, e);
    const double sum = s0 + s1 + s2;
    return std::min({s0 / sum, s1 / sum, s2 / sum});
}

}  // namespace rtc::lab
