#include "campaign.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <tuple>

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

CampaignOffender judged(const CampaignCounters::Offender& found, const CampaignPush& push, CampaignProgram program,
                        const std::vector<Triangle>& triangles, const Transform& world_to_object) {
    CampaignOffender o;
    o.number = uint64_t(found.high) << 32 | found.low;
    o.origin = {found.origin[0], found.origin[1], found.origin[2]};
    o.direction = {found.direction[0], found.direction[1], found.direction[2]};
    o.front = found.front;
    o.back = found.back;
    if (program == CampaignProgram::Spawn) return o;
    const CampaignRay again = campaign_ray(push, triangles, o.number);
    o.closest = again.closest;
    o.same_ray = std::memcmp(&again.origin, &o.origin, sizeof(Vec3)) == 0 &&
                 std::memcmp(&again.direction, &o.direction, sizeof(Vec3)) == 0;
    o.exact = exact_balance(transform_point(world_to_object, o.origin),
                            transform_vector(world_to_object, o.direction), triangles);
    return o;
}

// Places of one mesh after another; shapes that are the same are shared.
class PointList {
  public:
    explicit PointList(const Shape& shape, std::vector<CampaignPoint>& points, uint32_t& corners)
        : shape_(shape), points_(points), corners_(corners), here_(share({0, 0, 0})) {}

    void add(const std::string& name, const Transform& transform, double offset, bool vertices, bool promised) {
        const double at = offset * shape_.size;
        const std::array<double, 3> where = {at, -at, at / 2};
        if (vertices && offset != there_offset_) {
            there_ = offset == 0 ? here_ : share(where);
            there_offset_ = offset;
        }
        CampaignPoint point;
        point.mesh = shape_.mesh.name;
        point.transform = name;
        point.place = vertices ? "vertices" : "instance";
        point.offset = offset;
        point.promised = promised;
        std::tie(point.shape, point.first_corner) = vertices ? there_ : here_;
        point.object_to_world = transform;
        if (!vertices) point.object_to_world = translated(transform, float(where[0]), float(where[1]), float(where[2]));
        for (int i = 0; i < 3; ++i) point.ball[i] = vertices ? float(where[i]) : 0;
        // Origins keep their distance where floats are coarser than the mesh.
        point.ball[3] = float(std::max(3 * shape_.size, std::ldexp(at, -18)));
        point.convex = shape_.convex && at < 5e6;
        points_.push_back(std::move(point));
    }

  private:
    using Shared = std::pair<std::shared_ptr<const IndexedMesh>, uint32_t>;
    Shared share(const std::array<double, 3>& where) {
        const uint32_t first = corners_;
        corners_ += uint32_t(shape_.mesh.triangles.size() * 9);
        return {std::make_shared<const IndexedMesh>(moved(shape_.mesh, 1, where)), first};
    }

    const Shape& shape_;
    std::vector<CampaignPoint>& points_;
    uint32_t& corners_;
    Shared here_, there_;
    double there_offset_ = -1;
};

std::vector<CampaignPoint> make_points(bool beyond, bool more_transforms) {
    std::vector<CampaignPoint> points;
    uint32_t corners = 0;
    for (const Shape& shape : shapes()) {
        PointList list(shape, points, corners);
        for (int exponent = beyond ? 5 : 0; exponent <= (beyond ? 8 : 4); ++exponent) {
            const double offset = exponent == 0 ? 0 : std::pow(10.0, exponent);
            for (const auto& [name, transform] : transforms()) {
                list.add(name, transform, offset, true, !beyond);
                if (offset != 0) list.add(name, transform, offset, false, !beyond);
            }
        }
        if (!more_transforms) continue;
        for (const auto& [name, transform] : lab_transforms()) list.add(name, transform, 0, true, true);
    }
    // Triangles on either side of what rtc/spawn.glsl takes for thin.
    for (const double ratio : more_transforms ? std::vector<double>{1e-1, 1e-2, 3e-3, 1e-4} : std::vector<double>{}) {
        Shape shape{make_slivers(256, ratio), std::max(1.1, 42 * ratio), false};
        char name[32];
        std::snprintf(name, sizeof name, "slivers-%.0e", ratio);
        shape.mesh.name = name;
        PointList list(shape, points, corners);
        for (const auto& [transform_name, transform] : transforms()) list.add(transform_name, transform, 0, true, true);
    }
    return points;
}

}  // namespace

