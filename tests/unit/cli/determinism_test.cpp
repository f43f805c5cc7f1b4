// The same input and options give the same bytes, wherever and however often.
#include "cli_fixture.h"

using ::testing::HasSubstr;
using ::testing::Not;

namespace {

class Determinism : public Cli {};

TEST_F(Determinism, TheFolderDoesNotMatter) {
    copy_shaders("nv", "one");
    copy_shaders("nv", "another/place");
    const std::string arguments = "camera.rgen sky.rmiss shade.rchit -O -o out.spv --reflect out.json";
    ASSERT_EQ(rtc_in("one", arguments).status, 0);
    ASSERT_EQ(rtc_in("another/place", arguments).status, 0);
    EXPECT_EQ(read("one/out.spv"), read("another/place/out.spv"));
    EXPECT_EQ(read("one/out.json"), read("another/place/out.json"));
}

TEST_F(Determinism, ThePathOfTheSourcesDoesNotMatter) {
    copy_shaders("nv", "one");
    const std::string files[] = {"camera.rgen", "sky.rmiss", "shade.rchit"};
    std::string relative, absolute;
    for (const std::string& file : files) {
        relative += " " + file;
        absolute += " '" + (folder_ / "one" / file).string() + "'";
    }
    ASSERT_EQ(rtc_in("one", relative + " -o relative.spv").status, 0);
    ASSERT_EQ(rtc(absolute + " -o absolute.spv").status, 0);
    EXPECT_EQ(read("one/relative.spv"), read("absolute.spv"));
    EXPECT_THAT(read("absolute.spv"), Not(HasSubstr(folder_.string())));
}

TEST_F(Determinism, DebugNamesAreAsGiven) {
    copy_shaders("nv", "one");
    ASSERT_EQ(rtc("-g one/camera.rgen one/sky.rmiss -o out.spv").status, 0);
    EXPECT_THAT(read("out.spv"), HasSubstr("one/camera.rgen"));
    EXPECT_THAT(read("out.spv"), Not(HasSubstr(folder_.string())));
}

TEST_F(Determinism, TheCommandsSourceDoesNotMatter) {
    copy_shaders("nv");
    write("p.json", R"({"stages": [{"file": "camera.rgen"}, {"file": "sky.rmiss"}]})");
    ASSERT_EQ(rtc("camera.rgen sky.rmiss -o one.spv").status, 0);
    ASSERT_EQ(rtc("--pipeline p.json -o two.spv").status, 0);
    ASSERT_EQ(rtc("sky.rmiss -o three.spv -fshader-stage=rgen camera.rgen").status, 0);
    EXPECT_EQ(read("one.spv"), read("two.spv"));
    EXPECT_NE(read("one.spv"), read("three.spv")) << "the order of groups is input";
}

TEST_F(Determinism, EveryRunIsTheSame) {
    copy_shaders("ext");
    ASSERT_EQ(rtc("camera.rgen sky.rmiss shade.rchit -Os -g -o first.spv").status, 0);
    for (int i = 0; i < 3; ++i) {
        ASSERT_EQ(rtc("camera.rgen sky.rmiss shade.rchit -Os -g -o again.spv").status, 0);
        ASSERT_EQ(read("again.spv"), read("first.spv"));
    }
}

}  // namespace
