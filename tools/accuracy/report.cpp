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
    double seconds = 0, timed = 0;
    for (const Json& row : tier.value("leaks", Json::array())) {
        const std::string aim = row.at("aim");
        const Rate rate{row.at("unbalanced"), row.at("rays")};
        const bool promised = row.at("promised_zero");
        Rate& to = !promised ? s.beyond : aim == "interior" ? s.insides : aim == "edge" ? s.edges : s.vertices;
        to.events += rate.events;
        to.rays += rate.rays;
        seconds += row.value("seconds", 0.0);
        timed += row.contains("seconds") ? double(rate.rays) : 0;
        if (promised && aim != "interior" && row.value("looked_at", 0u)) {
            const double weight = double(rate.events) / double(row.at("looked_at"));
            s.leaks += weight * double(row.at("of_these_leaks"));
            s.doubles += weight * double(row.at("of_these_doubles"));
        }
        if (!promised) continue;
        const std::string axis = row.value("axis", "");
        auto here = std::find_if(s.axes.begin(), s.axes.end(), [&](const auto& entry) { return entry.first == axis; });
        if (here == s.axes.end()) here = s.axes.insert(here, {axis, {}});
        here->second.events += rate.events;
        here->second.rays += rate.rays;
    }
    s.aimed_speed = seconds > 0 ? timed / seconds / 1e6 : 0;
    if (s.aimed().rays) {
        s.leaks /= double(s.aimed().rays);
        s.doubles /= double(s.aimed().rays);
    }
    for (const Json& row : tier.value("culls", Json::array())) {
        s.culls.events += uint64_t(row.at("culled"));
        s.culls.rays += uint64_t(row.at("rays"));
    }
    for (const Json& row : tier.value("agreement", Json::array())) {
        const uint64_t rays = row.at("rays");
        const uint64_t differ = uint64_t(row.at("missed")) + uint64_t(row.at("invented")) + uint64_t(row.at("other"));
        const uint64_t excused = uint64_t(row.at("of_these_denormal")) + uint64_t(row.at("by_rule"));
        if (row.at("axis") == "transform") s.instanced = {differ - excused, rays};
        if (row.at("axis") == "ordinary")
            s.ordinary = {{differ - excused, rays},
                          row.at("t_ulp_p50"),
                          row.at("t_ulp_p99_9"),
                          row.at("t_ulp_max"),
                          row.value("weights_p99_9", 0.0),
                          row.value("weights_max", 0.0),
                          row.value("farthest_from_edge", 0.0)};
        if (row.at("axis") != "all") continue;
        s.weights_p999 = row.value("weights_p99_9", 0.0);
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
int compare(double a, double b, bool known, double margin) {
    return !known ? 0 : (a * margin < b ? -1 : (a > b * margin ? 1 : 0));
}
int compare(const Rate& a, const Rate& b) {
    if (!a.measured() || !b.measured() || chance(a, b) > 0.01) return 0;
    return a.rate() < b.rate() ? -1 : 1;
}

// An error that was measured of b alone keeps a from beating it.
bool beats(const Summary& a, const Summary& b, bool with_bytes) {
    if ((b.aimed().measured() && !a.aimed().measured()) || (b.first_hits.measured() && !a.first_hits.measured())) return false;
    auto t = [](const Summary& s) { return std::min(s.t_p999, 64.0); };  // no histogram goes further
    const int errors[] = {compare(a.aimed(), b.aimed()),
                          compare(a.insides, b.insides),
                          compare(a.beyond, b.beyond),
                          compare(a.culls, b.culls),
                          compare(a.first_hits, b.first_hits),
                          compare(a.self_hits, b.self_hits),
                          compare(t(a), t(b), a.has_t && b.has_t, 1.02),
                          compare(a.bytes, b.bytes, with_bytes && a.bytes > 0 && b.bytes > 0, 1.01),
                          compare(a.nanoseconds, b.nanoseconds, true, 1.03)};
    return a.nanoseconds > 0 && b.nanoseconds > 0 && *std::max_element(std::begin(errors), std::end(errors)) <= 0 &&
           *std::min_element(std::begin(errors), std::end(errors)) < 0;
}

std::string joined(const std::vector<std::string>& names) {
    std::string list;
    for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
    return list;
}

std::string ulps(double value) { return value > 64 ? "> 64" : format("%.2f", value); }

// Unbalanced rays where none is promised, all aims: a line an axis.
std::string axis_table(const DeviceReport& report) {
    std::string head = "| unbalanced, by axis", rule = "|---|", lines;
    std::vector<const Summary*> columns;
    for (const Summary& s : report.subjects) {
        if (s.axes.empty()) continue;
        columns.push_back(&s);
        head += " | " + (s.tier ? "`" + s.name + "`" : s.name);
        rule += "---|";
    }
    if (columns.empty()) return "";
    for (const auto& entry : columns[0]->axes) {
        lines += "| " + entry.first;
        for (const Summary* s : columns) {
            const auto here = std::find_if(s->axes.begin(), s->axes.end(), [&](const auto& e) { return e.first == entry.first; });
            lines += " | " + (here == s->axes.end() ? std::string() : cell(here->second));
        }
        lines += " |\n";
    }
    return head + " |\n" + rule + "\n" + lines + '\n';
}

}  // namespace

