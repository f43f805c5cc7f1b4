#include "cli_fixture.h"

#include <sys/wait.h>
#include <unistd.h>
#include <spirv-tools/libspirv.hpp>

#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>

namespace fs = std::filesystem;

Cli::Cli() {
    std::string pattern = (fs::temp_directory_path() / "rtc-cli-XXXXXX").string();
    if (!mkdtemp(pattern.data())) throw std::runtime_error("no temporary folder");
    folder_ = pattern;
}

Cli::~Cli() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
}

CliRun Cli::rtc(const std::string& arguments, const std::string& standard_input) {
    write(".stdin", standard_input);
    const std::string command =
        "cd '" + folder_.string() + "' && '" RTC_PROGRAM "' " + arguments + " <.stdin >.stdout 2>.stderr";
    const int status = std::system(command.c_str());
    CliRun run;
    run.status = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
    run.out = read(".stdout");
    run.err = read(".stderr");
    return run;
}

CliRun Cli::rtc_in(const std::string& folder, const std::string& arguments) {
    const fs::path outer = folder_;
    folder_ = outer / folder;
    CliRun run = rtc(arguments);
    folder_ = outer;
    return run;
}

void Cli::write(const std::string& name, const std::string& text) const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << text;
}

std::string Cli::read(const std::string& name) const {
    std::ifstream stream(folder_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

bool Cli::exists(const std::string& name) const { return fs::exists(folder_ / name); }

void Cli::copy_shaders(const std::string& dialect, const std::string& folder) const {
    fs::create_directories(folder_ / folder);
    fs::copy(fs::path(RTC_SHADERS) / dialect, folder_ / folder,
             fs::copy_options::overwrite_existing | fs::copy_options::recursive);
}

std::string miss_shader(const std::string& body) {
    return "#version 460\n#extension GL_NV_ray_tracing : require\n"
           "layout(location = 0) rayPayloadInNV vec4 color;\nvoid main() {\n    color = vec4(0.0);\n" +
           body + "}\n";
}

std::string raygen_shader(const std::string& body) {
    return "#version 460\n#extension GL_NV_ray_tracing : require\n"
           "layout(set = 0, binding = 0) uniform accelerationStructureNV scene;\n"
           "layout(set = 0, binding = 1, rgba8) uniform writeonly image2D image;\n"
           "layout(location = 0) rayPayloadNV vec4 color;\n"
           "void main() {\n"
           "    traceNV(scene, 0, 0xff, 0, 0, 0, vec3(0.0), 0.0, vec3(0.0, 0.0, 1.0), 1e9, 0);\n"
           "    imageStore(image, ivec2(gl_LaunchIDNV.xy), color);\n" +
           body + "}\n";
}

std::vector<uint32_t> words_of(const std::string& bytes) {
    std::vector<uint32_t> words(bytes.size() / 4);
    std::memcpy(words.data(), bytes.data(), words.size() * 4);
    return words;
}

bool is_module(const std::string& bytes) {
    const std::vector<uint32_t> words = words_of(bytes);
    return bytes.size() % 4 == 0 && words.size() > 5 && words[0] == 0x07230203;
}

std::string disassembled(const std::string& bytes) {
    std::string text;
    spvtools::SpirvTools(SPV_ENV_UNIVERSAL_1_6)
        .Disassemble(words_of(bytes), &text, SPV_BINARY_TO_TEXT_OPTION_NONE);
    return text;
}

bool is_valid_for(const std::string& bytes, const std::string& environment) {
    const spv_target_env env = environment == "vulkan1.1"   ? SPV_ENV_VULKAN_1_1
                               : environment == "vulkan1.2" ? SPV_ENV_VULKAN_1_2
                                                            : SPV_ENV_VULKAN_1_3;
    return spvtools::SpirvTools(env).Validate(words_of(bytes));
}
