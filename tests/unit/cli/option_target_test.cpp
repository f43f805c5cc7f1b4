// --target-env= -O0 -O -Os -g --max-recursion-depth= --max-callable-depth= --reserved= --no-*.
#include <nlohmann/json.hpp>

#include <set>
#include <string>

#include "cli_fixture.h"

using ::testing::HasSubstr;
using ::testing::Not;

namespace {

class Target : public Cli {
  protected:
    std::string module(const std::string& options, const std::string& dialect = "nv") {
        copy_shaders(dialect);
        const CliRun run = rtc("camera.rgen sky.rmiss shade.rchit -o out.spv " + options);
        EXPECT_EQ(run.status, 0) << run.err;
        return read("out.spv");
    }
    nlohmann::json reflection(const std::string& options, const std::string& dialect = "nv") {
        copy_shaders(dialect);
        const CliRun run = rtc("camera.rgen sky.rmiss shade.rchit -o out.spv --reflect out.json " + options);
        EXPECT_EQ(run.status, 0) << run.err;
        return nlohmann::json::parse(read("out.json"));
    }
};

TEST_F(Target, DefaultFollowsTheDialect) {
    EXPECT_TRUE(is_valid_for(module("", "nv"), "vulkan1.1"));
    EXPECT_TRUE(is_valid_for(module("", "ext"), "vulkan1.2"));
    EXPECT_EQ(reflection("", "nv")["spirvVersion"], "1.3");
}

TEST_F(Target, TargetEnvIsIndependentOfTheInput) {
    EXPECT_TRUE(is_valid_for(module("--target-env=vulkan1.1", "ext"), "vulkan1.1"));
    EXPECT_TRUE(is_valid_for(module("--target-env=vulkan1.2", "nv"), "vulkan1.2"));
    EXPECT_TRUE(is_valid_for(module("--target-env vulkan1.3", "nv"), "vulkan1.3"));
}

TEST_F(Target, TargetEnvRefusesOthers) {
    copy_shaders("nv");
    for (const char* bad : {"vulkan1.0", "vulkan", "opengl", "1.1", ""}) {
        const CliRun run = rtc("camera.rgen --target-env=" + std::string(bad));
        EXPECT_EQ(run.status, 1) << bad;
        EXPECT_THAT(run.err, HasSubstr("expected vulkan1.1, vulkan1.2 or vulkan1.3"));
    }
}

TEST_F(Target, DashO0IsTheDefault) { EXPECT_EQ(module("-O0"), module("")); }

TEST_F(Target, DashOMakesADifferentValidModule) {
    const std::string plain = module("");
    const std::string fast = module("-O");
    EXPECT_NE(fast, plain);
    EXPECT_TRUE(is_valid_for(fast, "vulkan1.1"));
}

TEST_F(Target, DashOsMakesASmallerModule) {
    const std::string small = module("-Os");
    EXPECT_LT(small.size(), module("").size());
    EXPECT_TRUE(is_valid_for(small, "vulkan1.1"));
}

TEST_F(Target, TheLastOptimisationLevelWins) { EXPECT_EQ(module("-O -Os -O0"), module("-O0")); }

TEST_F(Target, DashGKeepsLinesAndNamesAsGiven) {
    copy_shaders("nv", "src");
    ASSERT_EQ(rtc("-g src/camera.rgen src/sky.rmiss -o out.spv").status, 0);
    const std::string text = disassembled(read("out.spv"));
    EXPECT_THAT(text, HasSubstr("OpLine"));
    EXPECT_THAT(text, HasSubstr("\"src/camera.rgen\""));
    EXPECT_TRUE(is_valid_for(read("out.spv"), "vulkan1.1"));
}

TEST_F(Target, WithoutDashGThereIsNoSource) {
    const std::string text = disassembled(module(""));
    EXPECT_THAT(text, Not(HasSubstr("OpLine")));
    EXPECT_THAT(text, Not(HasSubstr("OpSource ")));
    EXPECT_THAT(text, Not(HasSubstr("rayPayloadInNV")));
}

TEST_F(Target, MaxRecursionDepth) {
    EXPECT_EQ(reflection("")["maxRecursionDepth"], 1);
    EXPECT_EQ(reflection("--max-recursion-depth=5")["maxRecursionDepth"], 5);
    for (const char* bad : {"0", "32", "-1", "two", ""}) {
        const CliRun run = rtc("camera.rgen --max-recursion-depth=" + std::string(bad));
        EXPECT_EQ(run.status, 1) << bad;
        EXPECT_THAT(run.err, HasSubstr("expected 1 to 31"));
    }
}

TEST_F(Target, MaxCallableDepth) {
    EXPECT_EQ(module("--max-callable-depth=3").empty(), false);
    EXPECT_EQ(rtc("camera.rgen --max-callable-depth=32").status, 1);
    EXPECT_EQ(rtc("camera.rgen --max-callable-depth=x").status, 1);
}

TEST_F(Target, ReservedSetAndBinding) {
    EXPECT_EQ(reflection("")["reserved"]["set"], 1) << "one above the highest used";
    EXPECT_EQ(reflection("--reserved=3")["reserved"]["set"], 3);
    const auto shared = reflection("--reserved=0.20")["reserved"];
    EXPECT_EQ(shared["set"], 0);
    EXPECT_EQ(shared["binding"], 20);
    EXPECT_THAT(disassembled(read("out.spv")), HasSubstr("Binding 20"));
}

TEST_F(Target, ReservedMistakes) {
    copy_shaders("nv");
    for (const char* bad : {"", "x", "1.", ".2", "1.2.3", "-1"}) {
        const CliRun run = rtc("camera.rgen --reserved=" + std::string(bad));
        EXPECT_EQ(run.status, 1) << bad;
        EXPECT_THAT(run.err, HasSubstr("expected SET or SET.BINDING"));
    }
}

TEST_F(Target, Addressing) {
    const auto heap = reflection(""), address = reflection("--addressing=address", "ext");
    EXPECT_THAT(heap["flags"].dump(), Not(HasSubstr("addressMode")));
    EXPECT_THAT(address["flags"].dump(), HasSubstr("addressMode"));
    EXPECT_THAT(address["requiredFeatures"].dump(), HasSubstr("bufferDeviceAddress"));
    EXPECT_THAT(address["reserved"]["bindings"].dump(), Not(HasSubstr("heap")));
    // Memory is only reached by address: no capability of the heap's texel buffer is left.
    const std::string text = disassembled(module("--addressing=address"));
    EXPECT_THAT(text, HasSubstr("OpMemoryModel PhysicalStorageBuffer64"));
    EXPECT_THAT(text, Not(HasSubstr("OpCapability SampledBuffer")));
    for (const char* target : {"vulkan1.1", "vulkan1.2", "vulkan1.3"})
        EXPECT_TRUE(is_valid_for(module(std::string("--addressing=address --target-env=") + target, "ext"), target));
    const CliRun run = rtc("camera.rgen --addressing=pointer");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("expected heap or address"));
}

