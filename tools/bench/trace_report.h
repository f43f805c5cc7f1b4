// The figures of the trace benchmark, as tables and JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace rtc::bench {

struct TraceRow {
    std::string scene, workload, runner;
    bool native = false;
    double rays = 0;            // of one launch
    std::vector<double> times;  // seconds a launch, one for each repetition
    uint32_t width = 0, height = 0;
    bool reduced = false;  // measured at width x height, too slow for the whole picture: not in the means
    // Against the reference runner's picture of the same sample; negative: not compared.
    double pixels_within = -1, first_hits_equal = -1;
    std::string error;  // why there are no times

    double median() const;
    double least() const;
    double rate() const { return times.empty() ? 0 : rays / median(); }  // rays a second
};

struct TraceReport {
    std::string device;
    uint32_t width = 0, height = 0;
    std::vector<TraceRow> rows;
};

// The row of another runner on the same scene and workload; null when there is none with times.
const TraceRow* find_row(const TraceReport& report, const TraceRow& like, const std::string& runner);

// Markdown tables: one of `scene`, and the geometric means over all.
std::string scene_table(const TraceReport& report, const std::string& scene);
std::string summary_table(const TraceReport& report);
nlohmann::ordered_json as_json(const TraceReport& report);

}  // namespace rtc::bench
