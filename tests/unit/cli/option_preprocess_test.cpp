// -E -D -U -I, #include, #pragma shader_stage.
#include "cli_fixture.h"

using ::testing::HasSubstr;
using ::testing::Not;

namespace {

class Preprocess : public Cli {};

TEST_F(Preprocess, DashEPrintsTheSource) {
    write("a.rmiss", "#version 460\n#define VALUE 7\nint x = VALUE; // gone\n");
    const CliRun run = rtc("-E a.rmiss");
    EXPECT_EQ(run.status, 0) << run.err;
    EXPECT_THAT(run.out, HasSubstr("#version 460"));
    EXPECT_THAT(run.out, HasSubstr("int x = 7;"));
    EXPECT_THAT(run.out, Not(HasSubstr("gone")));
    EXPECT_THAT(run.out, Not(HasSubstr("GL_GOOGLE_include_directive")));
    EXPECT_FALSE(exists("a.spv"));
}

TEST_F(Preprocess, DashEWritesToDashO) {
    write("a.rmiss", "#version 460\nint y;\n");
    const CliRun run = rtc("-E a.rmiss -o a.i");
    EXPECT_EQ(run.status, 0);
    EXPECT_EQ(run.out, "");
    EXPECT_THAT(read("a.i"), HasSubstr("int y;"));
}

TEST_F(Preprocess, DashERefusesSpirv) {
    write("a.rmiss", miss_shader());
    rtc("-c a.rmiss -o m.spv");
    const CliRun run = rtc("-E m.spv");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("'m.spv' is SPIR-V"));
}

TEST_F(Preprocess, WhatDashEPrintsCompiles) {
    copy_shaders("nv");
    ASSERT_EQ(rtc("-E camera.rgen -o flat.rgen").status, 0);
    std::filesystem::remove(folder_ / "common.glsl");
    const CliRun run = rtc("-c flat.rgen");
    EXPECT_EQ(run.status, 0) << run.err;
}

TEST_F(Preprocess, DashDDefines) {
    write("a.rmiss", "#version 460\nint a = A; int b = B(2);\n#ifdef EMPTY\nint c;\n#endif\n");
    const CliRun run = rtc("-E -DA=3 -D EMPTY '-DB(x)=x+x' a.rmiss");
    EXPECT_EQ(run.status, 0) << run.err;
    EXPECT_THAT(run.out, HasSubstr("int a = 3;"));
    EXPECT_THAT(run.out, HasSubstr("2 + 2"));
    EXPECT_THAT(run.out, HasSubstr("int c;"));
}

TEST_F(Preprocess, TheLastDashDWins) {
    write("a.rmiss", "#version 460\nint a = A;\n");
    EXPECT_THAT(rtc("-E -DA=3 -DA=4 a.rmiss").out, HasSubstr("int a = 4;"));
}

TEST_F(Preprocess, DashDRefusesWhatIsNoName) {
    write("a.rmiss", miss_shader());
    const CliRun run = rtc("-D1x=2 a.rmiss");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("macro names must be identifiers: '-D1x'"));
    EXPECT_EQ(rtc("-D=2 a.rmiss").status, 1);
    EXPECT_EQ(rtc("a.rmiss -D").status, 1);
}

TEST_F(Preprocess, DashUUndefines) {
    write("a.rmiss", "#version 460\n#ifdef A\nint a;\n#else\nint none;\n#endif\n");
    EXPECT_THAT(rtc("-E -DA -UA a.rmiss").out, HasSubstr("int none;"));
    EXPECT_THAT(rtc("-E -UA -DA a.rmiss").out, HasSubstr("int a;"));
    EXPECT_EQ(rtc("-U3 a.rmiss").status, 1);
}

TEST_F(Preprocess, IncludesLieBesideTheIncludingFile) {
    write("sub/a.rmiss", "#version 460\n#include \"b.glsl\"\n");
    write("sub/b.glsl", "#include \"deep/c.glsl\"\n");
    write("sub/deep/c.glsl", "#include \"d.glsl\"\n");
    write("sub/deep/d.glsl", "int found;\n");
    const CliRun run = rtc("-E sub/a.rmiss");
    EXPECT_EQ(run.status, 0) << run.err;
    EXPECT_THAT(run.out, HasSubstr("int found;"));
}