std::vector<CampaignPoint> campaign_points(bool beyond) { return make_points(beyond, false); }

std::vector<CampaignPoint> spawn_points() { return make_points(false, true); }

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

uint64_t CampaignReport::events(bool promised) const {
    uint64_t sum = 0;
    for (const CampaignRow& row : rows) sum += row.promised == promised ? row.events : 0;
    return sum;
}

CampaignReport run_campaign(CampaignTracer& tracer, const std::vector<CampaignPoint>& points, bool beyond,
                            const CampaignSettings& settings) {
    CampaignReport report;
    report.seed = settings.seed;
    const Clock::time_point start = Clock::now();
    const uint64_t total = beyond ? settings.beyond : settings.rays;
    const uint64_t share = (total + points.size() - 1) / points.size();
    const bool spawn = settings.program == CampaignProgram::Spawn;
    const std::vector<uint32_t> aims = spawn ? std::vector<uint32_t>{kModeInterior, kModeEdge, kModeVertex}
                                             : std::vector<uint32_t>{kModeEdge, kModeVertex};
    tools::Progress progress(spawn ? "self-hits" : (beyond ? "leaks beyond the promise" : "leaks"), points.size(), settings.quiet);
    double rays_done = 0, said = 0;
    for (size_t p = 0; p < points.size() && total; ++p) {
        const CampaignPoint& point = points[p];
        const std::vector<Triangle> triangles = point.shape->soup();
        const Transform world_to_object = invert(point.object_to_world);
        tracer.use(p);
        for (size_t a = 0; a < aims.size(); ++a) {
            const uint32_t aim = aims[a];
            CampaignRow row{point.mesh, point.transform, point.place, aim_name(Aim(aim)), point.offset, point.promised};
            // What is left of the time, in equal parts.
            const double spent = std::chrono::duration<double>(Clock::now() - start).count();
            const double parts = double(aims.size() * (points.size() - p) - a);
            const double allowed = settings.seconds > 0 ? std::max(0.0, settings.seconds - spent) / parts : 1e30;
            const Clock::time_point row_start = Clock::now();
            size_t kept[2] = {0, 0};
            for (uint64_t done = 0, turn = 0; done < share; ++turn) {
                const bool inside = point.convex && (turn & 1);
                uint64_t count = std::min<uint64_t>(tracer.lanes(), share - done);
                if (point.convex && turn == 0) count = std::min(count, (share + 1) / 2);
                CampaignPush push = push_of(point, aim | (inside ? kModeInside : kModeAxes) | (settings.naive ? kModeNaive : 0u),
                                            settings.seed * 0x10001u + uint32_t(p) * 2 + aim + beyond * 0x800u);
                push.first_low = uint32_t(done);
                push.first_high = uint32_t(done >> 32);
                push.rays = uint32_t(count);
                CampaignCounters counters{};
                row.seconds += tracer.launch(push, counters);
                row.rays += count;
                row.events += counters.events;
                row.missed += counters.missed;
                const uint32_t in_ring = std::min(counters.events, kCampaignRing);
                for (uint32_t i = 0; i < in_ring && kept[inside] < kOffendersKept; ++i) {
                    report.offenders.push_back(judged(counters.ring[i], push, settings.program, triangles, world_to_object));
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
            std::fprintf(stderr, "%zu of %zu places, %.0f million rays, %llu events, %.0f s\n", p + 1, points.size(),
                         rays_done * 1e-6, (unsigned long long)(report.events(true) + report.events(false)), now);
            said = now;
        }
    }
    progress.finish(rays_done);
    return report;
}

}  // namespace rtc::lab
