#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <spirv-tools/libspirv.hpp>

#include "frontend/frontend.h"

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

namespace {

std::string text_of(const rtc::FrontendResult& result) {
    std::string text;
    spvtools::SpirvTools(SPV_ENV_UNIVERSAL_1_6)
        .Disassemble(result.spirv, &text, SPV_BINARY_TO_TEXT_OPTION_FRIENDLY_NAMES);
    return text;
}

std::string errors_of(const rtc::FrontendResult& result) {
    std::string text;
    for (const rtc::Diagnostic& message : result.diagnostics) text += message.text + "\n";
    return text;
}

constexpr uint32_t kVersion13 = 0x10300, kVersion14 = 0x10400;

TEST(Glsl, EveryStageOfBothDialectsCompiles) {
    for (const char* dialect : {"nv", "ext"}) {
        int stages = 0;
        for (const auto& entry :
             std::filesystem::directory_iterator(std::string(RTC_SHADERS) + "/cli/" + dialect)) {
            const std::string path = entry.path().string();
            if (!rtc::stage_kind_from_file(path)) continue;
            std::ifstream stream(path, std::ios::binary);
            const rtc::FrontendResult result = rtc::compile_glsl(
                {std::nullopt,
                 path,
                 {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()}},
                {});
            EXPECT_TRUE(result.ok) << path << "\n" << errors_of(result);
            ASSERT_GT(result.spirv.size(), 5u);
            EXPECT_EQ(result.spirv[1], dialect[0] == 'n' ? kVersion13 : kVersion14) << path;
            EXPECT_EQ(result.kind, rtc::stage_kind_from_file(path));
            ++stages;
        }
        EXPECT_EQ(stages, 6) << dialect;
    }
}

TEST(Glsl, BothDialectsNamedAreChosenByThePreprocessor) {
    const std::string source =
        "#version 460\n#ifdef USE_EXT\n#extension GL_EXT_ray_tracing : require\n#define IN rayPayloadInEXT\n"
        "#else\n#extension GL_NV_ray_tracing : require\n#define IN rayPayloadInNV\n#endif\n"
        "layout(location = 0) IN vec4 c;\nvoid main() { c = vec4(0.0); }\n";
    rtc::FrontendResult result = rtc::compile_glsl({std::nullopt, "a.rmiss", source}, {});
    ASSERT_TRUE(result.ok) << errors_of(result);
    EXPECT_EQ(result.spirv[1], kVersion13);
    rtc::FrontendOptions options;
    options.macros = {{"USE_EXT", ""}};
    result = rtc::compile_glsl({std::nullopt, "a.rmiss", source}, options);
    ASSERT_TRUE(result.ok) << errors_of(result);
    EXPECT_EQ(result.spirv[1], kVersion14);
}

TEST(Glsl, DebugInfoHasLinesAndNamesAsGiven) {
    const std::string source =
        "#version 460\n#extension GL_NV_ray_tracing : require\n"
        "layout(location = 0) rayPayloadInNV vec4 color;\nvoid main() {\n    color = vec4(0.0);\n}\n";
    rtc::FrontendOptions options;
    rtc::FrontendResult result = rtc::compile_glsl({std::nullopt, "dir/a.rmiss", source}, options);
    EXPECT_THAT(text_of(result), HasSubstr("OpString \"dir/a.rmiss\""));
    EXPECT_THAT(text_of(result), ::testing::ContainsRegex("OpLine %[0-9]+ 5 0"));
    EXPECT_THAT(text_of(result), HasSubstr("OpName %color \"color\""));
    options.debug_info = false;
    result = rtc::compile_glsl({std::nullopt, "dir/a.rmiss", source}, options);
    EXPECT_THAT(text_of(result), Not(HasSubstr("OpLine")));
    EXPECT_THAT(text_of(result), Not(HasSubstr("dir/a.rmiss")));
}

TEST(Glsl, MacrosApplyInOrder) {
    rtc::FrontendOptions options;
    options.macros = {{"A", "1"}, {"A", std::nullopt}};
    const rtc::FrontendResult result = rtc::preprocess_glsl(
        {rtc::StageKind::Miss, "a", "#version 460\n#ifdef A\nint a;\n#else\nint none;\n#endif\n"}, options);
    EXPECT_TRUE(result.ok) << errors_of(result);
    EXPECT_THAT(result.text, HasSubstr("int none;"));
}

TEST(Glsl, MistakesInTheHeadKeepTheirLine) {
    rtc::FrontendOptions options;
    options.macros = {{"A", "1"}, {"B", "2"}};
    const rtc::FrontendResult result =
        rtc::compile_glsl({rtc::StageKind::Miss, "a", "#version 460\nbroken;\nvoid main() {}\n"}, options);
    ASSERT_FALSE(result.ok);
    EXPECT_EQ(result.diagnostics[0].line, 2u) << "macros add no lines";
}

TEST(Glsl, IncludesAreListedOnce) {
    rtc::FrontendOptions options;
    options.include = [](const rtc::IncludeRequest& request) {
        return rtc::IncludeAnswer{true, "lib/" + request.name,
                                  "#ifndef G\n#define G\nint g() { return 1; }\n#endif\n"};
    };
    const rtc::FrontendResult result =
        rtc::compile_glsl({rtc::StageKind::Miss, "a",
                           "#version 460\n#extension GL_NV_ray_tracing : require\n#include \"x\"\n#include "
                           "<x>\nvoid main() { g(); }\n"},
                          options);
    EXPECT_TRUE(result.ok) << errors_of(result);
    EXPECT_THAT(result.dependencies, ElementsAre("a", "lib/x"));
}

TEST(Glsl, SourcesOfRandomBytesEndInErrors) {
    uint32_t state = 1;
    for (int round = 0; round < 50; ++round) {
        std::string source = round % 2 ? "#version 460\n#extension GL_NV_ray_tracing : require\n" : "";
        for (int i = 0; i < 300; ++i) {
            state = state * 1664525u + 1013904223u;
            source += static_cast<char>(round % 3 ? 32 + (state >> 24) % 95 : state >> 24);
        }
        const rtc::FrontendResult result = rtc::compile_glsl({rtc::StageKind::AnyHit, "noise", source}, {});
        EXPECT_FALSE(result.ok);
        EXPECT_FALSE(result.diagnostics.empty());
    }
}

TEST(Glsl, VersionsBelow460AreNamed) {
    for (const char* head : {"#version 110\n", "#version 100\n", "#version 300 es\n", "#version 450\n",
                             "#version 460 compatibility\n", "#version 460 es\n"}) {
        const rtc::FrontendResult result =
            rtc::compile_glsl({rtc::StageKind::Miss, "a", std::string(head) + "void main() {}\n"}, {});
        EXPECT_FALSE(result.ok) << head;
        ASSERT_FALSE(result.diagnostics.empty());
        EXPECT_EQ(result.diagnostics[0].id, "version-unsupported") << head;
        EXPECT_EQ(result.diagnostics[0].line, 1u);
    }
}

TEST(Glsl, StageNames) {
    EXPECT_EQ(rtc::stage_kind_from_name("closesthit"), rtc::StageKind::ClosestHit);
    EXPECT_EQ(rtc::stage_kind_from_name("rcall"), rtc::StageKind::Callable);
    EXPECT_EQ(rtc::stage_kind_from_name("frag"), std::nullopt);
    EXPECT_EQ(rtc::stage_kind_from_file("a.b/c.rgen"), rtc::StageKind::RayGen);
    EXPECT_EQ(rtc::stage_kind_from_file("a.rgen/c"), std::nullopt);
    EXPECT_EQ(rtc::stage_kind_from_file("a.rgen.glsl"), rtc::StageKind::RayGen);
    EXPECT_EQ(rtc::stage_kind_from_file(".glsl"), std::nullopt);
}

// The talk's shaders as printed are negative tests: errors that name the replacement.
TEST(Glsl, ThePrintedSeedShadersSayWhatToWrite) {
    const auto errors = [](const std::string& name) {
        std::ifstream stream(std::string(RTC_SHADERS) + "/seed/printed/" + name, std::ios::binary);
        const std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
        EXPECT_FALSE(text.empty());
        const rtc::FrontendResult result = rtc::compile_glsl({std::nullopt, name, text}, {});
        EXPECT_FALSE(result.ok);
        return errors_of(result);
    };
    const std::string raygen = errors("raygen.rgen");
    for (const char* advice : {"#version 460", "#extension GL_NV_ray_tracing : require", "write `uniform`",
                               "declare it writeonly", "end it with `};`", "write gl_LaunchIDNV"})
        EXPECT_THAT(raygen, HasSubstr(advice));
    const std::string hit = errors("closesthit.rchit");
    for (const char* advice :
         {"#version 460", "#extension GL_NV_ray_tracing : require", "end it with `};`", "write gl_HitTNV"})
        EXPECT_THAT(hit, HasSubstr(advice));
}

std::string printed(const char* name) {
    std::ifstream stream(std::string(RTC_SHADERS) + "/seed/printed/" + name, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

std::string with(std::string text, const std::string& from, const std::string& to) {
    const size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

// --compat=gdc2019 accepts what has one meaning today. The rest stays an error that says what to write: the version
// and the extension, an image without a format, a function that is not given, coordinates that are unsigned.
TEST(Glsl, ThePrintedSeedShadersCompileInCompatibilityMode) {
    const std::string head = "#version 460\n#extension GL_NV_ray_tracing : require\n";
    rtc::FrontendOptions compat;
    compat.gdc2019 = true;
    const std::string hit = head + printed("closesthit.rchit");
    EXPECT_FALSE(rtc::compile_glsl({std::nullopt, "closesthit.rchit", hit}, {}).ok);
    EXPECT_EQ(errors_of(rtc::compile_glsl({std::nullopt, "closesthit.rchit", hit}, compat)), "");

    std::string raygen = head + printed("raygen.rgen");
    const std::string errors = errors_of(rtc::compile_glsl({std::nullopt, "raygen.rgen", raygen}, compat));
    for (const char* advice : {"declare it writeonly", "computeDir", "convert gl_LaunchIDNV.xy with ivec2"})
        EXPECT_THAT(errors, HasSubstr(advice));
    for (const char* accepted : {"write `uniform`", "end it with", "gl_GlobalInvocationIDNV", "instance"})
        EXPECT_THAT(errors, testing::Not(HasSubstr(accepted)));
    raygen = with(raygen, "image2D", "writeonly image2D");
    raygen = with(raygen, "void main", "vec3 computeDir(uvec2 pixel, vec3 dir) { return dir; }\nvoid main");
    raygen = with(raygen, "Image, gl_GlobalInvocationIDNV.xy", "Image, ivec2(gl_GlobalInvocationIDNV.xy)");
    const rtc::FrontendResult result = rtc::compile_glsl({std::nullopt, "raygen.rgen", raygen}, compat);
    EXPECT_EQ(errors_of(result), "");
    EXPECT_TRUE(result.ok);
}

// Two blocks with members of one name are told apart by their block names.
TEST(Glsl, CompatibilityModeKeepsBlocksApart) {
    rtc::FrontendOptions compat;
    compat.gdc2019 = true;
    const rtc::FrontendResult result = rtc::compile_glsl(
        {rtc::StageKind::RayGen, "a.rgen",
         "#version 460\n#extension GL_NV_ray_tracing : require\n"
         "layout(location = 1) rayPayloadNV firstInterface { vec4 color; }\n"
         "layout(location = 2) rayPayloadNV secondInterface { float color[2]; /* } */ };\n"
         "struct Plain { vec4 color; };\n"
         "void main() {\n    Plain p;\n    p.color = firstInterface.color; // secondInterface.color\n"
         "    secondInterface.color[1] = p.color.x;\n    nonsense;\n}\n"},
        compat);
    ASSERT_EQ(result.diagnostics.size(), 1u) << errors_of(result);
    EXPECT_EQ(result.diagnostics[0].line, 10u);
}

TEST(Glsl, BlockNamesUsedAsVariablesAreExplained) {
    const rtc::FrontendResult result =
        rtc::compile_glsl({rtc::StageKind::RayGen, "a.rgen",
                           "#version 460\n#extension GL_NV_ray_tracing : require\n"
                           "layout(location = 1) rayPayloadNV primaryPayload {\n    vec4 color;\n};\n"
                           "void main() {\n    primaryPayload.color = vec4(0.0);\n}\n"},
                          {});
    ASSERT_EQ(result.diagnostics.size(), 1u);
    EXPECT_EQ(result.diagnostics[0].line, 7u);
    EXPECT_THAT(result.diagnostics[0].text, HasSubstr("give the block an instance"));
}

}  // namespace
