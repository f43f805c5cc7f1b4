// --reflect --report --dump-after --help --version @FILE.
#include <nlohmann/json.hpp>

#include "cli_fixture.h"

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

namespace {

class Report : public Cli {
  protected:
    Report() { copy_shaders("nv"); }
};

TEST_F(Report, ReflectWritesJson) {
    ASSERT_EQ(rtc("camera.rgen sky.rmiss shade.rchit --reflect r.json").status, 0);
    EXPECT_TRUE(is_module(read("a.spv")));
    const auto json = nlohmann::json::parse(read("r.json"));
    EXPECT_EQ(json["stages"].size(), 3u);
    EXPECT_EQ(json["stages"][0]["kind"], "rgen");
    ASSERT_EQ(json["traceSites"].size(), 1u);
    EXPECT_EQ(json["traceSites"][0]["file"], "camera.rgen");
    EXPECT_EQ(json["traceSites"][0]["line"], 21);
    bool image = false;
    for (const auto& resource : json["resources"])
        image |= resource["name"] == "image" && resource["set"] == 0 && resource["binding"] == 1 &&
                 resource["type"] == "storage-image";
    EXPECT_TRUE(image) << json["resources"].dump();
}

TEST_F(Report, ReflectToStandardOutput) {
    const CliRun run = rtc("camera.rgen sky.rmiss --reflect=-");
    EXPECT_EQ(run.status, 0);
    EXPECT_TRUE(nlohmann::json::accept(run.out));
}

TEST_F(Report, ReflectReadsAFinishedModule) {
    ASSERT_EQ(rtc("camera.rgen sky.rmiss -o p.spv --reflect made.json").status, 0);
    const CliRun run = rtc("p.spv --reflect read.json");
    EXPECT_EQ(run.status, 0) << run.err;
    EXPECT_EQ(read("read.json"), read("made.json"));
    EXPECT_FALSE(exists("a.spv"));
}

TEST_F(Report, ReflectOfAModuleWithoutReflection) {
    ASSERT_EQ(rtc("camera.rgen sky.rmiss -o p.spv").status, 0);
    // What a stripper leaves: every OpString is gone.
    std::string stripped;
    const std::vector<uint32_t> words = words_of(read("p.spv"));
    for (size_t at = 0; at < words.size();) {
        const size_t count = at == 0 ? 5 : words[at] >> 16;
        if (at == 0 || (words[at] & 0xffff) != 7)
            stripped.append(reinterpret_cast<const char*>(&words[at]), count * 4);
        at += count;
    }
    write("stripped.spv", stripped);
    const CliRun run = rtc("stripped.spv --reflect r.json");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("stripped.spv: error: the module carries no rtc reflection"));
    EXPECT_FALSE(exists("r.json"));
}

TEST_F(Report, ReportSaysStatesAndTraceSites) {
    const CliRun run = rtc("camera.rgen sky.rmiss --report -o out.spv");
    EXPECT_EQ(run.status, 0);
    EXPECT_THAT(run.out, StartsWith("out.spv: SPIR-V 1.3, "));
    EXPECT_THAT(run.out, HasSubstr(" instructions, "));
    EXPECT_THAT(run.out, HasSubstr("  0   general     camera.rgen\n"));
    EXPECT_THAT(run.out, HasSubstr("camera.rgen:21: trace, "));
}

// Ray generation keeps its variables in registers; a closest-hit that traces has a frame.
TEST_F(Report, ReportNamesWhatIsSaved) {
    write("again.rchit",
          "#version 460\n#extension GL_NV_ray_tracing : require\n"
          "layout(set = 0, binding = 0) uniform accelerationStructureNV scene;\n"
          "layout(location = 0) rayPayloadInNV vec4 color;\n"
          "layout(location = 1) rayPayloadNV vec4 inner;\n"
          "void main() {\n"
          "    vec2 kept = gl_WorldRayDirectionNV.xy * gl_HitTNV;\n"
          "    traceNV(scene, 0, 0xff, 0, 0, 0, vec3(1.0), 0.0, vec3(0, 1, 0), 1e9, 1);\n"
          "    color = inner + kept.xyxy;\n}\n");
    const CliRun run = rtc("camera.rgen sky.rmiss again.rchit --max-recursion-depth=2 --report -o out.spv");
    EXPECT_EQ(run.status, 0) << run.err;
    EXPECT_THAT(run.out, HasSubstr("camera.rgen:21: trace, 0 bytes\n"));
    EXPECT_THAT(run.out, ::testing::ContainsRegex("again.rchit:8: trace, [1-9][0-9]* bytes: .*kept"));
}

TEST_F(Report, ReportSaysWhatExactWantsOfStepBudgets) {
    EXPECT_THAT(rtc("camera.rgen sky.rmiss --accuracy=exact --report -o p.spv").out, HasSubstr("step budgets below 6600"));
    EXPECT_THAT(rtc("camera.rgen sky.rmiss --accuracy=exact --no-resumable --report -o p.spv").out,
                ::testing::Not(HasSubstr("step budgets")));
    EXPECT_THAT(rtc("camera.rgen sky.rmiss --report -o p.spv").out, ::testing::Not(HasSubstr("step budgets")));
}

