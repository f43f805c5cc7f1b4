#include "campaign.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "cases.h"
#include "progress.h"

namespace rtc::lab {
namespace {

using Clock = std::chrono::steady_clock;
constexpr size_t kOffendersKept = 4;  // of a row, from outside and from inside each

struct Shape {
    IndexedMesh mesh;
    double size;
    bool convex;
};

std::vector<Shape> shapes() {
    return {{make_icosphere(5), 1, true},
            {make_torus_knot(400, 24), 1.6, false},
            {make_slivers(256, 1e-6), 1.1, false},
            {make_mug(3), 1.5, false}};
}

std::vector<std::pair<std::string, Transform>> transforms() {
    std::vector<std::pair<std::string, Transform>> chosen;
    for (const auto& entry : lab_transforms())
        if (entry.first == "identity" || entry.first == "rotated" || entry.first == "sheared" ||
            entry.first == "mirrored")
            chosen.push_back(entry);
    return chosen;
}

CampaignPush push_of(const CampaignPoint& point, uint32_t mode, uint32_t seed) {
    CampaignPush push{};
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 4; ++c) push.object_to_world[r * 4 + c] = point.object_to_world[r][c];
    std::copy_n(point.ball, 4, push.ball);
    if (mode & kModeInside) push.ball[3] *= 0.1f / 3;
    push.seed = seed;
    push.mode = mode;
    push.first_corner = point.first_corner;
    push.triangles = uint32_t(point.shape->triangles.size());
    return push;
}

CampaignOffender judged(const CampaignCounters::Offender& found, const CampaignPush& push,
                        const std::vector<Triangle>& triangles, const Transform& world_to_object) {
    CampaignOffender o;
    o.number = uint64_t(found.high) << 32 | found.low;
    o.origin = {found.origin[0], found.origin[1], found.origin[2]};
    o.direction = {found.direction[0], found.direction[1], found.direction[2]};
    o.front = found.front;
    o.back = found.back;
    const CampaignRay again = campaign_ray(push, triangles, o.number);
    o.closest = again.closest;
    o.same_ray = std::memcmp(&again.origin, &o.origin, sizeof(Vec3)) == 0 &&
                 std::memcmp(&again.direction, &o.direction, sizeof(Vec3)) == 0;
    o.exact = exact_balance(transform_point(world_to_object, o.origin),
                            transform_vector(world_to_object, o.direction), triangles);
    return o;
}

}  // namespace

std::vector<CampaignPoint> campaign_points(bool beyond) {
    std::vector<CampaignPoint> points;
    uint32_t corners = 0;
    for (const Shape& shape : shapes()) {
        const auto here = std::make_shared<const IndexedMesh>(shape.mesh);
        const uint32_t floats = uint32_t(shape.mesh.triangles.size() * 9), here_corner = corners;
        corners += floats;
        for (int exponent = beyond ? 5 : 0; exponent <= (beyond ? 8 : 4); ++exponent) {
            const double at = exponent == 0 ? 0 : std::pow(10.0, exponent) * shape.size;
            const std::array<double, 3> offset = {at, -at, at / 2};
            const auto there = at == 0 ? here : std::make_shared<const IndexedMesh>(moved(shape.mesh, 1, offset));
            const uint32_t there_corner = at == 0 ? here_corner : corners;
            corners += at == 0 ? 0 : floats;
            for (const auto& [name, transform] : transforms()) {
                for (const bool vertices : {true, false}) {
                    if (at == 0 && !vertices) continue;
                    CampaignPoint point;
                    point.mesh = shape.mesh.name;
                    point.transform = name;
                    point.place = vertices ? "vertices" : "instance";
                    point.offset = exponent == 0 ? 0 : std::pow(10.0, exponent);
                    point.promised = !beyond;
                    point.shape = vertices ? there : here;
                    point.first_corner = vertices ? there_corner : here_corner;
                    point.object_to_world =
                        vertices ? transform
                                 : translated(transform, float(at), float(-at), float(at / 2));
                    // Origins keep their distance where floats are coarser than the mesh.
                    const double reach = std::max(3 * shape.size, std::ldexp(at, -18));
                    for (int i = 0; i < 3; ++i) point.ball[i] = vertices ? float(offset[i]) : 0;
                    point.ball[3] = float(reach);
                    point.convex = shape.convex && at < 5e6;
                    points.push_back(std::move(point));
                }
            }
        }
    }
    return points;
}

std::vector<float> campaign_corners(const std::vector<CampaignPoint>& points) {
    std::vector<float> corners;
    for (const CampaignPoint& point : points) {
        const std::vector<Triangle> triangles = point.shape->soup();
        corners.resize(std::max(corners.size(), point.first_corner + triangles.size() * 9));
        std::memcpy(&corners[point.first_corner], triangles.data(), triangles.size() * sizeof(Triangle));
    }
    return corners;
}

