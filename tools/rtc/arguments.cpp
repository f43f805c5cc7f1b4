#include "arguments.h"

#include <charconv>
#include <string_view>

#include "error.h"

namespace cli {
namespace {

std::optional<uint32_t> number(std::string_view text) {
    uint32_t value = 0;
    const auto parsed = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || parsed.ec != std::errc() || parsed.ptr != text.data() + text.size())
        return std::nullopt;
    return value;
}

bool starts_with(std::string_view text, std::string_view prefix) {
    return text.substr(0, prefix.size()) == prefix;
}

constexpr const char* kAccuracies[] = {"watertight", "fast", "exact", "exact64"};

[[noreturn]] void invalid_value(std::string_view option, std::string_view value) {
    throw UsageError("invalid value '" + std::string(value) + "' in '" + std::string(option) + "=" +
                     std::string(value) + "'");
}

uint32_t number_between(std::string_view option, std::string_view value, uint32_t low, uint32_t high) {
    const auto parsed = number(value);
    if (!parsed || *parsed < low || *parsed > high)
        throw UsageError("invalid value '" + std::string(value) + "' in '" + std::string(option) + "=" +
                         std::string(value) + "': expected " + std::to_string(low) + " to " +
                         std::to_string(high));
    return *parsed;
}

class Parser {
  public:
    explicit Parser(const std::vector<std::string>& words) : words_(expand_response_files(words)) {}

    Arguments run() {
        bool options = true;
        for (at_ = 0; at_ < words_.size(); ++at_) {
            const std::string& word = words_[at_];
            if (options && word == "--")
                options = false;
            else if (options && word.size() > 1 && word[0] == '-')
                option(word);
            else
                add_file(word);
        }
        check();
        return std::move(out_);
    }

  private:
    void option(const std::string& word) {
        if (starts_with(word, "--")) return long_option(word);
        if (flag(word) || joined_or_next(word) || prefixed(word)) return;
        throw UsageError("unknown argument: '" + word + "'");
    }

    bool flag(std::string_view word) {
        if (word == "-c")
            mode(Mode::CompileOnly);
        else if (word == "-E")
            mode(Mode::Preprocess);
        else if (word == "-M" || word == "-MM")
            mode(Mode::Dependencies);
        else if (word == "-S")
            out_.assembly = true;
        else if (word == "-MD")
            out_.dependency_file = true;
        else if (word == "-MF")
            out_.dependency_output = next("-MF");
        else if (word == "-MT")
            out_.dependency_target = next("-MT");
        else if (word == "-O" || word == "-O1" || word == "-O2" || word == "-O3")
            out_.optimization = RTCC_OPTIMIZATION_PERFORMANCE;
        else if (word == "-O0")
            out_.optimization = RTCC_OPTIMIZATION_NONE;
        else if (word == "-Os")
            out_.optimization = RTCC_OPTIMIZATION_SIZE;
        else if (word == "-g")
            out_.debug_info = true;
        else if (word == "-w")
            out_.suppress_warnings = true;
        else if (word == "-Werror")
            out_.warnings_as_errors = true;
        else if (word == "-h")
            out_.help = true;
        else
            return false;
        return true;
    }

    // -oFILE and -o FILE
    bool joined_or_next(const std::string& word) {
        const std::string_view letters = "oDUIx";
        if (word.size() < 2 || letters.find(word[1]) == std::string_view::npos) return false;
        const std::string value = word.size() > 2 ? word.substr(2) : next(word);
        switch (word[1]) {
            case 'o':
                if (!out_.output.empty()) throw UsageError("more than one '-o'");
                out_.output = value;
                break;
            case 'D': {
                const size_t equals = value.find('=');
                if (value.empty() || equals == 0) throw UsageError("-D without a macro name: '" + word + "'");
                out_.macros.push_back({value.substr(0, equals), equals == std::string::npos
                                                                    ? std::string()
                                                                    : value.substr(equals + 1)});
                break;
            }
            case 'U':
                out_.macros.push_back({value, std::nullopt});
                break;
            case 'I':
                out_.include_directories.push_back(value);
                break;
            case 'x':
                if (value == "hlsl")
                    throw UsageError(
                        "language 'hlsl': compile HLSL with DXC or Slang and give rtc the SPIR-V");
                if (value != "glsl" && value != "spirv" && value != "none")
                    throw UsageError("language not recognized: '" + value + "'");
                break;
        }
        return true;
    }

