#include "leaks.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "campaign_rays.h"

namespace rtc::lab {
namespace {

constexpr uint64_t kBatch = 1 << 17;
constexpr uint64_t kLookedAt = 24;  // of a place

Vec3 to_world(const Transform& m, const Vec3& p) {
    float out[3];
    for (int r = 0; r < 3; ++r) {
        out[r] = float(double(m[r][0]) * p.x + double(m[r][1]) * p.y + double(m[r][2]) * p.z + m[r][3]);
    }
    return {out[0], out[1], out[2]};
}

}  // namespace

void LeakCounts::add(const LeakCounts& more) {
    rays += more.rays;
    unbalanced += more.unbalanced;
    looked_at += more.looked_at;
    leaks += more.leaks;
    doubles += more.doubles;
    missed += more.missed;
    turns += more.turns;
    seconds += more.seconds;
}

HostScene leak_scene(const LeakCase& c, const BuildOptions& options) {
    Instance instance = c.instance;
    instance.blas = 0;
    return build_scene({Blas{{{c.mesh->soup(), {}, false}}}}, {instance}, options);
}

std::vector<Ray> leak_rays(const LeakCase& c, uint64_t count, uint64_t batch) {
    Random random(c.seed * 1000003 + batch);
    std::normal_distribution<double> normal;
    std::vector<Ray> rays(count);
    for (Ray& ray : rays) {
        const Vec3 target = aim_point(*c.mesh, c.aim, random);
        double v[3] = {normal(random), normal(random), normal(random)};
        const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        const double reach = c.from_inside ? 0.2 : c.distance;
        Vec3 origin = {float(c.centre.x + v[0] / length * reach * c.size),
                       float(c.centre.y + v[1] / length * reach * c.size),
                       float(c.centre.z + v[2] / length * reach * c.size)};
        if (c.from_zero) origin = {float(v[0] / length), float(v[1] / length), float(v[2] / length)};
        Vec3 world_origin, direction;
        if (c.axis_parallel >= 0) {
            // Along an axis of the object, identity transform: the ray meets the target exactly. The
            // zeros of the direction carry either sign.
            float o[3] = {target.x, target.y, target.z}, d[3];
            for (int i = 0; i < 3; ++i) d[i] = random() & 1 ? 0.0f : -0.0f;
            const float side = random() & 1 ? 1.0f : -1.0f;
            o[c.axis_parallel] -= side * float(c.distance * c.size);
            d[c.axis_parallel] = side;
            world_origin = {o[0], o[1], o[2]};
            direction = {d[0], d[1], d[2]};
        } else {
            world_origin = to_world(c.instance.object_to_world, origin);
            const Vec3 world_target = to_world(c.instance.object_to_world, target);
            direction = {world_target.x - world_origin.x, world_target.y - world_origin.y,
                         world_target.z - world_origin.z};
        }
        ray.origin = world_origin;
        ray.direction = direction;
        ray.tmin = 0;
        ray.tmax = std::numeric_limits<float>::infinity();
        ray.flags = 2;  // no opaque: the any-hit sees, counts and ignores every candidate
        ray.sbt = kIgnore;
    }
    return rays;
}

LeakCounts count_leaks(RayTracer& tracer, const LeakCase& c, uint64_t total) {
    LeakCounts counts;
    const Transform world_to_object = invert(c.instance.object_to_world);
    std::vector<Triangle> triangles;
    for (uint64_t batch = 0; counts.rays < total; ++batch) {
        const std::vector<Ray> rays = leak_rays(c, std::min(kBatch, total - counts.rays), batch);
        const std::vector<RayResult> results = tracer.trace(rays);
        for (size_t i = 0; i < rays.size(); ++i) {
            const RayResult& r = results[i];
            const int64_t balance = int64_t(r.back) - int64_t(r.front);
            const int64_t expected = c.from_inside ? 1 : 0;
            counts.unbalanced += balance != expected;
            counts.missed += r.front + r.back == 0;
            counts.turns += r.turns;
            if (balance == expected || !c.look || counts.looked_at == kLookedAt) continue;
            if (triangles.empty()) triangles = c.mesh->soup();
            const ExactBalance exact = exact_balance(transform_point(world_to_object, rays[i].origin),
                                                     transform_vector(world_to_object, rays[i].direction), triangles);
            const uint32_t got = r.front + r.back, due = exact.front + exact.back;
            counts.looked_at++;
            counts.leaks += got < due;
            counts.doubles += got > due;
        }
        counts.rays += rays.size();
        counts.seconds += tracer.seconds;
    }
    return counts;
}

uint64_t count_false_culls(RayTracer& tracer, const LeakCase& c, uint64_t total) {
    uint64_t culls = 0, done = 0;
    BuildOptions generous;
    generous.inflate = 0.05f;
    const HostScene tight = leak_scene(c), loose = leak_scene(c, generous);
    for (uint64_t batch = 0; done < total; ++batch) {
        const std::vector<Ray> rays = leak_rays(c, std::min(kBatch, total - done), batch);
        tracer.set_scene(tight);
        const auto seen = tracer.trace(rays);
        tracer.set_scene(loose);
        const auto there = tracer.trace(rays);
        for (size_t i = 0; i < rays.size(); ++i) {
            culls += seen[i].front != there[i].front || seen[i].back != there[i].back;
        }
        done += rays.size();
    }
    return culls;
}

}  // namespace rtc::lab
