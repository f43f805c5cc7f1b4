#include "experiments.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <limits>

#include "cases.h"
#include "error.h"

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

}  // namespace

const std::vector<std::string>& axis_names() {
    static const std::vector<std::string> names = {"mesh",     "offset",    "size", "aspect",
                                                   "distance", "transform", "zeros"};
    return names;
}

void measure_axis(RayTracer& tracer, const std::string& axis, uint64_t rays, std::vector<LeakRow>& rows) {
    uint64_t seed = 1;
    for (Placed& point : points_of(axis)) {
        point.c.mesh = &point.mesh;
        tracer.set_scene(leak_scene(point.c));
        for (Aim aim : {Aim::Interior, Aim::Edge, Aim::Vertex}) {
            point.c.aim = aim;
            point.c.seed = ++seed;
            point.c.look = point.promised && aim != Aim::Interior;  // of the others nobody is told
            LeakRow row{axis, point.value, point.mesh.name, aim_name(aim), point.promised, {}};
            // Half from inside where inside is known.
            // At offsets of 1e7 and more nothing lies inside a sphere of a few ulps.
            double far = std::fabs(point.c.centre.x);
            for (const auto& row : point.c.instance.object_to_world) far = std::max(far, double(std::fabs(row[3])));
            const bool convex = point.mesh.name == "icosphere" && axis != "distance" && far < 5e6;
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

void measure_culls(RayTracer& tracer, uint64_t rays, std::vector<CullRow>& rows) {
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

static std::vector<Ray> cost_rays(bool coherent, uint64_t rays) {
    std::mt19937_64 random(3);
    std::uniform_real_distribution<float> unit(-1, 1);
    const uint32_t side = uint32_t(std::sqrt(double(rays)));
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
    return batch;
}

static double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    const size_t half = values.size() / 2;
    return values.size() % 2 ? values[half] : (values[half - 1] + values[half]) / 2;
}

void measure_cost(const std::vector<CostSubject>& all, uint64_t rays, unsigned repeats) {
    const IndexedMesh knot = make_torus_knot(2000, 50);
    const HostScene scene = build_scene({Blas{{{knot.soup(), {}, true}}}}, {{}});
    std::vector<CostSubject> subjects = all;
    // One that cannot must not take the others' figures with it.
    auto each = [&](auto&& work) {
        for (size_t i = 0; i < subjects.size(); ++i) {
            if (!subjects[i].report->cost_problem.empty()) continue;
            try {
                work(i);
            } catch (const tools::Error& problem) {
                subjects[i].report->cost_problem = problem.what();
                subjects[i].report->cost.clear();
            }
        }
    };
    each([&](size_t i) { subjects[i].tracer->set_scene(scene); });
    for (const bool coherent : {true, false}) {
        const std::vector<Ray> batch = cost_rays(coherent, rays);
        std::vector<std::vector<double>> times(subjects.size());
        std::vector<CostRow> rows(subjects.size());
        // One after the other, again and again: what else the machine does, and how warm it is, is the same for all.
        for (unsigned repeat = 0; repeat <= repeats; ++repeat) {
            each([&](size_t i) {
                const std::clock_t before = std::clock();
                const auto results = subjects[i].tracer->trace(batch);
                const double cpu = double(std::clock() - before) / CLOCKS_PER_SEC;
                if (repeat == 0) {  // compiles, allocates, warms up
                    uint64_t turns = 0;
                    for (const RayResult& r : results) turns += r.turns;
                    rows[i].turns_per_ray = double(turns) / double(batch.size());
                } else {
                    times[i].push_back(subjects[i].by_cpu ? cpu : subjects[i].tracer->seconds);
                }
            });
        }
        size_t first = 0;
        while (first < subjects.size() && !subjects[first].report->cost_problem.empty()) ++first;
        each([&](size_t i) {
            CostRow& row = rows[i];
            row.workload = coherent ? "primary" : "random";
            row.triangles = knot.triangles.size();
            row.rays = batch.size();
            row.by_cpu = subjects[i].by_cpu;
            row.seconds = median(times[i]);
            std::vector<double> ratios;
            for (size_t k = 0; k < times[i].size(); ++k) ratios.push_back(times[i][k] / times[first][k]);
            row.against_first = median(ratios);
            row.scene_bytes = subjects[i].tracer->scene_bytes();
            subjects[i].report->cost.push_back(row);
        });
    }
}

}  // namespace rtc::lab
