// -fshader-stage= -fentry-point= -x --stage --hit-group --pipeline, order of groups.
#include <nlohmann/json.hpp>

#include "cli_fixture.h"

using ::testing::ElementsAre;
using ::testing::HasSubstr;

namespace {

class Stages : public Cli {
  protected:
    Stages() { copy_shaders("nv"); }

    // What --reflect says of the pipeline; null when rtc fails.
    nlohmann::json reflection(const std::string& arguments) {
        const CliRun run = rtc(arguments + " -o out.spv --reflect out.json");
        EXPECT_EQ(run.status, 0) << run.err;
        return run.status == 0 ? nlohmann::json::parse(read("out.json")) : nlohmann::json();
    }

    std::vector<std::string> groups(const std::string& arguments) {
        std::vector<std::string> names;
        const nlohmann::json json = reflection(arguments);
        for (const auto& group : json["groups"])
            names.push_back(group["kind"].get<std::string>() + " " + group["name"].get<std::string>());
        return names;
    }
};

TEST_F(Stages, GroupsComeInCommandLineOrder) {
    EXPECT_THAT(groups("camera.rgen sky.rmiss shade.rchit"),
                ElementsAre("general camera.rgen", "general sky.rmiss", "triangles shade.rchit"));
    EXPECT_THAT(groups("shade.rchit sky.rmiss camera.rgen"),
                ElementsAre("triangles shade.rchit", "general sky.rmiss", "general camera.rgen"));
}

TEST_F(Stages, HitGroupGathersItsFiles) {
    EXPECT_THAT(groups("camera.rgen --hit-group ball=shade.rchit,cutout.rahit,sphere.rint sky.rmiss"),
                ElementsAre("general camera.rgen", "procedural ball", "general sky.rmiss"));
    EXPECT_THAT(groups("camera.rgen sky.rmiss --hit-group=leaf=cutout.rahit,shade.rchit"),
                ElementsAre("general camera.rgen", "general sky.rmiss", "triangles leaf"));
}

TEST_F(Stages, AnRchitInAHitGroupIsNoGroupOfItsOwn) {
    EXPECT_THAT(groups("camera.rgen shade.rchit sky.rmiss --hit-group leaf=shade.rchit,cutout.rahit"),
                ElementsAre("general camera.rgen", "general sky.rmiss", "triangles leaf"));
}

TEST_F(Stages, OneStageMayServeSeveralHitGroups) {
    const auto json =
        reflection("camera.rgen sky.rmiss --hit-group a=shade.rchit --hit-group b=shade.rchit,cutout.rahit");
    EXPECT_EQ(json["groups"].size(), 4u);
    EXPECT_EQ(json["stages"].size(), 4u) << "shade.rchit is one stage";
    EXPECT_EQ(json["groups"][2]["handle"][0], json["groups"][3]["handle"][0]);
    EXPECT_NE(json["groups"][2]["handle"][1], json["groups"][3]["handle"][1]);
}

TEST_F(Stages, AnEmptyHitGroupShadesNothing) {
    const auto json = reflection("camera.rgen sky.rmiss --hit-group none=");
    EXPECT_EQ(json["groups"][2]["handle"][0], "0x00000000");
}

TEST_F(Stages, HitGroupMistakes) {
    EXPECT_EQ(rtc("camera.rgen --hit-group shade.rchit").status, 1) << "no name";
    EXPECT_EQ(rtc("camera.rgen --hit-group =shade.rchit").status, 1);
    EXPECT_EQ(rtc("camera.rgen --hit-group").status, 1);
    EXPECT_EQ(rtc("camera.rgen --hit-group g=gone.rchit").status, 1);
    CliRun run = rtc("camera.rgen sky.rmiss --hit-group g=sky.rmiss");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err,
                HasSubstr("hit group 'g': 'sky.rmiss' is of kind rmiss, expected rchit, rahit or rint"));
    write("other.rchit", read("shade.rchit"));
    run = rtc("camera.rgen --hit-group g=shade.rchit,other.rchit");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("hit group 'g' has more than one rchit"));
    run = rtc("camera.rgen --hit-group g=shade.rchit --hit-group g=other.rchit");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("two groups are named 'g'"));
    run = rtc("camera.rgen sky.rmiss cutout.rahit");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("'cutout.rahit' (rahit) is in no hit group"));
}