    bool prefixed(const std::string& word) {
        const size_t equals = word.find('=');
        if (equals == std::string::npos) return false;
        const std::string name = word.substr(0, equals), value = word.substr(equals + 1);
        if (name == "-std") {
            out_.glsl_version = value;
            rtcc_options_t probe = rtcc_options_create();
            const rtcc_status status = rtcc_options_set_glsl_version(probe, value.c_str());
            rtcc_options_release(probe);
            if (value.empty() || status != RTCC_STATUS_SUCCESS) invalid_value(name, value);
        } else if (name == "-mfmt") {
            if (value == "bin")
                out_.format = BinaryFormat::Bin;
            else if (value == "c")
                out_.format = BinaryFormat::C;
            else if (value == "num")
                out_.format = BinaryFormat::Num;
            else
                invalid_value(name, value);
        } else if (name == "-fentry-point") {
            if (value.empty()) invalid_value(name, value);
            entry_ = value;
        } else if (name == "-fshader-stage") {
            stage_ = rtcc_stage_from_name(value.c_str());
            if (stage_ == RTCC_STAGE_AUTO) invalid_value(name, value);
        } else {
            return false;
        }
        return true;
    }

    void long_option(const std::string& word) {
        const size_t equals = word.find('=');
        const std::string name = word.substr(0, equals);
        if (equals == std::string::npos) {
            if (name == "--help")
                out_.help = true;
            else if (name == "--version")
                out_.version = true;
            else if (name == "--report")
                out_.report = true;
            else if (name == "--checked")
                out_.checked = true;
            else if (name == "--no-validate")
                out_.validate = false;
            else if (name == "--no-resumable")
                out_.resumable = false;
            else if (name == "--no-specialize")
                out_.specialize = false;
            else if (takes_value(name))
                valued(name, next(name));
            else
                throw UsageError("unknown argument: '" + word + "'");
            return;
        }
        if (!takes_value(name)) throw UsageError("unknown argument: '" + word + "'");
        valued(name, word.substr(equals + 1));
    }

    static bool takes_value(std::string_view name) {
        for (std::string_view known :
             {"--addressing", "--assume", "--compat", "--hit-group", "--stage", "--scene-profile", "--pipeline",
              "--reflect", "--target-env", "--max-recursion-depth",
              "--max-callable-depth", "--reserved", "--dump-after", "--accuracy"})
            if (name == known) return true;
        return false;
    }

