// -M -MM -MD -MF -MT.
#include "cli_fixture.h"

using ::testing::HasSubstr;

namespace {

class Dependencies : public Cli {
  protected:
    Dependencies() { copy_shaders("nv"); }
};

TEST_F(Dependencies, DashMListsEachFileOnce) {
    const CliRun run = rtc("-M camera.rgen sky.rmiss");
    EXPECT_EQ(run.status, 0) << run.err;
    EXPECT_EQ(run.out, "a.spv: camera.rgen common.glsl sky.rmiss\n");
    EXPECT_FALSE(exists("a.spv"));
}

TEST_F(Dependencies, DashMMIsTheSame) {
    EXPECT_EQ(rtc("-MM camera.rgen").out, rtc("-M camera.rgen").out);
    EXPECT_EQ(rtc("-MM camera.rgen").out, "a.spv: camera.rgen common.glsl\n");
}

TEST_F(Dependencies, DashMDWritesBesideTheOutput) {
    const CliRun run = rtc("-MD camera.rgen sky.rmiss -o out.spv");
    EXPECT_EQ(run.status, 0) << run.err;
    EXPECT_TRUE(is_module(read("out.spv")));
    EXPECT_EQ(read("out.spv.d"), "out.spv: camera.rgen common.glsl sky.rmiss\n");
}

TEST_F(Dependencies, DashMFNamesTheFile) {
    EXPECT_EQ(rtc("-MD -MF deps.mk camera.rgen sky.rmiss -o out.spv").status, 0);
    EXPECT_EQ(read("deps.mk"), "out.spv: camera.rgen common.glsl sky.rmiss\n");
    EXPECT_FALSE(exists("out.spv.d"));
    EXPECT_EQ(rtc("-M -MF only.mk camera.rgen").out, "");
    EXPECT_EQ(read("only.mk"), "a.spv: camera.rgen common.glsl\n");
}

TEST_F(Dependencies, DashMTNamesTheTarget) {
    EXPECT_EQ(rtc("-M -MT 'some target' camera.rgen").out, "some target: camera.rgen common.glsl\n");
}

TEST_F(Dependencies, DashMFAndDashMTNeedARule) {
    EXPECT_EQ(rtc("-MF deps.mk camera.rgen").status, 1);
    EXPECT_EQ(rtc("-MT x camera.rgen").status, 1);
    EXPECT_EQ(rtc("camera.rgen -MD -MF").status, 1);
}

TEST_F(Dependencies, BlanksAreEscaped) {
    std::filesystem::rename(folder_ / "sky.rmiss", folder_ / "my sky.rmiss");
    EXPECT_EQ(rtc("-M 'my sky.rmiss'").out, "a.spv: my\\ sky.rmiss common.glsl\n");
}

TEST_F(Dependencies, SpirvAndPipelineFilesCount) {
    ASSERT_EQ(rtc("-c sky.rmiss").status, 0);
    write("p.json", R"({"stages": [{"file": "camera.rgen"}, {"file": "sky.rmiss.spv"}]})");
    EXPECT_EQ(rtc("-M --pipeline p.json").out, "a.spv: camera.rgen common.glsl sky.rmiss.spv p.json\n");
    ASSERT_EQ(rtc("-MD --pipeline p.json -o out.spv").status, 0);
    EXPECT_EQ(read("out.spv.d"), "out.spv: camera.rgen common.glsl sky.rmiss.spv p.json\n");
}

}  // namespace
