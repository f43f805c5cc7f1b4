#include <glslang/Public/ResourceLimits.h>
#include <glslang/Public/ShaderLang.h>
#include <glslang/SPIRV/GlslangToSpv.h>

#include <charconv>
#include <mutex>

#include "frontend/advice.h"
#include "frontend/compat.h"
#include "frontend/frontend.h"
#include "frontend/includer.h"
#include "frontend/messages.h"
#include "frontend/scan.h"

namespace rtc {
namespace {

// What a stage is parsed for. It follows from the dialect alone and is
// independent of the finished module's target. EXT asks for SPIR-V 1.4
// (SPV_KHR_ray_tracing, issue 1); below 1.5 glslang still writes the OpExtension
// strings that a downgrade would otherwise have to add.
enum class Environment { Nv, Ext };

void initialize_glslang() {
    static std::once_flag once;
    std::call_once(once, [] { glslang::InitializeProcess(); });
}

EShLanguage glslang_stage(StageKind kind) {
    switch (kind) {
        case StageKind::RayGen:
            return EShLangRayGen;
        case StageKind::Intersection:
            return EShLangIntersect;
        case StageKind::AnyHit:
            return EShLangAnyHit;
        case StageKind::ClosestHit:
            return EShLangClosestHit;
        case StageKind::Miss:
            return EShLangMiss;
        case StageKind::Callable:
            return EShLangCallable;
    }
    return EShLangRayGen;
}

void report(FrontendResult& result, const char* id, const std::string& file, uint32_t line,
            std::string text) {
    result.diagnostics.push_back({Severity::Error, id, file, line, std::move(text)});
}

// `assumed` is an extension that the source should have asked for.
std::string preamble_for(const FrontendOptions& options, const std::string& assumed) {
    std::string preamble = "#extension GL_GOOGLE_include_directive : enable\n";
    if (!assumed.empty()) preamble += "#extension " + assumed + " : enable\n";
    for (const Macro& macro : options.macros)
        preamble +=
            macro.value ? "#define " + macro.name + " " + *macro.value + "\n" : "#undef " + macro.name + "\n";
    return preamble;
}

const TBuiltInResource& limits() {
    static const TBuiltInResource resources = [] {
        TBuiltInResource r = *GetDefaultResources();
        // Vulkan has no such limit; the default (from OpenGL ES) is no statement about a device.
        r.maxCombinedTextureImageUnits = 1 << 16;
        return r;
    }();
    return resources;
}

struct Version {
    int number = 460;
    EProfile profile = ECoreProfile;
    bool forced = false;
};

// glslang wants 460 for ray tracing and, given less, may fail in its own built-ins
// (and print them); so versions are judged here, and a wrong one is parsed as 460
// for the sake of the messages that follow.
bool chosen_version(const GlslSource& source, const SourceFacts& facts, const FrontendOptions& options,
                    Version& version, FrontendResult& result) {
    int number = facts.version;
    std::string profile = facts.profile;
    uint32_t line = facts.version_line;
    if (!options.glsl_version.empty()) {
        if (!parse_glsl_version(options.glsl_version, number, profile)) {
            report(result, "std-unknown", source.file, 0,
                   "invalid GLSL version '" + options.glsl_version + "'");
            return false;
        }
        version.forced = true;
        line = 0;
    }
    if (number == 0) {
        report(result, "version-missing", source.file, 1, "no #version; begin the shader with #version 460");
        return false;
    }
    if (number < 460 || (!profile.empty() && profile != "core")) {
        report(result, "version-unsupported", source.file, line,
               "#version " + std::to_string(number) + (profile.empty() ? "" : " " + profile) +
                   ": ray tracing shaders need #version 460 (core profile)");
        version.forced = true;
        return false;
    }
    return true;
}

constexpr EShMessages kMessages =
    static_cast<EShMessages>(EShMsgSpvRules | EShMsgVulkanRules | EShMsgCascadingErrors);

void set_environment(glslang::TShader& shader, EShLanguage stage, Environment environment) {
    const bool ext = environment == Environment::Ext;
    shader.setEnvInput(glslang::EShSourceGlsl, stage, glslang::EShClientVulkan, 100);
    shader.setEnvClient(glslang::EShClientVulkan,
                        ext ? glslang::EShTargetVulkan_1_2 : glslang::EShTargetVulkan_1_1);
    shader.setEnvTarget(glslang::EShTargetSpv, ext ? glslang::EShTargetSpv_1_4 : glslang::EShTargetSpv_1_3);
}

// Keeps the pointers that TShader::setStrings… stores alive as long as the shader.
struct ShaderText {
    ShaderText(const GlslSource& source, const FrontendOptions& options, const std::string& assumed = {})
        : preamble(preamble_for(options, assumed)),
          text(source.text.c_str()),
          length(static_cast<int>(source.text.size())),
          name(source.file.c_str()) {}
    void give_to(glslang::TShader& shader) {
        shader.setStringsWithLengthsAndNames(&text, &length, &name, 1);
        shader.setPreamble(preamble.c_str());
    }
    std::string preamble;
    const char* text;
    int length;
    const char* name;
};

void remember_dependencies(const GlslSource& source, const SourceIncluder& includer, FrontendResult& result) {
    result.dependencies.assign(1, source.file);
    result.dependencies.insert(result.dependencies.end(), includer.files().begin(), includer.files().end());
}

struct Attempt {
    FrontendResult result;
    bool wants_ext = false;  // an include, or glslang, says that this needs the EXT environment
};

bool preprocess(const GlslSource& source, const SourceFacts& facts, const FrontendOptions& options,
                StageKind kind, Environment environment, FrontendResult& result, bool& wants_ext) {
    initialize_glslang();
    Version version;
    chosen_version(source, facts, options, version, result);
    const EShLanguage stage = glslang_stage(kind);
    ShaderText text(source, options);
    SourceIncluder includer(options);
    glslang::TShader shader(stage);
    text.give_to(shader);
    set_environment(shader, stage, environment);
    const auto messages = static_cast<EShMessages>(kMessages | EShMsgOnlyPreprocessor);
    const bool ok = shader.preprocess(&limits(), version.number, version.profile, version.forced, false,
                                      messages, &result.text, includer);
    parse_glslang_log(shader.getInfoLog(), source.file, result.diagnostics);
    remember_dependencies(source, includer, result);
    wants_ext = includer.names_ext();
    return ok && !has_errors(result.diagnostics);
}

Attempt compile(const GlslSource& source, const SourceFacts& facts, const FrontendOptions& options,
                StageKind kind, Environment environment, const std::string& assumed = {}) {
    initialize_glslang();
    Attempt attempt;
    FrontendResult& result = attempt.result;
    result.kind = kind;
    Version version;
    const bool version_ok = chosen_version(source, facts, options, version, result);

    if (!assumed.empty())
        report(result, "extension-missing", source.file, 1,
               "no #extension; write #extension " + assumed + " : require");

    const EShLanguage stage = glslang_stage(kind);
    ShaderText text(source, options, assumed);
    SourceIncluder includer(options);
    glslang::TShader shader(stage);
    text.give_to(shader);
    shader.setEntryPoint("main");
    set_environment(shader, stage, environment);
    auto messages = kMessages;
    if (options.debug_info) messages = static_cast<EShMessages>(messages | EShMsgDebugInfo);
    const bool parsed =
        shader.parse(&limits(), version.number, version.profile, version.forced, false, messages, includer);
    parse_glslang_log(shader.getInfoLog(), source.file, result.diagnostics);
    remember_dependencies(source, includer, result);
    attempt.wants_ext = includer.names_ext();
    bool linked = false;
    glslang::TProgram program;
    if (parsed) {
        program.addShader(&shader);
        linked = program.link(messages);
        parse_glslang_log(program.getInfoLog(), source.file, result.diagnostics);
    }
    if (!parsed || !linked || !version_ok || !assumed.empty()) {
        for (const Diagnostic& message : result.diagnostics)
            attempt.wants_ext |=
                message.text.find("not supported for current targeted SPIR-V") != std::string::npos;
        add_advice(source.file, source.text, result.diagnostics);
        if (!has_errors(result.diagnostics))
            report(result, "glsl-error", source.file, 0, "the GLSL front end failed without a message");
        return attempt;
    }

    glslang::SpvOptions spv_options;
    spv_options.generateDebugInfo = options.debug_info;
    spv::SpvBuildLogger logger;
    glslang::GlslangToSpv(*program.getIntermediate(stage), result.spirv, &logger, &spv_options);
    parse_glslang_log(logger.getAllMessages(), source.file, result.diagnostics);
    result.ok = !result.spirv.empty() && !has_errors(result.diagnostics);
    return attempt;
}

// The stage: said by the caller, by a pragma, or by the file's extension.
bool find_stage(const GlslSource& source, const SourceFacts& facts, StageKind& kind, FrontendResult& result) {
    if (source.kind) {
        kind = *source.kind;
        return true;
    }
    if (!facts.stage_pragmas.empty()) {
        const StagePragma& first = facts.stage_pragmas.front();
        for (const StagePragma& pragma : facts.stage_pragmas) {
            if (pragma.name == first.name) continue;
            report(result, "shader-stage-conflict", source.file, pragma.line,
                   "'#pragma shader_stage(" + pragma.name + ")' conflicts with an earlier 'shader_stage(" +
                       first.name + ")' in line " + std::to_string(first.line));
            return false;
        }
        const auto named = stage_kind_from_name(first.name);
        if (!named) {
            report(
                result, "shader-stage-unknown", source.file, first.line,
                "'#pragma shader_stage(" + first.name +
                    ")' names no ray tracing stage: expected raygen, intersection, anyhit, closesthit, miss "
                    "or callable");
            return false;
        }
        kind = *named;
        return true;
    }
    const auto from_file = stage_kind_from_file(source.file);
    if (!from_file) {
        report(result, "shader-stage-unknown", source.file, 0,
               "cannot tell the shader stage: no file extension .rgen, .rint, .rahit, .rchit, .rmiss or "
               ".rcall, no "
               "#pragma shader_stage, no -fshader-stage");
        return false;
    }
    kind = *from_file;
    return true;
}

// Sources that name both dialects choose by #if; only the preprocessor knows.
Environment find_environment(const GlslSource& source, const FrontendOptions& options, StageKind kind,
                             const SourceFacts& facts) {
    if (!facts.names_ext) return Environment::Nv;
    if (!facts.names_nv) return Environment::Ext;
    FrontendResult preprocessed;
    bool ignored = false;
    if (!preprocess(source, facts, options, kind, Environment::Ext, preprocessed, ignored))
        return Environment::Ext;
    return scan_source(preprocessed.text).names_ext ? Environment::Ext : Environment::Nv;
}

// glslang echoes our preamble's own directive; it is no part of the user's text.
void drop_preamble(std::string& text) {
    const std::string_view line = "#extension GL_GOOGLE_include_directive : enable";
    const size_t at = text.find(line);
    if (at == std::string::npos || text.substr(0, at).find_first_not_of(" \t\r\n") != std::string::npos)
        return;
    size_t end = at + line.size();
    if (end < text.size() && text[end] == '\n') ++end;
    text.erase(0, end);
}

}  // namespace

std::optional<StageKind> stage_kind_from_name(std::string_view name) {
    if (name == "rgen" || name == "raygen") return StageKind::RayGen;
    if (name == "rint" || name == "intersection") return StageKind::Intersection;
    if (name == "rahit" || name == "anyhit") return StageKind::AnyHit;
    if (name == "rchit" || name == "closesthit" || name == "closest") return StageKind::ClosestHit;
    if (name == "rmiss" || name == "miss") return StageKind::Miss;
    if (name == "rcall" || name == "callable") return StageKind::Callable;
    return std::nullopt;
}

std::optional<StageKind> stage_kind_from_file(std::string_view file) {
    const size_t slash = file.find_last_of("/\\");
    if (slash != std::string_view::npos) file.remove_prefix(slash + 1);
    // "shadow.rmiss.glsl" is an rmiss, as glslangValidator has it.
    for (std::string_view suffix : {".glsl"})
        if (file.size() > suffix.size() && file.substr(file.size() - suffix.size()) == suffix)
            file.remove_suffix(suffix.size());
    const size_t dot = file.rfind('.');
    if (dot == std::string_view::npos) return std::nullopt;
    const std::string_view extension = file.substr(dot + 1);
    for (const char* known : {"rgen", "rint", "rahit", "rchit", "rmiss", "rcall"})
        if (extension == known) return stage_kind_from_name(known);
    return std::nullopt;
}

std::optional<StageKind> stage_kind_from_source(const std::string& file, const std::string& text) {
    FrontendResult ignored;
    StageKind kind;
    if (!find_stage({std::nullopt, file, {}}, scan_source(text), kind, ignored)) return std::nullopt;
    return kind;
}

bool parse_glsl_version(std::string_view text, int& version, std::string& profile) {
    const auto parsed = std::from_chars(text.data(), text.data() + text.size(), version);
    if (parsed.ec != std::errc()) return false;
    profile = std::string(parsed.ptr, text.data() + text.size());
    constexpr int known[] = {100, 110, 120, 130, 140, 150, 300, 310, 320,
                             330, 400, 410, 420, 430, 440, 450, 460};
    bool found = false;
    for (int number : known) found |= number == version;
    return found && (profile.empty() || profile == "core" || profile == "compatibility" || profile == "es");
}

std::string glslang_version() {
    const glslang::Version version = glslang::GetVersion();
    return std::to_string(version.major) + "." + std::to_string(version.minor) + "." +
           std::to_string(version.patch);
}

FrontendResult compile_glsl(const GlslSource& original, const FrontendOptions& options) {
    GlslSource source = original;
    if (options.gdc2019) source.text = translate_gdc2019(source.text);
    const SourceFacts facts = scan_source(source.text);
    FrontendResult result;
    StageKind kind;
    if (!find_stage(source, facts, kind, result)) {
        result.dependencies.push_back(source.file);
        return result;
    }
    const Environment environment = find_environment(source, options, kind, facts);
    Attempt attempt = compile(source, facts, options, kind, environment);
    if (environment == Environment::Nv && !facts.names_nv && attempt.wants_ext)
        attempt = compile(source, facts, options, kind, Environment::Ext);
    else if (environment == Environment::Nv && !attempt.result.ok && attempt.wants_ext) {
        // An NV shader with a feature of later SPIR-V: the newer environment parses NV too.
        Attempt second = compile(source, facts, options, kind, Environment::Ext);
        if (second.result.ok) attempt = std::move(second);
    }
    // Without the extension the first of its words ends the parse; with it, the messages say all at once.
    if (!attempt.result.ok && !facts.names_nv && !facts.names_ext && !attempt.wants_ext) {
        const std::string missing = extension_used(source.text);
        if (!missing.empty())
            attempt = compile(source, facts, options, kind,
                              missing == "GL_NV_ray_tracing" ? Environment::Nv : Environment::Ext, missing);
    }
    return std::move(attempt.result);
}

FrontendResult preprocess_glsl(const GlslSource& original, const FrontendOptions& options) {
    GlslSource source = original;
    if (options.gdc2019) source.text = translate_gdc2019(source.text);
    const SourceFacts facts = scan_source(source.text);
    FrontendResult result;
    StageKind kind = StageKind::RayGen;
    if (!find_stage(source, facts, kind, result)) {
        result.dependencies.push_back(source.file);
        return result;
    }
    bool wants_ext = false;
    const bool ext = facts.names_ext;
    result.ok =
        preprocess(source, facts, options, kind, ext ? Environment::Ext : Environment::Nv, result, wants_ext);
    if (!ext && wants_ext) {
        result = {};
        result.ok = preprocess(source, facts, options, kind, Environment::Ext, result, wants_ext);
    }
    result.kind = kind;
    drop_preamble(result.text);
    if (!result.ok) add_advice(source.file, source.text, result.diagnostics);
    return result;
}

}  // namespace rtc
