// Whether fresh runs of the laboratory agree with earlier ones: `rtc-accuracy check`.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

#include "report.h"

namespace rtc::lab {
namespace {

using Json = nlohmann::ordered_json;

// "llvmpipe (LLVM 15.0.6, 256 bits) ..." but for the bits, which are the processor's.
std::string without_width(std::string device) {
    const size_t end = device.find(" bits");
    if (end == std::string::npos) return device;
    const size_t begin = device.rfind(", ", end);
    if (begin != std::string::npos) device.erase(begin, end + 5 - begin);
    return device;
}

const Json* find(const Json& rows, const std::function<bool(const Json&)>& wanted) {
    for (const Json& row : rows)
        if (wanted(row)) return &row;
    return nullptr;
}

class Comparison {
  public:
    Comparison(const Tolerances& tolerances, Verdict& verdict) : tolerances_(tolerances), verdict_(verdict) {}

    void compare(const Json& fresh, const Json& old, const std::string& device) {
        for (const Json& tier : fresh.at("tiers")) {
            name_ = tier.at("tier");
            where_ = device + ", " + name_;
            promises(tier);
            const Json* before = find(old.at("tiers"), [&](const Json& t) { return t.at("tier") == tier.at("tier"); });
            if (!before) {
                verdict_.notes.push_back(where_ + ": not measured before");
                continue;
            }
            rows(tier, *before, "leaks", {"axis", "value", "mesh", "aim"}, {"unbalanced"});
            rows(tier, *before, "culls", {"mesh", "place"}, {"culled"});
            rows(tier, *before, "agreement", {"axis"}, {"missed", "invented", "other"});
            if (tier.contains("self_hits") && before->contains("self_hits")) {
                const Json &now = tier.at("self_hits"), &then = before->at("self_hits");
                rate("self-hits", {now.at("hits"), now.at("rays")}, {then.at("hits"), then.at("rays")});
                rate("self-hits of slivers", {now.at("thin_hits"), now.at("thin_rays")},
                     {then.at("thin_hits"), then.at("thin_rays")});
            }
            costs(tier, *before);
        }
    }

  private:
    void disagree(const std::string& text) { verdict_.disagreements.push_back(where_ + ": " + text); }

    void none(const std::string& what, uint64_t events) {
        ++verdict_.compared;
        if (events) disagree(std::to_string(events) + " " + what + " where none are promised");
    }

    void promises(const Json& tier) {
        const bool exact = name_ == "exact" || name_ == "exact64", watertight = exact || name_ == "watertight";
        uint64_t leaks = 0, all = 0, culls = 0;
        for (const Json& row : tier.value("leaks", Json::array())) {
            all += uint64_t(row.at("unbalanced"));
            if (row.at("promised_zero")) leaks += uint64_t(row.at("unbalanced"));
        }
        for (const Json& row : tier.value("culls", Json::array())) culls += uint64_t(row.at("culled"));
        if (watertight) none("leaks or double hits", leaks);
        if (watertight) none("false culls", culls);
        if (watertight && tier.contains("self_hits"))
            none("self-hits", uint64_t(tier.at("self_hits").at("hits")) + uint64_t(tier.at("self_hits").at("thin_hits")));
        if (name_ == "contracted" && tier.contains("leaks")) {
            ++verdict_.compared;
            if (all == 0) disagree("the negative control does not leak");
        }
        for (const Json& row : tier.value("agreement", Json::array())) {
            if (!exact || row.at("axis") != "all") continue;
            const uint64_t differ = uint64_t(row.at("missed")) + uint64_t(row.at("invented")) + uint64_t(row.at("other"));
            none("first hits other than exact arithmetic's", differ - uint64_t(row.at("of_these_denormal")));
            ++verdict_.compared;
            if (double(row.at("t_ulp_p99_9")) > 1) disagree("t is off by more than an ulp");
        }
    }

