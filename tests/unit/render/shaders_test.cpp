// The shaders that come with rtc: they compile in both dialects, and the seed's printed ones fail with
// advice.
#include <gtest/gtest.h>
#include <rtc/compiler.h>

#include <algorithm>
#include <filesystem>
#include <memory>

#include "rtc_compile.h"

namespace rtc::tools {
namespace {

namespace fs = std::filesystem;

struct Outcome {
    rtcc_status status;
    std::string messages;
};

Outcome compile(const fs::path& file, const std::string& source) {
    rtcc_compiler_t compiler = rtcc_compiler_create();
    rtcc_result_t result =
        rtcc_compile_stage(compiler, RTCC_STAGE_AUTO, file.c_str(), source.data(), source.size(), nullptr);
    Outcome outcome{rtcc_result_status(result), rtcc_result_messages(result)};
    rtcc_result_release(result);
    rtcc_compiler_release(compiler);
    return outcome;
}

Outcome compile(const fs::path& file) { return compile(file, read_text_file(file.string())); }

std::vector<fs::path> stages_in(const fs::path& folder) {
    std::vector<fs::path> files;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder))
        if (entry.is_regular_file() && rtcc_stage_from_file_name(entry.path().c_str()) != RTCC_STAGE_AUTO)
            files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
}

TEST(Shaders, OrdinaryOnesCompileInBothDialects) {
    const fs::path folder = fs::path(RTC_TESTDATA) / "shaders/render";
    const std::vector<fs::path> nv = stages_in(folder), ext = stages_in(folder / "ext");
    ASSERT_GE(nv.size(), 9u);
    ASSERT_EQ(nv.size(), ext.size()) << "run tools/render/make-ext-twins";
    for (size_t i = 0; i < nv.size(); ++i) {
        EXPECT_EQ(nv[i].filename(), ext[i].filename());
        for (const fs::path& file : {nv[i], ext[i]}) {
            const Outcome outcome = compile(file);
            EXPECT_EQ(outcome.status, RTCC_STATUS_SUCCESS) << outcome.messages;
        }
    }
}

TEST(Shaders, TheSeedsCorrectedOnesCompile) {
    for (const fs::path& file : stages_in(fs::path(RTC_TESTDATA) / "shaders/seed/corrected")) {
        const Outcome outcome = compile(file);
        EXPECT_EQ(outcome.status, RTCC_STATUS_SUCCESS) << outcome.messages;
    }
}

// glslang stops at the first syntax error, so the printed text is mended step by step; at each step the
// next message must name the replacement.
struct Mend {
    const char *advice, *from, *to;
};

void mend_until_it_compiles(const char* name, const std::vector<Mend>& mends) {
    const fs::path file = fs::path(RTC_TESTDATA) / "shaders/seed/printed" / name;
    std::string source = read_text_file(file.string());
    for (const Mend& mend : mends) {
        const Outcome outcome = compile(file, source);
        EXPECT_EQ(outcome.status, RTCC_STATUS_COMPILATION_ERROR);
        EXPECT_NE(outcome.messages.find(mend.advice), std::string::npos)
            << "expected advice: " << mend.advice << "\n"
            << outcome.messages;
        size_t place = *mend.from ? source.find(mend.from) : 0;
        ASSERT_NE(place, std::string::npos) << mend.from;
        for (; place != std::string::npos;
             place = *mend.from ? source.find(mend.from, place + std::string(mend.to).size())
                                : std::string::npos)
            source.replace(place, std::string(mend.from).size(), mend.to);
    }
    const Outcome outcome = compile(file, source);
    EXPECT_EQ(outcome.status, RTCC_STATUS_SUCCESS) << outcome.messages;
}

TEST(Shaders, TheSeedsPrintedRaygenFailsWithAdvice) {
    mend_until_it_compiles(
        "raygen.rgen",
        {{"#version 460", "", "#version 460\n"},
         {"#extension GL_NV_ray_tracing", "#version 460\n",
          "#version 460\n#extension GL_NV_ray_tracing : require\n"},
         {"uniform", ") accelerationStructureNV", ") uniform accelerationStructureNV"},
         {"uniform", ") image2D", ") uniform image2D"},
         {"writeonly", "uniform image2D", "writeonly uniform image2D"},
         {";", "vec3 dir;\n}\n",
          "vec3 dir;\n} parameters;\nvec3 computeDir(uvec2 pixel, vec3 dir) { return dir; }\n"},
         {";", "vec4 color;\n}\n", "vec4 color;\n} payload;\n"},
         {"instance", "primaryPayload.color", "payload.color"},
         {"instance", "traceParameters.", "parameters."},
         {"'sbtMiss'", "sbtMiss, sbtOffset, sbtStride,",
          "parameters.sbtOffset, parameters.sbtStride, parameters.sbtMiss,"},
         {"gl_LaunchIDNV", "gl_GlobalInvocationIDNV", "gl_LaunchIDNV"},
         {"ivec2", "Image, gl_LaunchIDNV.xy", "Image, ivec2(gl_LaunchIDNV.xy)"}});
}

TEST(Shaders, TheSeedsPrintedClosestHitFailsWithAdvice) {
    mend_until_it_compiles("closesthit.rchit", {{"#version 460", "", "#version 460\n"},
                                                {"#extension GL_NV_ray_tracing", "#version 460\n",
                                                 "#version 460\n#extension GL_NV_ray_tracing : require\n"},
                                                {";", "vec4 color;\n}\n", "vec4 color;\n} payload;\n"},
                                                {"uniform", ") sampler3D", ") uniform sampler3D"},
                                                {"gl_HitTNV", "gl_hitTNV", "gl_HitTNV"},
                                                {"instance", "primaryPayload.color", "payload.color"}});
}

}  // namespace
}  // namespace rtc::tools