TEST_F(Report, ReportOfAFinishedModule) {
    ASSERT_EQ(rtc("camera.rgen sky.rmiss -o p.spv --report").status, 0);
    // All but the comparison with the pipeline linked another way, which a module does not know.
    const std::string linked = rtc("camera.rgen sky.rmiss -o p.spv --report").out;
    EXPECT_EQ(rtc("p.spv --report").out, linked.substr(0, linked.find("removed by what is known")));
}

// Each fact's own part, with the others known; what follows from the pipeline's shape has none.
TEST_F(Report, ReportTellsWhatOneFactRemoves) {
    const CliRun run = rtc("camera.rgen sky.rmiss shade.rchit --assume=single-level --report -o p.spv");
    EXPECT_EQ(run.status, 0) << run.err;
    const size_t at = run.out.find("instructions removed by one fact alone, the others known:\n");
    ASSERT_NE(at, std::string::npos) << run.out;
    const std::string facts = run.out.substr(at);
    EXPECT_THAT(facts, ::testing::ContainsRegex("\n  cull mask +[1-9][0-9]*\n"));
    EXPECT_THAT(facts, ::testing::ContainsRegex("\n  single-level +[1-9][0-9]*\n"));
    EXPECT_THAT(facts, Not(HasSubstr("recursion depth")));
    EXPECT_THAT(facts, Not(HasSubstr("identity-transforms")));
    EXPECT_THAT(rtc("camera.rgen sky.rmiss --no-specialize --report -o p.spv").out, Not(HasSubstr("one fact alone")));
}

TEST_F(Report, ReportLeavesStandardOutputToTheModule) {
    const CliRun run = rtc("camera.rgen sky.rmiss --report -o -");
    EXPECT_TRUE(is_module(run.out));
    EXPECT_THAT(run.err, HasSubstr("trace, "));
}

TEST_F(Report, DumpAfterPrintsAndStops) {
    const CliRun run = rtc("camera.rgen sky.rmiss --dump-after=split");
    EXPECT_EQ(run.status, 0) << run.err;
    EXPECT_THAT(run.out, HasSubstr("OpFunction"));
    EXPECT_FALSE(exists("a.spv"));
    EXPECT_EQ(rtc("camera.rgen --dump-after=").status, 1);
}

TEST_F(Report, Help) {
    const CliRun run = rtc("--help");
    EXPECT_EQ(run.status, 0);
    EXPECT_EQ(run.err, "");
    EXPECT_EQ(rtc("-h").out, run.out);
    for (const char* option : {"-c ",
                               "-D",
                               "--dump-after",
                               "-E ",
                               "-fentry-point=",
                               "-fshader-stage=",
                               "-g ",
                               "--hit-group",
                               "-I",
                               "-M ",
                               "-MM ",
                               "-MD ",
                               "-MF ",
                               "-MT ",
                               "--checked ",
                               "--max-callable-depth",
                               "--max-recursion-depth",
                               "-mfmt=",
                               "--no-resumable",
                               "--no-validate",
                               "-O ",
                               "-Os ",
                               "-O0 ",
                               "-o ",
                               "--pipeline",
                               "--reflect",
                               "--report",
                               "--reserved",
                               "-S ",
                               "--stage",
                               "-std=",
                               "--target-env",
                               "-U",
                               "--version",
                               "-w ",
                               "-Werror ",
                               "-x ",
                               "@<file>"})
        EXPECT_THAT(run.out, HasSubstr(std::string("\n  ") + option)) << option;
}

TEST_F(Report, Version) {
    const CliRun run = rtc("--version");
    EXPECT_EQ(run.status, 0);
    EXPECT_THAT(run.out, StartsWith("rtc "));
    EXPECT_THAT(run.out, HasSubstr("glslang "));
}

TEST_F(Report, ResponseFileHoldsOptions) {
    write("my files.rmiss", read("sky.rmiss"));
    write("args.rsp", "camera.rgen 'my files.rmiss'\n  -o \"from response.spv\" -DNAME=a\\ b\n@more.rsp");
    write("more.rsp", "-O0");
    const CliRun run = rtc("@args.rsp");
    EXPECT_EQ(run.status, 0) << run.err;
    EXPECT_TRUE(is_module(read("from response.spv")));
}

TEST_F(Report, ResponseFileMistakes) {
    CliRun run = rtc("@gone.rsp");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("cannot open response file: 'gone.rsp'"));
    write("loop.rsp", "@loop.rsp");
    run = rtc("@loop.rsp");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("nested too deeply"));
    write("open.rsp", "camera.rgen\n'my files.rmiss' \\\n -o \"never closed.spv\n-O0\n");
    run = rtc("@open.rsp");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("open.rsp:3: error: a quote (\") that begins here is not closed"));
}

}  // namespace