    void valued(const std::string& name, const std::string& value) {
        if (name == "--hit-group") {
            const size_t equals = value.find('=');
            if (equals == std::string::npos || equals == 0)
                throw UsageError("invalid '--hit-group " + value + "': expected NAME=FILE[,FILE...]");
            InputArgument group;
            group.kind = InputArgument::Kind::HitGroup;
            group.name = value.substr(0, equals);
            group.file = value.substr(equals + 1);
            out_.inputs.push_back(std::move(group));
        } else if (name == "--stage") {
            out_.inputs.push_back(parse_stage_argument(value));
        } else if (name == "--pipeline") {
            InputArgument pipeline;
            pipeline.kind = InputArgument::Kind::Pipeline;
            pipeline.file = value;
            out_.inputs.push_back(std::move(pipeline));
        } else if (name == "--assume") {
            if (value.empty()) invalid_value(name, value);
            out_.assume.push_back(value);
        } else if (name == "--scene-profile") {
            if (value.empty()) invalid_value(name, value);
            out_.scene_profiles.push_back(value);
        } else if (name == "--reflect") {
            if (value.empty()) invalid_value(name, value);
            out_.reflect = value;
        } else if (name == "--target-env") {
            if (value == "vulkan1.1")
                out_.target = RTCC_TARGET_VULKAN_1_1;
            else if (value == "vulkan1.2")
                out_.target = RTCC_TARGET_VULKAN_1_2;
            else if (value == "vulkan1.3")
                out_.target = RTCC_TARGET_VULKAN_1_3;
            else
                throw UsageError("invalid value '" + value + "' in '--target-env=" + value +
                                 "': expected vulkan1.1, vulkan1.2 or vulkan1.3");
        } else if (name == "--addressing") {
            if (value != "heap" && value != "address")
                throw UsageError("invalid value '" + value + "' in '--addressing=" + value +
                                 "': expected heap or address");
            out_.addressing = value == "address" ? RTCC_ADDRESSING_ADDRESS : RTCC_ADDRESSING_HEAP;
        } else if (name == "--compat") {
            if (value != "gdc2019")
                throw UsageError("invalid value '" + value + "' in '--compat=" + value + "': expected gdc2019");
            out_.compat = RTCC_COMPAT_GDC2019;
        } else if (name == "--accuracy") {
            out_.accuracy = parse_accuracy(value);
            if (!out_.accuracy)
                throw UsageError("invalid value '" + value + "' in '--accuracy=" + value +
                                 "': expected fast, watertight, exact or exact64");
        } else if (name == "--max-recursion-depth") {
            out_.recursion_depth = number_between(name, value, 1, 31);
        } else if (name == "--max-callable-depth") {
            out_.callable_depth = number_between(name, value, 0, 31);
        } else if (name == "--reserved") {
            reserved(value);
        } else if (name == "--dump-after") {
            if (value.empty()) invalid_value(name, value);
            out_.dump_after = value;
        }
    }

    void reserved(const std::string& value) {
        const size_t dot = value.find('.');
        const auto set = number(std::string_view(value).substr(0, dot));
        const auto binding = dot == std::string::npos ? std::optional<uint32_t>(0)
                                                      : number(std::string_view(value).substr(dot + 1));
        if (!set || !binding || *set > 0x7fffffff)
            throw UsageError("invalid value '" + value + "' in '--reserved=" + value +
                             "': expected SET or SET.BINDING");
        out_.reserved_set = static_cast<int32_t>(*set);
        out_.reserved_binding = *binding;
    }

    void mode(Mode wanted) {
        if (out_.mode == wanted) return;
        // As with a C compiler, -E beats -M beats -c.
        out_.mode = std::max(out_.mode, wanted, [](Mode a, Mode b) { return rank(a) < rank(b); });
    }
    static int rank(Mode mode) {
        return mode == Mode::Link ? 0 : mode == Mode::CompileOnly ? 1 : mode == Mode::Dependencies ? 2 : 3;
    }

    std::string next(std::string_view option) {
        if (at_ + 1 >= words_.size())
            throw UsageError("argument to '" + std::string(option) + "' is missing (expected 1 value)");
        return words_[++at_];
    }

    void add_file(const std::string& file) {
        InputArgument input;
        input.file = file;
        input.stage = stage_;
        input.entry = entry_;
        out_.inputs.push_back(std::move(input));
    }

