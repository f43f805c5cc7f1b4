// --accuracy=, on the command line and in pipeline files.
#include <nlohmann/json.hpp>

#include "cli_fixture.h"

namespace {

using testing::HasSubstr;

class Accuracy : public Cli {
  protected:
    std::string accuracy(const std::string& arguments) {
        copy_shaders("nv");
        const CliRun run = rtc(arguments + " -o out.spv --reflect out.json");
        EXPECT_EQ(run.status, 0) << run.err;
        return nlohmann::json::parse(read("out.json"))["accuracy"];
    }
};

TEST_F(Accuracy, WatertightIsTheDefault) { EXPECT_EQ(accuracy("camera.rgen sky.rmiss"), "watertight"); }

TEST_F(Accuracy, EveryTierLinksAndIsRecordedInTheModule) {
    for (const std::string tier : {"fast", "watertight", "exact", "exact64"}) {
        EXPECT_EQ(accuracy("camera.rgen sky.rmiss --accuracy=" + tier), tier);
        EXPECT_TRUE(is_valid_for(read("out.spv"), "vulkan1.1"));
        // Float64 is for those who ask for it.
        const std::string text = disassembled(read("out.spv"));
        EXPECT_EQ(text.find("OpCapability Float64") != std::string::npos, tier == "exact64") << tier;
        EXPECT_EQ(accuracy("camera.rgen sky.rmiss --addressing=address --accuracy=" + tier), tier);
    }
}

TEST_F(Accuracy, UnknownTiersAreRefused) {
    copy_shaders("nv");
    for (const char* bad : {"", "best", "Exact"}) {
        const CliRun run = rtc("camera.rgen --accuracy=" + std::string(bad));
        EXPECT_EQ(run.status, 1) << bad;
        EXPECT_THAT(run.err, HasSubstr("expected fast, watertight, exact or exact64"));
    }
}

TEST_F(Accuracy, PipelineFilesAskAndTheCommandLineWins) {
    write("p.json", R"({"stages": [{"file": "camera.rgen"}, {"file": "sky.rmiss"}], "accuracy": "exact"})");
    EXPECT_EQ(accuracy("--pipeline p.json"), "exact");
    EXPECT_EQ(accuracy("--pipeline p.json --accuracy=fast"), "fast");
    write("bad.json", R"({"stages": [{"file": "camera.rgen"}], "accuracy": "good"})");
    const CliRun run = rtc("--pipeline bad.json");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("\"good\" is no accuracy"));
}

}  // namespace
