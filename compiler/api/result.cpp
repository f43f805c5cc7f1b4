#include <spirv-tools/libspirv.hpp>

#include <algorithm>

#include "api/objects.h"
#include "reflect/reflection_io.h"

namespace {

std::string as_line(const rtc::Diagnostic& message) {
    std::string line;
    if (!message.file.empty())
        line = message.file + ":" + (message.line ? std::to_string(message.line) + ":" : "") + " ";
    return line + (message.severity == rtc::Severity::Error ? "error: " : "warning: ") + message.text + "\n";
}

void view_reflection(rtcc_result& result) {
    const rtc::Reflection& r = result.reflection;
    for (const rtc::StageReport& stage : r.stages)
        result.stage_infos.push_back({rtcc::stage_of(stage.kind), stage.name.c_str(), stage.file.c_str(),
                                      stage.first_state, stage.states, stage.payload_words,
                                      stage.record_bytes});
    for (const rtc::GroupReport& group : r.groups) {
        rtcc_group_info info = {};
        info.kind = static_cast<rtcc_group_kind>(group.kind);
        info.name = group.name.c_str();
        std::copy(std::begin(group.handle), std::end(group.handle), info.handle);
        result.group_infos.push_back(info);
    }
    for (const rtc::ResourceReport& resource : r.resources)
        result.resource_infos.push_back({resource.name.c_str(), resource.stage.c_str(), resource.set,
                                         resource.binding, resource.type.c_str(), resource.array_size});
    for (const rtc::SpecConstantReport& constant : r.spec_constants)
        result.spec_constant_infos.push_back({constant.stage.c_str(), constant.name.c_str(),
                                              constant.original_id, constant.id, constant.type.c_str(),
                                              constant.default_value});
    for (const rtc::TraceSiteReport& site : r.trace_sites) {
        auto& names = result.variable_names.emplace_back();
        for (const std::string& name : site.variables) names.push_back(name.c_str());
    }
    for (size_t i = 0; i < r.trace_sites.size(); ++i) {
        const rtc::TraceSiteReport& site = r.trace_sites[i];
        result.trace_site_infos.push_back({site.stage.c_str(), site.file.c_str(), site.line,
                                           site.callable ? 1 : 0, site.frame_bytes,
                                           result.variable_names[i].size(), result.variable_names[i].data()});
    }
    for (const std::string& feature : r.required_features) result.feature_names.push_back(feature.c_str());

    for (const rtc::FactReport& fact : r.facts)
        result.fact_infos.push_back({fact.name.c_str(), fact.state.c_str(), fact.detail.c_str()});

    rtcc_reflection& view = result.view;
    view.fact_count = result.fact_infos.size();
    view.facts = result.fact_infos.data();
    view.assumptions = r.assumptions;
    view.stage_count = result.stage_infos.size();
    view.stages = result.stage_infos.data();
    view.group_count = result.group_infos.size();
    view.groups = result.group_infos.data();
    view.resource_count = result.resource_infos.size();
    view.resources = result.resource_infos.data();
    view.spec_constant_count = result.spec_constant_infos.size();
    view.spec_constants = result.spec_constant_infos.data();
    view.trace_site_count = result.trace_site_infos.size();
    view.trace_sites = result.trace_site_infos.data();
    view.required_feature_count = result.feature_names.size();
    view.required_features = result.feature_names.data();
    view.flags = r.flags;
    view.accuracy = static_cast<rtcc_accuracy>(r.accuracy);
    view.identity = r.identity;
    view.reserved_set = r.reserved_set;
    view.reserved_binding = r.reserved_binding;
    view.used_bindings = r.used_bindings;
    view.push_constant_bytes = r.push_constant_bytes;
    view.state_count = r.state_count;
    view.max_recursion_depth = r.max_recursion_depth;
    view.max_callable_depth = r.max_callable_depth;
    view.stack_words = r.stack_words;
    view.scratch_words = r.scratch_words;
    view.payload_words = r.payload_words;
    view.attribute_words = r.attribute_words;
    view.callable_words = r.callable_words;
    view.spirv_version = r.spirv_version;
    view.instruction_count = r.instruction_count;
    result.reflection_json = rtc::reflection_to_json(r);
}

size_t count_of(const rtcc_result& result, rtc::Severity severity) {
    return static_cast<size_t>(
        std::count_if(result.diagnostics.begin(), result.diagnostics.end(),
                      [&](const rtc::Diagnostic& d) { return d.severity == severity; }));
}

}  // namespace

