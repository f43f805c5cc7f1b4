#include "experiments.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <limits>

#include "cases.h"
#include "error.h"
#include "exact.h"

namespace rtc::lab {
namespace {

std::string power_text(int exponent) { return "1e" + std::to_string(exponent); }

struct Placed {
    std::string value;
    IndexedMesh mesh;
    LeakCase c;  // mesh pointer filled in later
    bool promised = true;
};

Placed placed(std::string value, IndexedMesh mesh, double size, bool promised) {
    Placed p{std::move(value), std::move(mesh), {}, promised};
    p.c.size = size;
    return p;
}

std::vector<Placed> points_of(const std::string& axis) {
    std::vector<Placed> points;
    auto add = [&](const std::string& value, IndexedMesh mesh, double size, bool promised) -> Placed& {
        points.push_back(placed(value, std::move(mesh), size, promised));
        return points.back();
    };
    if (axis == "mesh") {
        add("closed", make_icosphere(5), 1, true);
        add("closed", make_torus_knot(400, 24), 1.6, true);
        add("closed", make_slivers(256, 1e-6), 1.1, true);
        add("closed", make_cube_grid(24), 1.8, true);
    } else if (axis == "offset") {
        for (int e = -1; e <= 8; ++e) {
            const double at = e < 0 ? 0 : std::pow(10.0, e);
            Placed& p =
                add(e < 0 ? "0" : power_text(e), moved(make_icosphere(4), 1, {at, -at, at / 2}), 1, e <= 4);
            p.c.centre = {float(at), float(-at), float(at / 2)};
        }
    } else if (axis == "size") {
        for (int e = -36; e <= 36; e += 6) {
            const double s = std::pow(10.0, e);
            add(power_text(e), moved(make_icosphere(4), s, {0, 0, 0}), s, std::abs(e) <= 30);
        }
    } else if (axis == "aspect") {
        for (int e = -1; e >= -8; --e) {
            // The needle's radius is 256 rim edges over 2 pi.
            const double ratio = std::pow(10.0, e);
            add(power_text(e), make_slivers(256, ratio), std::max(1.1, 42 * ratio), e >= -6);
        }
    } else if (axis == "distance") {
        for (int e = 1; e <= 8; ++e)
            add(power_text(e), make_icosphere(4), 1, e <= 5).c.distance = std::pow(10.0, e);
        // The other way round: small origins, large vertices.
        for (int e = 1; e <= 6; ++e) {
            const double at = std::pow(10.0, e);
            add("0 to " + power_text(e), moved(make_icosphere(4), 1, {at, -at, at / 2}), 1, true)
                .c.from_zero = true;
        }
    } else if (axis == "transform") {
        for (const auto& [name, transform] : lab_transforms()) {
            for (const IndexedMesh& mesh : {make_icosphere(4), make_torus_knot(200, 16)}) {
                const bool promised = name != "stretch 1e6:1" && name != "oblique 1e4:1" &&
                                      name != "near-singular" && name != "rotated + 1e8";
                add(name, mesh, 1.6, promised).c.instance.object_to_world = transform;
            }
        }
    } else if (axis == "zeros") {
        for (int i = 0; i < 3; ++i) {
            add(std::string("along ") + "xyz"[i], make_cube_grid(24), 1.8, true).c.axis_parallel = i;
        }
    } else {
        std::string known;
        for (const std::string& name : axis_names()) known += (known.empty() ? "" : ", ") + name;
        throw tools::Error("unknown axis \"" + axis + "\": " + known);
    }
    return points;
}

double percentile(const std::vector<double>& sorted, double p) {
    if (sorted.empty()) return 0;
    return sorted[std::min(sorted.size() - 1, size_t(p * double(sorted.size())))];
}

double ulp(double t) {
    const float f = std::fabs(float(t));
    return double(std::nextafter(f, std::numeric_limits<float>::infinity())) - double(f);
}

ExactRow compare(DeviceTracer& tracer, const std::string& name, const IndexedMesh& mesh, const Vec3& centre,
                 double size, uint64_t count, uint64_t seed) {
    const std::vector<Triangle> triangles = mesh.soup();
    tracer.set_scene(build_scene({Blas{{{triangles, {}, true}}}}, {{}}));
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> unit(-1, 1);
    std::vector<Ray> rays(count);
    const float far = std::numeric_limits<float>::max();
    for (Ray& ray : rays) {
        Vec3 target, origin;
        for (int i = 0; i < 3; ++i) {
            (&origin.x)[i] = float(centre[i] + 3 * size * unit(random));
            (&target.x)[i] = float(centre[i] + size * unit(random));
        }
        ray.origin = origin;
        ray.direction = {target.x - origin.x, target.y - origin.y, target.z - origin.z};
        ray.tmax = far;
    }
    const auto results = tracer.trace(rays);
    ExactRow row{.scene = name, .rays = count};
    std::vector<double> errors;
    for (uint64_t i = 0; i < count; ++i) {
        const ExactRay ray{rays[i].origin, rays[i].direction, 0, far};
        const auto expected = nearest(ray, triangles);
        const RayResult& got = results[i];
        const bool hit = got.instance != kNoInstance;
        row.hits += expected.has_value();
        if (!expected && !hit) continue;
        if (expected && hit && expected->triangle == got.primitive) {
            errors.push_back(std::fabs(double(got.t) - expected->t) / ulp(expected->t));
            continue;
        }
        if (expected && hit && expected->boundary) {
            ++row.ties;
            continue;
        }
        row.missed += expected && !hit;
        row.invented += !expected && hit;
        row.wrong += expected && hit;
        const double margin = inside_margin(ray, triangles[expected ? expected->triangle : got.primitive]);
        row.worst_margin = std::max(row.worst_margin, std::fabs(margin));
    }
    std::sort(errors.begin(), errors.end());
    row.t_p50 = percentile(errors, 0.5);
    row.t_p99 = percentile(errors, 0.99);
    row.t_p999 = percentile(errors, 0.999);
    row.t_max = errors.empty() ? 0 : errors.back();
    return row;
}

}  // namespace

const std::vector<std::string>& axis_names() {
    static const std::vector<std::string> names = {"mesh",     "offset",    "size", "aspect",
                                                   "distance", "transform", "zeros"};
    return names;
}

void measure_axis(DeviceTracer& tracer, const std::string& axis, uint64_t rays, std::vector<LeakRow>& rows) {
    uint64_t seed = 1;
    for (Placed& point : points_of(axis)) {
        point.c.mesh = &point.mesh;
        tracer.set_scene(leak_scene(point.c));
        for (Aim aim : {Aim::Interior, Aim::Edge, Aim::Vertex}) {
            point.c.aim = aim;
            point.c.seed = ++seed;
            LeakRow row{axis, point.value, point.mesh.name, aim_name(aim), point.promised, {}};
            // Half from inside where inside is known.
            // At offsets of 1e7 and more nothing lies inside a sphere of a few ulps.
            const bool convex =
                point.mesh.name == "icosphere" && axis != "distance" && std::fabs(point.c.centre.x) < 5e6;
            point.c.from_inside = false;
            row.counts = count_leaks(tracer, point.c, convex ? rays / 2 : rays);
            if (convex) {
                point.c.from_inside = true;
                row.counts.add(count_leaks(tracer, point.c, rays - rays / 2));
            }
            rows.push_back(row);
        }
    }
}

void measure_culls(DeviceTracer& tracer, uint64_t rays, std::vector<CullRow>& rows) {
    uint64_t seed = 500;
    auto measure = [&](const std::string& place, const IndexedMesh& mesh, LeakCase c) {
        c.mesh = &mesh;
        c.aim = Aim::Edge;
        c.size = 1.6;
        c.seed = ++seed;
        rows.push_back({mesh.name, place, rays, count_false_culls(tracer, c, rays)});
    };
    for (const IndexedMesh& mesh : {make_plane(16), make_icosphere(3)}) {
        for (const auto& [name, transform] : lab_transforms()) {
            LeakCase c;
            c.instance.object_to_world = transform;
            measure(name, mesh, c);
        }
        for (double at : {1e2, 1e4, 1e6}) {
            LeakCase c;
            c.centre = {float(at), float(-at), float(at / 2)};
            char text[32];
            std::snprintf(text, sizeof text, "offset %.0e", at);
            measure(text, moved(mesh, 1, {at, -at, at / 2}), c);
        }
        for (double at : {1e1, 1e2, 1e3, 1e4, 1e5}) {
            LeakCase c;
            c.from_zero = true;
            char text[32];
            std::snprintf(text, sizeof text, "0 to %.0e", at);
            measure(text, moved(mesh, 1, {at, -at, at / 2}), c);
        }
        for (double distance : {1e2, 1e4, 1e6}) {
            LeakCase c;
            c.distance = distance;
            char text[32];
            std::snprintf(text, sizeof text, "distance %.0e", distance);
            measure(text, mesh, c);
        }
    }
}

void measure_exact(DeviceTracer& tracer, uint64_t rays, std::vector<ExactRow>& rows) {
    const IndexedMesh sphere = make_icosphere(3), knot = make_torus_knot(80, 12);
    rows.push_back(compare(tracer, "icosphere", sphere, {}, 1, rays, 11));
    rows.push_back(compare(tracer, "torus knot", knot, {}, 1.5, rays, 12));
    rows.push_back(
        compare(tracer, "icosphere + 1e2", moved(sphere, 1, {100, -100, 50}), {100, -100, 50}, 1, rays, 13));
    rows.push_back(compare(tracer, "icosphere + 1e4", moved(sphere, 1, {1e4, -1e4, 5e3}), {1e4f, -1e4f, 5e3f},
                           1, rays, 14));
    rows.push_back(compare(tracer, "slivers 1e-4", make_slivers(256, 1e-4), {}, 0.02, rays, 15));
}

void measure_cost(DeviceTracer& tracer, uint64_t rays, std::vector<CostRow>& rows) {
    const IndexedMesh knot = make_torus_knot(2000, 50);
    tracer.set_scene(build_scene({Blas{{{knot.soup(), {}, true}}}}, {{}}));
    std::mt19937_64 random(3);
    std::uniform_real_distribution<float> unit(-1, 1);
    const uint32_t side = uint32_t(std::sqrt(double(rays)));
    for (const bool coherent : {true, false}) {
        std::vector<Ray> batch(size_t(side) * side);
        for (size_t i = 0; i < batch.size(); ++i) {
            Ray& ray = batch[i];
            ray.tmax = 1e30f;
            if (coherent) {
                // Tiles of 8 x 4, as the launch grid walks pixels.
                const size_t tile = i / 32, tiles = std::max<size_t>(side / 8, 1);
                const float x = float((tile % tiles) * 8 + i % 8), y = float((tile / tiles) * 4 + i / 8 % 4);
                ray.origin = {0, 0, 4};
                ray.direction = {1.2f * (x / float(side) - 0.5f), 1.2f * (y / float(side) - 0.5f), -1};
            } else {
                ray.origin = {1.6f * unit(random), 1.6f * unit(random), 1.6f * unit(random)};
                ray.direction = {unit(random), unit(random), unit(random)};
            }
        }
        CostRow row{coherent ? "primary" : "random", knot.triangles.size(), batch.size()};
        row.seconds = std::numeric_limits<double>::infinity();
        row.cpu_seconds = row.seconds;
        for (int repeat = 0; repeat < 7; ++repeat) {
            const std::clock_t before = std::clock();
            const auto results = tracer.trace(batch);
            row.cpu_seconds = std::min(row.cpu_seconds, double(std::clock() - before) / CLOCKS_PER_SEC);
            row.seconds = std::min(row.seconds, tracer.seconds);
            uint64_t turns = 0;
            for (const RayResult& r : results) turns += r.turns;
            row.turns_per_ray = double(turns) / double(batch.size());
        }
        rows.push_back(row);
    }
}

}  // namespace rtc::lab
