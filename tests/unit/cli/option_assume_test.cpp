// --assume= --scene-profile= --no-specialize, and "assume", "sceneProfile" in pipeline files.
#include <nlohmann/json.hpp>

#include "cli_fixture.h"

using ::testing::AllOf;
using ::testing::HasSubstr;

namespace {

class Assume : public Cli {
  protected:
    nlohmann::json reflection(const std::string& options) {
        copy_shaders("nv");
        const CliRun run = rtc("camera.rgen sky.rmiss shade.rchit -o out.spv --reflect out.json " + options);
        EXPECT_EQ(run.status, 0) << run.err;
        EXPECT_TRUE(is_valid_for(read("out.spv"), "vulkan1.1"));
        return nlohmann::json::parse(read("out.json"));
    }
    std::string state(const nlohmann::json& json, const std::string& name) {
        for (const auto& fact : json["facts"])
            if (fact["name"] == name) return fact["state"];
        return "missing";
    }
};

TEST_F(Assume, PromisesAreReflectedAndRemoveCode) {
    const auto plain = reflection("");
    EXPECT_EQ(plain["assumptions"].dump(), "[]");
    EXPECT_EQ(state(plain, "opaque"), "unknown");
    EXPECT_EQ(state(plain, "no any-hit"), "proven");
    const auto told = reflection("--assume=single-level,opaque --assume identity-transforms");
    EXPECT_EQ(told["assumptions"].dump(), R"(["opaque","single-level","identity-transforms"])");
    EXPECT_EQ(state(told, "opaque"), "assumed");
    EXPECT_EQ(state(told, "no-masks"), "unknown");
    EXPECT_LT(told["instructions"], plain["instructions"]);
    const auto nothing = reflection("--assume=opaque --no-specialize");
    EXPECT_EQ(nothing["assumptions"].dump(), "[]");
    EXPECT_GT(nothing["instructions"], plain["instructions"]);
}

TEST_F(Assume, WrongNamesAreErrorsThatListTheRightOnes) {
    copy_shaders("nv");
    for (const char* bad : {"opaqe", "", "opaque,flat"}) {
        const CliRun run = rtc("camera.rgen --assume=" + std::string(bad));
        EXPECT_EQ(run.status, 1) << bad;
        const std::string list = *bad ? "single-level, identity-transforms" : "assume";
        EXPECT_THAT(run.err, AllOf(HasSubstr(bad), HasSubstr(list)));
    }
    const CliRun both = rtc("camera.rgen sky.rmiss shade.rchit --assume=triangles,aabbs");
    EXPECT_EQ(both.status, 1);
    EXPECT_THAT(both.err, HasSubstr("'triangles' and 'aabbs'"));
}

TEST_F(Assume, SceneProfiles) {
    write("scene.json", R"({"rtcSceneProfile": 1, "assume": ["no-masks", "triangles"], "topLevels": []})");
    EXPECT_EQ(reflection("--scene-profile scene.json")["assumptions"].dump(), R"(["no-masks","triangles"])");
    write("other.json", R"({"assume": ["no-masks"]})");
    for (const char* file : {"other.json", "missing.json"}) {
        const CliRun run = rtc("camera.rgen --scene-profile " + std::string(file));
        EXPECT_EQ(run.status, 1);
        EXPECT_THAT(run.err, HasSubstr(file));
    }
}

TEST_F(Assume, PipelineFiles) {
    copy_shaders("nv");
    write("scene.json", R"({"rtcSceneProfile": 1, "assume": ["no-masks"]})");
    const std::string stages = R"("stages": [{"file": "camera.rgen"}, {"file": "sky.rmiss"}, {"file": "shade.rchit"}])";
    write("p.json", "{" + stages + R"(, "assume": ["opaque"], "sceneProfile": "scene.json"})");
    const CliRun run = rtc("--pipeline p.json -o out.spv --reflect out.json");
    ASSERT_EQ(run.status, 0) << run.err;
    EXPECT_EQ(nlohmann::json::parse(read("out.json"))["assumptions"].dump(), R"(["opaque","no-masks"])");
    write("p.json", "{" + stages + ",\n \"assume\": [\"opaque\", \"tall\"]}");
    const CliRun bad = rtc("--pipeline p.json -o out.spv");
    EXPECT_EQ(bad.status, 1);
    EXPECT_THAT(bad.err, AllOf(HasSubstr("p.json:2:"), HasSubstr("\"tall\"")));
}

TEST_F(Assume, TheReportComparesWithNothingRemoved) {
    copy_shaders("nv");
    const CliRun run = rtc("camera.rgen sky.rmiss shade.rchit -o out.spv --report --assume=opaque");
    ASSERT_EQ(run.status, 0) << run.err;
    EXPECT_THAT(run.out, AllOf(HasSubstr("facts:"), HasSubstr("assumed"), HasSubstr("unknown"), HasSubstr("proven"),
                               HasSubstr("instructions"), HasSubstr(" -> ")));
}

}  // namespace