bool is_knob(const std::string& subject) {
    return subject == "box16" || subject == "box8" || subject == "float-inverse" || subject == "t64";
}

double Rate::bound() const {
    if (events == 0) return 3.0 / double(rays);
    return (double(events) + 2 * std::sqrt(double(events)) + 2) / double(rays);
}

double chance(const Rate& a, const Rate& b) {
    const double n = double(a.events + b.events), p = double(a.rays) / (double(a.rays) + double(b.rays));
    if (n == 0 || a.rays == 0 || b.rays == 0) return 1;
    const double mean = n * p, off = std::fabs(double(a.events) - mean);
    if (n > 4000) return std::erfc(std::max(0.0, off - 0.5) / std::sqrt(2 * n * p * (1 - p)));
    double sum = 0;  // binomial, both tails
    for (uint64_t k = 0; k <= a.events + b.events; ++k)
        if (std::fabs(double(k) - mean) >= off * (1 - 1e-12))
            sum += std::exp(std::lgamma(n + 1) - std::lgamma(double(k) + 1) - std::lgamma(n - double(k) + 1) +
                            double(k) * std::log(p) + (n - double(k)) * std::log(1 - p));
    return std::min(1.0, sum);
}

std::vector<Json> merge_runs(const std::vector<Json>& runs) {
    std::vector<Json> devices;
    for (const Json& run : runs) {
        if (!run.is_object() || !run.contains("device") || !run.contains("tiers"))
            throw std::runtime_error("not what rtc-accuracy --json writes: no \"device\" or no \"tiers\"");
        auto here = std::find_if(devices.begin(), devices.end(), [&](const Json& d) { return d.at("device") == run.at("device"); });
        if (here == devices.end()) {
            here = devices.insert(here, Json{{"device", run.at("device")}, {"by_cpu", run.value("by_cpu", false)}});
            (*here)["commands"] = Json::array();
            (*here)["tiers"] = Json::array();
        }
        if (run.contains("command")) (*here)["commands"].push_back(run.at("command"));
        if (run.contains("payload")) (*here)["payload"] = run.at("payload");
        Json& tiers = (*here)["tiers"];
        for (const Json& tier : run.at("tiers")) {
            auto same = std::find_if(tiers.begin(), tiers.end(), [&](const Json& t) { return t.at("tier") == tier.at("tier"); });
            if (same == tiers.end()) {
                tiers.push_back(tier);
            } else {
                same->update(tier);
            }
        }
    }
    return devices;
}

std::vector<DeviceReport> summarise(const std::vector<Json>& runs) {
    std::vector<DeviceReport> reports;
    for (const Json& device : merge_runs(runs)) {
        DeviceReport& report = reports.emplace_back();
        report.device = device.at("device");
        report.by_cpu = device.at("by_cpu");
        for (const Json& command : device.at("commands")) report.commands.push_back(command);
        for (const Json& tier : device.at("tiers")) {
            Summary s = summary_of(tier);
            (is_knob(s.name) ? report.knobs : report.subjects).push_back(std::move(s));
        }
        const auto base = std::find_if(report.subjects.begin(), report.subjects.end(),
                                       [](const Summary& s) { return s.name == "watertight"; });
        if (!report.knobs.empty() && base != report.subjects.end()) report.knobs.insert(report.knobs.begin(), *base);
        for (const Json& row : device.value("payload", Json::array()))
            report.payloads.push_back({row.at("name"), row.at("bytes"), row.at("seconds"), row.at("against_first"),
                                       row.at("colour_error_mean"), row.at("colour_error_max")});
    }
    return reports;
}

std::vector<std::string> dominated(const std::vector<Summary>& subjects, bool with_bytes) {
    std::vector<std::string> names;
    for (const Summary& b : subjects)
        for (const Summary& a : subjects)
            if (&a != &b && beats(a, b, with_bytes)) {
                names.push_back(b.name);
                break;
            }
    return names;
}