TEST_F(Stages, FshaderStageIsForTheFilesThatFollow) {
    std::filesystem::rename(folder_ / "sky.rmiss", folder_ / "sky.txt");
    EXPECT_THAT(groups("camera.rgen -fshader-stage=rmiss sky.txt"),
                ElementsAre("general camera.rgen", "general sky.txt"));
    EXPECT_EQ(rtc("camera.rgen sky.txt").status, 1);
    EXPECT_EQ(rtc("-fshader-stage=rmiss sky.txt -fshader-stage=rgen camera.rgen -o x.spv").status, 0);
    EXPECT_EQ(rtc("-fshader-stage=vertex camera.rgen").status, 1);
    EXPECT_EQ(rtc("-fshader-stage=closesthit -c shade.rchit").status, 0) << "the pragma's names count too";
}

TEST_F(Stages, DashXTakesTheLanguagesThereAre) {
    EXPECT_EQ(rtc("-x glsl -c sky.rmiss").status, 0);
    EXPECT_EQ(rtc("-xglsl -c sky.rmiss").status, 0);
    const CliRun run = rtc("-x hlsl -c sky.rmiss");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("DXC or Slang"));
    EXPECT_THAT(rtc("-x pascal sky.rmiss").err, HasSubstr("language not recognized: 'pascal'"));
}

TEST_F(Stages, SpirvIsTakenWhereverGlslIs) {
    ASSERT_EQ(rtc("-c camera.rgen sky.rmiss shade.rchit").status, 0);
    std::filesystem::rename(folder_ / "shade.rchit.spv", folder_ / "shade.bin");
    EXPECT_THAT(groups("camera.rgen sky.rmiss.spv shade.bin"),
                ElementsAre("general camera.rgen", "general sky.rmiss.spv", "triangles shade.bin"));
}

TEST_F(Stages, FentryPointChoosesAmongEntryPoints) {
    ASSERT_EQ(rtc("-c sky.rmiss").status, 0);
    CliRun run = rtc("camera.rgen -fentry-point=main sky.rmiss.spv -o out.spv");
    EXPECT_EQ(run.status, 0) << run.err;
    run = rtc("camera.rgen -fentry-point=other sky.rmiss.spv");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err,
                HasSubstr("sky.rmiss.spv: error: the module has no ray tracing entry point 'other'"));
    EXPECT_THAT(run.err, HasSubstr("it has rmiss 'main'"));
    EXPECT_EQ(rtc("-fentry-point= camera.rgen").status, 1);
}

TEST_F(Stages, StageNamesKindFileEntryAndConstants) {
    ASSERT_EQ(rtc("-c camera.rgen").status, 0);
    const auto json = reflection(
        "--stage dark=rgen:camera.rgen.spv:main,spec.3=0.5 "
        "--stage=light=rgen:camera.rgen,spec.3=2 sky.rmiss");
    EXPECT_EQ(json["stages"][0]["name"], "dark");
    EXPECT_EQ(json["stages"][1]["name"], "light");
    EXPECT_EQ(json["groups"][0]["name"], "dark");
    EXPECT_EQ(json["groups"][1]["name"], "light");
}

TEST_F(Stages, SpecialisationChangesTheModule) {
    const auto make = [&](const std::string& value) {
        EXPECT_EQ(rtc("--stage cam=rgen:camera.rgen,spec.3=" + value + " sky.rmiss -S -o -").status, 0);
        return rtc("--stage cam=rgen:camera.rgen,spec.3=" + value + " sky.rmiss -S -o -").out;
    };
    EXPECT_THAT(make("0.625"), HasSubstr(" 0.625"));
    EXPECT_NE(make("0.625"), make("0.75"));
    EXPECT_EQ(make("0.5"), make("5e-1"));
}

