#include "frontend/advice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "frontend/frontend.h"

using ::testing::HasSubstr;

namespace {

// Every message of compiling `body` behind the NV head, joined.
std::string messages(const std::string& body,
                     const std::string& head = "#extension GL_NV_ray_tracing : require\n") {
    const rtc::FrontendResult result =
        rtc::compile_glsl({rtc::StageKind::ClosestHit, "a.rchit", "#version 460\n" + head + body}, {});
    EXPECT_FALSE(result.ok);
    std::string text;
    for (const rtc::Diagnostic& message : result.diagnostics)
        text += message.file + ":" + std::to_string(message.line) + ": " + message.text + "\n";
    return text;
}

TEST(Advice, OldSpellings) {
    const std::pair<const char*, const char*> cases[] = {
        {"gl_hitTNV", "write gl_HitTNV"},
        {"gl_GlobalInvocationIDNV.x", "write gl_LaunchIDNV, a uvec3"},
        {"gl_GlobalInvocationID.x", "ray tracing stages have gl_LaunchIDNV or gl_LaunchIDEXT instead"},
        {"gl_LaunchIDNVX.x", "write gl_LaunchIDNV"},
        {"gl_GeometryIndexNV", "GL_EXT_ray_tracing has gl_GeometryIndexEXT"},
        {"gl_ObjectToWorld3x4NV[0].x", "gl_ObjectToWorldNV only; transpose it"},
    };
    for (const auto& [expression, advice] : cases)
        EXPECT_THAT(messages("void main() { float x = float(" + std::string(expression) + "); }\n"),
                    HasSubstr(advice))
            << expression;
    EXPECT_THAT(messages("void main() { traceNVX(); }\n"), HasSubstr("write traceNV"));
    EXPECT_THAT(messages("intersectionAttributesNV vec2 a;\nvoid main() {}\n"),
                HasSubstr("write hitAttributeNV"));
}

TEST(Advice, MissingUniform) {
    EXPECT_THAT(messages("layout(binding = 0) accelerationStructureNV s;\nvoid main() {}\n"),
                HasSubstr("write `uniform` before the type"));
    EXPECT_THAT(messages("layout(binding = 0) sampler3D s;\nvoid main() {}\n"),
                HasSubstr("write `uniform` before the type"));
    EXPECT_THAT(messages("layout(binding = 0) uniform image2D i;\nvoid main() { imageLoad(i, ivec2(0)); }\n"),
                HasSubstr("declare it writeonly"));
}

TEST(Advice, BlocksThatEndTooEarly) {
    EXPECT_THAT(messages("rayPayloadInNV P { vec4 c; }\n\n// note\nvoid main() {}\n"),
                HasSubstr("end it with `};` or an instance name"));
    EXPECT_THAT(messages("rayPayloadInNV P { vec4 c; };\nvoid main() { P.c = vec4(0.0); }\n"),
                HasSubstr("give the block an instance"));
}

TEST(Advice, MissingExtensions) {
    EXPECT_THAT(messages("rayPayloadInNV vec4 c;\nvoid main() {}\n", ""),
                HasSubstr("write #extension GL_NV_ray_tracing : require"));
    EXPECT_THAT(messages("hitAttributeEXT vec2 c;\nvoid main() {}\n", ""),
                HasSubstr("write #extension GL_EXT_ray_tracing : require"));
    EXPECT_THAT(messages("#extension GL_EXT_made_up : require\nvoid main() {}\n"),
                HasSubstr("give the stage as SPIR-V instead"));
}

TEST(Advice, PositionFetchHasAnIdOfItsOwn) {
    const rtc::FrontendResult result =
        rtc::compile_glsl({rtc::StageKind::ClosestHit, "a.rchit",
                           "#version 460\n#extension GL_EXT_ray_tracing : require\n"
                           "#extension GL_EXT_ray_tracing_position_fetch : require\n"
                           "void main() { vec3 p = gl_HitTriangleVertexPositionsEXT[0]; }\n"},
                          {});
    ASSERT_FALSE(result.diagnostics.empty());
    EXPECT_EQ(result.diagnostics[0].id, "position-fetch-glsl");
}

TEST(Advice, WordsInsideOtherWordsAreNotMisspelled) {
    EXPECT_THAT(messages("void main() { float my_gl_hitTNV_x = undefined_name; }\n"),
                ::testing::Not(HasSubstr("write gl_HitTNV")));
}

TEST(Advice, ASuccessIsLeftAlone) {
    std::vector<rtc::Diagnostic> diagnostics = {{rtc::Severity::Warning, "w", "a", 1, "syntax error"}};
    rtc::add_advice("a", "rayPayloadNV x", diagnostics);
    EXPECT_EQ(diagnostics[0].text, "syntax error");
}

}  // namespace
