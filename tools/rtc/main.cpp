// rtc [options] a.rgen b.rchit c.rmiss … -o pipeline.spv
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "arguments.h"
#include "error.h"
#include "inputs.h"
#include "output.h"
#include "plan.h"
#include "report.h"
#include "rtc/compiler.h"

namespace cli {
namespace {

template <auto Release>
struct Releaser {
    template <typename T>
    void operator()(T* object) const {
        Release(object);
    }
};
using Compiler = std::unique_ptr<struct rtcc_compiler, Releaser<rtcc_compiler_release>>;
using Options = std::unique_ptr<struct rtcc_options, Releaser<rtcc_options_release>>;
using Pipeline = std::unique_ptr<struct rtcc_pipeline, Releaser<rtcc_pipeline_release>>;
using Result = std::unique_ptr<struct rtcc_result, Releaser<rtcc_result_release>>;

void require(rtcc_status status, const std::string& what) {
    if (status != RTCC_STATUS_SUCCESS) throw UsageError(what);
}

std::string assumption_list() {
    std::string names;
    for (size_t i = 0; rtcc_assumption_name(i); ++i)
        names += (i ? ", " : "") + std::string(rtcc_assumption_name(i));
    return names;
}

Options make_options(const Arguments& arguments) {
    Options options(rtcc_options_create());
    rtcc_options_t o = options.get();
    for (const MacroArgument& macro : arguments.macros) {
        if (macro.value)
            require(rtcc_options_add_macro(o, macro.name.c_str(), macro.value->c_str()),
                    "macro names must be identifiers: '-D" + macro.name + "'");
        else
            require(rtcc_options_undefine_macro(o, macro.name.c_str()),
                    "macro names must be identifiers: '-U" + macro.name + "'");
    }
    for (const std::string& folder : arguments.include_directories)
        rtcc_options_add_include_directory(o, folder.c_str());
    rtcc_options_set_glsl_version(o, arguments.glsl_version.c_str());
    rtcc_options_set_debug_info(o, arguments.debug_info);
    rtcc_options_set_optimization(o, arguments.optimization);
    rtcc_options_set_target_env(o, arguments.target);
    if (arguments.accuracy) rtcc_options_set_accuracy(o, *arguments.accuracy);
    if (arguments.recursion_depth) rtcc_options_set_max_recursion_depth(o, *arguments.recursion_depth);
    if (arguments.callable_depth) rtcc_options_set_max_callable_depth(o, *arguments.callable_depth);
    if (arguments.reserved_set)
        rtcc_options_set_reserved(o, *arguments.reserved_set, arguments.reserved_binding);
    rtcc_options_set_validate(o, arguments.validate);
    rtcc_options_set_addressing(o, arguments.addressing);
    rtcc_options_set_compat(o, arguments.compat);
    rtcc_options_set_resumable(o, arguments.resumable);
    rtcc_options_set_checked(o, arguments.checked);
    rtcc_options_set_specialize(o, arguments.specialize);
    for (const std::string& list : arguments.assume)
        require(rtcc_options_assume(o, list.c_str()),
                "invalid value '" + list + "' in '--assume=" + list + "': expected a list of " + assumption_list());
    // As glslc has it, -M implies -w: only what it finds matters.
    rtcc_options_set_suppress_warnings(o,
                                       arguments.suppress_warnings || arguments.mode == Mode::Dependencies);
    rtcc_options_set_warnings_as_errors(o, arguments.warnings_as_errors);
    if (!arguments.dump_after.empty()) rtcc_options_set_stop_after(o, arguments.dump_after.c_str());
    return options;
}

class Program {
  public:
    explicit Program(const Arguments& arguments)
        : arguments_(arguments), compiler_(rtcc_compiler_create()), options_(make_options(arguments)) {}

