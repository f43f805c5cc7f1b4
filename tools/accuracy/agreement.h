// First hits on a device against exact arithmetic, over every axis of cases.h.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "ray_tracer.h"
#include "oracle.h"

namespace rtc::lab {

struct AgreementRow {
    std::string axis;
    uint64_t cases = 0, rays = 0, hits = 0;
    uint64_t missed = 0, invented = 0;  // hit by exact arithmetic only, by the device only
    uint64_t inverted = 0;              // another triangle than the first
    uint64_t denormal = 0;              // of all differences: where denormals are at stake (denormals.h)
    uint64_t with_denormals = 0;        // rays of which that is true, whether they differ or not
    uint64_t by_rule = 0;               // of the others: rays that tie or meet an edge exactly, which only a rule decides
    uint64_t missed_plainly = 0, invented_plainly = 0;  // but for denormals and rules
    uint64_t later = 0;                 // of `inverted`, but for the two above: the triangle hit lies beyond the first
    uint64_t ties = 0, on_edge = 0;     // rays that only a rule decides
    double t_p50 = 0, t_p99 = 0, t_p999 = 0, t_max = 0;  // ulps, cases without denormals
    double b_p50 = 0, b_p999 = 0, b_max = 0;             // of the barycentrics, absolute; of the same hits
    double margin = 0;                                   // how far from an edge a difference that no rule excuses lies, at most
    std::string first;                                   // the first difference, as hexadecimal floats
    OracleCounts oracle;                                 // what it needed rationals for
    double device_seconds = 0, oracle_seconds = 0;       // wall time; both run at the same time
    void add(const AgreementRow& more);                  // the counts
    uint64_t different() const { return missed + invented + inverted; }
};

struct AgreementSettings {
    uint64_t rays = 1'000'000;  // in all, in equal shares over the axes and within them over their cases
    unsigned threads = 0;       // of the oracle; 0: all the machine has
    double seconds = 0;         // cut every share so that the whole takes about this long; 0: no limit
    bool quiet = false;
    std::vector<std::string> axes;  // empty: all
};

// The tracer should pause (TracerOptions): exact decisions of a whole group can take more turns than
// lavapipe 22.3 allows a dispatch.
// `total` receives the sum of all axes, t errors included.
std::vector<AgreementRow> measure_agreement(RayTracer& tracer, const AgreementSettings& settings,
                                            AgreementRow* total = nullptr);

}  // namespace rtc::lab
