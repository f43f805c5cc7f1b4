// What must end in a clear message and never in a crash.
#include "cli_fixture.h"

using ::testing::HasSubstr;
using ::testing::StartsWith;

namespace {

class BadInput : public Cli {};

TEST_F(BadInput, NoInput) {
    const CliRun run = rtc("");
    EXPECT_EQ(run.status, 1);
    EXPECT_EQ(run.err, "rtc: error: no input files\n");
}

TEST_F(BadInput, UnknownOptions) {
    write("a.rmiss", miss_shader());
    for (const char* option :
         {"-fnothing", "--nothing", "--nothing=3", "-Z", "--report=yes", "-mfmt", "-Wall", "-std"}) {
        const CliRun run = rtc("a.rmiss " + std::string(option));
        EXPECT_EQ(run.status, 1) << option;
        EXPECT_THAT(run.err, StartsWith("rtc: error: unknown argument: '" + std::string(option) + "'"))
            << option;
    }
}

TEST_F(BadInput, OptionsWithoutTheirValue) {
    for (const char* option :
         {"-o", "-D", "-U", "-I", "-MF", "-MT", "-x", "--hit-group", "--stage", "--pipeline", "--reflect",
          "--target-env", "--max-recursion-depth", "--max-callable-depth", "--reserved", "--dump-after"}) {
        const CliRun run = rtc("a.rmiss " + std::string(option));
        EXPECT_EQ(run.status, 1) << option;
        EXPECT_THAT(run.err, HasSubstr("argument to '" + std::string(option) + "' is missing")) << option;
    }
}

TEST_F(BadInput, MissingFile) {
    const CliRun run = rtc("gone.rgen");
    EXPECT_EQ(run.status, 1);
    EXPECT_EQ(run.err, "rtc: error: cannot open input file: 'gone.rgen': No such file or directory\n");
}

TEST_F(BadInput, AFolder) {
    std::filesystem::create_directory(folder_ / "d.rgen");
    const CliRun run = rtc("d.rgen");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("'d.rgen': is a directory"));
}

TEST_F(BadInput, UnknownStageExtension) {
    write("a.vert", "#version 460\nvoid main() {}\n");
    const CliRun run = rtc("a.vert");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("a.vert: error: cannot tell the shader stage"));
}

TEST_F(BadInput, EmptyFile) {
    write("a.rgen", "");
    const CliRun run = rtc("a.rgen");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("a.rgen:1: error: no #version"));
}

TEST_F(BadInput, NoMain) {
    write("a.rgen", "#version 460\n#extension GL_NV_ray_tracing : require\n");
    const CliRun run = rtc("a.rgen");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("a.rgen: error: "));
    EXPECT_THAT(run.err, HasSubstr("Missing entry point"));
}

TEST_F(BadInput, BytesThatAreNoText) {
    std::string bytes;
    for (int i = 0; i < 4096; ++i) bytes += static_cast<char>(i * 37);
    write("a.rgen", bytes);
    EXPECT_EQ(rtc("a.rgen").status, 1);
    write("b.rgen", "#version 460\n" + bytes);
    EXPECT_EQ(rtc("b.rgen").status, 1);
}

TEST_F(BadInput, WrongMagicInASpvFile) {
    write("a.spv", "not SPIR-V at all!!!");
    const CliRun run = rtc("a.spv");
    EXPECT_EQ(run.status, 1);
    EXPECT_EQ(run.err, "a.spv: error: not a SPIR-V module: wrong magic number\n");
}

TEST_F(BadInput, TruncatedSpirv) {
    write("a.rmiss", miss_shader());
    write("a.rgen", raygen_shader());
    ASSERT_EQ(rtc("-c a.rmiss").status, 0);
    const std::string whole = read("a.rmiss.spv");
    for (size_t size :
         {size_t{4}, size_t{16}, size_t{19}, size_t{24}, whole.size() / 2 + 1, whole.size() - 3}) {
        write("cut.spv", whole.substr(0, size));
        const CliRun run = rtc("a.rgen cut.spv");
        EXPECT_EQ(run.status, 1) << size;
        EXPECT_THAT(run.err, StartsWith("cut.spv: error: ")) << size;
    }
    // Cut between instructions: the framing is whole, the module is not.
    for (size_t at = 5 * 4; at < whole.size();) {
        write("cut.spv", whole.substr(0, at));
        const CliRun run = rtc("a.rgen cut.spv");
        EXPECT_EQ(run.status, 1) << at;
        EXPECT_THAT(run.err, HasSubstr("error: ")) << at;
        const size_t step = (words_of(whole)[at / 4] >> 16) * 4;
        at += step * 5 < whole.size() / 8 ? step : step * 5;
        if (at > whole.size() / 3) break;
    }
}

