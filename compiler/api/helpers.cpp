#include <cstring>

#include "api/objects.h"

namespace rtcc {

std::optional<rtc::StageKind> kind_of(rtcc_stage stage) {
    if (stage < RTCC_STAGE_RAYGEN || stage > RTCC_STAGE_CALLABLE) return std::nullopt;
    return static_cast<rtc::StageKind>(stage);
}

bool valid_stage(rtcc_stage stage) { return stage == RTCC_STAGE_AUTO || kind_of(stage).has_value(); }

namespace {

std::string described(const rtc::SpirvInfo& info) {
    std::string text;
    for (const rtc::EntryPointInfo& entry : info.entry_points)
        text += (text.empty() ? "" : ", ") +
                (entry.kind ? std::string(rtcc_stage_name(stage_of(*entry.kind)))
                            : "execution model " + std::to_string(entry.model)) +
                " '" + entry.name + "'";
    return text.empty() ? "it has no entry point" : "it has " + text;
}

}  // namespace

std::optional<rtc::EntryPointInfo> choose_entry(const rtc::SpirvInfo& info,
                                                std::optional<rtc::StageKind> kind,
                                                const std::optional<std::string>& entry, std::string& error) {
    const rtc::EntryPointInfo* found = nullptr;
    size_t count = 0;
    for (const rtc::EntryPointInfo& candidate : info.entry_points) {
        if (!candidate.kind || (kind && candidate.kind != kind) || (entry && candidate.name != *entry))
            continue;
        if (count++ == 0) found = &candidate;
    }
    if (count == 1) return *found;
    const std::string what = (kind ? std::string(rtcc_stage_name(stage_of(*kind))) : "ray tracing") +
                             " entry point" + (entry ? " '" + *entry + "'" : "");
    error = count == 0 ? "the module has no " + what + ": " + described(info)
                       : "the module has more than one " + what + ", name one: " + described(info);
    return std::nullopt;
}

}  // namespace rtcc

extern "C" {

const char* rtcc_version(void) { return RTC_VERSION; }

uint32_t rtcc_abi_version(void) { return RTC_ABI_VERSION; }

const char* rtcc_front_end_version(void) {
    static const std::string version = "glslang " + rtc::glslang_version();
    return version.c_str();
}

rtcc_compiler_t rtcc_compiler_create(void) { return new (std::nothrow) rtcc_compiler; }

void rtcc_compiler_release(rtcc_compiler_t compiler) { delete compiler; }

int rtcc_is_spirv(const void* bytes, size_t size) {
    return bytes && rtc::looks_like_spirv(bytes, size) ? 1 : 0;
}

rtcc_result_t rtcc_module_from_bytes(const char* file, const void* bytes, size_t size) {
    return rtcc::make_result(nullptr, [&](rtcc_result& result, const rtcc_options&) {
        const std::string name = file ? file : "";
        if (!bytes) return RTCC_STATUS_INVALID_ARGUMENT;
        std::string error;
        std::vector<uint32_t> words;
        if (rtc::spirv_from_bytes(bytes, size, words, error)) error = rtc::inspect_spirv(words).error;
        if (!error.empty()) {
            result.error("spirv-malformed", name, 0, error);
            return RTCC_STATUS_INVALID_SPIRV;
        }
        result.words = std::move(words);
        return RTCC_STATUS_SUCCESS;
    });
}

rtcc_stage rtcc_module_stage(const uint32_t* words, size_t word_count, const char* entry) {
    if (!words) return RTCC_STAGE_AUTO;
    try {
        const rtc::SpirvInfo info = rtc::inspect_spirv({words, words + word_count});
        if (!info.error.empty()) return RTCC_STAGE_AUTO;
        std::string error;
        const auto chosen = rtcc::choose_entry(
            info, std::nullopt, entry ? std::optional<std::string>(entry) : std::nullopt, error);
        return chosen ? rtcc::stage_of(*chosen->kind) : RTCC_STAGE_AUTO;
    } catch (...) {
        return RTCC_STAGE_AUTO;
    }
}

rtcc_stage rtcc_stage_from_file_name(const char* file) {
    const auto kind = file ? rtc::stage_kind_from_file(file) : std::nullopt;
    return kind ? rtcc::stage_of(*kind) : RTCC_STAGE_AUTO;
}

rtcc_stage rtcc_stage_from_source(const char* file, const char* source, size_t source_size) {
    if (!source && source_size) return RTCC_STAGE_AUTO;
    try {
        const auto kind =
            rtc::stage_kind_from_source(file ? file : "", std::string(source ? source : "", source_size));
        return kind ? rtcc::stage_of(*kind) : RTCC_STAGE_AUTO;
    } catch (...) {
        return RTCC_STAGE_AUTO;
    }
}

rtcc_stage rtcc_stage_from_name(const char* name) {
    const auto kind = name ? rtc::stage_kind_from_name(name) : std::nullopt;
    return kind ? rtcc::stage_of(*kind) : RTCC_STAGE_AUTO;
}

const char* rtcc_stage_name(rtcc_stage stage) {
    switch (stage) {
        case RTCC_STAGE_RAYGEN:
            return "rgen";
        case RTCC_STAGE_INTERSECTION:
            return "rint";
        case RTCC_STAGE_ANY_HIT:
            return "rahit";
        case RTCC_STAGE_CLOSEST_HIT:
            return "rchit";
        case RTCC_STAGE_MISS:
            return "rmiss";
        case RTCC_STAGE_CALLABLE:
            return "rcall";
        default:
            return "auto";
    }
}

}  // extern "C"
