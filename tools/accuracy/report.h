// What the laboratory's JSON says, condensed: one table and one plot for each device. Runs of one device may be
// merged from several files.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace rtc::lab {

// Events among rays: the rate, and what it is below with 95 % confidence.
struct Rate {
    uint64_t events = 0, rays = 0;
    bool measured() const { return rays != 0; }
    double rate() const { return rays ? double(events) / double(rays) : 0; }
    double bound() const;  // 3 / rays when nothing was seen
};

// One line of the table, one point of the plot.
struct Summary {
    std::string name;
    bool tier = false;                // of rtc's, rather than somebody else's
    double against_first = 0;         // time over the first subject's, both workloads (geometric mean); 0: not measured
    double primary = 0, random = 0;   // Mrays/s
    double nanoseconds = 0;           // a ray, geometric mean
    double turns = 0, bytes = 0;      // a ray; a triangle; 0: not known
    Rate insides, edges, vertices, beyond;  // unbalanced; the last: outside the range that is promised
    Rate culls, first_hits, missed, invented, later, self_hits, thin_self_hits;
    bool has_t = false;
    double t_p50 = 0, t_p99 = 0, t_p999 = 0, t_max = 0;
    std::string problem;
    // Unbalanced of what is aimed at edges and vertices.
    Rate aimed() const { return {edges.events + vertices.events, edges.rays + vertices.rays}; }
};

struct DeviceReport {
    std::string device;
    bool by_cpu = false;
    std::vector<Summary> subjects;
};

// Runs of one device become one report, in the order of the first that names it; of what was measured twice of a
// subject the last run counts. Throws std::runtime_error on what is not the laboratory's JSON.
std::vector<DeviceReport> summarise(const std::vector<nlohmann::ordered_json>& runs);

// Names of subjects that another one beats or equals in cost and in every error measured of both, and beats in one.
std::vector<std::string> dominated(const DeviceReport& report);

// `plot`: path for the picture's link, none when empty.
std::string markdown_table(const DeviceReport& report, const std::string& plot);

// Cost against error: three panels (unbalanced rays, first hits, t). SVG 1.1, no scripts, no external fonts.
std::string plot_svg(const DeviceReport& report);

}  // namespace rtc::lab
