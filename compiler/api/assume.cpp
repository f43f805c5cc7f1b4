// What the user promises about scenes: names, lists of names, and the scene profiles of the runtime.
#include <nlohmann/json.hpp>

#include "api/objects.h"

namespace {

constexpr int kProfileVersion = 1;

// Commas and blanks separate; false for a name that does not exist.
bool parse_list(std::string_view text, uint32_t& bits) {
    uint32_t all = 0;
    while (!text.empty()) {
        const size_t begin = text.find_first_not_of(", \t\n");
        if (begin == std::string_view::npos) break;
        text.remove_prefix(begin);
        const size_t end = std::min(text.find_first_of(", \t\n"), text.size());
        uint32_t bit = 0;
        if (!rtc::assumption_from_name(text.substr(0, end), bit)) return false;
        all |= bit;
        text.remove_prefix(end);
    }
    bits |= all;
    return true;
}

bool parse_profile(const char* text, size_t size, uint32_t& bits) {
    const auto json = nlohmann::json::parse(text, text + size, nullptr, false);
    if (!json.is_object() || json.value("rtcSceneProfile", 0) != kProfileVersion || !json.contains("assume") ||
        !json["assume"].is_array())
        return false;
    uint32_t all = 0;
    for (const auto& name : json["assume"]) {
        uint32_t bit = 0;
        if (!name.is_string() || !rtc::assumption_from_name(name.get<std::string>(), bit)) return false;
        all |= bit;
    }
    bits |= all;
    return true;
}

template <typename Work>
rtcc_status guarded(rtcc_options_t options, const Work& work) {
    if (!options) return RTCC_STATUS_INVALID_ARGUMENT;
    try {
        return work() ? RTCC_STATUS_SUCCESS : RTCC_STATUS_INVALID_ARGUMENT;
    } catch (const std::bad_alloc&) {
        return RTCC_STATUS_OUT_OF_MEMORY;
    } catch (...) {
        return RTCC_STATUS_INVALID_ARGUMENT;
    }
}

}  // namespace

extern "C" {

const char* rtcc_assumption_name(size_t index) {
    const auto known = rtc::assumptions();
    return index < known.size() ? known[index].name : nullptr;
}

rtcc_status rtcc_options_assume(rtcc_options_t options, const char* names) {
    return guarded(options, [&] { return names && parse_list(names, options->link.assumptions); });
}

rtcc_status rtcc_options_add_scene_profile(rtcc_options_t options, const char* json, size_t size) {
    return guarded(options, [&] { return json && parse_profile(json, size, options->link.assumptions); });
}

rtcc_status rtcc_options_set_specialize(rtcc_options_t options, int enable) {
    return guarded(options, [&] {
        options->link.specialize = enable != 0;
        return true;
    });
}

rtcc_status rtcc_options_ignore_fact(rtcc_options_t options, const char* name) {
    return guarded(options, [&] {
        if (!name || !*name) return false;
        options->link.ignored_facts.push_back(name);
        return true;
    });
}

}  // extern "C"