tools::Scene campaign_scene(const CampaignPoint& point) {
    tools::Scene scene;
    scene.name = point.mesh;
    tools::Mesh mesh;
    mesh.name = point.mesh;
    for (const Vec3& v : point.shape->vertices) mesh.positions.push_back({v.x, v.y, v.z});
    for (const auto& t : point.shape->triangles) mesh.indices.insert(mesh.indices.end(), t.begin(), t.end());
    mesh.opaque = false;
    mesh.no_duplicate_any_hit = true;  // what is counted must not be seen twice
    scene.meshes.push_back(std::move(mesh));
    tools::Instance instance;
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 4; ++c) instance.transform[c][r] = point.object_to_world[r][c];
    scene.instances.push_back(instance);
    return scene;
}

uint64_t CampaignReport::rays(bool promised) const {
    uint64_t sum = 0;
    for (const CampaignRow& row : rows) sum += row.promised == promised ? row.rays : 0;
    return sum;
}

uint64_t CampaignReport::unbalanced(bool promised) const {
    uint64_t sum = 0;
    for (const CampaignRow& row : rows) sum += row.promised == promised ? row.unbalanced : 0;
    return sum;
}

CampaignReport run_campaign(CampaignTracer& tracer, const std::vector<CampaignPoint>& points, bool beyond,
                            const CampaignSettings& settings) {
    CampaignReport report;
    report.seed = settings.seed;
    const Clock::time_point start = Clock::now();
    const uint64_t total = beyond ? settings.beyond : settings.rays;
    const uint64_t share = (total + points.size() - 1) / points.size();
    tools::Progress progress(beyond ? "leaks beyond the promise" : "leaks", points.size(), settings.quiet);
    double rays_done = 0, said = 0;
    for (size_t p = 0; p < points.size() && total; ++p) {
        const CampaignPoint& point = points[p];
        const std::vector<Triangle> triangles = point.shape->soup();
        const Transform world_to_object = invert(point.object_to_world);
        tracer.use(p);
        for (const uint32_t aim : {kModeEdge, kModeVertex}) {
            CampaignRow row{point.mesh, point.transform, point.place, aim == kModeEdge ? "edge" : "vertex",
                            point.offset, point.promised};
            // What is left of the time, in equal parts.
            const double spent = std::chrono::duration<double>(Clock::now() - start).count();
            const double parts = 2 * double(points.size() - p) - (aim == kModeVertex ? 1 : 0);
            const double allowed = settings.seconds > 0 ? std::max(0.0, settings.seconds - spent) / parts : 1e30;
            const Clock::time_point row_start = Clock::now();
            size_t kept[2] = {0, 0};
            for (uint64_t done = 0, turn = 0; done < share; ++turn) {
                const bool inside = point.convex && (turn & 1);
                uint64_t count = std::min<uint64_t>(tracer.lanes(), share - done);
                if (point.convex && turn == 0) count = std::min(count, (share + 1) / 2);
                CampaignPush push = push_of(point, aim | (inside ? kModeInside : kModeAxes),
                                            settings.seed * 0x10001u + uint32_t(p) * 2 + aim + beyond * 0x800u);
                push.first_low = uint32_t(done);
                push.first_high = uint32_t(done >> 32);
                push.rays = uint32_t(count);
                CampaignCounters counters{};
                row.seconds += tracer.launch(push, counters);
                row.rays += count;
                row.unbalanced += counters.unbalanced;
                row.missed += counters.missed;
                const uint32_t in_ring = std::min(counters.unbalanced, kCampaignRing);
                for (uint32_t i = 0; i < in_ring && kept[inside] < kOffendersKept; ++i) {
                    report.offenders.push_back(judged(counters.ring[i], push, triangles, world_to_object));
                    report.offenders.back().row = report.rows.size();
                    ++kept[inside];
                }
                done += count;
                if (std::chrono::duration<double>(Clock::now() - row_start).count() > allowed) break;
            }
            rays_done += double(row.rays);
            report.rows.push_back(std::move(row));
        }
        progress.update(p + 1, rays_done);
        // Into a file, a line now and then.
        const double now = std::chrono::duration<double>(Clock::now() - start).count();
        if (!settings.quiet && !isatty(STDOUT_FILENO) && now > said + 10) {
            std::fprintf(stderr, "%zu of %zu places, %.0f million rays, %llu unbalanced, %.0f s\n", p + 1, points.size(),
                         rays_done * 1e-6, (unsigned long long)(report.unbalanced(true) + report.unbalanced(false)), now);
            said = now;
        }
    }
    progress.finish(rays_done);
    return report;
}

}  // namespace rtc::lab