std::string markdown_table(const DeviceReport& report, const std::string& plot) {
    std::string out = "### " + report.device + "\n\n";
    if (!plot.empty()) out += "![Cost against error](" + plot + ")\n\n";
    auto number = [](double value, const char* pattern) { return value > 0 ? format(pattern, value) : std::string(); };
    auto line = [&](const Summary& s, const std::vector<std::string>& cells) {
        out += "| " + (s.tier ? "`" + s.name + "`" : s.name);
        for (const std::string& text : cells) out += " | " + text;
        out += " |\n";
    };
    auto head = [&](const std::string& columns) {
        out += "| | " + columns + " |\n|---|";
        for (char c : columns) out += c == '|' ? "---|" : "";
        out += "---|\n";
    };
    head("time over `" + (report.subjects.empty() ? std::string() : report.subjects[0].name) +
         "`'s | Mrays/s primary | random | aimed | turns a ray | bytes a triangle | unbalanced, aimed inside | at edges | at "
         "vertices | leaks in 10⁹ | double hits in 10⁹ | beyond | culled falsely | self-hits | of slivers");
    for (const Summary& s : report.subjects) {
        auto billion = [&](double share) {
            if (!s.aimed().measured()) return std::string();
            if (s.aimed().events == 0) return "0 (< " + format("%.2g", s.aimed().bound() * 1e9) + ")";
            return s.leaks + s.doubles > 0 ? format("%.2g", share * 1e9) : std::string();  // not looked at
        };
        line(s, {number(s.against_first, "%.2f"), number(s.primary, "%.3g"), number(s.random, "%.3g"), number(s.aimed_speed, "%.3g"),
                 number(s.turns, "%.1f"), number(s.bytes, "%.0f"), cell(s.insides), cell(s.edges), cell(s.vertices),
                 billion(s.leaks), billion(s.doubles), cell(s.beyond), cell(s.culls), cell(s.self_hits), cell(s.thin_self_hits)});
    }
    out += '\n';
    head("first hit differs | missed | invented | too far | t p50 | p99 | p99.9 | max | weights p99.9 | ordinary: differs | "
         "t p50 | p99.9 | max | weights p99.9 | max");
    for (const Summary& s : report.subjects) {
        const Summary::Ordinary& o = s.ordinary;
        const bool has = o.differ.measured();
        line(s, {cell(s.first_hits), cell(s.missed), cell(s.invented), cell(s.later), s.has_t ? ulps(s.t_p50) : "",
                 s.has_t ? ulps(s.t_p99) : "", s.has_t ? ulps(s.t_p999) : "", s.has_t ? format("%.3g", s.t_max) : "",
                 number(s.weights_p999, "%.1e"), cell(o.differ), has ? ulps(o.t_p50) : "", has ? ulps(o.t_p999) : "",
                 has ? format("%.3g", o.t_max) : "", number(o.weights_p999, "%.1e"), number(o.weights_max, "%.1e")});
    }
    out += '\n' + axis_table(report);
    if (!report.subjects.empty()) {
        const Summary& s = report.subjects[0];
        out += "Rays of the first line (others may have had time for fewer): " + grouped(s.insides.rays) + " aimed inside, " + grouped(s.edges.rays) + " at edges, " +
               grouped(s.vertices.rays) + " at vertices, " + grouped(s.beyond.rays) + " beyond, " + grouped(s.first_hits.rays) +
               " for first hits, " + grouped(s.ordinary.differ.rays) + " ordinary ones. Time is " + (report.by_cpu ? "CPU time of all cores" : "the device's clock") + ".";
        const std::string names = joined(dominated(report.subjects));
        out += names.empty() ? " Nobody is dominated." : " Dominated (another is no worse in anything and better in something): " + names + ".";
        out += "\n\n";
    }
    for (const std::string& command : report.commands) out += "- " + command + "\n";
    for (const Summary& s : report.subjects)
        if (!s.problem.empty()) out += "- `" + s.name + "`: " + s.problem + "\n";
    return out;
}

std::string knob_table(const DeviceReport& report) {
    if (report.knobs.size() < 2) return "";
    std::string out = "### Knobs on " + report.device +
                      "\n\n| | time over `watertight`'s | Mrays/s primary | random | turns a ray | bytes a triangle | unbalanced "
                      "| beyond | culled falsely | first hit differs | of instances | t p50 | p99.9 | dominated |\n"
                      "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
    const double base = report.knobs[0].against_first;
    const std::vector<std::string> worse = dominated(report.knobs, true);
    for (const Summary& s : report.knobs) {
        auto number = [](double value, const char* pattern) { return value > 0 ? format(pattern, value) : std::string(); };
        const Rate all{s.insides.events + s.aimed().events, s.insides.rays + s.aimed().rays};
        out += "| `" + s.name + "`";
        for (const std::string& text :
             {number(base > 0 ? s.against_first / base : 0, "%.2f"), number(s.primary, "%.3g"), number(s.random, "%.3g"),
              number(s.turns, "%.1f"), number(s.bytes, "%.0f"), cell(all), cell(s.beyond), cell(s.culls), cell(s.first_hits),
              cell(s.instanced), s.has_t ? ulps(s.t_p50) : "", s.has_t ? ulps(s.t_p999) : "",
              std::string(std::find(worse.begin(), worse.end(), s.name) != worse.end() ? "yes" : "no")})
            out += " | " + text;
        out += " |\n";
    }
    out += '\n';
    for (const Summary& s : report.knobs)
        if (!s.problem.empty()) out += "- `" + s.name + "`: " + s.problem + "\n";
    if (report.payloads.empty()) return out;
    out += "| payload | bytes | time over the first's | colour off, mean | at most |\n|---|---|---|---|---|\n";
    for (const PayloadRow& p : report.payloads)
        out += "| " + p.name + " | " + format("%.0f", p.bytes) + " | " + format("%.2f", p.against_first) + " | " +
               format("%.1e", p.colour_error_mean) + " | " + format("%.1e", p.colour_error_max) + " |\n";
    return out + '\n';
}

}  // namespace rtc::lab
