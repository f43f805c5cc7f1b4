#include "glsl.h"

#include <glslang/Public/ResourceLimits.h>
#include <glslang/Public/ShaderLang.h>
#include <glslang/SPIRV/GlslangToSpv.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <regex>
#include <sstream>

#include "../common/error.h"

namespace rtc::native {
namespace {

using tools::Error;
using tools::JobStage;

EShLanguage language(JobStage stage) {
    switch (stage) {
        case JobStage::RayGen:
            return EShLangRayGen;
        case JobStage::Intersection:
            return EShLangIntersect;
        case JobStage::AnyHit:
            return EShLangAnyHit;
        case JobStage::ClosestHit:
            return EShLangClosestHit;
        case JobStage::Miss:
            return EShLangMiss;
        case JobStage::Callable:
            return EShLangCallable;
    }
    return EShLangRayGen;
}

class Includer final : public glslang::TShader::Includer {
  public:
    Includer(std::string file, const std::vector<std::string>& dirs) : file_(std::move(file)), dirs_(dirs) {}
    IncludeResult* includeLocal(const char* name, const char* from, size_t) override {
        std::filesystem::path base(from && *from ? from : file_.c_str());
        if (IncludeResult* found = open(base.parent_path() / name)) return found;
        return includeSystem(name, from, 0);
    }
    IncludeResult* includeSystem(const char* name, const char*, size_t) override {
        for (const std::string& dir : dirs_)
            if (IncludeResult* found = open(std::filesystem::path(dir) / name)) return found;
        return nullptr;
    }
    void releaseInclude(IncludeResult* result) override {
        if (!result) return;
        delete static_cast<std::string*>(result->userData);
        delete result;
    }

  private:
    IncludeResult* open(const std::filesystem::path& path) {
        std::ifstream in(path, std::ios::binary);
        if (!in) return nullptr;
        std::ostringstream text;
        text << in.rdbuf();
        auto* content = new std::string(to_ext_ ? native::to_ext(text.str()) : text.str());
        return new IncludeResult(path.string(), content->data(), content->size(), content);
    }
    std::string file_;
    const std::vector<std::string>& dirs_;

  public:
    bool to_ext_ = false;
};

}  // namespace

bool is_nv(const std::string& glsl) {
    static const std::regex extension(R"(#\s*extension\s+GL_NV_ray_tracing\b)");
    return std::regex_search(glsl, extension);
}

std::string to_ext(const std::string& glsl) {
    static const std::pair<std::regex, const char*> rules[] = {
        {std::regex(R"(\bGL_NV_ray_tracing\b)"), "GL_EXT_ray_tracing"},
        {std::regex(R"(\btraceNV\b)"), "traceRayEXT"},
        {std::regex(R"(\b(ignoreIntersection|terminateRay)NV\s*\(\s*\))"), "$1EXT"},
        {std::regex(
             R"(\b(gl_\w+?|rayPayload|rayPayloadIn|hitAttribute|callableData|callableDataIn|shaderRecord|)"
             R"(accelerationStructure|reportIntersection|executeCallable)NV\b)"),
         "$1EXT"},
    };
    std::string text = glsl;
    for (const auto& [from, to] : rules) text = std::regex_replace(text, from, to);
    return text;
}

std::vector<uint32_t> compile_glsl(const GlslSource& source) {
    static std::once_flag once;
    std::call_once(once, [] { glslang::InitializeProcess(); });
    EShLanguage stage = language(source.stage);
    bool nv = is_nv(source.text);
    glslang::TShader shader(stage);
    const char* text = source.text.c_str();
    int length = int(source.text.size());
    const char* name = source.file.c_str();
    shader.setStringsWithLengthsAndNames(&text, &length, &name, 1);
    std::string preamble;
    for (const std::string& define : source.defines) {
        size_t equals = define.find('=');
        preamble +=
            "#define " +
            (equals == std::string::npos ? define
                                         : define.substr(0, equals) + " " + define.substr(equals + 1)) +
            "\n";
    }
    shader.setPreamble(preamble.c_str());
    shader.setEnvInput(glslang::EShSourceGlsl, stage, glslang::EShClientVulkan, 100);
    shader.setEnvClient(glslang::EShClientVulkan,
                        nv ? glslang::EShTargetVulkan_1_1 : glslang::EShTargetVulkan_1_2);
    shader.setEnvTarget(glslang::EShTargetSpv, nv ? glslang::EShTargetSpv_1_3 : glslang::EShTargetSpv_1_4);
    auto messages = EShMessages(EShMsgSpvRules | EShMsgVulkanRules);
    Includer includer(source.file, source.include_dirs);
    includer.to_ext_ = !nv;
    glslang::TProgram program;
    if (!shader.parse(GetDefaultResources(), 460, false, messages, includer))
        throw Error(source.file + ":\n" + shader.getInfoLog());
    program.addShader(&shader);
    if (!program.link(messages)) throw Error(source.file + ":\n" + program.getInfoLog());
    std::vector<uint32_t> words;
    glslang::SpvOptions options;
    options.disableOptimizer = true;
    options.generateDebugInfo = source.debug_info;
    spv::SpvBuildLogger logger;
    glslang::GlslangToSpv(*program.getIntermediate(stage), words, &logger, &options);
    if (words.empty()) throw Error(source.file + ": no SPIR-V was generated\n" + logger.getAllMessages());
    return words;
}

const char* stage_suffix(JobStage stage) {
    static const char* const names[] = {"rgen", "rint", "rahit", "rchit", "rmiss", "rcall"};
    return names[uint32_t(stage)];
}

bool stage_of_suffix(const std::string& suffix, JobStage& stage) {
    for (JobStage s : {JobStage::RayGen, JobStage::Intersection, JobStage::AnyHit, JobStage::ClosestHit,
                       JobStage::Miss, JobStage::Callable})
        if (suffix == stage_suffix(s)) {
            stage = s;
            return true;
        }
    return false;
}

bool stage_of_file(const std::string& path, JobStage& stage) {
    std::filesystem::path name = std::filesystem::path(path).filename();
    if (name.extension() == ".glsl" || name.extension() == ".spv" || name.extension() == ".spvasm")
        name = name.stem();
    std::string extension = name.extension().string();
    return !extension.empty() && stage_of_suffix(extension.substr(1), stage);
}

std::string read_text(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    if (!in) throw Error("cannot read '" + path + "'");
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
}

std::vector<uint32_t> read_words(const std::string& path) {
    std::string bytes = read_text(path);
    std::vector<uint32_t> words(bytes.size() / 4);
    std::memcpy(words.data(), bytes.data(), words.size() * 4);
    if (bytes.size() % 4 || words.size() < 5 || words[0] != 0x07230203u)
        throw Error("'" + path + "' is not a SPIR-V module");
    return words;
}

}  // namespace rtc::native
