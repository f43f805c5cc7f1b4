// What the opaque handles of rtc/compiler.h point to.
#pragma once

#include <exception>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "frontend/frontend.h"
#include "pipeline.h"
#include "rtc/compiler.h"

struct rtcc_compiler {};

struct rtcc_options {
    rtc::FrontendOptions frontend;
    rtc::LinkOptions link;
    rtcc_include_resolve_fn resolve = nullptr;
    rtcc_include_release_fn release = nullptr;
    void* include_user_data = nullptr;
    bool warnings_as_errors = false;
    bool suppress_warnings = false;
};

namespace rtcc {

struct SpecText {
    uint32_t id = 0;
    std::string value;
};

struct Stage {
    std::optional<rtc::StageKind> kind;  // absent: to be found when compiled
    std::string name;
    std::string file;
    bool is_glsl = true;
    std::string source;
    std::vector<uint32_t> words;
    std::optional<std::string> entry;
    std::vector<rtc::SpecValue> specialization;
    std::vector<SpecText> specialization_text;
};

struct Group {
    bool general = true;
    std::string name;
    int32_t stages[3] = {-1, -1, -1};  // general; or closest hit, any hit, intersection
};

}  // namespace rtcc

struct rtcc_pipeline {
    std::vector<rtcc::Stage> stages;
    std::vector<rtcc::Group> groups;
};

struct rtcc_result {
    rtcc_status status = RTCC_STATUS_INTERNAL_ERROR;
    std::vector<uint32_t> words;
    std::string text;
    std::string assembly;
    std::vector<rtc::Diagnostic> diagnostics;
    std::string messages;
    std::vector<std::string> dependencies;

    // The C view points into `reflection`, which therefore never changes after publish().
    bool has_reflection = false;
    rtc::Reflection reflection;
    std::string reflection_json;
    rtcc_reflection view = {};
    std::vector<rtcc_stage_info> stage_infos;
    std::vector<rtcc_group_info> group_infos;
    std::vector<rtcc_resource_info> resource_infos;
    std::vector<rtcc_spec_constant_info> spec_constant_infos;
    std::vector<rtcc_trace_site_info> trace_site_infos;
    std::vector<rtcc_fact_info> fact_infos;
    std::vector<std::vector<const char*>> variable_names;
    std::vector<const char*> feature_names;

    void error(const char* id, const std::string& file, uint32_t line, std::string what) {
        diagnostics.push_back({rtc::Severity::Error, id, file, line, std::move(what)});
    }
    // Settles warnings, status and the views; nothing may be added afterwards.
    void publish(rtcc_status wanted, const rtcc_options& options);
};

namespace rtcc {

// Runs `body`, which returns a status; exceptions end here.
template <typename F>
rtcc_status guarded(F&& body) {
    try {
        return body();
    } catch (const std::bad_alloc&) {
        return RTCC_STATUS_OUT_OF_MEMORY;
    } catch (...) {
        return RTCC_STATUS_INTERNAL_ERROR;
    }
}

// Runs `body` on a fresh result; an exception makes that an internal error.
template <typename F>
rtcc_result_t make_result(const rtcc_options* options, F&& body) {
    try {
        const rtcc_options defaults;
        const rtcc_options& chosen = options ? *options : defaults;
        auto result = std::make_unique<rtcc_result>();
        rtcc_status status = RTCC_STATUS_INTERNAL_ERROR;
        try {
            status = body(*result, chosen);
        } catch (const std::bad_alloc&) {
            throw;
        } catch (const std::exception& problem) {
            result->error("internal", "", 0, std::string("internal error: ") + problem.what());
        }
        result->publish(status, chosen);
        return result.release();
    } catch (...) {
        return nullptr;
    }
}

std::optional<rtc::StageKind> kind_of(rtcc_stage stage);
inline rtcc_stage stage_of(rtc::StageKind kind) { return static_cast<rtcc_stage>(kind); }
bool valid_stage(rtcc_stage stage);

// Chooses the entry point; nullopt with `error` when none fits.
std::optional<rtc::EntryPointInfo> choose_entry(const rtc::SpirvInfo& info,
                                                std::optional<rtc::StageKind> kind,
                                                const std::optional<std::string>& entry, std::string& error);

}  // namespace rtcc