TEST_F(BadInput, SpirvOfTheOtherEndianness) {
    write("a.rmiss", miss_shader());
    write("a.rgen", raygen_shader());
    ASSERT_EQ(rtc("-c a.rmiss").status, 0);
    std::string swapped = read("a.rmiss.spv");
    for (size_t i = 0; i + 3 < swapped.size(); i += 4) {
        std::swap(swapped[i], swapped[i + 3]);
        std::swap(swapped[i + 1], swapped[i + 2]);
    }
    write("swapped.spv", swapped);
    const CliRun run = rtc("a.rgen swapped.spv -o out.spv");
    EXPECT_EQ(run.status, 0) << run.err;
}

TEST_F(BadInput, SpirvOfAnotherKindOfShader) {
    write("a.rmiss", miss_shader());
    write("a.rgen", raygen_shader());
    ASSERT_EQ(rtc("a.rgen a.rmiss -o compute.spv").status, 0);
    const CliRun run = rtc("a.rgen compute.spv");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("compute.spv: error: the module has no ray tracing entry point"));
}

TEST_F(BadInput, NoRayGeneration) {
    write("a.rmiss", miss_shader());
    const CliRun run = rtc("a.rmiss");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("ray generation"));
}

struct JsonCase {
    const char* text;
    const char* message;
};

TEST_F(BadInput, PipelineFiles) {
    write("a.rgen", raygen_shader());
    write("a.rmiss", miss_shader());
    write("bad.spv", "no");
    const JsonCase cases[] = {
        {"", "p.json:1:1: error: unexpected end of the file"},
        {"{", "p.json:1:2: error: expected a member's name in quotes"},
        {"[]", "p.json:1:1: error: expected an object, found an array"},
        {"{}", "p.json:1:1: error: \"stages\" is missing"},
        {"{\"stages\": 3}", "p.json:1:12: error: expected an array, found a number"},
        {"{\"stages\": [],}", "p.json:1:15: error: expected a member's name in quotes"},
        {"{\"stages\": [] \"groups\": []}", "p.json:1:15: error: expected ',' or '}'"},
        {"{\n  \"stages\": [\n    {\"file\": \"a.rgen\", \"color\": 1}\n  ]\n}",
         "p.json:3:24: error: unknown member \"color\""},
        {"{\"stages\": [{\"name\": \"x\"}]}", "p.json:1:13: error: \"file\" is missing"},
        {"{\"stages\": [{\"file\": \"gone.rgen\"}]}",
         "p.json:1:22: error: cannot open input file: 'gone.rgen'"},
        {"{\"stages\": [{\"file\": \"bad.spv\"}]}", "bad.spv: error: not a SPIR-V module"},
        {"{\"stages\": [{\"file\": \"a.rgen\", \"kind\": \"vert\"}]}",
         "p.json:1:40: error: \"vert\" is no stage"},
        {"{\"stages\": [{\"file\": \"a.rgen\"}, {\"file\": \"a.rgen\"}]}", "two stages are named 'a.rgen'"},
        {"{\"stages\": [{\"file\": \"a.rgen\", \"file\": \"a.rgen\"}]}",
         "p.json:1:32: error: duplicate name \"file\""},
        {"{\"stages\": [{\"file\": \"a.rgen\"}], \"groups\": [{\"general\": \"b\"}]}",
         "p.json:1:57: error: no stage is named \"b\""},
        {"{\"stages\": [{\"file\": \"a.rgen\"}], \"groups\": []}", "error: stage \"a.rgen\" is in no group"},
        {"{\"stages\": [{\"file\": \"a.rgen\"}], \"groups\": [{\"general\": \"a.rgen\", \"anyHit\": "
         "\"a.rgen\"}]}",
         "error: a group is general or a hit group, not both"},
        {"{\"stages\": [{\"file\": \"a.rgen\"}], \"groups\": [{\"name\": \"a\", \"general\": \"a.rgen\"},"
         " {\"name\": \"a\"}]}",
         "error: two groups are named 'a'"},
        {"{\"stages\": [{\"file\": \"a.rgen\", \"spec\": {\"x\": 1}}]}",
         "p.json:1:41: error: \"x\" is no specialisation constant's id"},
        {"{\"stages\": [{\"file\": \"a.rgen\", \"spec\": {\"1\": [1]}}]}",
         "error: expected a number, a bool or a string, found an array"},
        {"{\"stages\": [tru]}", "p.json:1:13: error: expected a value, found 'tru'"},
        {"{\"stages\": \"\\q\"}", "error: unknown escape '\\q'"},
        {"{\"stages\": \"abc", "error: unexpected end of the file in a string"},
        {"{\"stages\": []} x", "p.json:1:16: error: expected the end of the file"},
    };
    for (const JsonCase& bad : cases) {
        write("p.json", bad.text);
        const CliRun run = rtc("--pipeline p.json");
        EXPECT_EQ(run.status, 1) << bad.text;
        EXPECT_THAT(run.err, HasSubstr(bad.message)) << bad.text;
    }
    write("p.json", "{\"stages\": " + std::string(100000, '['));
    EXPECT_THAT(rtc("--pipeline p.json").err, HasSubstr("nested too deeply"));
    EXPECT_EQ(rtc("--pipeline gone.json").status, 1);
}

