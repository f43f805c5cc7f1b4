// What the laboratory measures, axis by axis.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "device_tracer.h"
#include "leaks.h"

namespace rtc::lab {

// Leaks and double hits at one point of one axis.
struct LeakRow {
    std::string axis, value, mesh, aim;
    bool must_be_zero = false;  // inside the range the watertight tier promises
    LeakCounts counts;
};

// Boxes that hide what the triangle test would hit.
struct CullRow {
    std::string mesh, place;
    uint64_t rays = 0, culls = 0;
};

// First hits against exact arithmetic.
struct ExactRow {
    std::string scene;
    uint64_t rays = 0, hits = 0;
    uint64_t missed = 0;      // exact hit, device miss
    uint64_t invented = 0;    // device hit, exact miss
    uint64_t wrong = 0;       // another triangle, not a tie on an edge
    uint64_t ties = 0;        // another triangle, and exact arithmetic has the ray on an edge
    double worst_margin = 0;  // how far from an edge a difference was, in barycentric weight
    double t_p50 = 0, t_p99 = 0, t_p999 = 0, t_max = 0;  // error of t in ulps of the exact t
};

// Cost of the same binary: closest hits on a mesh of `triangles`.
struct CostRow {
    std::string workload;
    uint64_t triangles = 0, rays = 0;
    double seconds = 0, turns_per_ray = 0;
    double cpu_seconds = 0;  // of this process: the steadier figure for devices that are the CPU
    double mrays() const { return seconds > 0 ? double(rays) / seconds / 1e6 : 0; }
};

struct Report {
    Variant variant = Variant::Watertight;
    std::vector<LeakRow> leaks;
    std::vector<CullRow> culls;
    std::vector<ExactRow> exact;
    std::vector<CostRow> cost;
};

// Names for --axes.
const std::vector<std::string>& axis_names();

void measure_axis(DeviceTracer& tracer, const std::string& axis, uint64_t rays, std::vector<LeakRow>& rows);
void measure_culls(DeviceTracer& tracer, uint64_t rays, std::vector<CullRow>& rows);
void measure_exact(DeviceTracer& tracer, uint64_t rays, std::vector<ExactRow>& rows);
void measure_cost(DeviceTracer& tracer, uint64_t rays, std::vector<CostRow>& rows);

}  // namespace rtc::lab
