// Handles that release themselves, and the sources most tests need.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <memory>
#include <string>

#include "rtc/compiler.h"

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

inline std::string shader(const std::string& name) {
    std::ifstream stream(std::string(RTC_SHADERS) + "/" + name, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

inline const std::string kMiss =
    "#version 460\n#extension GL_NV_ray_tracing : require\n"
    "layout(location = 0) rayPayloadInNV vec4 color;\nvoid main() { color = vec4(0.0); }\n";

inline const std::string kRaygen =
    "#version 460\n#extension GL_NV_ray_tracing : require\n"
    "layout(set = 0, binding = 0) uniform accelerationStructureNV scene;\n"
    "layout(set = 0, binding = 1, rgba8) uniform writeonly image2D image;\n"
    "layout(constant_id = 5) const int kIndex = 0;\n"
    "layout(location = 0) rayPayloadNV vec4 color;\n"
    "void main() {\n"
    "    traceNV(scene, 0, 0xff, 0, 0, 0, vec3(0.0), 0.0, vec3(0.0, 0.0, 1.0), 1e9, 0);\n"
    "    imageStore(image, ivec2(gl_LaunchIDNV.xy) + kIndex, color);\n}\n";

inline Result compile_stage(const std::string& source, const char* file,
                            rtcc_const_options_t options = nullptr) {
    Compiler compiler(rtcc_compiler_create());
    return Result(
        rtcc_compile_stage(compiler.get(), RTCC_STAGE_AUTO, file, source.data(), source.size(), options));
}

inline int32_t add(const Pipeline& pipeline, const std::string& source, const char* file,
                   const char* name = nullptr) {
    return rtcc_pipeline_add_glsl(pipeline.get(), RTCC_STAGE_AUTO, name, file, source.data(), source.size());
}

// A ray generation and a miss stage, each its group.
inline Pipeline small_pipeline() {
    Pipeline pipeline(rtcc_pipeline_create());
    rtcc_pipeline_add_general_group(pipeline.get(), nullptr, add(pipeline, kRaygen, "a.rgen"));
    rtcc_pipeline_add_general_group(pipeline.get(), nullptr, add(pipeline, kMiss, "b.rmiss"));
    return pipeline;
}

inline Result compile(const Pipeline& pipeline, rtcc_const_options_t options = nullptr) {
    Compiler compiler(rtcc_compiler_create());
    return Result(rtcc_compile_pipeline(compiler.get(), pipeline.get(), options));
}

inline std::string bytes_of(const Result& result) {
    return {reinterpret_cast<const char*>(rtcc_result_words(result.get())),
            rtcc_result_word_count(result.get()) * 4};
}