    void check() const {
        if (out_.help || out_.version) return;
        if (out_.inputs.empty()) throw UsageError("no input files");
        if (out_.format != BinaryFormat::Bin) {
            const char* what =
                out_.format == BinaryFormat::C ? "a C-style initializer list" : "a list of numbers";
            if (out_.mode == Mode::Preprocess)
                throw UsageError(std::string("cannot emit output as ") + what +
                                 " when only preprocessing the source");
            if (out_.mode == Mode::Dependencies)
                throw UsageError(std::string("cannot emit output as ") + what +
                                 " when only listing dependencies");
            if (out_.assembly)
                throw UsageError(std::string("cannot emit output as ") + what + " when emitting assembly");
        }
        const bool any_dependencies = out_.dependency_file || out_.mode == Mode::Dependencies;
        if (!any_dependencies && !out_.dependency_output.empty())
            throw UsageError("'-MF' needs '-M' or '-MD'");
        if (!any_dependencies && !out_.dependency_target.empty())
            throw UsageError("'-MT' needs '-M' or '-MD'");
        if (out_.mode == Mode::CompileOnly && !out_.output.empty() && out_.inputs.size() > 1)
            throw UsageError("cannot specify -o when generating multiple output files");
        for (const InputArgument& input : out_.inputs)
            if (out_.mode != Mode::Link && input.kind == InputArgument::Kind::Pipeline &&
                out_.mode == Mode::CompileOnly)
                throw UsageError("'-c' compiles files, not a --pipeline");
    }

    std::vector<std::string> words_;
    size_t at_ = 0;
    Arguments out_;
    rtcc_stage stage_ = RTCC_STAGE_AUTO;  // what the next files are
    std::optional<std::string> entry_;
};

}  // namespace

std::optional<rtcc_accuracy> parse_accuracy(const std::string& name) {
    for (size_t i = 0; i < std::size(kAccuracies); ++i)
        if (name == kAccuracies[i]) return static_cast<rtcc_accuracy>(i);
    return std::nullopt;
}

const char* accuracy_name(rtcc_accuracy accuracy) {
    return static_cast<size_t>(accuracy) < std::size(kAccuracies) ? kAccuracies[accuracy] : "unknown";
}

InputArgument parse_stage_argument(const std::string& text) {
    const std::string where = "invalid '--stage " + text + "': ";
    const std::string form = "expected NAME=KIND:FILE[:ENTRY][,spec.ID=VALUE...]";
    const size_t equals = text.find('=');
    const size_t colon = text.find(':', equals == std::string::npos ? 0 : equals);
    if (equals == std::string::npos || equals == 0 || colon == std::string::npos)
        throw UsageError(where + form);
    InputArgument stage;
    stage.kind = InputArgument::Kind::Stage;
    stage.name = text.substr(0, equals);
    const std::string kind = text.substr(equals + 1, colon - equals - 1);
    stage.stage = rtcc_stage_from_name(kind.c_str());
    if (stage.stage == RTCC_STAGE_AUTO)
        throw UsageError(where + "'" + kind +
                         "' is no stage: expected rgen, rint, rahit, rchit, rmiss or rcall");

    size_t comma = text.find(',', colon);
    stage.file = text.substr(colon + 1, comma == std::string::npos ? comma : comma - colon - 1);
    const size_t entry = stage.file.rfind(':');
    if (entry != std::string::npos) {
        stage.entry = stage.file.substr(entry + 1);
        stage.file.resize(entry);
    }
    if (stage.file.empty() || (stage.entry && stage.entry->empty())) throw UsageError(where + form);

    while (comma != std::string::npos) {
        const size_t end = text.find(',', comma + 1);
        const std::string item = text.substr(comma + 1, end == std::string::npos ? end : end - comma - 1);
        const size_t value = item.find('=');
        const auto id = starts_with(item, "spec.") && value != std::string::npos
                            ? number(std::string_view(item).substr(5, value - 5))
                            : std::nullopt;
        if (!id || value + 1 == item.size())
            throw UsageError(where + "'" + item + "' is no specialisation: expected spec.ID=VALUE");
        stage.specialization.push_back({*id, item.substr(value + 1)});
        comma = end;
    }
    return stage;
}

Arguments parse_arguments(const std::vector<std::string>& words) { return Parser(words).run(); }

}  // namespace cli