TEST_F(Preprocess, DashISearchesInOrder) {
    write("a.rmiss", "#version 460\n#include \"x.glsl\"\n#include <y.glsl>\n");
    write("one/x.glsl", "int one;\n");
    write("two/x.glsl", "int two;\n");
    write("two/y.glsl", "int why;\n");
    const CliRun run = rtc("-E -Ione -I two a.rmiss");
    EXPECT_EQ(run.status, 0) << run.err;
    EXPECT_THAT(run.out, HasSubstr("int one;"));
    EXPECT_THAT(run.out, Not(HasSubstr("int two;")));
    EXPECT_THAT(run.out, HasSubstr("int why;"));
}

TEST_F(Preprocess, TheFileItselfComesBeforeDashI) {
    write("a.rmiss", "#version 460\n#include \"x.glsl\"\n");
    write("x.glsl", "int here;\n");
    write("one/x.glsl", "int one;\n");
    EXPECT_THAT(rtc("-E -Ione a.rmiss").out, HasSubstr("int here;"));
}

TEST_F(Preprocess, AnglesSkipTheFilesFolder) {
    write("a.rmiss", "#version 460\n#include <x.glsl>\n");
    write("x.glsl", "int here;\n");
    const CliRun run = rtc("-E a.rmiss");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("a.rmiss:2: error:"));
    EXPECT_THAT(run.err, HasSubstr("x.glsl"));
}

TEST_F(Preprocess, AMissingIncludeIsNamed) {
    write("a.rmiss",
          "#version 460\n#extension GL_NV_ray_tracing : require\n#include \"gone.glsl\"\nvoid main() {}\n");
    const CliRun run = rtc("-c a.rmiss");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("a.rmiss:3: error:"));
    EXPECT_THAT(run.err, HasSubstr("gone.glsl"));
}

TEST_F(Preprocess, AFileThatIncludesItselfEnds) {
    write("a.rmiss", "#version 460\n#include \"loop.glsl\"\nvoid main() {}\n");
    write("loop.glsl", "#include \"loop.glsl\"\n");
    const CliRun run = rtc("-c a.rmiss");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("too many levels of inclusion"));
}

TEST_F(Preprocess, ErrorsInIncludesNameTheInclude) {
    write("a.rmiss",
          "#version 460\n#extension GL_NV_ray_tracing : require\n#include \"bad.glsl\"\nvoid main() {}\n");
    write("bad.glsl", "\nint x = missing;\n");
    const CliRun run = rtc("-c a.rmiss");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("bad.glsl:2: error: 'missing' : undeclared identifier"));
}

TEST_F(Preprocess, PragmaNamesTheStage) {
    write("sky.glsl", "#pragma shader_stage(miss)\n" + miss_shader());
    // The pragma stands after #version in real files; glslang wants #version first.
    write("sky.glsl", "#version 460\n#pragma shader_stage(miss)\n" + miss_shader().substr(13));
    const CliRun run = rtc("-c sky.glsl");
    EXPECT_EQ(run.status, 0) << run.err;
    EXPECT_THAT(disassembled(read("sky.glsl.spv")), HasSubstr("OpEntryPoint Miss"));
}

TEST_F(Preprocess, PragmaBeatsTheExtension) {
    write("sky.rgen", "#version 460\n#pragma shader_stage(miss)\n" + miss_shader().substr(13));
    EXPECT_EQ(rtc("-c sky.rgen").status, 0);
    EXPECT_THAT(disassembled(read("sky.rgen.spv")), HasSubstr("OpEntryPoint Miss"));
}

TEST_F(Preprocess, PragmasThatDisagreeAreAnError) {
    write("sky.glsl",
          "#version 460\n#pragma shader_stage(miss)\n#pragma shader_stage(raygen)\nvoid main() {}\n");
    const CliRun run = rtc("-c sky.glsl");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("sky.glsl:3: error: '#pragma shader_stage(raygen)' conflicts"));
}

TEST_F(Preprocess, PragmaOfAnotherKindOfShaderIsAnError) {
    write("sky.glsl", "#version 460\n#pragma shader_stage(fragment)\nvoid main() {}\n");
    const CliRun run = rtc("-c sky.glsl");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err,
                HasSubstr("sky.glsl:2: error: '#pragma shader_stage(fragment)' names no ray tracing stage"));
}

}  // namespace
