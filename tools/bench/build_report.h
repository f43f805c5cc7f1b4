// The figures of the build benchmark, as tables, JSON and a plot.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace rtc::bench {

struct BuildRow {
    std::string mesh, by, mode;  // mode: "fast trace", "fast build", "low memory", "update"
    size_t primitives = 0;       // triangles, or instances of a top level
    bool top = false;
    std::vector<double> times;   // seconds
    double bytes = 0, compacted = 0, scratch = 0;
    std::string error;

    double median() const;
    double rate() const;  // primitives a second
};

struct BuildReport {
    std::string device;
    std::vector<BuildRow> rows;
};

std::string build_table(const BuildReport& report);
nlohmann::ordered_json as_json(const BuildReport& report);
// Millions of triangles a second over the number of triangles, both logarithmic, a line for each builder and mode.
std::string build_plot(const BuildReport& report, const std::string& mesh);

}  // namespace rtc::bench
