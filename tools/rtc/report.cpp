#include "report.h"

#include "arguments.h"

#include <algorithm>

namespace cli {
namespace {

std::string padded(std::string text, size_t width) {
    if (text.size() < width) text.append(width - text.size(), ' ');
    return text;
}

std::string counted(uint32_t count, const char* what) {
    return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

size_t widest(size_t width, const char* text) { return std::max(width, std::string(text).size()); }

}  // namespace

std::string report_text(const rtcc_reflection& r, const std::string& module) {
    std::string out = module + ": SPIR-V " + std::to_string(r.spirv_version >> 16 & 0xff) + "." +
                      std::to_string(r.spirv_version >> 8 & 0xff) + ", " +
                      counted(r.instruction_count, "instruction") + ", " + counted(r.state_count, "state") +
                      "\n";
    out += "  recursion depth " + std::to_string(r.max_recursion_depth) + ", callable depth " +
           std::to_string(r.max_callable_depth) + ", " +
           (r.flags & RTC_MODULE_RESUMABLE ? "resumable" : "not resumable") + ", accuracy " +
           accuracy_name(r.accuracy) + "\n";
    // traverse.glsl, RTC_TURNS_OF_A_TRIANGLE; exact_test.cpp holds the two together.
    if (r.flags & RTC_MODULE_RESUMABLE && (r.accuracy == RTCC_ACCURACY_EXACT || r.accuracy == RTCC_ACCURACY_EXACT_FLOAT64))
        out += "  step budgets below 6600 leave no room for this accuracy's longest decision, within which nothing suspends: a "
               "driver that counts turns may end it without a word\n";
    out += "  stack " + std::to_string(r.stack_words * 4) + " bytes, scratch " +
           std::to_string(r.scratch_words * 4) + " bytes, payload " + std::to_string(r.payload_words * 4) +
           " bytes, hit attributes " + std::to_string(r.attribute_words * 4) + " bytes, callable data " +
           std::to_string(r.callable_words * 4) + " bytes a lane\n";
    out += "  rtc's own bindings: set " + std::to_string(r.reserved_set) + ", bindings";
    for (uint32_t i = 0; i < RTC_BINDING_COUNT; ++i)
        if (r.used_bindings >> i & 1) out += " " + std::to_string(r.reserved_binding + i);
    out += "\n";
    if (r.required_feature_count) {
        out += "  needs";
        for (size_t i = 0; i < r.required_feature_count; ++i)
            out += std::string(i ? ", " : " ") + r.required_features[i];
        out += "\n";
    }

    size_t width = 0;
    for (size_t i = 0; i < r.stage_count; ++i) width = widest(width, r.stages[i].name);
    out += "stages:\n";
    for (size_t i = 0; i < r.stage_count; ++i) {
        const rtcc_stage_info& stage = r.stages[i];
        out += "  " + padded(rtcc_stage_name(stage.stage), 6) + padded(stage.name, width) + "  " +
               counted(stage.state_count, "state");
        if (stage.payload_words) out += ", payload " + std::to_string(stage.payload_words * 4) + " bytes";
        if (stage.record_bytes) out += ", record " + std::to_string(stage.record_bytes) + " bytes";
        out += "\n";
    }
    static const char* const kKinds[] = {"general", "triangles", "procedural"};
    out += "groups:\n";
    for (size_t i = 0; i < r.group_count; ++i)
        out += "  " + padded(std::to_string(i), 4) + padded(kKinds[r.groups[i].kind], 12) + r.groups[i].name +
               "\n";
    if (r.trace_site_count) out += "live state saved across calls:\n";
    for (size_t i = 0; i < r.trace_site_count; ++i) {
        const rtcc_trace_site_info& site = r.trace_sites[i];
        out += std::string("  ") + (*site.file ? site.file : site.stage) +
               (site.line ? ":" + std::to_string(site.line) : "") + ": " +
               (site.callable ? "callable" : "trace") + ", " + counted(site.frame_bytes, "byte");
        for (size_t k = 0; k < site.variable_count; ++k)
            out += std::string(k ? ", " : ": ") + site.variables[k];
        out += "\n";
    }
    if (r.fact_count) out += "facts:\n";
    width = 0;
    for (size_t i = 0; i < r.fact_count; ++i) width = widest(width, r.facts[i].name);
    for (size_t i = 0; i < r.fact_count; ++i)
        out += "  " + padded(r.facts[i].name, width) + "  " + padded(r.facts[i].state, 9) + r.facts[i].detail + "\n";
    return out;
}

std::string comparison_text(const rtcc_reflection& before, const rtcc_reflection& now) {
    const auto frame_bytes = [](const rtcc_reflection& r) {
        uint32_t bytes = 0;
        for (size_t i = 0; i < r.trace_site_count; ++i) bytes += r.trace_sites[i].frame_bytes;
        return bytes;
    };
    const auto line = [](const char* what, uint32_t a, uint32_t b) {
        return std::string("  ") + padded(what, 24) + std::to_string(a) + " -> " + std::to_string(b) + "\n";
    };
    return "removed by what is known (--no-specialize -> this module):\n" +
           line("instructions", before.instruction_count, now.instruction_count) +
           line("states", before.state_count, now.state_count) +
           line("frame bytes, all sites", frame_bytes(before), frame_bytes(now)) +
           line("stack bytes a lane", before.stack_words * 4, now.stack_words * 4) +
           line("scratch bytes a lane", before.scratch_words * 4, now.scratch_words * 4);
}

std::string facts_text(const std::vector<std::pair<std::string, uint32_t>>& without, const rtcc_reflection& now) {
    if (without.empty()) return "";
    size_t width = 0;
    for (const auto& [fact, instructions] : without) width = widest(width, fact.c_str());
    std::string out = "instructions removed by one fact alone, the others known:\n";
    for (const auto& [fact, instructions] : without)
        out += "  " + padded(fact, width) + "  " + std::to_string(int64_t(instructions) - now.instruction_count) + "\n";
    return out + "Registers and compile times are a driver's: rtc-run --statistics, with and without --no-specialize, prints them.\n";
}

}  // namespace cli
