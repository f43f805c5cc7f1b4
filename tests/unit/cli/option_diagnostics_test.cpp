// -w -Werror -std=, message format, counts, exit statuses.
#include "cli_fixture.h"

using ::testing::HasSubstr;
using ::testing::Not;

namespace {

class Diagnostics : public Cli {
  protected:
    // `enable` of an unknown extension is a warning in GLSL.
    const std::string warning_ =
        "#version 460\n#extension GL_NV_ray_tracing : require\n"
        "#extension GL_XX_no_such_thing : enable\n"
        "layout(location = 0) rayPayloadInNV vec4 c;\nvoid main() { c = vec4(0.0); }\n";
};

TEST_F(Diagnostics, ErrorsReadFileLineErrorText) {
    write("a.rmiss", miss_shader("    color = nothing;\n"));
    const CliRun run = rtc("-c a.rmiss");
    EXPECT_EQ(run.status, 1);
    EXPECT_EQ(run.out, "");
    EXPECT_EQ(run.err, "a.rmiss:6: error: 'nothing' : undeclared identifier\n1 error generated.\n");
}

TEST_F(Diagnostics, CountsAreSummedOverFiles) {
    write("a.rmiss", miss_shader("    color = nothing;\n"));
    write("b.rmiss", miss_shader("    color = never;\n    color = neither;\n"));
    EXPECT_THAT(rtc("a.rmiss b.rmiss").err, HasSubstr("\n3 errors generated.\n"));
}

TEST_F(Diagnostics, WarningsArePrintedAndDoNotFail) {
    write("a.rmiss", warning_);
    const CliRun run = rtc("-c a.rmiss");
    EXPECT_EQ(run.status, 0);
    EXPECT_THAT(run.err, HasSubstr("a.rmiss:3: warning: "));
    EXPECT_THAT(run.err, HasSubstr("1 warning generated.\n"));
    EXPECT_TRUE(exists("a.rmiss.spv"));
}

TEST_F(Diagnostics, WarningsAndErrorsAreCountedTogether) {
    write("a.rmiss", warning_);
    write("b.rmiss", miss_shader("    color = nothing;\n"));
    EXPECT_THAT(rtc("-c a.rmiss b.rmiss").err, HasSubstr("1 warning and 1 error generated.\n"));
}

TEST_F(Diagnostics, DashWSilencesWarnings) {
    write("a.rmiss", warning_);
    const CliRun run = rtc("-w -c a.rmiss");
    EXPECT_EQ(run.status, 0);
    EXPECT_EQ(run.err, "");
    EXPECT_EQ(rtc("-w -Werror -c a.rmiss").status, 0) << "what is silenced is no error";
}

TEST_F(Diagnostics, DashWerrorMakesThemErrors) {
    write("a.rmiss", warning_);
    const CliRun run = rtc("-Werror -c a.rmiss");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("a.rmiss:3: error: "));
    EXPECT_THAT(run.err, HasSubstr("1 error generated.\n"));
    EXPECT_FALSE(exists("a.rmiss.spv"));
}

// The linker's own warnings obey the same options and name the source line.
TEST_F(Diagnostics, LinkWarnings) {
    std::string source = raygen_shader();
    source.replace(source.find("0xff"), 4, "0x00");
    write("a.rgen", source);
    write("b.rmiss", miss_shader());
    CliRun run = rtc("a.rgen b.rmiss -o out.spv");
    EXPECT_EQ(run.status, 0);
    EXPECT_THAT(run.err, HasSubstr("a.rgen:7: warning: the cull mask is 0"));
    EXPECT_TRUE(exists("out.spv"));
    EXPECT_EQ(rtc("-w a.rgen b.rmiss").err, "");
    run = rtc("-Werror a.rgen b.rmiss -o strict.spv");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("a.rgen:7: error: the cull mask is 0"));
    EXPECT_FALSE(exists("strict.spv"));
}

TEST_F(Diagnostics, DashStdOverridesTheVersion) {
    write("old.rmiss", "#version 450\n" + miss_shader().substr(13));
    const CliRun run = rtc("-c old.rmiss");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("old.rmiss:1: error: #version 450"));
    EXPECT_EQ(rtc("-std=460core -c old.rmiss").status, 0);
    write("none.rmiss", miss_shader().substr(13));
    EXPECT_EQ(rtc("-std=460 -c none.rmiss").status, 0);
}

TEST_F(Diagnostics, DashStdRefusesUnknownVersions) {
    write("a.rmiss", miss_shader());
    for (const char* bad : {"461", "460gold", "", "core"}) {
        const CliRun run = rtc("-c a.rmiss -std=" + std::string(bad));
        EXPECT_EQ(run.status, 1) << bad;
        EXPECT_THAT(run.err, HasSubstr("invalid value '" + std::string(bad) + "' in '-std=")) << bad;
    }
    EXPECT_EQ(rtc("-std=100 -c a.rmiss").status, 1) << "a version, but none for ray tracing";
    EXPECT_EQ(rtc("-std=310es -c a.rmiss").status, 1);
}

TEST_F(Diagnostics, AMissingVersionIsNamedAndNothingElsePrinted) {
    write("a.rmiss", "void main() {}\n");
    const CliRun run = rtc("-c a.rmiss");
    EXPECT_EQ(run.status, 1);
    EXPECT_EQ(run.out, "") << "glslang prints its built-ins when it fails inside";
    EXPECT_THAT(run.err, HasSubstr("a.rmiss:1: error: no #version; begin the shader with #version 460"));
}

TEST_F(Diagnostics, ALinkErrorNamesTheSourceLine) {
    write("a.rgen",
          "#version 460\n#extension GL_NV_ray_tracing : require\n"
          "layout(set = 0, binding = 0) uniform accelerationStructureNV scene;\n"
          "layout(location = 0) rayPayloadNV vec4 color;\n"
          "void main() {\n"
          "    traceNV(scene, 0, 0xff, 0, 0, 0, vec3(0.0), 0.0, vec3(0.0, 0.0, 1.0), 1e9, 3);\n}\n");
    const CliRun run = rtc("a.rgen");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("a.rgen:6: error: "));
    EXPECT_THAT(run.err, HasSubstr("location 3"));
}

}  // namespace
