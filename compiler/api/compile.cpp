#include <algorithm>

#include "api/objects.h"
#include "reflect/reflection_io.h"

namespace {

// The caller's callbacks as the front end wants them.
rtc::FrontendOptions frontend_options(const rtcc_options& options) {
    rtc::FrontendOptions frontend = options.frontend;
    if (!options.resolve) return frontend;
    frontend.include = [resolve = options.resolve, release = options.release,
                        user_data = options.include_user_data](const rtc::IncludeRequest& request) {
        rtc::IncludeAnswer answer;
        rtcc_include_result* found = resolve(user_data, request.name.c_str(),
                                             request.local ? RTCC_INCLUDE_QUOTED : RTCC_INCLUDE_ANGLED,
                                             request.includer.c_str(), request.depth);
        if (!found) {
            answer.text = "cannot find or open include file";
            return answer;
        }
        if (found->name) answer.name.assign(found->name, found->name_size);
        if (found->content) answer.text.assign(found->content, found->content_size);
        answer.ok = !answer.name.empty();
        if (release) release(user_data, found);
        return answer;
    };
    return frontend;
}

void add_dependencies(rtcc_result& result, const std::vector<std::string>& files) {
    for (const std::string& file : files)
        if (!file.empty() && std::find(result.dependencies.begin(), result.dependencies.end(), file) ==
                                 result.dependencies.end())
            result.dependencies.push_back(file);
}

void append(rtcc_result& result, std::vector<rtc::Diagnostic>& more) {
    result.diagnostics.insert(result.diagnostics.end(), std::make_move_iterator(more.begin()),
                              std::make_move_iterator(more.end()));
}

rtcc_status front_end_failure(const rtc::FrontendResult& compiled) {
    for (const rtc::Diagnostic& message : compiled.diagnostics)
        if (message.id == "shader-stage-unknown" || message.id == "shader-stage-conflict")
            return RTCC_STATUS_INVALID_STAGE;
    return RTCC_STATUS_COMPILATION_ERROR;
}

rtcc_status glsl_stage(const rtcc::Stage& stage, const rtc::FrontendOptions& frontend, rtc::StageInput& input,
                       rtcc_result& result) {
    rtc::FrontendResult compiled = rtc::compile_glsl({stage.kind, stage.file, stage.source}, frontend);
    const rtcc_status status = compiled.ok ? RTCC_STATUS_SUCCESS : front_end_failure(compiled);
    add_dependencies(result, compiled.dependencies);
    append(result, compiled.diagnostics);
    input.kind = compiled.kind;
    input.spirv = std::move(compiled.spirv);
    return status;
}

rtcc_status spirv_stage(const rtcc::Stage& stage, rtc::StageInput& input, rtcc_result& result) {
    add_dependencies(result, {stage.file});
    const rtc::SpirvInfo info = rtc::inspect_spirv(stage.words);
    if (!info.error.empty()) {
        result.error("spirv-malformed", stage.file, 0, info.error);
        return RTCC_STATUS_INVALID_SPIRV;
    }
    std::string error;
    const auto entry = rtcc::choose_entry(info, stage.kind, stage.entry, error);
    if (!entry) {
        result.error("entry-point-missing", stage.file, 0, error);
        return RTCC_STATUS_INVALID_SPIRV;
    }
    input.kind = *entry->kind;
    input.entry = entry->name;
    input.spirv = stage.words;
    return RTCC_STATUS_SUCCESS;
}

// Values given for a stage against the constants its module has.
rtcc_status specialize(const rtcc::Stage& stage, rtc::StageInput& input, rtcc_result& result) {
    if (stage.specialization.empty() && stage.specialization_text.empty()) return RTCC_STATUS_SUCCESS;
    const rtc::SpirvInfo info = rtc::inspect_spirv(input.spirv);
    rtcc_status status = RTCC_STATUS_SUCCESS;
    const auto constant_of = [&](uint32_t id) -> const rtc::SpecConstantInfo* {
        for (const rtc::SpecConstantInfo& constant : info.spec_constants)
            if (constant.spec_id == id) return &constant;
        result.error("spec-constant-unknown", stage.file, 0,
                     "stage '" + stage.name + "' has no specialisation constant " + std::to_string(id));
        status = RTCC_STATUS_LINK_ERROR;
        return nullptr;
    };
    for (const rtc::SpecValue& value : stage.specialization)
        if (constant_of(value.id)) input.specialization.push_back(value);
    for (const rtcc::SpecText& value : stage.specialization_text) {
        const rtc::SpecConstantInfo* constant = constant_of(value.id);
        if (!constant) continue;
        std::string error;
        uint64_t bits = 0;
        if (!rtc::spec_value_from_text(*constant, value.value, bits, error)) {
            result.error("spec-constant-value", stage.file, 0, "stage '" + stage.name + "': " + error);
            status = RTCC_STATUS_LINK_ERROR;
            continue;
        }
        input.specialization.push_back({value.id, bits});
    }
    return status;
}

bool is_general(rtc::StageKind kind) {
    return kind == rtc::StageKind::RayGen || kind == rtc::StageKind::Miss || kind == rtc::StageKind::Callable;
}

rtcc_status link_groups(const rtcc_pipeline& pipeline, rtc::PipelineInput& input, rtcc_result& result) {
    rtcc_status status = RTCC_STATUS_SUCCESS;
    const auto check = [&](const rtcc::Group& group, int32_t index, bool fits, const char* expected) {
        if (index < 0 || fits) return;
        const rtc::StageInput& stage = input.stages[static_cast<size_t>(index)];
        result.error("group-stage-kind", stage.file, 0,
                     "group '" + group.name + "': stage '" + stage.name + "' is of kind " +
                         rtcc_stage_name(rtcc::stage_of(stage.kind)) + ", expected " + expected);
        status = RTCC_STATUS_LINK_ERROR;
    };
    const auto kind_at = [&](int32_t index) {
        return index < 0 ? rtc::StageKind::RayGen : input.stages[static_cast<size_t>(index)].kind;
    };
    for (const rtcc::Group& group : pipeline.groups) {
        rtc::GroupInput linked;
        linked.name = group.name;
        if (group.general) {
            check(group, group.stages[0], is_general(kind_at(group.stages[0])), "rgen, rmiss or rcall");
            linked.kind = rtc::GroupKind::General;
            linked.general = group.stages[0];
        } else {
            check(group, group.stages[0], kind_at(group.stages[0]) == rtc::StageKind::ClosestHit, "rchit");
            check(group, group.stages[1], kind_at(group.stages[1]) == rtc::StageKind::AnyHit, "rahit");
            check(group, group.stages[2], kind_at(group.stages[2]) == rtc::StageKind::Intersection, "rint");
            linked.kind = group.stages[2] >= 0 ? rtc::GroupKind::Procedural : rtc::GroupKind::Triangles;
            linked.closest_hit = group.stages[0];
            linked.any_hit = group.stages[1];
            linked.intersection = group.stages[2];
        }
        input.groups.push_back(std::move(linked));
    }
    return status;
}

rtcc_status compile_pipeline(const rtcc_pipeline& pipeline, const rtcc_options& options,
                             rtcc_result& result) {
    if (pipeline.stages.empty()) {
        result.error("pipeline-empty", "", 0, "the pipeline has no stages");
        return RTCC_STATUS_LINK_ERROR;
    }
    rtc::FrontendOptions frontend = frontend_options(options);
    frontend.debug_info = true;  // trace sites are reported by line; the core strips what -g did not ask for
    rtc::PipelineInput input;
    rtcc_status status = RTCC_STATUS_SUCCESS;
    for (const rtcc::Stage& stage : pipeline.stages) {
        rtc::StageInput& added = input.stages.emplace_back();
        added.name = stage.name;
        added.file = stage.file;
        rtcc_status one =
            stage.is_glsl ? glsl_stage(stage, frontend, added, result) : spirv_stage(stage, added, result);
        if (one == RTCC_STATUS_SUCCESS) one = specialize(stage, added, result);
        if (status == RTCC_STATUS_SUCCESS) status = one;
    }
    if (status != RTCC_STATUS_SUCCESS) return status;
    status = link_groups(pipeline, input, result);
    if (status != RTCC_STATUS_SUCCESS) return status;

    rtc::LinkResult linked = rtc::link_pipeline(input, options.link);
    append(result, linked.diagnostics);
    result.text = std::move(linked.dump);
    if (!linked.ok) {
        if (std::none_of(result.diagnostics.begin(), result.diagnostics.end(),
                         [](const rtc::Diagnostic& d) { return d.severity == rtc::Severity::Error; }))
            result.error("internal", "", 0, "internal error: linking failed without a message");
        return RTCC_STATUS_LINK_ERROR;
    }
    result.words = std::move(linked.spirv);
    if (!result.words.empty()) {
        result.has_reflection = true;
        result.reflection = std::move(linked.reflection);
    }
    return RTCC_STATUS_SUCCESS;
}

rtc::GlslSource source_of(rtcc_stage stage, const char* file, const char* source, size_t size) {
    return {rtcc::kind_of(stage), file ? file : "", std::string(source ? source : "", size)};
}

}  // namespace

