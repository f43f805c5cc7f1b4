// The command line as data. glslc's option names, plus what a pipeline needs.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "rtc/compiler.h"

namespace cli {

struct SpecArgument {
    uint32_t id = 0;
    std::string value;
};

// One stage or group as the user named it, in command line order.
struct InputArgument {
    enum class Kind { File, Stage, HitGroup, Pipeline } kind = Kind::File;
    std::string name;                    // of a --stage or --hit-group
    std::string file;                    // or the members' list of a --hit-group
    rtcc_stage stage = RTCC_STAGE_AUTO;  // -fshader-stage= or --stage
    std::optional<std::string> entry;    // -fentry-point= or --stage
    std::vector<SpecArgument> specialization;
};

struct MacroArgument {
    std::string name;
    std::optional<std::string> value;  // nullopt: -U
};

enum class Mode { Link, CompileOnly, Preprocess, Dependencies };
enum class BinaryFormat { Bin, C, Num };

struct Arguments {
    std::vector<InputArgument> inputs;
    std::vector<MacroArgument> macros;
    std::vector<std::string> include_directories;
    std::string output;  // empty: the default
    Mode mode = Mode::Link;
    bool assembly = false;
    BinaryFormat format = BinaryFormat::Bin;
    bool dependency_file = false;  // -MD
    std::string dependency_output, dependency_target;
    bool debug_info = false, suppress_warnings = false, warnings_as_errors = false;
    bool report = false, validate = true, resumable = true, specialize = true, checked = false;
    std::vector<std::string> assume, scene_profiles;
    std::string glsl_version, reflect, dump_after;
    rtcc_optimization optimization = RTCC_OPTIMIZATION_NONE;
    rtcc_target_env target = RTCC_TARGET_AUTO;
    rtcc_addressing addressing = RTCC_ADDRESSING_HEAP;
    rtcc_compat compat = RTCC_COMPAT_NONE;
    std::optional<rtcc_accuracy> accuracy;
    std::optional<uint32_t> recursion_depth, callable_depth;
    std::optional<int32_t> reserved_set;
    uint32_t reserved_binding = 0;
    bool help = false, version = false;
};

// `words` are the arguments after the program's name, response files still in them.
// Throws UsageError.
Arguments parse_arguments(const std::vector<std::string>& words);

// "NAME=KIND:FILE[:ENTRY][,spec.ID=VALUE…]"
InputArgument parse_stage_argument(const std::string& text);

// RTCC_ACCURACY_* of "fast", "watertight", "exact" or "exact64"; nullopt: none of them.
std::optional<rtcc_accuracy> parse_accuracy(const std::string& name);
const char* accuracy_name(rtcc_accuracy accuracy);

// Replaces @FILE by the words in that file (blanks separate, quotes and backslashes keep).
std::vector<std::string> expand_response_files(const std::vector<std::string>& words);

void print_help();
void print_version();

}  // namespace cli