TEST_F(BadInput, NumberedColumnsCountCharacters) {
    write("p.json", "{\"stages\": [{\"name\": \"größe\", \"colour\": 1}]}");
    EXPECT_THAT(rtc("--pipeline p.json").err, HasSubstr("p.json:1:31: error: unknown member \"colour\""));
}

// ---- Spellings of the 2019 talk and of early headers ------------------------------

TEST_F(BadInput, SeedSpellingsNameTheReplacement) {
    write("a.rchit",
          "#version 460\n#extension GL_NV_ray_tracing : require\n"
          "rayPayloadInNV primaryPayload { vec4 color; } p;\n"
          "void main() {\n"
          "    p.color = vec4(gl_hitTNV);\n"
          "    p.color.xyz = vec3(gl_GlobalInvocationIDNV);\n}\n");
    const CliRun run = rtc("-c a.rchit");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("a.rchit:5: error: 'gl_hitTNV' : undeclared identifier; write gl_HitTNV"));
    EXPECT_THAT(run.err,
                HasSubstr("a.rchit:6: error: 'gl_GlobalInvocationIDNV' : undeclared identifier; write "
                          "gl_LaunchIDNV"));
}

TEST_F(BadInput, DeclarationsWithoutUniform) {
    write("a.rgen",
          "#version 460\n#extension GL_NV_ray_tracing : require\n"
          "layout(set = 0, binding = 0) accelerationStructureNV scene;\nvoid main() {}\n");
    EXPECT_THAT(rtc("-c a.rgen").err, HasSubstr("a.rgen:3: error: "));
    EXPECT_THAT(rtc("-c a.rgen").err, HasSubstr("write `uniform` before the type"));
}

TEST_F(BadInput, BlocksUsedByTheirName) {
    write("a.rgen",
          "#version 460\n#extension GL_NV_ray_tracing : require\n"
          "layout(location = 1) rayPayloadNV primaryPayload { vec4 color; };\n"
          "void main() { primaryPayload.color = vec4(0.0); }\n");
    const CliRun run = rtc("-c a.rgen");
    EXPECT_THAT(run.err, HasSubstr("a.rgen:4: error: "));
    EXPECT_THAT(run.err, HasSubstr("give the block an instance"));
    EXPECT_THAT(run.err, HasSubstr("\n1 error generated.")) << "consequences are not listed";
}

TEST_F(BadInput, BlocksWithoutASemicolon) {
    write("a.rgen",
          "#version 460\n#extension GL_NV_ray_tracing : require\n"
          "layout(location = 1) rayPayloadNV primaryPayload {\n    vec4 color;\n}\n\nvoid main() {}\n");
    EXPECT_THAT(rtc("-c a.rgen").err, HasSubstr("end it with `};` or an instance name"));
}

TEST_F(BadInput, NoExtension) {
    write("a.rgen",
          "#version 460\nlayout(set = 0, binding = 0) uniform accelerationStructureNV scene;\nvoid main() "
          "{}\n");
    EXPECT_THAT(rtc("-c a.rgen").err, HasSubstr("write #extension GL_NV_ray_tracing : require"));
    write("b.rgen", "#version 460\n#extension GL_NVX_raytracing : require\nvoid main() {}\n");
    EXPECT_THAT(rtc("-c b.rgen").err, HasSubstr("write #extension GL_NV_ray_tracing : require"));
}

TEST_F(BadInput, PositionFetchIsNamed) {
    write("a.rchit",
          "#version 460\n#extension GL_EXT_ray_tracing : require\n"
          "#extension GL_EXT_ray_tracing_position_fetch : require\nvoid main() {}\n");
    const CliRun run = rtc("-c a.rchit");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("a.rchit:3: error: "));
    EXPECT_THAT(run.err, HasSubstr("does not know position fetch; give the stage as SPIR-V"));
}

}  // namespace