extern "C" {

rtcc_result_t rtcc_compile_pipeline(rtcc_const_compiler_t compiler, rtcc_const_pipeline_t pipeline,
                                    rtcc_const_options_t options) {
    return rtcc::make_result(options, [&](rtcc_result& result, const rtcc_options& chosen) {
        if (!compiler || !pipeline) return RTCC_STATUS_INVALID_ARGUMENT;
        return compile_pipeline(*pipeline, chosen, result);
    });
}

rtcc_result_t rtcc_compile_stage(rtcc_const_compiler_t compiler, rtcc_stage stage, const char* file,
                                 const char* source, size_t source_size, rtcc_const_options_t options) {
    return rtcc::make_result(options, [&](rtcc_result& result, const rtcc_options& chosen) {
        if (!compiler || (!source && source_size) || !rtcc::valid_stage(stage))
            return RTCC_STATUS_INVALID_ARGUMENT;
        rtc::FrontendOptions frontend = frontend_options(chosen);
        frontend.debug_info = chosen.link.debug_info;
        rtc::FrontendResult compiled =
            rtc::compile_glsl(source_of(stage, file, source, source_size), frontend);
        const rtcc_status status = compiled.ok ? RTCC_STATUS_SUCCESS : front_end_failure(compiled);
        add_dependencies(result, compiled.dependencies);
        append(result, compiled.diagnostics);
        result.words = std::move(compiled.spirv);
        return status;
    });
}

rtcc_result_t rtcc_preprocess_stage(rtcc_const_compiler_t compiler, rtcc_stage stage, const char* file,
                                    const char* source, size_t source_size, rtcc_const_options_t options) {
    return rtcc::make_result(options, [&](rtcc_result& result, const rtcc_options& chosen) {
        if (!compiler || (!source && source_size) || !rtcc::valid_stage(stage))
            return RTCC_STATUS_INVALID_ARGUMENT;
        rtc::FrontendResult processed =
            rtc::preprocess_glsl(source_of(stage, file, source, source_size), frontend_options(chosen));
        const rtcc_status status = processed.ok ? RTCC_STATUS_SUCCESS : front_end_failure(processed);
        add_dependencies(result, processed.dependencies);
        append(result, processed.diagnostics);
        result.text = std::move(processed.text);
        return status;
    });
}

rtcc_result_t rtcc_reflect_module(rtcc_const_compiler_t compiler, const char* file, const uint32_t* words,
                                  size_t word_count) {
    return rtcc::make_result(nullptr, [&](rtcc_result& result, const rtcc_options&) {
        if (!compiler || (!words && word_count)) return RTCC_STATUS_INVALID_ARGUMENT;
        result.words.assign(words, words + word_count);
        std::string error;
        if (!rtc::read_reflection(result.words, result.reflection, error)) {
            result.error("no-reflection", file ? file : "", 0, error);
            return RTCC_STATUS_NO_REFLECTION;
        }
        result.has_reflection = true;
        return RTCC_STATUS_SUCCESS;
    });
}

}  // extern "C"
