// What the laboratory measures, axis by axis.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "agreement.h"
#include "leaks.h"
#include "ray_tracer.h"

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

// Cost of the same binary: closest hits on a mesh of `triangles`.
struct CostRow {
    std::string workload;
    uint64_t triangles = 0, rays = 0, scene_bytes = 0;
    bool by_cpu = false;       // `seconds` are this process's CPU seconds: the steadier figure for devices that are the CPU
    double seconds = 0;        // median
    double against_first = 1;  // median of the ratios to the first subject's time in the same round
    double turns_per_ray = 0;  // 0: not known
};

// Rays that leave surfaces (rtc/spawn.glsl) and hit the triangle that they leave; `thin`: of slivers.
struct SelfHits {
    uint64_t rays = 0, hits = 0, thin_rays = 0, thin_hits = 0;
};

struct Report {
    std::string subject;
    std::vector<LeakRow> leaks;
    std::vector<CullRow> culls;
    std::vector<AgreementRow> agreement;
    std::vector<CostRow> cost;
    SelfHits self_hits;
    std::string problem;  // why it could not be measured
    std::string cost_problem;  // why its cost could not be
};

struct CostSubject {
    RayTracer* tracer;
    Report* report;
    bool by_cpu;
};

// Names for --axes.
const std::vector<std::string>& axis_names();

void measure_axis(RayTracer& tracer, const std::string& axis, uint64_t rays, std::vector<LeakRow>& rows);
void measure_culls(RayTracer& tracer, uint64_t rays, std::vector<CullRow>& rows);
// Interleaved: every subject traces the same rays `repeats` times, in turns. Adds two rows to each report, or says in it
// why not: who throws is left out from there on. Ratios are to the first that is left.
void measure_cost(const std::vector<CostSubject>& subjects, uint64_t rays, unsigned repeats);

}  // namespace rtc::lab