    int run() {
        for (const std::string& file : arguments_.scene_profiles) add_scene_profile(file, file);
        bool ok = false;
        if (is_finished_module()) {
            ok = reflect_module();
        } else {
            const Plan plan = make_plan(arguments_, files_);
            if (plan.accuracy && !arguments_.accuracy) rtcc_options_set_accuracy(options_.get(), *plan.accuracy);
            switch (arguments_.mode) {
                case Mode::Link:
                    ok = link(plan);
                    break;
                case Mode::CompileOnly:
                    ok = compile_only(plan);
                    break;
                case Mode::Preprocess:
                    ok = preprocess(plan);
                    break;
                case Mode::Dependencies:
                    ok = list_dependencies(plan);
                    break;
            }
        }
        print_counts();
        return ok ? 0 : 1;
    }

  private:
    // Prints messages and counts them; true when the result can be used.
    bool accept(const Result& result) {
        if (!result) throw InputError("rtc: error: out of memory");
        std::fputs(rtcc_result_messages(result.get()), stderr);
        warnings_ += rtcc_result_warning_count(result.get());
        errors_ += rtcc_result_error_count(result.get());
        return rtcc_result_status(result.get()) == RTCC_STATUS_SUCCESS;
    }

    void print_counts() const {
        const auto plural = [](size_t count, const char* what) {
            return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
        };
        std::string text;
        if (warnings_) text = plural(warnings_, "warning");
        if (errors_) text += (text.empty() ? "" : " and ") + plural(errors_, "error");
        if (!text.empty()) std::fprintf(stderr, "%s generated.\n", text.c_str());
    }

    // Text beside the module: on stdout, unless the module itself goes there.
    void print(const std::string& text) const {
        std::fputs(text.c_str(), arguments_.output == "-" ? stderr : stdout);
    }

    // The only input, without a ray tracing stage, but asked about: made by rtc before.
    bool is_finished_module() {
        if (arguments_.inputs.size() != 1 || arguments_.mode != Mode::Link) return false;
        const InputArgument& input = arguments_.inputs.front();
        if (input.kind != InputArgument::Kind::File || (arguments_.reflect.empty() && !arguments_.report))
            return false;
        const auto source = files_.open(input.file);
        if (!source->is_spirv) return false;
        return rtcc_module_stage(source->words.data(), source->words.size(), nullptr) == RTCC_STAGE_AUTO &&
               !input.entry && input.stage == RTCC_STAGE_AUTO;
    }

    bool reflect_module() {
        const auto source = files_.open(arguments_.inputs.front().file);
        const Result result(rtcc_reflect_module(compiler_.get(), source->name.c_str(), source->words.data(),
                                                source->words.size()));
        if (!accept(result)) return false;
        write_reflection(result.get(), source->name);
        return true;
    }

    void write_reflection(rtcc_result_t result, const std::string& module) {
        if (!arguments_.reflect.empty())
            write_output(arguments_.reflect, rtcc_result_reflection_json(result));
        const rtcc_reflection* reflection = rtcc_result_reflection(result);
        if (arguments_.report && reflection) print(report_text(*reflection, module));
    }

    Pipeline make_pipeline(const Plan& plan) const {
        Pipeline pipeline(rtcc_pipeline_create());
        for (const PlannedStage& stage : plan.stages) {
            const SourceFile& source = *stage.source;
            const int32_t index =
                source.is_spirv
                    ? rtcc_pipeline_add_spirv(pipeline.get(), stage.kind, stage.name.c_str(),
                                              source.name.c_str(), source.words.data(), source.words.size(),
                                              stage.entry ? stage.entry->c_str() : nullptr)
                    : rtcc_pipeline_add_glsl(pipeline.get(), stage.kind, stage.name.c_str(),
                                             source.name.c_str(), source.bytes.data(), source.bytes.size());
            if (index < 0) throw InputError("rtc: error: cannot add stage '" + stage.name + "'");
            if (!source.is_spirv && stage.entry && *stage.entry != "main")
                throw InputError("rtc: error: stage '" + stage.name +
                                 "': the entry point of GLSL is main, not '" + *stage.entry + "'");
            for (const SpecArgument& spec : stage.specialization)
                rtcc_pipeline_specialize_text(pipeline.get(), index, spec.id, spec.value.c_str());
        }
        for (const PlannedGroup& group : plan.groups) {
            if (group.general)
                rtcc_pipeline_add_general_group(pipeline.get(), group.name.c_str(), group.stages[0]);
            else
                rtcc_pipeline_add_hit_group(pipeline.get(), group.name.c_str(), group.stages[0],
                                            group.stages[1], group.stages[2]);
        }
        return pipeline;
    }

