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

// How probable such a difference or a larger one is where both rates are one: events are as likely to be of either
// run as rays are. 1: the same. Exact for few events; where many rays are events it says rather too much.
double chance(const Rate& a, const Rate& b);

// Points beside the tiers, which no pipeline can be compiled for: box16, box8, float-inverse, t64.
bool is_knob(const std::string& subject);

// One line of the table, one point of the plot.
struct Summary {
    std::string name;
    bool tier = false;                // of rtc's, rather than somebody else's
    double against_first = 0;         // time over the first subject's, both workloads (geometric mean); 0: not measured
    double primary = 0, random = 0;   // Mrays/s
    double nanoseconds = 0;           // a ray, geometric mean
    double turns = 0, bytes = 0;      // a ray; a triangle; 0: not known
    double aimed_speed = 0;           // Mrays/s of the rays that leaks are counted with, by the binary that counts
    Rate insides, edges, vertices, beyond;  // unbalanced; the last: outside the range that is promised
    double leaks = 0, doubles = 0;    // shares of those aimed at edges and vertices, estimated from the ones looked at
    std::vector<std::pair<std::string, Rate>> axes;  // unbalanced where it is promised that none is, by axis
    Rate culls, first_hits, missed, invented, later, self_hits, thin_self_hits;
    Rate instanced;                   // first hits that differ on the axis of transforms
    bool has_t = false;
    double t_p50 = 0, t_p99 = 0, t_p999 = 0, t_max = 0, weights_p999 = 0;
    struct Ordinary {  // random rays at meshes of unit size
        Rate differ;
        double t_p50 = 0, t_p999 = 0, t_max = 0, weights_p999 = 0, weights_max = 0, farthest_from_edge = 0;
    } ordinary;
    std::string problem;
    // Unbalanced of what is aimed at edges and vertices.
    Rate aimed() const { return {edges.events + vertices.events, edges.rays + vertices.rays}; }
};

// A launch whose payload is packed or not.
struct PayloadRow {
    std::string name;
    double bytes = 0, seconds = 0, against_first = 1, colour_error_mean = 0, colour_error_max = 0;
};

struct DeviceReport {
    std::string device;
    bool by_cpu = false;
    std::vector<Summary> subjects;
    std::vector<Summary> knobs;  // points beside the tiers, behind a copy of `watertight`; empty: not measured
    std::vector<PayloadRow> payloads;
    std::vector<std::string> commands;  // what measured it
};

// Runs of one device become one report, in the order of the first that names it; of what was measured twice of a
// subject the last run counts. Throws std::runtime_error on what is not the laboratory's JSON.
std::vector<DeviceReport> summarise(const std::vector<nlohmann::ordered_json>& runs);

// Names of subjects that another one beats or equals in cost and in every error measured of both, and beats in one.
// Times within 3 % are equal, and rates that differ as chance (one in a hundred) can make them. Bytes count where
// `with_bytes`.
std::vector<std::string> dominated(const std::vector<Summary>& subjects, bool with_bytes = false);

// The table of the points beside the tiers; empty where none was measured.
std::string knob_table(const DeviceReport& report);

// `plot`: path for the picture's link, none when empty.
// Three tables: cost and leaks, first hits, leaks by axis.
std::string markdown_table(const DeviceReport& report, const std::string& plot);

// Cost against error: three panels (unbalanced rays, first hits, t). SVG 1.1, no scripts, no external fonts.
std::string plot_svg(const DeviceReport& report);

// The same as PNG. Throws tools::Error.
void write_plot_png(const DeviceReport& report, const std::string& path);

// Whether fresh runs agree with the checked-in ones of the same devices.
struct Tolerances {
    double cost = 0.15;    // of a ratio of times
    double turns = 0.05;   // a ray
    double t_p50 = 0.1;    // of the median error of t, besides 8 / sqrt(hits), or 1/16 ulp where that is more
    double chance = 1e-6;  // rates that differ by more than this explains disagree
};
struct Verdict {
    std::vector<std::string> disagreements;
    std::vector<std::string> notes;  // what there was nothing to compare with
    uint64_t compared = 0;
};
// Promises hold in the fresh runs; rates, place by place, agree within chance; costs, as ratios, within tolerance.
// Device names match but for the width of vectors. Throws as summarise does.
Verdict compare_runs(const std::vector<nlohmann::ordered_json>& fresh, const std::vector<nlohmann::ordered_json>& checked_in,
                     const Tolerances& tolerances = {});

// Runs of one device as one, as summarise merges them.
std::vector<nlohmann::ordered_json> merge_runs(const std::vector<nlohmann::ordered_json>& runs);

}  // namespace rtc::lab
