// -o -S -mfmt= -c, standard input and output, names of outputs.
#include "cli_fixture.h"

using ::testing::HasSubstr;
using ::testing::StartsWith;

namespace {

class Output : public Cli {
  protected:
    Output() {
        write("a.rgen", raygen_shader());
        write("b.rmiss", miss_shader());
    }
};

TEST_F(Output, WithoutOptionsIsASpv) {
    const CliRun run = rtc("a.rgen b.rmiss");
    EXPECT_EQ(run.status, 0) << run.err;
    EXPECT_EQ(run.out + run.err, "");
    EXPECT_TRUE(is_module(read("a.spv")));
    EXPECT_TRUE(is_valid_for(read("a.spv"), "vulkan1.1"));
}

TEST_F(Output, DashOWithAndWithoutABlank) {
    EXPECT_EQ(rtc("a.rgen b.rmiss -o one.spv").status, 0);
    EXPECT_EQ(rtc("-otwo.spv a.rgen b.rmiss").status, 0);
    EXPECT_TRUE(is_module(read("one.spv")));
    EXPECT_EQ(read("one.spv"), read("two.spv"));
}

TEST_F(Output, DashODashIsStandardOutput) {
    const CliRun run = rtc("a.rgen b.rmiss -o -");
    EXPECT_EQ(run.status, 0);
    EXPECT_TRUE(is_module(run.out));
    EXPECT_FALSE(exists("a.spv"));
}

TEST_F(Output, DashOIntoAMissingFolderFails) {
    const CliRun run = rtc("a.rgen b.rmiss -o no/such/folder.spv");
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("rtc: error: cannot write output file: 'no/such/folder.spv'"));
}

TEST_F(Output, NothingIsWrittenWhenCompilingFails) {
    write("a.rgen", "#version 460\nnonsense\n");
    EXPECT_EQ(rtc("a.rgen b.rmiss -o out.spv").status, 1);
    EXPECT_FALSE(exists("out.spv"));
}

TEST_F(Output, DashSIsAssembly) {
    EXPECT_EQ(rtc("-S a.rgen b.rmiss").status, 0);
    EXPECT_THAT(read("a.spvasm"), HasSubstr("OpEntryPoint GLCompute"));
    EXPECT_THAT(rtc("-S a.rgen b.rmiss -o -").out, StartsWith("; SPIR-V"));
}

TEST_F(Output, MfmtBinIsTheDefault) {
    rtc("a.rgen b.rmiss -o plain.spv");
    EXPECT_EQ(rtc("-mfmt=bin a.rgen b.rmiss -o bin.spv").status, 0);
    EXPECT_EQ(read("bin.spv"), read("plain.spv"));
}

TEST_F(Output, MfmtNumIsAListOfWords) {
    rtc("a.rgen b.rmiss -o plain.spv");
    EXPECT_EQ(rtc("-mfmt=num a.rgen b.rmiss -o list").status, 0);
    const std::string list = read("list");
    EXPECT_THAT(list, StartsWith("0x07230203,"));
    EXPECT_EQ(std::count(list.begin(), list.end(), ',') + 1,
              static_cast<std::ptrdiff_t>(read("plain.spv").size() / 4));
}

TEST_F(Output, MfmtCIsAnInitializer) {
    EXPECT_EQ(rtc("-mfmt=c a.rgen b.rmiss -o list").status, 0);
    EXPECT_THAT(read("list"), StartsWith("{0x07230203,"));
    EXPECT_EQ(read("list").back(), '\n');
    EXPECT_EQ(read("list")[read("list").size() - 2], '}');
}

TEST_F(Output, MfmtRefusesOtherFormatsAndOutputsThatAreNoBinary) {
    EXPECT_THAT(rtc("-mfmt=hex a.rgen").err, HasSubstr("invalid value 'hex' in '-mfmt=hex'"));
    EXPECT_EQ(rtc("-mfmt=hex a.rgen").status, 1);
    EXPECT_EQ(rtc("-mfmt=c -S a.rgen").status, 1);
    EXPECT_EQ(rtc("-mfmt=num -E a.rgen").status, 1);
    EXPECT_EQ(rtc("-mfmt=num -M a.rgen").status, 1);
}

TEST_F(Output, DashCCompilesEachStageByItself) {
    write("folder/c.rmiss", miss_shader());
    EXPECT_EQ(rtc("-c a.rgen folder/c.rmiss").status, 0);
    EXPECT_THAT(disassembled(read("a.rgen.spv")), HasSubstr("OpEntryPoint RayGeneration"));
    EXPECT_THAT(disassembled(read("c.rmiss.spv")), HasSubstr("OpEntryPoint Miss"));
    EXPECT_FALSE(exists("a.spv"));
    EXPECT_EQ(rtc("-c a.rgen b.rmiss -o x.spv").status, 1) << "one name for two outputs";
    EXPECT_EQ(rtc("-c -S a.rgen").status, 0);
    EXPECT_THAT(read("a.rgen.spvasm"), HasSubstr("OpTrace"));
}

TEST_F(Output, DashReadsStandardInput) {
    rtc("a.rgen b.rmiss -o plain.spv");
    EXPECT_EQ(rtc("a.rgen -fshader-stage=rmiss - -o piped.spv", miss_shader()).status, 0);
    EXPECT_TRUE(is_module(read("piped.spv")));
    const CliRun run = rtc("-", miss_shader());
    EXPECT_EQ(run.status, 1);
    EXPECT_THAT(run.err, HasSubstr("<stdin>: error: cannot tell the shader stage"));
}

TEST_F(Output, StandardInputMayBeSpirv) {
    ASSERT_EQ(rtc("-c b.rmiss").status, 0);
    const CliRun run = rtc("a.rgen - -o out.spv", read("b.rmiss.spv"));
    EXPECT_EQ(run.status, 0) << run.err;
    EXPECT_TRUE(is_module(read("out.spv")));
}

TEST_F(Output, DoubleDashEndsOptions) {
    write("-odd.rmiss", miss_shader());
    EXPECT_EQ(rtc("a.rgen -o out.spv -- -odd.rmiss").status, 0);
    EXPECT_TRUE(is_module(read("out.spv")));
}

}  // namespace