void rtcc_result::publish(rtcc_status wanted, const rtcc_options& options) {
    status = wanted;
    if (status == RTCC_STATUS_INVALID_ARGUMENT && diagnostics.empty())
        error("invalid-argument", "", 0, "invalid argument");
    if (options.suppress_warnings)
        std::erase_if(diagnostics,
                      [](const rtc::Diagnostic& d) { return d.severity == rtc::Severity::Warning; });
    if (options.warnings_as_errors)
        for (rtc::Diagnostic& message : diagnostics)
            if (message.severity == rtc::Severity::Warning) {
                message.severity = rtc::Severity::Error;
                if (status == RTCC_STATUS_SUCCESS) status = RTCC_STATUS_COMPILATION_ERROR;
            }
    if (status != RTCC_STATUS_SUCCESS) {
        words.clear();
        has_reflection = false;
    }
    for (const rtc::Diagnostic& message : diagnostics) messages += as_line(message);
    if (has_reflection) view_reflection(*this);
}

extern "C" {

void rtcc_result_release(rtcc_result_t result) { delete result; }

rtcc_status rtcc_result_status(rtcc_const_result_t result) {
    return result ? result->status : RTCC_STATUS_INTERNAL_ERROR;
}

const uint32_t* rtcc_result_words(rtcc_const_result_t result) {
    return result && !result->words.empty() ? result->words.data() : nullptr;
}

size_t rtcc_result_word_count(rtcc_const_result_t result) { return result ? result->words.size() : 0; }

const char* rtcc_result_text(rtcc_const_result_t result) { return result ? result->text.c_str() : ""; }

size_t rtcc_result_text_size(rtcc_const_result_t result) { return result ? result->text.size() : 0; }

const char* rtcc_result_assembly(rtcc_result_t result) {
    if (!result || result->words.empty()) return "";
    try {
        if (result->assembly.empty()) {
            spvtools::SpirvTools tools(SPV_ENV_UNIVERSAL_1_6);
            tools.Disassemble(result->words, &result->assembly,
                              SPV_BINARY_TO_TEXT_OPTION_INDENT | SPV_BINARY_TO_TEXT_OPTION_FRIENDLY_NAMES);
        }
        return result->assembly.c_str();
    } catch (...) {
        return "";
    }
}

size_t rtcc_result_diagnostic_count(rtcc_const_result_t result) {
    return result ? result->diagnostics.size() : 0;
}

rtcc_diagnostic rtcc_result_diagnostic(rtcc_const_result_t result, size_t index) {
    if (!result || index >= result->diagnostics.size()) return {RTCC_SEVERITY_WARNING, "", "", 0, ""};
    const rtc::Diagnostic& message = result->diagnostics[index];
    return {message.severity == rtc::Severity::Error ? RTCC_SEVERITY_ERROR : RTCC_SEVERITY_WARNING,
            message.id.c_str(), message.file.c_str(), message.line, message.text.c_str()};
}

const char* rtcc_result_messages(rtcc_const_result_t result) {
    return result ? result->messages.c_str() : "";
}

size_t rtcc_result_warning_count(rtcc_const_result_t result) {
    return result ? count_of(*result, rtc::Severity::Warning) : 0;
}

size_t rtcc_result_error_count(rtcc_const_result_t result) {
    return result ? count_of(*result, rtc::Severity::Error) : 0;
}

size_t rtcc_result_dependency_count(rtcc_const_result_t result) {
    return result ? result->dependencies.size() : 0;
}

const char* rtcc_result_dependency(rtcc_const_result_t result, size_t index) {
    return result && index < result->dependencies.size() ? result->dependencies[index].c_str() : nullptr;
}

const rtcc_reflection* rtcc_result_reflection(rtcc_const_result_t result) {
    return result && result->has_reflection ? &result->view : nullptr;
}

const char* rtcc_result_reflection_json(rtcc_const_result_t result) {
    return result ? result->reflection_json.c_str() : "";
}

}  // extern "C"