    std::string default_output() const { return arguments_.assembly ? "a.spvasm" : "a.spv"; }

    std::string module_text(rtcc_result_t result) const {
        if (arguments_.assembly) return rtcc_result_assembly(result);
        return format_words(rtcc_result_words(result), rtcc_result_word_count(result), arguments_.format);
    }

    void add_scene_profile(const std::string& file, const std::string& shown) {
        const std::string text = read_input(file);
        if (rtcc_options_add_scene_profile(options_.get(), text.data(), text.size()) != RTCC_STATUS_SUCCESS)
            throw InputError("rtc: error: '" + shown + "' is no scene profile of this version: expected what "
                             "rtrWriteSceneProfile wrote");
    }

    // The same pipeline with nothing removed, and with one fact after the other unknown, for the report.
    void report_unspecialized(rtcc_const_pipeline_t pipeline, const rtcc_reflection& now) const {
        const Options plain(rtcc_options_clone(options_.get()));
        rtcc_options_set_specialize(plain.get(), 0);
        const Result result(rtcc_compile_pipeline(compiler_.get(), pipeline, plain.get()));
        if (const rtcc_reflection* before = rtcc_result_reflection(result.get()))
            print(comparison_text(*before, now));
        std::vector<std::pair<std::string, uint32_t>> without;
        for (size_t i = 0; i < now.fact_count; ++i) {
            if (now.facts[i].state == std::string("unknown")) continue;
            const Options open(rtcc_options_clone(options_.get()));
            rtcc_options_ignore_fact(open.get(), now.facts[i].name);
            const Result other(rtcc_compile_pipeline(compiler_.get(), pipeline, open.get()));
            const rtcc_reflection* r = rtcc_result_reflection(other.get());
            // Facts of the pipeline's shape stay what they are.
            if (r && r->fact_count == now.fact_count && r->facts[i].state != std::string(now.facts[i].state))
                without.emplace_back(now.facts[i].name, r->instruction_count);
        }
        print(facts_text(without, now));
    }

    bool link(const Plan& plan) {
        for (const std::string& list : plan.assume)
            if (rtcc_options_assume(options_.get(), list.c_str()) != RTCC_STATUS_SUCCESS)
                throw InputError("rtc: error: \"assume\": '" + list + "' is none of " + assumption_list());
        for (const std::string& file : plan.scene_profiles) add_scene_profile(file, file);
        const Pipeline pipeline = make_pipeline(plan);
        const Result result(rtcc_compile_pipeline(compiler_.get(), pipeline.get(), options_.get()));
        if (!accept(result)) return false;
        if (!arguments_.dump_after.empty()) {
            write_output(arguments_.output.empty() ? "-" : arguments_.output,
                         std::string(rtcc_result_text(result.get()), rtcc_result_text_size(result.get())));
            return true;
        }
        const std::string output = arguments_.output.empty() ? default_output() : arguments_.output;
        write_output(output, module_text(result.get()));
        if (arguments_.dependency_file) write_dependencies(result.get(), plan, output);
        write_reflection(result.get(), output);
        if (arguments_.report && arguments_.specialize)
            if (const rtcc_reflection* now = rtcc_result_reflection(result.get()))
                report_unspecialized(pipeline.get(), *now);
        return true;
    }

    void write_dependencies(rtcc_const_result_t result, const Plan& plan, const std::string& output) {
        if (output == "-" && arguments_.dependency_output.empty())
            throw UsageError("'-MD' to the standard output needs '-MF'");
        std::vector<std::string> files;
        for (size_t i = 0; i < rtcc_result_dependency_count(result); ++i)
            files.push_back(rtcc_result_dependency(result, i));
        files.insert(files.end(), plan.description_files.begin(), plan.description_files.end());
        write_output(
            arguments_.dependency_output.empty() ? output + ".d" : arguments_.dependency_output,
            make_rule(arguments_.dependency_target.empty() ? output : arguments_.dependency_target, files));
    }

