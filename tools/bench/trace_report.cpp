#include "trace_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "bench_device.h"

namespace rtc::bench {
namespace {

std::string format(const char* pattern, double value) {
    char text[64];
    std::snprintf(text, sizeof text, pattern, value);
    return text;
}

// Names in order of first appearance.
template <typename Get>
std::vector<std::string> distinct(const TraceReport& report, Get get) {
    std::vector<std::string> names;
    for (const TraceRow& row : report.rows)
        if (const std::string name = get(row); !name.empty() && std::find(names.begin(), names.end(), name) == names.end())
            names.push_back(name);
    return names;
}

std::vector<std::string> peers_of(const TraceReport& report) {
    std::vector<std::string> peers =
        distinct(report, [](const TraceRow& row) { return row.native ? row.runner : std::string(); });
    const std::vector<std::string> ours =
        distinct(report, [](const TraceRow& row) { return row.native ? std::string() : row.runner; });
    if (ours.size() > 1) peers.push_back(ours[0]);  // variants against the first
    return peers;
}

std::string ratio_text(const TraceReport& report, const TraceRow& row, const std::string& peer) {
    const TraceRow* other = find_row(report, row, peer);
    if (!other || other == &row || row.times.empty()) return "";
    const std::string text = format("%.2f", row.rate() / other->rate());
    return other->reduced || row.reduced ? "(" + text + ")" : text;
}

struct Mean {
    double logs = 0, lowest = 1e30;
    int count = 0;
    void add(double ratio) {
        logs += std::log(ratio);
        lowest = std::min(lowest, ratio);
        ++count;
    }
    double value() const { return std::exp(logs / std::max(1, count)); }
};

Mean mean_of(const TraceReport& report, const std::string& runner, const std::string& peer,
             const std::string& workload) {
    Mean mean;
    for (const TraceRow& row : report.rows) {
        if (row.runner != runner || row.times.empty() || row.reduced) continue;
        if (!workload.empty() && row.workload != workload) continue;
        const TraceRow* other = find_row(report, row, peer);
        if (other && !other->reduced) mean.add(row.rate() / other->rate());
    }
    return mean;
}

}  // namespace

double TraceRow::median() const { return median_of(times); }

double TraceRow::least() const { return times.empty() ? 0 : *std::min_element(times.begin(), times.end()); }

const TraceRow* find_row(const TraceReport& report, const TraceRow& like, const std::string& runner) {
    for (const TraceRow& row : report.rows)
        if (row.scene == like.scene && row.workload == like.workload && row.runner == runner && !row.times.empty())
            return &row;
    return nullptr;
}

std::string scene_table(const TraceReport& report, const std::string& scene) {
    const std::vector<std::string> peers = peers_of(report);
    std::string text = "| workload | by | median ms | least ms | Mrays/s |";
    std::string line = "| --- | --- | --- | --- | --- |";
    for (const std::string& peer : peers) {
        text += " against " + peer + " |";
        line += " --- |";
    }
    text += " same pixels % | same first hits % |\n" + line + " --- | --- |\n";
    for (const TraceRow& row : report.rows) {
        if (row.scene != scene) continue;
        text += "| " + row.workload + " | " + row.runner + " | ";
        if (row.times.empty()) {
            text += row.error + " |\n";
            continue;
        }
        text += format("%.3f", 1e3 * row.median()) + " | " + format("%.3f", 1e3 * row.least()) + " | " +
                format("%.4g", row.rate() * 1e-6);
        if (row.reduced) text += " (at " + std::to_string(row.width) + "×" + std::to_string(row.height) + ")";
        text += " |";
        for (const std::string& peer : peers) text += " " + ratio_text(report, row, peer) + " |";
        text += row.pixels_within < 0 ? " |" : " " + format("%.3f", 100 * row.pixels_within) + " |";
        text += row.first_hits_equal < 0 ? " |\n" : " " + format("%.4f", 100 * row.first_hits_equal) + " |\n";
    }
    return text;
}

std::string summary_table(const TraceReport& report) {
    const std::vector<std::string> peers = peers_of(report);
    const std::vector<std::string> workloads =
        distinct(report, [](const TraceRow& row) { return row.workload; });
    std::string text = "| rtc | against |", line = "| --- | --- |";
    for (const std::string& workload : workloads) {
        text += " " + workload + " |";
        line += " --- |";
    }
    text += " all | lowest | measurements |\n" + line + " --- | --- | --- |\n";
    for (const std::string& runner :
         distinct(report, [](const TraceRow& row) { return row.native ? std::string() : row.runner; }))
        for (const std::string& peer : peers) {
            const Mean all = mean_of(report, runner, peer, "");
            if (runner == peer || all.count == 0) continue;
            text += "| " + runner + " | " + peer + " |";
            for (const std::string& workload : workloads) {
                const Mean mean = mean_of(report, runner, peer, workload);
                text += mean.count ? " " + format("%.2f", mean.value()) + " |" : " |";
            }
            text += " **" + format("%.2f", all.value()) + "** | " + format("%.2f", all.lowest) + " | " +
                    std::to_string(all.count) + " |\n";
        }
    return text;
}

nlohmann::ordered_json as_json(const TraceReport& report) {
    nlohmann::ordered_json out{{"device", report.device}, {"width", report.width}, {"height", report.height}};
    nlohmann::ordered_json rows = nlohmann::ordered_json::array();
    for (const TraceRow& row : report.rows) {
        nlohmann::ordered_json entry{{"scene", row.scene}, {"workload", row.workload}, {"by", row.runner},
                                     {"native", row.native}};
        if (!row.error.empty()) entry["error"] = row.error;
        if (!row.times.empty()) {
            entry["rays"] = row.rays;
            entry["median_ms"] = 1e3 * row.median();
            entry["least_ms"] = 1e3 * row.least();
            entry["mrays_per_s"] = row.rate() * 1e-6;
            std::vector<double> times;
            for (double time : row.times) times.push_back(1e3 * time);
            entry["times_ms"] = times;
        }
        if (row.reduced) entry["reduced_to"] = {row.width, row.height};
        if (row.pixels_within >= 0) entry["pixels_within"] = row.pixels_within;
        if (row.first_hits_equal >= 0) entry["first_hits_equal"] = row.first_hits_equal;
        rows.push_back(entry);
    }
    out["rows"] = rows;
    nlohmann::ordered_json means = nlohmann::ordered_json::array();
    for (const std::string& runner :
         distinct(report, [](const TraceRow& row) { return row.native ? std::string() : row.runner; }))
        for (const std::string& peer : peers_of(report)) {
            const Mean all = mean_of(report, runner, peer, "");
            if (runner != peer && all.count)
                means.push_back({{"by", runner}, {"against", peer}, {"geometric_mean", all.value()},
                                 {"lowest", all.lowest}, {"measurements", all.count}});
        }
    out["means"] = means;
    return out;
}

}  // namespace rtc::bench
