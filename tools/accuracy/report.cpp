// Summaries and tables of the laboratory's JSON.
#include "report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

namespace rtc::lab {
namespace {

using Json = nlohmann::ordered_json;

std::string format(const char* pattern, double value) {
    char text[64];
    std::snprintf(text, sizeof text, pattern, value);
    return text;
}

// 1 234 567
std::string grouped(uint64_t n) {
    std::string digits = std::to_string(n), out;
    for (size_t i = 0; i < digits.size(); ++i) {
        if (i && (digits.size() - i) % 3 == 0) out += ' ';
        out += digits[i];
    }
    return out;
}

std::string cell(const Rate& r) {
    if (!r.measured()) return "";
    if (r.events == 0) return "0 (< " + format("%.1e", r.bound()) + ")";
    return format("%.2g", r.rate());
}

Summary summary_of(const Json& tier) {
    Summary s;
    s.name = tier.at("tier");
    s.tier = s.name != "native" && s.name.rfind("embree", 0) != 0;
    s.problem = tier.value("problem", "");
    double product = 1, ratio = 1;
    int workloads = 0;
    for (const Json& row : tier.value("cost", Json::array())) {
        const double rays = row.at("rays"), seconds = row.at("seconds");
        (row.at("workload") == "primary" ? s.primary : s.random) = rays / seconds / 1e6;
        product *= seconds / rays * 1e9;
        ratio *= double(row.at("against_first"));
        s.turns = std::max(s.turns, double(row.at("turns_per_ray")));
        s.bytes = double(row.at("scene_bytes")) / double(row.at("triangles"));
        ++workloads;
    }
    if (workloads) {
        s.nanoseconds = std::pow(product, 1.0 / workloads);
        s.against_first = std::pow(ratio, 1.0 / workloads);
    }
    for (const Json& row : tier.value("leaks", Json::array())) {
        const std::string aim = row.at("aim");
        Rate& to = !row.at("promised_zero").get<bool>() ? s.beyond
                   : aim == "interior"                  ? s.insides
                   : aim == "edge"                      ? s.edges
                                                        : s.vertices;
        to.events += uint64_t(row.at("unbalanced"));
        to.rays += uint64_t(row.at("rays"));
    }
    for (const Json& row : tier.value("culls", Json::array())) {
        s.culls.events += uint64_t(row.at("culled"));
        s.culls.rays += uint64_t(row.at("rays"));
    }
    for (const Json& row : tier.value("agreement", Json::array())) {
        if (row.at("axis") != "all") continue;
        const uint64_t rays = row.at("rays");
        const uint64_t differ = uint64_t(row.at("missed")) + uint64_t(row.at("invented")) + uint64_t(row.at("other"));
        const uint64_t excused = uint64_t(row.at("of_these_denormal")) + uint64_t(row.at("by_rule"));
        s.first_hits = {differ - excused, rays};
        s.missed = {row.at("missed_plainly"), rays};
        s.invented = {row.at("invented_plainly"), rays};
        s.later = {row.at("later"), rays};
        s.has_t = true;
        s.t_p50 = row.at("t_ulp_p50");
        s.t_p99 = row.at("t_ulp_p99");
        s.t_p999 = row.at("t_ulp_p99_9");
        s.t_max = row.at("t_ulp_max");
    }
    if (tier.contains("self_hits")) {
        const Json& row = tier.at("self_hits");
        s.self_hits = {row.at("hits"), row.at("rays")};
        s.thin_self_hits = {row.at("thin_hits"), row.at("thin_rays")};
    }
    return s;
}

// Of one error: -1 better, 0 as good or not known of both, 1 worse.
int compare(double a, double b, bool known) { return !known ? 0 : (a < b ? -1 : (a > b ? 1 : 0)); }
int compare(const Rate& a, const Rate& b) { return compare(a.rate(), b.rate(), a.measured() && b.measured()); }

bool beats(const Summary& a, const Summary& b) {
    const int errors[] = {compare(a.aimed(), b.aimed()), compare(a.insides, b.insides), compare(a.first_hits, b.first_hits),
                          compare(a.self_hits, b.self_hits), compare(a.t_p999, b.t_p999, a.has_t && b.has_t),
                          compare(a.nanoseconds, b.nanoseconds, a.nanoseconds > 0 && b.nanoseconds > 0)};
    return *std::max_element(std::begin(errors), std::end(errors)) <= 0 &&
           *std::min_element(std::begin(errors), std::end(errors)) < 0 && a.nanoseconds > 0 && b.nanoseconds > 0;
}

std::string ulps(double value) { return value > 64 ? "> 64" : format("%.2f", value); }

}  // namespace

double Rate::bound() const {
    if (events == 0) return 3.0 / double(rays);
    return (double(events) + 2 * std::sqrt(double(events)) + 2) / double(rays);
}

std::vector<DeviceReport> summarise(const std::vector<Json>& runs) {
    struct Merged {
        std::string device;
        bool by_cpu;
        std::vector<Json> tiers;
    };
    std::vector<Merged> devices;
    for (const Json& run : runs) {
        if (!run.is_object() || !run.contains("device") || !run.contains("tiers"))
            throw std::runtime_error("not what rtc-accuracy --json writes: no \"device\" or no \"tiers\"");
        const std::string device = run.at("device");
        auto here = std::find_if(devices.begin(), devices.end(), [&](const Merged& d) { return d.device == device; });
        if (here == devices.end()) here = devices.insert(here, {device, run.value("by_cpu", false), {}});
        for (const Json& tier : run.at("tiers")) {
            auto same = std::find_if(here->tiers.begin(), here->tiers.end(),
                                     [&](const Json& t) { return t.at("tier") == tier.at("tier"); });
            if (same == here->tiers.end()) {
                here->tiers.push_back(tier);
            } else {
                same->update(tier);
            }
        }
    }
    std::vector<DeviceReport> reports;
    for (const Merged& device : devices) {
        reports.push_back({device.device, device.by_cpu, {}});
        for (const Json& tier : device.tiers) reports.back().subjects.push_back(summary_of(tier));
    }
    return reports;
}

std::vector<std::string> dominated(const DeviceReport& report) {
    std::vector<std::string> names;
    for (const Summary& b : report.subjects)
        for (const Summary& a : report.subjects)
            if (&a != &b && beats(a, b)) {
                names.push_back(b.name);
                break;
            }
    return names;
}

std::string markdown_table(const DeviceReport& report, const std::string& plot) {
    std::string out = "### " + report.device + "\n\n";
    if (!plot.empty()) out += "![Cost against error](" + plot + ")\n\n";
    out += "| | time over `" + (report.subjects.empty() ? std::string() : report.subjects[0].name) +
           "`'s | Mrays/s primary | random | turns a ray | bytes a triangle | unbalanced, aimed inside | at edges | at "
           "vertices | beyond | culled falsely | first hit differs | missed | invented | too far | t p50 | p99 | p99.9 | "
           "max | self-hits | of slivers |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
    for (const Summary& s : report.subjects) {
        auto number = [](double value, const char* pattern) { return value > 0 ? format(pattern, value) : std::string(); };
        out += "| " + (s.tier ? "`" + s.name + "`" : s.name);
        for (const std::string& text :
             {number(s.against_first, "%.2f"), number(s.primary, "%.3g"), number(s.random, "%.3g"), number(s.turns, "%.1f"),
              number(s.bytes, "%.0f"), cell(s.insides), cell(s.edges), cell(s.vertices), cell(s.beyond), cell(s.culls),
              cell(s.first_hits), cell(s.missed), cell(s.invented), cell(s.later), s.has_t ? ulps(s.t_p50) : "",
              s.has_t ? ulps(s.t_p99) : "", s.has_t ? ulps(s.t_p999) : "", s.has_t ? format("%.3g", s.t_max) : "",
              cell(s.self_hits), cell(s.thin_self_hits)})
            out += " | " + text;
        out += " |\n";
    }
    out += '\n';
    if (!report.subjects.empty()) {
        const Summary& s = report.subjects[0];
        out += "Rays of a line: " + grouped(s.insides.rays) + " aimed inside, " + grouped(s.edges.rays) + " at edges, " +
               grouped(s.vertices.rays) + " at vertices, " + grouped(s.beyond.rays) + " beyond, " + grouped(s.first_hits.rays) +
               " for first hits. Time is " + (report.by_cpu ? "CPU time of all cores" : "the device's clock") + ".";
        std::string names;
        for (const std::string& name : dominated(report)) names += (names.empty() ? "" : ", ") + name;
        out += names.empty() ? " Nobody is dominated." : " Dominated (another is no worse in anything and better in something): " + names + ".";
        out += "\n\n";
    }
    for (const Summary& s : report.subjects)
        if (!s.problem.empty()) out += "- `" + s.name + "`: " + s.problem + "\n";
    return out;
}

}  // namespace rtc::lab
