#include "rtc_compile.h"

#include <rtc/compiler.h>

#include <chrono>
#include <cstring>
#include <fstream>
#include <memory>
#include <sstream>

#include "error.h"

namespace rtc::tools {
namespace {

template <typename T, void (*Release)(T)>
struct Releaser {
    void operator()(std::remove_pointer_t<T>* object) const { Release(object); }
};
template <typename T, void (*Release)(T)>
using Owned = std::unique_ptr<std::remove_pointer_t<T>, Releaser<T, Release>>;

using Compiler = Owned<rtcc_compiler_t, rtcc_compiler_release>;
using Options = Owned<rtcc_options_t, rtcc_options_release>;
using Pipeline = Owned<rtcc_pipeline_t, rtcc_pipeline_release>;
using Result = Owned<rtcc_result_t, rtcc_result_release>;

void require(rtcc_status status, const char* what) {
    if (status != RTCC_STATUS_SUCCESS) throw Error(std::string(what) + " was refused by the compiler");
}

Options make_options(const JobPipeline& pipeline, const CompileOptions& wanted) {
    Options options(rtcc_options_create());
    require(rtcc_options_set_optimization(
                options.get(), wanted.optimize ? RTCC_OPTIMIZATION_PERFORMANCE : RTCC_OPTIMIZATION_NONE),
            "the optimisation level");
    require(rtcc_options_set_debug_info(options.get(), wanted.debug_info), "debug info");
    require(rtcc_options_set_accuracy(options.get(), wanted.accuracy), "the accuracy");
    require(rtcc_options_set_addressing(
                options.get(), wanted.addresses ? RTCC_ADDRESSING_ADDRESS : RTCC_ADDRESSING_HEAP),
            "the addressing mode");
    require(rtcc_options_set_checked(options.get(), wanted.checked), "checked");
    require(rtcc_options_set_resumable(options.get(), wanted.resumable), "resumable");
    require(rtcc_options_set_specialize(options.get(), wanted.specialize), "specialize");
    require(rtcc_options_assume(options.get(), wanted.assume.c_str()), "an assumption");
    require(rtcc_options_set_max_recursion_depth(options.get(), pipeline.max_recursion),
            "the recursion depth");
    require(rtcc_options_set_max_callable_depth(options.get(), pipeline.max_callable_depth),
            "the callable depth");
    require(rtcc_options_set_reserved(options.get(), wanted.reserved_set, wanted.reserved_binding),
            "the reserved set");
    return options;
}

void define(rtcc_options_t options, const std::string& text) {
    const size_t equals = text.find('=');
    const std::string name = text.substr(0, equals);
    const std::string value = equals == std::string::npos ? "" : text.substr(equals + 1);
    require(rtcc_options_add_macro(options, name.c_str(), value.c_str()), "a macro definition");
}

// Macros are options of a compilation, not of a stage, so a stage with its own is compiled first.
std::vector<uint32_t> compile_with_macros(rtcc_const_compiler_t compiler, rtcc_const_options_t base,
                                          const JobShader& shader, const std::string& source,
                                          std::string& warnings) {
    Options options(rtcc_options_clone(base));
    for (const std::string& macro : shader.defines) define(options.get(), macro);
    Result result(rtcc_compile_stage(compiler, rtcc_stage(shader.stage), shader.file.c_str(), source.data(),
                                     source.size(), options.get()));
    if (rtcc_result_status(result.get()) != RTCC_STATUS_SUCCESS)
        throw Error(rtcc_result_messages(result.get()));
    warnings += rtcc_result_messages(result.get());
    const uint32_t* words = rtcc_result_words(result.get());
    return {words, words + rtcc_result_word_count(result.get())};
}

}  // namespace

std::string read_text_file(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::ostringstream text;
    text << file.rdbuf();
    if (!file) throw Error("cannot read " + path);
    return text.str();
}

std::vector<uint32_t> read_words_file(const std::string& path) {
    const std::string bytes = read_text_file(path);
    if (bytes.empty() || bytes.size() % 4)
        throw Error(path + " is not SPIR-V: its size is not a multiple of 4");
    std::vector<uint32_t> words(bytes.size() / 4);
    std::memcpy(words.data(), bytes.data(), bytes.size());
    return words;
}

bool is_address_module(const std::vector<uint32_t>& words) {
    Compiler compiler(rtcc_compiler_create());
    Result result(rtcc_reflect_module(compiler.get(), "module", words.data(), words.size()));
    const rtcc_reflection* reflection = rtcc_result_reflection(result.get());
    return reflection && (reflection->flags & RTC_MODULE_ADDRESS_MODE);
}

CompiledModule compile_job(const JobPipeline& job, const CompileOptions& wanted) {
    const auto start = std::chrono::steady_clock::now();
    Compiler compiler(rtcc_compiler_create());
    Options options = make_options(job, wanted);
    Pipeline pipeline(rtcc_pipeline_create());
    CompiledModule compiled;

    std::vector<int32_t> stages;
    for (const JobShader& shader : job.shaders) {
        std::vector<uint32_t> spirv = shader.spirv;
        std::string source;
        if (spirv.empty()) source = read_text_file(shader.file);
        if (spirv.empty() && !shader.defines.empty())
            spirv = compile_with_macros(compiler.get(), options.get(), shader, source, compiled.warnings);
        const int32_t stage =
            spirv.empty()
                ? rtcc_pipeline_add_glsl(pipeline.get(), rtcc_stage(shader.stage), shader.name.c_str(),
                                         shader.file.c_str(), source.data(), source.size())
                : rtcc_pipeline_add_spirv(pipeline.get(), rtcc_stage(shader.stage), shader.name.c_str(),
                                          shader.file.c_str(), spirv.data(), spirv.size(),
                                          shader.entry.c_str());
        if (stage < 0) throw Error("stage '" + shader.name + "' was refused: is its name used twice?");
        for (const JobShader::Constant& constant : shader.constants)
            require(rtcc_pipeline_specialize(pipeline.get(), stage, constant.id, constant.value),
                    "a specialisation constant");
        stages.push_back(stage);
    }
    auto stage_of = [&](int index) { return index < 0 ? -1 : stages.at(size_t(index)); };
    for (const JobGroup& group : job.groups) {
        const int32_t index =
            group.general >= 0
                ? rtcc_pipeline_add_general_group(pipeline.get(), group.name.c_str(), stage_of(group.general))
                : rtcc_pipeline_add_hit_group(pipeline.get(), group.name.c_str(), stage_of(group.closest_hit),
                                              stage_of(group.any_hit), stage_of(group.intersection));
        if (index < 0) throw Error("group '" + group.name + "' was refused: is its name used twice?");
    }

    Result result(rtcc_compile_pipeline(compiler.get(), pipeline.get(), options.get()));
    if (rtcc_result_status(result.get()) != RTCC_STATUS_SUCCESS) {
        const std::string messages = rtcc_result_messages(result.get());
        throw Error(messages.empty() ? "the pipeline does not compile"
                                     : "the pipeline does not compile:\n" + messages);
    }
    compiled.warnings += rtcc_result_messages(result.get());
    const uint32_t* words = rtcc_result_words(result.get());
    compiled.words.assign(words, words + rtcc_result_word_count(result.get()));
    compiled.reflection_json = rtcc_result_reflection_json(result.get());
    compiled.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return compiled;
}

}  // namespace rtc::tools