TEST_F(Target, Compat) {
    copy_shaders("nv");
    write("old.rgen",
          "#version 460\n#extension GL_NV_ray_tracing : require\n"
               "layout(set = 0, binding = 0) accelerationStructureNV scene;\n"
               "layout(location = 0) rayPayloadNV payload { vec4 color; }\n"
               "void main() {\n    payload.color = vec4(gl_GlobalInvocationIDNV, 0.0);\n"
               "    traceNV(scene, 0u, 0xffu, 0u, 0u, 0u, vec3(0.0), 0.0, payload.color.xyz, 1.0, 0);\n}\n");
    EXPECT_EQ(rtc("old.rgen -o old.spv").status, 1);
    const CliRun run = rtc("old.rgen --compat=gdc2019 -o old.spv");
    EXPECT_EQ(run.status, 0) << run.err;
    const CliRun bad = rtc("old.rgen --compat=gdc2018");
    EXPECT_EQ(bad.status, 1);
    EXPECT_THAT(bad.err, HasSubstr("expected gdc2019"));
}

// Any hit, intersection and callable shaders among them; SampledBuffer is in every Vulkan device.
TEST_F(Target, DefaultModulesDeclareNoOptionalCapability) {
    for (const char* dialect : {"nv", "ext"}) {
        const std::string text = disassembled(module("", dialect));
        std::set<std::string> declared;
        for (size_t at = 0; (at = text.find("OpCapability ", at)) != std::string::npos;) {
            at += std::string("OpCapability ").size();
            declared.insert(text.substr(at, text.find('\n', at) - at));
        }
        declared.erase("SampledBuffer");
        EXPECT_EQ(declared, std::set<std::string>{"Shader"}) << dialect;
        EXPECT_THAT(text, Not(HasSubstr("OpExtension"))) << dialect;
    }
}

TEST_F(Target, NoResumable) {
    EXPECT_THAT(reflection("")["flags"].dump(), HasSubstr("resumable"));
    EXPECT_THAT(reflection("--no-resumable")["flags"].dump(), Not(HasSubstr("resumable")));
}

TEST_F(Target, CheckedTraversalInEveryTier) {
    EXPECT_THAT(reflection("")["flags"].dump(), Not(HasSubstr("checked")));
    for (const std::string tier : {"fast", "watertight", "exact", "exact64"})
        for (const std::string addressing : {"heap", "address"}) {
            const std::string options = "--checked --accuracy=" + tier + " --addressing=" + addressing;
            const char* dialect = addressing == "address" ? "ext" : "nv";
            EXPECT_THAT(reflection(options, dialect)["flags"].dump(), HasSubstr("checked"));
            EXPECT_TRUE(is_valid_for(module(options, dialect), addressing == "address" ? "vulkan1.2" : "vulkan1.1"))
                << options;
        }
}

TEST_F(Target, NoValidateGivesTheSameModule) { EXPECT_EQ(module("--no-validate"), module("")); }

}  // namespace
