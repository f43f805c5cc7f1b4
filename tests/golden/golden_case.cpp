#include "golden_case.h"

#include <algorithm>
#include <fstream>
#include <sstream>

#include "spirv-tools/libspirv.hpp"

namespace rtc::test {
namespace {

namespace fs = std::filesystem;

StageKind stage_kind(const std::string& word) {
    for (StageKind kind : {StageKind::RayGen, StageKind::Intersection, StageKind::AnyHit, StageKind::ClosestHit,
                           StageKind::Miss, StageKind::Callable})
        if (word == stage_kind_name(kind)) return kind;
    throw GoldenError("unknown stage kind '" + word + "'");
}

int stage_index(const PipelineInput& input, const std::string& name) {
    for (size_t i = 0; i < input.stages.size(); ++i)
        if (input.stages[i].name == name) return static_cast<int>(i);
    throw GoldenError("no stage is named '" + name + "'");
}

StageInput read_stage(std::istringstream& words, const fs::path& folder) {
    StageInput stage;
    std::string kind, file, more;
    words >> kind >> stage.name >> file;
    stage.kind = stage_kind(kind);
    if (size_t colon = file.find(':'); colon != std::string::npos) {
        stage.entry = file.substr(colon + 1);
        file.resize(colon);
    }
    stage.file = file;
    stage.spirv = assemble_file(folder / (file + ".spvasm"));
    while (words >> more) {
        unsigned id = 0;
        unsigned long long value = 0;
        if (std::sscanf(more.c_str(), "spec.%u=%llu", &id, &value) != 2)
            throw GoldenError("cannot read '" + more + "'");
        stage.specialization.push_back({id, value});
    }
    return stage;
}

GroupInput read_group(std::istringstream& words, const PipelineInput& input) {
    GroupInput group;
    std::string kind, member;
    words >> kind >> group.name;
    if (kind == "general") {
        group.general = stage_index(input, group.name);
        return group;
    }
    if (kind != "triangles" && kind != "procedural") throw GoldenError("unknown group kind '" + kind + "'");
    group.kind = kind == "triangles" ? GroupKind::Triangles : GroupKind::Procedural;
    while (words >> member) {
        const size_t equals = member.find('=');
        const std::string role = member.substr(0, equals);
        const int stage = stage_index(input, equals == std::string::npos ? "" : member.substr(equals + 1));
        if (role == "closest-hit") {
            group.closest_hit = stage;
        } else if (role == "any-hit") {
            group.any_hit = stage;
        } else if (role == "intersection") {
            group.intersection = stage;
        } else {
            throw GoldenError("unknown member '" + member + "'");
        }
    }
    return group;
}

void read_option(std::istringstream& words, LinkOptions& options) {
    std::string name;
    long value = 0;
    words >> name;
    if (name == "assume") {
        std::string list, one;
        words >> list;
        for (std::istringstream names(list); std::getline(names, one, ',');) {
            uint32_t bit = 0;
            if (!assumption_from_name(one, bit)) throw GoldenError("no assumption is named '" + one + "'");
            options.assumptions |= bit;
        }
        return;
    }
    if (!(words >> value)) throw GoldenError("an option needs a name and a number");
    if (name == "max-recursion-depth") {
        options.max_recursion_depth = static_cast<uint32_t>(value);
    } else if (name == "max-callable-depth") {
        options.max_callable_depth = static_cast<uint32_t>(value);
    } else if (name == "reserved-set") {
        options.reserved_set = static_cast<int32_t>(value);
    } else if (name == "optimize") {
        options.optimize = value ? Optimization::Performance : Optimization::None;
    } else if (name == "resumable") {
        options.resumable = value != 0;
    } else if (name == "specialize") {
        options.specialize = value != 0;
    } else if (name == "debug-info") {
        options.debug_info = value != 0;
    } else {
        throw GoldenError("unknown option '" + name + "'");
    }
}

}  // namespace

std::string read_text(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    if (!in) throw GoldenError("cannot read " + file.string());
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
}

std::vector<uint32_t> assemble_file(const fs::path& spvasm) {
    const std::string text = read_text(spvasm);
    // The assembler writes its environment's version into the header; the set's own stands in the comment.
    unsigned major = 1, minor = 3;
    if (size_t at = text.find("; Version: "); at != std::string::npos)
        std::sscanf(text.c_str() + at, "; Version: %u.%u", &major, &minor);
    constexpr spv_target_env kByMinor[] = {SPV_ENV_UNIVERSAL_1_0, SPV_ENV_UNIVERSAL_1_1, SPV_ENV_UNIVERSAL_1_2,
                                           SPV_ENV_UNIVERSAL_1_3, SPV_ENV_UNIVERSAL_1_4, SPV_ENV_UNIVERSAL_1_5,
                                           SPV_ENV_UNIVERSAL_1_6};
    if (major != 1 || minor > 6) throw GoldenError(spvasm.string() + ": unknown SPIR-V version");
    spvtools::SpirvTools tools(kByMinor[minor]);
    std::string message;
    tools.SetMessageConsumer([&](spv_message_level_t, const char*, const spv_position_t& at, const char* what) {
        message += "\n  " + std::to_string(at.line + 1) + ": " + what;
    });
    std::vector<uint32_t> words;
    if (!tools.Assemble(text, &words)) throw GoldenError(spvasm.string() + " does not assemble:" + message);
    return words;
}

GoldenCase read_golden_case(const fs::path& folder) {
    GoldenCase golden;
    golden.name = folder.filename().string();
    std::istringstream lines(read_text(folder / "command"));
    std::string line;
    for (int number = 1; std::getline(lines, line); ++number) {
        line = line.substr(0, line.find('#'));
        std::istringstream words(line);
        std::string item;
        if (!(words >> item)) continue;
        try {
            if (item == "stage") {
                golden.input.stages.push_back(read_stage(words, folder));
            } else if (item == "group") {
                golden.input.groups.push_back(read_group(words, golden.input));
            } else if (item == "option") {
                read_option(words, golden.options);
            } else if (item == "dump") {
                words >> golden.options.stop_after;
            } else {
                throw GoldenError("unknown item '" + item + "'");
            }
        } catch (const GoldenError& error) {
            throw GoldenError((folder / "command").string() + ":" + std::to_string(number) + ": " + error.what());
        }
    }
    return golden;
}

std::vector<fs::path> golden_folders(const fs::path& root) {
    std::vector<fs::path> folders;
    for (const auto& entry : fs::directory_iterator(root))
        if (fs::exists(entry.path() / "command")) folders.push_back(entry.path());
    std::sort(folders.begin(), folders.end());
    return folders;
}

std::string golden_text(const LinkResult& result, bool whole_module) {
    std::string text;
    for (const Diagnostic& d : result.diagnostics) {
        text += d.severity == Severity::Error ? "; error " : "; warning ";
        text += d.id + ": " + d.file + (d.line ? ":" + std::to_string(d.line) : "") + ": " + d.text + "\n";
    }
    text += whole_module ? result.dump : canonical_text(result.dump);
    if (!text.empty() && text.back() != '\n') text += '\n';
    return text;
}

}  // namespace rtc::test