    void rate(const std::string& what, const Rate& now, const Rate& then) {
        if (!now.measured() || !then.measured()) return;
        ++verdict_.compared;
        if (chance(now, then) >= tolerances_.chance) return;
        char text[160];
        std::snprintf(text, sizeof text, ": %llu of %llu, before %llu of %llu", (unsigned long long)now.events,
                      (unsigned long long)now.rays, (unsigned long long)then.events, (unsigned long long)then.rays);
        disagree(what + text);
    }

    // Rates of `events` in the rows of `list` that have the same `keys`.
    void rows(const Json& tier, const Json& before, const char* list, const std::vector<const char*>& keys,
              const std::vector<const char*>& events) {
        if (!tier.contains(list) || !before.contains(list)) return;
        for (const Json& row : tier.at(list)) {
            const Json* old = find(before.at(list), [&](const Json& r) {
                return std::all_of(keys.begin(), keys.end(), [&](const char* key) { return r.at(key) == row.at(key); });
            });
            if (!old) continue;
            std::string place = list;
            for (const char* key : keys) place += " " + row.at(key).get<std::string>();
            for (const char* event : events)
                rate(place + " " + event, {row.at(event), row.at("rays")}, {old->at(event), old->at("rays")});
            if (!row.contains("t_ulp_p50")) continue;
            // Errors spread over decades: the median of n is off by some share of 1 / sqrt(n).
            const double hits = std::min(double(row.at("hits")), double(old->at("hits"))), then = old->at("t_ulp_p50");
            if (hits >= 100)
                near(place + " t p50, ulp", row.at("t_ulp_p50"), then,
                     std::max(1.0 / 16, (tolerances_.t_p50 + 8 / std::sqrt(hits)) * then));
        }
    }

    void near(const std::string& what, double now, double then, double margin) {
        ++verdict_.compared;
        if (std::fabs(now - then) <= margin) return;
        char text[96];
        std::snprintf(text, sizeof text, ": %.3g, before %.3g (tolerance %.2g)", now, then, margin);
        disagree(what + text);
    }

    void costs(const Json& tier, const Json& before) {
        if (!tier.contains("cost") || !before.contains("cost")) return;
        for (const Json& row : tier.at("cost")) {
            const Json* old = find(before.at("cost"), [&](const Json& r) { return r.at("workload") == row.at("workload"); });
            if (!old || row.at("triangles") != old->at("triangles")) continue;
            const std::string workload = row.at("workload");
            const double ratio = old->at("against_first"), turns = old->at("turns_per_ray");
            near(workload + ", time over the first's", row.at("against_first"), ratio, tolerances_.cost * ratio);
            near(workload + ", turns a ray", row.at("turns_per_ray"), turns, tolerances_.turns * turns);
            near(workload + ", bytes", row.at("scene_bytes"), old->at("scene_bytes"), 0.01 * double(old->at("scene_bytes")));
        }
    }

    const Tolerances& tolerances_;
    Verdict& verdict_;
    std::string name_, where_;
};

}  // namespace

Verdict compare_runs(const std::vector<Json>& fresh, const std::vector<Json>& checked_in, const Tolerances& tolerances) {
    Verdict verdict;
    Comparison comparison(tolerances, verdict);
    const std::vector<Json> before = merge_runs(checked_in);
    for (const Json& device : merge_runs(fresh)) {
        const std::string name = device.at("device");
        const auto old = std::find_if(before.begin(), before.end(), [&](const Json& d) {
            return without_width(d.at("device")) == without_width(name);
        });
        // Promises hold anywhere.
        const Json nothing{{"tiers", Json::array()}};
        if (old == before.end()) verdict.notes.push_back(name + ": nothing is checked in for this device; promises alone were looked at");
        const size_t notes = verdict.notes.size();
        comparison.compare(device, old == before.end() ? nothing : *old, name);
        if (old == before.end()) verdict.notes.resize(notes);
    }
    if (verdict.compared == 0) verdict.disagreements.push_back("there was nothing to compare");
    return verdict;
}

}  // namespace rtc::lab
