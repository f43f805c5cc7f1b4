// The front end: one GLSL ray tracing stage in, one SPIR-V module out. It knows
// glslang and nothing below it; the core knows SPIR-V and nothing of GLSL.
// Everything here is thread-safe: no state outlives a call except glslang's own
// process-wide symbol tables, which are initialised once.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline.h"

namespace rtc {

// A -D or -U, applied in the order given.
struct Macro {
    std::string name;
    std::optional<std::string> value;  // nullopt: undefine
};

struct IncludeRequest {
    std::string name;      // as written between the quotes or brackets
    std::string includer;  // resolved name of the including source
    bool local = true;     // "name" (true) or <name>
    size_t depth = 0;
};

struct IncludeAnswer {
    bool ok = false;
    std::string name;  // resolved name: identity, diagnostics and dependencies use it
    std::string text;  // the source, or why it was not found
};

// Called once for each #include; must be safe to call from the compiling thread.
using IncludeCallback = std::function<IncludeAnswer(const IncludeRequest&)>;

struct FrontendOptions {
    std::vector<Macro> macros;
    std::vector<std::string> include_directories;
    IncludeCallback include;   // when empty: the file system
    std::string glsl_version;  // "460", "460core": overrides #version (-std=)
    bool debug_info = true;    // OpLine, OpSource with text
    bool gdc2019 = false;      // accept spellings of 2019 (compat.h); included files are taken as they are
};

struct GlslSource {
    std::optional<StageKind> kind;  // absent: from #pragma shader_stage, then the file's extension
    std::string file;               // name in messages; its folder is searched first by #include "…"
    std::string text;
};

struct FrontendResult {
    bool ok = false;
    StageKind kind = StageKind::RayGen;
    std::vector<uint32_t> spirv;
    std::string text;                       // preprocess_glsl's output
    std::vector<std::string> dependencies;  // the file, then every included one, each once
    std::vector<Diagnostic> diagnostics;
};

FrontendResult compile_glsl(const GlslSource& source, const FrontendOptions& options);
FrontendResult preprocess_glsl(const GlslSource& source, const FrontendOptions& options);

// "rgen" … "rcall"; accepts the long spellings of #pragma shader_stage as well.
std::optional<StageKind> stage_kind_from_name(std::string_view name);
std::optional<StageKind> stage_kind_from_file(std::string_view file);
// What a GlslSource without a kind is taken for; absent when that is an error.
std::optional<StageKind> stage_kind_from_source(const std::string& file, const std::string& text);
// Splits "460core"; false when it is no GLSL version and profile.
bool parse_glsl_version(std::string_view text, int& version, std::string& profile);
std::string glslang_version();

// ---- SPIR-V, seen from outside --------------------------------------------------

struct EntryPointInfo {
    uint32_t model = 0;
    std::optional<StageKind> kind;  // absent for non ray tracing models
    std::string name;
};

struct SpecConstantInfo {
    uint32_t spec_id = 0;
    enum class Type { Bool, Int, Uint, Float, Unknown } type = Type::Unknown;
    uint32_t width = 32;
};

struct SpirvInfo {
    std::string error;  // not empty: malformed, and the rest means nothing
    uint32_t version = 0;
    std::vector<EntryPointInfo> entry_points;
    std::vector<SpecConstantInfo> spec_constants;
};

bool looks_like_spirv(const void* bytes, size_t size);
// Bytes of either endianness to words in ours; false (with why) when they are no whole module.
bool spirv_from_bytes(const void* bytes, size_t size, std::vector<uint32_t>& words, std::string& error);
SpirvInfo inspect_spirv(const std::vector<uint32_t>& words);
// Text ("7", "-1", "0x10", "1.5", "true") to the bit pattern a constant of that type has.
bool spec_value_from_text(const SpecConstantInfo& constant, std::string_view text, uint64_t& bits,
                          std::string& error);

}  // namespace rtc