TEST_F(Stages, SpecialisationMistakes) {
    CliRun run = rtc("--stage cam=rgen:camera.rgen,spec.9=1 sky.rmiss");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("stage 'cam' has no specialisation constant 9"));
    run = rtc("--stage cam=rgen:camera.rgen,spec.3=red sky.rmiss");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("'red' is no floating-point number"));
    EXPECT_EQ(rtc("--stage cam=rgen:camera.rgen,spec.x=1").status, 1);
    EXPECT_EQ(rtc("--stage cam=rgen:camera.rgen,spec.3=").status, 1);
    EXPECT_EQ(rtc("--stage cam=rgen:camera.rgen,const.3=1").status, 1);
}

TEST_F(Stages, StageMistakes) {
    EXPECT_EQ(rtc("--stage camera.rgen").status, 1);
    EXPECT_EQ(rtc("--stage cam=camera.rgen").status, 1);
    EXPECT_EQ(rtc("--stage cam=rgen:").status, 1);
    CliRun run = rtc("--stage cam=vert:camera.rgen");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("'vert' is no stage"));
    run = rtc("--stage cam=rgen:camera.rgen --stage cam=rmiss:sky.rmiss");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("two stages are named 'cam'"));
    run = rtc("--stage cam=rgen:camera.rgen:start");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("the entry point of GLSL is main, not 'start'"));
    ASSERT_EQ(rtc("-c sky.rmiss").status, 0);
    run = rtc("--stage cam=rgen:sky.rmiss.spv");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("the module has no rgen entry point"));
}

TEST_F(Stages, HitGroupsMayNameStages) {
    EXPECT_THAT(
        groups("camera.rgen sky.rmiss --stage glass=rchit:shade.rchit --hit-group g=glass,cutout.rahit"),
        ElementsAre("general camera.rgen", "general sky.rmiss", "triangles g"));
}

TEST_F(Stages, FilesOfOneNameInTwoFoldersAreTwoStages) {
    copy_shaders("nv", "more");
    EXPECT_THAT(groups("camera.rgen sky.rmiss more/sky.rmiss"),
                ElementsAre("general camera.rgen", "general sky.rmiss", "general more/sky.rmiss"));
    const CliRun run = rtc("camera.rgen sky.rmiss sky.rmiss");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("two stages are named 'sky.rmiss'"));
}

TEST_F(Stages, PipelineFileSaysTheSame) {
    write("p.json", R"({
        "stages": [
            {"name": "cam", "kind": "rgen", "file": "camera.rgen", "spec": {"3": 0.5}},
            {"file": "sky.rmiss", "entry": "main"},
            {"name": "shade", "file": "shade.rchit"},
            {"name": "cutout", "file": "cutout.rahit"}
        ],
        "groups": [
            {"general": "cam"},
            {"name": "leaf", "closestHit": "shade", "anyHit": "cutout", "intersection": null},
            {"general": "sky.rmiss"},
            {"name": "nothing"}
        ]
    })");
    ASSERT_EQ(rtc("--pipeline p.json -o file.spv").status, 0);
    EXPECT_THAT(groups("--pipeline=p.json"),
                ElementsAre("general cam", "triangles leaf", "general sky.rmiss", "triangles nothing"));
}

TEST_F(Stages, PipelineFileMakesGroupsAsTheCommandLineDoes) {
    write("sub/p.json", R"({"stages": [{"file": "../camera.rgen"}, {"file": "../sky.rmiss"},
                                       {"file": "../shade.rchit"}]})");
    ASSERT_EQ(rtc("--pipeline sub/p.json -o file.spv").status, 0) << "files are relative to the JSON file";
    EXPECT_THAT(groups("--pipeline sub/p.json"),
                ElementsAre("general camera.rgen", "general sky.rmiss", "triangles shade.rchit"));
}

}  // namespace
