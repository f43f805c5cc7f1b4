#include "frontend/messages.h"

#include <gtest/gtest.h>

#include "frontend/frontend.h"

namespace {

std::vector<rtc::Diagnostic> parsed(const std::string& log) {
    std::vector<rtc::Diagnostic> out;
    rtc::parse_glslang_log(log, "main.rgen", out);
    return out;
}

TEST(Messages, AreSplitIntoFileLineAndText) {
    const auto out = parsed("ERROR: dir/a.rgen:12: 'x' : undeclared identifier \n");
    ASSERT_EQ(out.size(), 1u);
    EXPECT_EQ(out[0].severity, rtc::Severity::Error);
    EXPECT_EQ(out[0].file, "dir/a.rgen");
    EXPECT_EQ(out[0].line, 12u);
    EXPECT_EQ(out[0].text, "'x' : undeclared identifier");
}

TEST(Messages, FileNamesMayHoldColons) {
    const auto out = parsed("WARNING: C:\\a b:c.rgen:7: '' : text: with 3: colons\n");
    ASSERT_EQ(out.size(), 1u);
    EXPECT_EQ(out[0].severity, rtc::Severity::Warning);
    EXPECT_EQ(out[0].file, "C:\\a b:c.rgen");
    EXPECT_EQ(out[0].line, 7u);
    EXPECT_EQ(out[0].text, "'' : text: with 3: colons");
}

TEST(Messages, WithoutAPositionBelongToTheFile) {
    const auto out = parsed("ERROR: Linking ray-generation stage: Missing entry point\n    more about it\n");
    ASSERT_EQ(out.size(), 1u);
    EXPECT_EQ(out[0].file, "main.rgen");
    EXPECT_EQ(out[0].line, 0u);
    EXPECT_EQ(out[0].text, "Linking ray-generation stage: Missing entry point\n    more about it");
}

TEST(Messages, SummariesAreDropped) {
    EXPECT_TRUE(parsed("ERROR: 3 compilation errors.  No code generated.\n\n"
                       "ERROR: a:3: '' : compilation terminated \nmain.rgen\n"
                       "SPIR-V is not generated for failed compile or link\n")
                    .empty());
}

TEST(Messages, ConsequencesAreDropped) {
    const auto out = parsed(
        "ERROR: a:3: 'q' : undeclared identifier\n"
        "ERROR: a:3: 'xyz' : vector swizzle too long\n"
        "ERROR: a:3: '=' :  cannot convert from 'float' to 'int'\n"
        "ERROR: a:4: 'xyz' : vector swizzle selection out of range\n"
        "ERROR: a:5: '=' :  cannot convert from 'float' to 'int'\n");
    ASSERT_EQ(out.size(), 2u);
    EXPECT_EQ(out[1].line, 5u);
    EXPECT_EQ(out[1].text, "'=' : cannot convert from 'float' to 'int'");
}

TEST(Messages, TheSameMessageTwiceIsOne) {
    EXPECT_EQ(parsed("ERROR: a:3: 'q' : bad\nERROR: a:3: 'q' : bad\nERROR: a:4: 'q' : bad\n").size(), 2u);
}

TEST(Messages, AMissingEntryPointIsAnEchoOfOtherErrors) {
    EXPECT_EQ(parsed("ERROR: a:3: '' : syntax error\n"
                     "ERROR: Linking miss stage: Missing entry point: Each stage requires one entry point\n")
                  .size(),
              1u);
    EXPECT_EQ(parsed("ERROR: Linking miss stage: Missing entry point: Each stage requires one entry point\n")
                  .size(),
              1u);
}

TEST(Messages, OddTextIsKept) {
    EXPECT_EQ(parsed("ERROR: \n").size(), 0u) << "nothing is said";
    const auto out = parsed("ERROR: 99999999999: x\n");
    ASSERT_EQ(out.size(), 1u);
    EXPECT_EQ(out[0].line, 0u);
}

// What the front end says itself, before glslang: id, line and advice.
TEST(Messages, OfTheFrontEndHaveIds) {
    const std::string body = "void main() {}\n", nv = "#extension GL_NV_ray_tracing : require\n";
    const struct {
        const char* id;
        const char* file;
        std::string text;
        const char* version;  // -std
        uint32_t line;
        const char* says;
    } rows[] = {
        {"version-missing", "a.rgen", nv + body, "", 1, "begin the shader with #version 460"},
        {"version-unsupported", "a.rgen", "#version 450\n" + nv + body, "", 1, "460"},
        {"std-unknown", "a.rgen", "#version 460\n" + nv + body, "4.6", 0, "invalid GLSL version '4.6'"},
        {"extension-missing", "a.rmiss",
         "#version 460\nlayout(location = 0) rayPayloadInNV vec4 c;\nvoid main() { c = vec4(0.0); }\n", "", 1,
         "write #extension GL_NV_ray_tracing : require"},
        {"shader-stage-unknown", "a.glsl", "#version 460\n" + nv + body, "", 0, "no file extension .rgen"},
        {"shader-stage-unknown", "a.glsl", "#version 460\n#pragma shader_stage(vertex)\n" + body, "", 2,
         "expected raygen, intersection, anyhit, closesthit, miss or callable"},
        {"shader-stage-conflict", "a.glsl",
         "#version 460\n#pragma shader_stage(miss)\n#pragma shader_stage(callable)\n" + body, "", 3,
         "conflicts with an earlier 'shader_stage(miss)' in line 2"},
    };
    for (auto& row : rows) {
        rtc::FrontendOptions options;
        options.glsl_version = row.version;
        const rtc::FrontendResult result = rtc::compile_glsl({std::nullopt, row.file, row.text}, options);
        EXPECT_FALSE(result.ok) << row.id;
        ASSERT_FALSE(result.diagnostics.empty()) << row.id;
        const rtc::Diagnostic& first = result.diagnostics.front();
        EXPECT_EQ(first.id, row.id);
        EXPECT_EQ(first.line, row.line) << row.id;
        EXPECT_NE(first.text.find(row.says), std::string::npos) << first.text;
    }
}

}  // namespace
