#include "campaign_rays.h"

#include <gmpxx.h>

#include <algorithm>
#include <cmath>

#include "exact.h"

namespace rtc::lab {
namespace {

// campaign_ray.glsl, line by line.
uint32_t pcg(uint32_t v) {
    const uint32_t s = v * 747796405u + 2891336453u;
    const uint32_t w = ((s >> ((s >> 28) + 4)) ^ s) * 277803737u;
    return (w >> 22) ^ w;
}

struct Hash {
    uint32_t state;
    uint32_t next() { return pcg(state += 0x9e3779b9u); }
    float unit() { return float(next() >> 8) * 0x1p-24f; }
};

Vec3 to_world(const float* m, const Vec3& p) {
    float out[3];
    for (int r = 0; r < 3; ++r) {
        const float x = m[r * 4] * p.x, y = m[r * 4 + 1] * p.y, z = m[r * 4 + 2] * p.z;
        out[r] = ((x + y) + z) + m[r * 4 + 3];
    }
    return {out[0], out[1], out[2]};
}

float mixed(float w, float a, float u, float b, float v, float c) {
    const float wa = w * a, ub = u * b, vc = v * c;
    return (wa + ub) + vc;
}

using Q = std::array<mpq_class, 3>;

Q rational(const Vec3& v) { return {mpq_class(v.x), mpq_class(v.y), mpq_class(v.z)}; }

Q minus(const Q& a, const Q& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

mpq_class determinant(const Q& x, const Q& y, const Q& z) {
    return x[0] * (y[1] * z[2] - y[2] * z[1]) + x[1] * (y[2] * z[0] - y[0] * z[2]) +
           x[2] * (y[0] * z[1] - y[1] * z[0]);
}

}  // namespace

CampaignRay campaign_ray(const CampaignPush& push, const std::vector<Triangle>& triangles, uint64_t number) {
    const uint32_t low = uint32_t(number), high = uint32_t(number >> 32);
    Hash hash{pcg(low ^ pcg(high ^ pcg(push.seed)))};
    const Triangle& triangle = triangles[hash.next() % push.triangles];
    const uint32_t k = hash.next() % 3;
    const Vec3 &a = triangle[k], &b = triangle[(k + 1) % 3], &c = triangle[(k + 2) % 3];
    const uint32_t aim = push.mode & 3;
    float u = hash.unit(), v = hash.unit();
    u = aim == kModeVertex ? 0.0f : u;
    v = aim == kModeInterior ? v : 0.0f;
    if (u + v > 1) {
        u = 1 - u;
        v = 1 - v;
    }
    const float w = (1 - u) - v;
    const Vec3 target = {mixed(w, a.x, u, b.x, v, c.x), mixed(w, a.y, u, b.y, v, c.y),
                         mixed(w, a.z, u, b.z, v, c.z)};
    const uint32_t face = hash.next() % 6;
    const float s = 2 * hash.unit() - 1, t = 2 * hash.unit() - 1, side = face & 1 ? 1.0f : -1.0f;
    const Vec3 way = face < 2 ? Vec3{side, s, t} : (face < 4 ? Vec3{t, side, s} : Vec3{s, t, side});
    Vec3 from;
    for (int i = 0; i < 3; ++i) {
        const float step = push.ball[3] * way[i];
        (&from.x)[i] = push.ball[i] + step;
    }
    const Vec3 goal = to_world(push.object_to_world, target);
    CampaignRay ray;
    ray.origin = to_world(push.object_to_world, from);
    ray.direction = {goal.x - ray.origin.x, goal.y - ray.origin.y, goal.z - ray.origin.z};
    const uint32_t signs = hash.next();
    if ((push.mode & kModeAxes) && (signs & 7) == 0) {
        const int axis = int(face >> 1);
        for (int i = 0; i < 3; ++i) {
            (&ray.direction.x)[i] = i == axis ? side : (signs & (8u << i) ? 0.0f : -0.0f);
            const float step = side * (2 * push.ball[3]);
            (&ray.origin.x)[i] = i == axis ? goal[i] - step : goal[i];
        }
    }
    ray.closest = (push.mode & kModeInside) && (signs & 64);
    return ray;
}

ExactBalance exact_balance(const Vec3& origin, const Vec3& direction,
                           const std::vector<Triangle>& triangles) {
    ExactBalance result;
    const ExactRay ray{origin, direction, 0, 0};
    const float x = std::fabs(direction.x), y = std::fabs(direction.y), z = std::fabs(direction.z);
    const int axis = x > y ? (x > z ? 0 : 2) : (y > z ? 1 : 2);
    auto turned = [axis](const Vec3& v) { return Vec3{v[(axis + 1) % 3], v[(axis + 2) % 3], v[axis]}; };
    const Q o = rational(turned(origin)), d = rational(turned(direction));
    for (const Triangle& triangle : triangles) {
        if (surely_missed(ray, triangle)) continue;
        Q p[3];
        for (int i = 0; i < 3; ++i) p[i] = rational(turned(triangle[i]));
        int side[3];
        bool touched = false;
        for (int i = 0; i < 3; ++i) {
            const Q &b = p[(i + 1) % 3], &c = p[(i + 2) % 3];
            side[i] = sgn(determinant(d, minus(c, o), minus(b, o)));
            if (side[i] != 0) continue;
            touched = true;  // then as if the ray were moved by (e, e^2): exact.glsl
            const Q w = minus(c, b);
            side[i] = -sgn(mpq_class(d[1] * w[2] - d[2] * w[1]));
            if (side[i] == 0) side[i] = -sgn(mpq_class(d[2] * w[0] - d[0] * w[2]));
        }
        if (side[0] != side[1] || side[1] != side[2] || side[0] == 0) continue;
        const mpq_class above = determinant(minus(p[0], o), minus(p[1], o), minus(p[2], o));
        const mpq_class below = determinant(d, minus(p[1], p[0]), minus(p[2], p[0]));
        if (sgn(below) == 0 || sgn(above) * sgn(below) <= 0) continue;  // behind the origin
        // Front faces have their normal against the ray.
        ++(sgn(below) < 0 ? result.front : result.back);
        result.touched += touched;
        result.nearest_edge = std::min(result.nearest_edge, std::fabs(inside_margin(ray, triangle)));
    }
    return result;
}

}  // namespace rtc::lab
