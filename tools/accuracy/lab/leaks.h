// Leaks and double hits, counted without arithmetic: a ray that starts outside
// a closed surface leaves it as often as it enters, one that starts inside
// once more. This holds for folded and self-intersecting meshes too, as long
// as triangles share their vertices, so every deviation is traversal's. A ray that
// loses an entry and an exit is not seen here; false culls and first hits see it.
#pragma once

#include <cstdint>

#include "ray_tracer.h"
#include "meshes.h"

namespace rtc::lab {

struct LeakCase {
    const IndexedMesh* mesh = nullptr;
    Instance instance;  // of the mesh
    Aim aim = Aim::Edge;
    bool from_inside = false;  // origins near `centre`, which must lie inside the mesh
    Vec3 centre;               // of the mesh, object space
    double size = 1;           // radius of a ball round the mesh
    double distance = 3;       // of outside origins, in sizes
    bool from_zero = false;    // outside origins lie within one unit of (0, 0, 0) instead
    int axis_parallel = -1;    // >= 0: rays run along this axis exactly
    bool look = true;          // at unbalanced rays, in exact arithmetic
    uint64_t seed = 1;
};

struct LeakCounts {
    uint64_t rays = 0;
    uint64_t unbalanced = 0;  // entries and exits do not match: a leak or a double hit
    // Of the unbalanced, some are looked at in exact arithmetic: hits that are missing, hits too many. (The others
    // took one thing for another.)
    uint64_t looked_at = 0, leaks = 0, doubles = 0;
    uint64_t missed = 0;      // aimed rays without any candidate
    uint64_t turns = 0;
    double seconds = 0;

    void add(const LeakCounts& more);
};

// The tracer's scene must hold the case's mesh as its only instance.
LeakCounts count_leaks(RayTracer& tracer, const LeakCase& c, uint64_t rays);
std::vector<Ray> leak_rays(const LeakCase& c, uint64_t rays, uint64_t batch);

HostScene leak_scene(const LeakCase& c, const BuildOptions& options = {});

// False box culls: rays that see other candidates once every box of both
// levels is generously inflated. Sets the tracer's scene.
uint64_t count_false_culls(RayTracer& tracer, const LeakCase& c, uint64_t rays);

}  // namespace rtc::lab