    // One stage through the front end alone; SPIR-V has been there before.
    const SourceFile& glsl_of(const PlannedStage& stage, const char* option) const {
        if (stage.source->is_spirv)
            throw InputError("rtc: error: '" + stage.source->name + "' is SPIR-V, '" + option +
                             "' takes GLSL");
        return *stage.source;
    }

    bool compile_only(const Plan& plan) {
        bool all = true;
        for (const PlannedStage& stage : plan.stages) {
            const SourceFile& source = glsl_of(stage, "-c");
            const Result result(rtcc_compile_stage(compiler_.get(), stage.kind, source.name.c_str(),
                                                   source.bytes.data(), source.bytes.size(), options_.get()));
            if (!accept(result)) {
                all = false;
                continue;
            }
            const char* suffix = arguments_.assembly ? ".spvasm" : ".spv";
            const std::string output = !arguments_.output.empty() ? arguments_.output
                                       : source.name == "<stdin>" ? default_output()
                                                                  : last_component(source.name) + suffix;
            write_output(output, module_text(result.get()));
            if (arguments_.dependency_file) write_dependencies(result.get(), Plan(), output);
        }
        return all;
    }

    bool preprocess(const Plan& plan) {
        std::string text;
        bool all = true;
        for (const PlannedStage& stage : plan.stages) {
            const SourceFile& source = glsl_of(stage, "-E");
            const Result result(rtcc_preprocess_stage(compiler_.get(), stage.kind, source.name.c_str(),
                                                      source.bytes.data(), source.bytes.size(),
                                                      options_.get()));
            all &= accept(result);
            text += rtcc_result_text(result.get());
        }
        if (all) write_output(arguments_.output.empty() ? "-" : arguments_.output, text);
        return all;
    }

    bool list_dependencies(const Plan& plan) {
        std::vector<std::string> files;
        const auto add = [&](const std::string& file) {
            for (const std::string& known : files)
                if (known == file) return;
            files.push_back(file);
        };
        bool all = true;
        for (const PlannedStage& stage : plan.stages) {
            const SourceFile& source = *stage.source;
            if (source.is_spirv) {
                add(source.name);
                continue;
            }
            const Result result(rtcc_preprocess_stage(compiler_.get(), stage.kind, source.name.c_str(),
                                                      source.bytes.data(), source.bytes.size(),
                                                      options_.get()));
            all &= accept(result);
            for (size_t i = 0; i < rtcc_result_dependency_count(result.get()); ++i)
                add(rtcc_result_dependency(result.get(), i));
        }
        for (const std::string& file : plan.description_files) add(file);
        if (!all) return false;
        const std::string target =
            arguments_.dependency_target.empty() ? default_output() : arguments_.dependency_target;
        const std::string output = !arguments_.dependency_output.empty() ? arguments_.dependency_output
                                   : !arguments_.output.empty()          ? arguments_.output
                                                                         : "-";
        write_output(output, make_rule(target, files));
        return true;
    }

    const Arguments& arguments_;
    SourceFiles files_;
    Compiler compiler_;
    Options options_;
    size_t warnings_ = 0, errors_ = 0;
};

int run(const std::vector<std::string>& words) {
    try {
        const Arguments arguments = parse_arguments(words);
        if (arguments.help) return print_help(), 0;
        if (arguments.version) return print_version(), 0;
        return Program(arguments).run();
    } catch (const UsageError& error) {
        std::fprintf(stderr, "rtc: error: %s\n", error.what());
        return 1;
    } catch (const InputError& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "rtc: internal error: %s\n", error.what());
        return 1;
    }
}

}  // namespace
}  // namespace cli

int main(int argc, char** argv) { return cli::run(std::vector<std::string>(argv + (argc > 0), argv + argc)); }
