// GLSL to SPIR-V for the native executors, and the NV dialect rewritten as EXT,
// so that one source runs on both extensions.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "../common/ray_tracing_job.h"

namespace rtc::native {

// GL_NV_ray_tracing spellings become those of GL_EXT_ray_tracing; EXT sources come back unchanged.
std::string to_ext(const std::string& glsl);
bool is_nv(const std::string& glsl);

struct GlslSource {
    std::string text;
    std::string file;  // for messages and for relative #include
    tools::JobStage stage = tools::JobStage::RayGen;
    std::vector<std::string> defines;  // "NAME" or "NAME=VALUE"
    std::vector<std::string> include_dirs;
    bool debug_info = false;
};

// SPIR-V 1.3 for NV sources, 1.4 for EXT ones. Throws tools::Error with the compiler's messages.
std::vector<uint32_t> compile_glsl(const GlslSource& source);

const char* stage_suffix(tools::JobStage stage);  // "rgen", "rint", ...
// By file name: a.rgen, a.rgen.glsl; false when the name tells nothing.
bool stage_of_file(const std::string& path, tools::JobStage& stage);
bool stage_of_suffix(const std::string& suffix, tools::JobStage& stage);  // "rgen"
std::string read_text(const std::string& path);
std::vector<uint32_t> read_words(const std::string& path);  // SPIR-V; throws unless it looks like it

}  // namespace rtc::native
