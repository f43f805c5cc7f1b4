// Damaged and hostile SPIR-V: an error with a message, never a crash, a hang or a huge allocation.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <random>

#include "core_test_util.h"
#include "ir/module.h"
#include "golden_case.h"

namespace rtc::test {
namespace {

using Words = std::vector<uint32_t>;

const std::string kStoreAndTrace = std::string("OpStore %payload %float_0\n") + kTrace;

Words good_raygen() { return assemble(raygen_text(kPayload, kStoreAndTrace, kPayloadLocation)); }

LinkResult link_raygen(const Words& words) { return link({{StageKind::RayGen, words}}); }

void expect_rejected(const std::string& text, const std::string& what) {
    expect_clear_error(link_raygen(assemble(text)), what);
}

// The modules of a golden set, the largest real inputs at hand.
GoldenCase golden(const char* name) { return read_golden_case(std::filesystem::path(RTC_GOLDEN_DIR) / name); }

// Word index of each instruction.
std::vector<size_t> instruction_starts(const Words& words) {
    std::vector<size_t> starts;
    for (size_t at = 5; at < words.size(); at += words[at] >> 16) starts.push_back(at);
    return starts;
}

TEST(Malformed, TheUndamagedModuleLinks) {
    const LinkResult result = link_raygen(good_raygen());
    EXPECT_TRUE(result.ok) << describe(result);
}

TEST(Malformed, APayloadNamedOnlyByTheTraceIsFound) {
    const LinkResult result = link_raygen(assemble(raygen_text(kPayload, kTrace, kPayloadLocation)));
    EXPECT_TRUE(result.ok) << describe(result);
}

TEST(Malformed, EmptyAndShorterThanAHeader) {
    for (size_t size = 0; size < 5; ++size) {
        Words words = good_raygen();
        words.resize(size);
        expect_clear_error(link_raygen(words), std::to_string(size) + " words");
    }
}

TEST(Malformed, HeaderOnly) {
    Words words = good_raygen();
    words.resize(5);
    expect_clear_error(link_raygen(words), "a header alone");
}

TEST(Malformed, WrongMagic) {
    Words words = good_raygen();
    words[0] = 0x07230204;
    expect_clear_error(link_raygen(words), "wrong magic");
}

// SPIR-V 2.3: a module may be stored in either byte order.
TEST(Malformed, OtherByteOrderIsReadAsTheSameModule) {
    const Words words = good_raygen();
    Words swapped = words;
    for (uint32_t& w : swapped) w = w >> 24 | (w >> 8 & 0xff00) | (w << 8 & 0xff0000) | w << 24;
    const LinkResult result = link_raygen(swapped);
    EXPECT_TRUE(result.ok) << describe(result);
    EXPECT_TRUE(result.spirv == link_raygen(words).spirv);
}

TEST(Malformed, UnknownVersions) {
    for (uint32_t version : {0u, 0x00010700u, 0x00020000u, 0xffffffffu, 0x00010301u}) {
        Words words = good_raygen();
        words[1] = version;
        expect_clear_error(link_raygen(words), "version " + std::to_string(version));
    }
}

TEST(Malformed, IdBounds) {
    for (uint32_t bound : {0u, 1u, 5u, 0x400000u, 0x7fffffffu, 0xffffffffu}) {
        Words words = good_raygen();
        words[3] = bound;
        expect_clear_error(link_raygen(words), "bound " + std::to_string(bound));
    }
}

TEST(Malformed, LargestAllowedIdBoundIsFine) {
    Words words = good_raygen();
    words[3] = 0x300000;
    const LinkResult result = link_raygen(words);
    EXPECT_TRUE(result.ok) << describe(result);
}

TEST(Malformed, ZeroWordCountAtEveryInstruction) {
    const Words good = good_raygen();
    for (size_t at : instruction_starts(good)) {
        Words words = good;
        words[at] &= 0xffff;
        expect_clear_error(link_raygen(words), "word count 0 at word " + std::to_string(at));
    }
}

TEST(Malformed, WordCountPastTheEnd) {
    const Words good = good_raygen();
    for (size_t at : instruction_starts(good)) {
        Words words = good;
        words[at] |= 0xffff0000;
        expect_clear_error(link_raygen(words), "word count 65535 at word " + std::to_string(at));
    }
}

TEST(Malformed, TruncatedAtEveryWord) {
    for (const char* name : {"trace-straight", "trace-in-function", "spec-constant-instances", "ext-dialect"}) {
        const GoldenCase set = golden(name);
        const Words good = set.input.stages[0].spirv;
        for (size_t size = 0; size < good.size(); ++size) {
            PipelineInput input = set.input;
            input.stages[0].spirv.resize(size);
            expect_clear_error(link_pipeline(input, {}), std::string(name) + " cut at word " + std::to_string(size));
        }
    }
}

// These may happen to give a valid module: only surviving is asked.
TEST(Malformed, EveryInstructionLeftOutOrTwice) {
    const GoldenCase set = golden("trace-from-closest-hit");
    for (size_t stage = 0; stage < set.input.stages.size(); ++stage) {
        const Words good = set.input.stages[stage].spirv;
        for (size_t at : instruction_starts(good)) {
            const auto begin = good.begin() + static_cast<std::ptrdiff_t>(at);
            const auto end = begin + (*begin >> 16);
            PipelineInput input = set.input;
            Words& words = input.stages[stage].spirv;
            words.assign(good.begin(), begin);
            words.insert(words.end(), end, good.end());
            const LinkResult without = link_pipeline(input, {});
            if (!without.ok) expect_clear_error(without, "instruction left out at " + std::to_string(at));
            words.assign(good.begin(), end);
            words.insert(words.end(), begin, good.end());
            const LinkResult twice = link_pipeline(input, {});
            if (!twice.ok) expect_clear_error(twice, "instruction twice at " + std::to_string(at));
        }
    }
}

TEST(Malformed, EveryWordReplaced) {
    for (const char* name : {"trace-in-loop", "payload-nested-struct"}) {
        const GoldenCase set = golden(name);
        const Words good = set.input.stages[0].spirv;
        for (size_t at = 5; at < good.size(); ++at) {
            for (uint32_t value : {0u, 1u, 0xffffffffu, 0x7fffffffu, good[3], good[at] ^ 1u, good[at] + 0x10000u}) {
                PipelineInput input = set.input;
                input.stages[0].spirv[at] = value;
                const LinkResult result = link_pipeline(input, {});
                if (!result.ok)
                    expect_clear_error(result, std::string(name) + ": word " + std::to_string(at) + " = " +
                                                   std::to_string(value));
            }
        }
    }
}

TEST(Malformed, RandomWords) {
    std::mt19937 random(1);
    for (int round = 0; round < 300; ++round) {
        Words words = good_raygen();
        const size_t keep = 5 + random() % (words.size() - 5);
        for (size_t i = keep; i < words.size(); ++i) words[i] = random() % 3 ? random() % words[3] : random();
        const LinkResult result = link_raygen(words);
        if (!result.ok) expect_clear_error(result, "random round " + std::to_string(round));
    }
}

TEST(Malformed, StringWithoutEnd) {
    Words words = good_raygen();
    for (size_t at : instruction_starts(words))
        if ((words[at] & 0xffff) == 15) words[at + (words[at] >> 16) - 1] = 0x41414141;  // OpEntryPoint
    expect_clear_error(link_raygen(words), "a name without an end");
}

TEST(Malformed, CyclicTypes) {
    const std::pair<const char*, const char*> cases[] = {
        {"a struct in itself", "%t = OpTypeStruct %t"},
        {"an array of itself", "%t = OpTypeArray %t %uint_255"},
        {"a vector of itself", "%t = OpTypeVector %t 3"},
        {"a matrix of itself", "%t = OpTypeMatrix %t 3"},
        {"a pointer to itself", "%t = OpTypePointer Function %t"},
        {"two structs in each other", "%t = OpTypeStruct %u\n%u = OpTypeStruct %t"},
        {"an array of a struct of it", "%t = OpTypeArray %u %uint_255\n%u = OpTypeStruct %t"},
        {"a function type of itself", "%t = OpTypeFunction %void %t"},
    };
    for (const auto& [what, text] : cases) {
        expect_rejected(raygen_text(text, ""), what);
        // The same, used as the payload's type, so that a pass has to look inside.
        expect_rejected(raygen_text(std::string(text) + "\n%pt = OpTypePointer RayPayloadNV %t\n"
                                                        "%payload = OpVariable %pt RayPayloadNV\n",
                                    kTrace, kPayloadLocation),
                        what);
    }
}

TEST(Malformed, CyclicConstants) {
    expect_rejected(raygen_text("%c = OpConstantComposite %v3float %c %c %c", ""), "a composite of itself");
    expect_rejected(raygen_text("%c = OpSpecConstantOp %uint IAdd %c %c", ""), "a specialisation constant of itself");
}

TEST(Malformed, DeeplyNestedTypes) {
    std::string text = "%t0 = OpTypeStruct %float\n";
    for (int i = 1; i < 20000; ++i)
        text += "%t" + std::to_string(i) + " = OpTypeStruct %t" + std::to_string(i - 1) + "\n";
    text += "%pt = OpTypePointer RayPayloadNV %t19999\n%payload = OpVariable %pt RayPayloadNV\n";
    expect_rejected(raygen_text(text, kTrace, kPayloadLocation), "a payload nested 20 000 deep");
}

TEST(Malformed, HugePayloads) {
    const std::pair<const char*, const char*> cases[] = {
        {"2^31 floats", "%n = OpConstant %uint 2147483648\n%t = OpTypeArray %float %n\n"},
        {"2^32 - 1 floats", "%n = OpConstant %uint 4294967295\n%t = OpTypeArray %float %n\n"},
        {"0 floats", "%n = OpConstant %uint 0\n%t = OpTypeArray %float %n\n"},
        {"2^16 x 2^16 floats", "%n = OpConstant %uint 65536\n%r = OpTypeArray %float %n\n%t = OpTypeArray %r %n\n"},
        {"a runtime array", "%t = OpTypeRuntimeArray %float\n"},
        {"an acceleration structure", "%t = OpTypeStruct %as\n"},
    };
    for (const auto& [what, text] : cases)
        expect_rejected(raygen_text(std::string(text) + "%pt = OpTypePointer RayPayloadNV %t\n"
                                                        "%payload = OpVariable %pt RayPayloadNV\n",
                                    kTrace, kPayloadLocation),
                        what);
}

// A local of 2^20 structs, live across a trace: an error or a module, but no word-by-word expansion.
TEST(Malformed, HugeLiveArray) {
    const LinkResult result = link_raygen(assemble(raygen_text(
        std::string(kPayload) + "%n = OpConstant %uint 1048576\n%arr = OpTypeArray %v3float %n\n%pa = OpTypePointer Function %arr\n"
                   "%pf = OpTypePointer Function %v3float\n",
        "%a = OpVariable %pa Function\n%e = OpAccessChain %pf %a %uint_255\nOpStore %e %zero3\n" + kStoreAndTrace +
            "%v = OpLoad %v3float %e\nOpStore %e %v\n",
        kPayloadLocation)));
    EXPECT_LT(result.spirv.size(), 1000000u);
    if (!result.ok) expect_clear_error(result, "a live array of 12 MiB");
}

TEST(Malformed, ForwardReferences) {
    expect_rejected(raygen_text("%t = OpTypeVector %late 3\n%late = OpTypeInt 64 0", ""), "a type before its part");
    expect_rejected(raygen_text("", "%a = OpIAdd %uint %b %uint_0\n%b = OpIAdd %uint %uint_0 %uint_0"),
                    "a value before its definition");
    expect_rejected(raygen_text("", "%a = OpIAdd %uint %nowhere %uint_0"), "a value without a definition");
    expect_rejected(raygen_text("", "OpBranch %nowhere\n%l = OpLabel"), "a branch to no label");
    expect_rejected(raygen_text("", "OpBranch %uint_0\n%l = OpLabel"), "a branch to a constant");
    expect_rejected(raygen_text("", "OpBranch %other\n%l = OpLabel", "",
                                "%f = OpFunction %void None %fn\n%other = OpLabel\nOpReturn\nOpFunctionEnd\n"),
                    "a branch into another function");
    expect_rejected(raygen_text("", "%v = OpFunctionCall %void %uint_0"), "a call of a constant");
    expect_rejected(raygen_text("", "%v = OpFunctionCall %void %nowhere"), "a call of nothing");
}

TEST(Malformed, Recursion) {
    expect_rejected(raygen_text("", "%v = OpFunctionCall %void %f", "",
                                "%f = OpFunction %void None %fn\n%fl = OpLabel\n%fv = OpFunctionCall %void %f\n"
                                "OpReturn\nOpFunctionEnd\n"),
                    "a function that calls itself");
    expect_rejected(raygen_text("", "%v = OpFunctionCall %void %main"), "main calling itself");
    expect_rejected(raygen_text(kPayload, "%v = OpFunctionCall %void %f", kPayloadLocation,
                                "%f = OpFunction %void None %fn\n%fl = OpLabel\n" + kStoreAndTrace +
                                    "%fv = OpFunctionCall %void %g\nOpReturn\nOpFunctionEnd\n"
                                    "%g = OpFunction %void None %fn\n%gl = OpLabel\n%gv = OpFunctionCall %void %f\n"
                                    "OpReturn\nOpFunctionEnd\n"),
                    "two tracing functions that call each other");
}

TEST(Malformed, ControlFlow) {
    expect_rejected(raygen_text("", "OpBranch %l\n%l = OpLabel\nOpBranch %l\n%m = OpLabel"),
                    "a loop without a merge instruction");
    expect_rejected(raygen_text("%true = OpConstantTrue %bool",
                                "OpBranchConditional %true %a %b\n%a = OpLabel\nOpBranch %b\n%b = OpLabel\n"
                                "OpBranchConditional %true %a %c\n%c = OpLabel"),
                    "an irreducible loop");
    expect_rejected(raygen_text("%true = OpConstantTrue %bool",
                                "OpSelectionMerge %nowhere None\nOpBranchConditional %true %a %b\n%a = OpLabel\n"
                                "OpBranch %b\n%b = OpLabel"),
                    "a merge block that does not exist");
    expect_rejected(raygen_text("", "OpBranch %entry\n%l = OpLabel"), "a branch to the entry block");
    expect_rejected(raygen_text("", "%p = OpPhi %uint %uint_0 %uint_0\n"), "a phi in the entry block");
    expect_rejected(raygen_text("", "OpReturn\nOpReturn\n%l = OpLabel"), "an instruction after the terminator");
}

TEST(Malformed, DeeplyNestedBranches) {
    std::string body, tail;
    constexpr int kDepth = 3000;
    for (int i = 0; i < kDepth; ++i) {
        const std::string n = std::to_string(i);
        body += "OpSelectionMerge %m" + n + " None\nOpBranchConditional %true %t" + n + " %m" + n + "\n%t" + n + " = OpLabel\n";
        tail = "OpBranch %m" + n + "\n%m" + n + " = OpLabel\n" + tail;
    }
    const LinkResult result =
        link_raygen(assemble(raygen_text(std::string("%true = OpConstantTrue %bool\n") + kPayload, body + kStoreAndTrace + tail, kPayloadLocation)));
    if (!result.ok) expect_clear_error(result, "3000 nested branches");
}

TEST(Malformed, EntryPoints) {
    expect_clear_error(link({{StageKind::RayGen, good_raygen(), "Main"}}), "an entry point that is not there");
    expect_clear_error(link({{StageKind::RayGen, good_raygen(), ""}}), "an entry point without a name");
    expect_clear_error(link({{StageKind::Miss, good_raygen()}}), "a raygen module given as a miss stage");
    expect_rejected(
        "OpCapability Shader\nOpMemoryModel Logical GLSL450\nOpEntryPoint GLCompute %main \"main\"\n"
        "OpExecutionMode %main LocalSize 1 1 1\n%void = OpTypeVoid\n%fn = OpTypeFunction %void\n"
        "%main = OpFunction %void None %fn\n%l = OpLabel\nOpReturn\nOpFunctionEnd\n",
        "a compute shader given as a raygen stage");
    expect_rejected("OpCapability RayTracingNV\nOpExtension \"SPV_NV_ray_tracing\"\nOpMemoryModel Logical GLSL450\n"
                    "OpEntryPoint RayGenerationNV %main \"main\"\n%void = OpTypeVoid\n%main = OpTypeFunction %void\n",
                    "an entry point that names a type");
    expect_rejected("OpCapability RayTracingNV\nOpExtension \"SPV_NV_ray_tracing\"\nOpMemoryModel Logical GLSL450\n"
                    "OpEntryPoint RayGenerationNV %main \"main\"\n%void = OpTypeVoid\n%fn = OpTypeFunction %void\n"
                    "%main = OpFunction %void None %fn\nOpFunctionEnd\n",
                    "an entry point without a body");
    expect_rejected("OpCapability RayTracingNV\nOpExtension \"SPV_NV_ray_tracing\"\nOpMemoryModel Logical GLSL450\n",
                    "a module without an entry point");
}

TEST(Malformed, TraceOperands) {
    const auto trace = [](const std::string& operands) {
        return "OpStore %payload %float_0\n%s = OpLoad %as %scene\nOpTraceNV " + operands + "\n";
    };
    const std::string good = "%s %uint_0 %uint_255 %uint_0 %uint_0 %uint_0 %zero3 %float_0 %up3 %float_1 %uint_0";
    ASSERT_TRUE(link_raygen(assemble(raygen_text(kPayload, trace(good), kPayloadLocation))).ok);
    const auto reject = [&](const std::string& operands, const char* what) {
        expect_rejected(raygen_text(kPayload, trace(operands), kPayloadLocation), what);
    };
    reject("%s %float_0 %uint_255 %uint_0 %uint_0 %uint_0 %zero3 %float_0 %up3 %float_1 %uint_0", "float ray flags");
    reject("%s %uint_0 %uint_255 %uint_0 %uint_0 %uint_0 %float_0 %float_0 %up3 %float_1 %uint_0", "a scalar origin");
    reject("%s %uint_0 %uint_255 %uint_0 %uint_0 %uint_0 %zero3 %zero3 %up3 %float_1 %uint_0", "a vector tmin");
    reject("%s %uint_0 %uint_255 %uint_0 %uint_0 %uint_0 %zero3 %float_0 %up3 %float_1 %float_0", "a float payload");
    reject("%s %uint_0 %uint_255 %uint_0 %uint_0 %uint_0 %zero3 %float_0 %up3 %float_1 %uint_255",
           "a payload location that no variable has");
    reject("%uint_0 %uint_0 %uint_255 %uint_0 %uint_0 %uint_0 %zero3 %float_0 %up3 %float_1 %uint_0",
           "an acceleration structure that is a number");
    reject("%scene %uint_0 %uint_255 %uint_0 %uint_0 %uint_0 %zero3 %float_0 %up3 %float_1 %uint_0",
           "an acceleration structure that is a pointer");
    reject("%s %uint %uint_255 %uint_0 %uint_0 %uint_0 %zero3 %float_0 %up3 %float_1 %uint_0", "a type as ray flags");
}

// n decorations in a group applied to m targets would make n * m decorations. Memory is limited to 4 GiB (see main).
TEST(Malformed, DecorationGroupsDoNotMultiply) {
    std::string text = "OpCapability RayTracingNV\nOpExtension \"SPV_NV_ray_tracing\"\nOpMemoryModel Logical GLSL450\n"
                       "OpEntryPoint RayGenerationNV %main \"main\"\n";
    for (int i = 0; i < 4000; ++i) text += "OpDecorate %group RelaxedPrecision\n";
    text += "%group = OpDecorationGroup\n";
    for (int k = 0; k < 40; ++k) {
        text += "OpGroupDecorate %group";
        for (int i = 0; i < 1000; ++i) text += " %void";
        text += "\n";
    }
    text += "%void = OpTypeVoid\n%fn = OpTypeFunction %void\n%main = OpFunction %void None %fn\n%l = OpLabel\n"
            "OpReturn\nOpFunctionEnd\n";
    const LinkResult result = link_raygen(assemble(text));
    if (!result.ok) expect_clear_error(result, "4000 x 40 000 group decorations");
}

// Found by rtc_fuzz_reader: what a value's type is depended on the order of functions and types.
TEST(Malformed, NothingStandsBehindAFunction) {
    Words words = good_raygen();
    words[3] += 1;
    const Words late{3u << 16 | 22u, words[3] - 1, 64};  // OpTypeFloat 64
    words.insert(words.end(), late.begin(), late.end());
    const LinkResult result = link_raygen(words);
    expect_clear_error(result, "a type behind the last function");
    EXPECT_EQ(result.diagnostics.front().id, "spirv-malformed");
}

// Found by rtc_fuzz_reader: written and read again, instructions without a line took on the line before.
TEST(Malformed, LinesEndWithTheirBlockAndWithNoLine) {
    ir::Module module = ir::read_module(good_raygen(), "lines");
    module.files.push_back("a.rgen");
    ir::Block& first = module.functions[0].blocks[0];
    ASSERT_GE(first.insts.size(), 3u);
    for (ir::Inst& inst : first.insts) inst.source = {};
    first.insts[0].source = {1, 7};
    ir::Block second;
    second.label = module.new_id();
    second.insts.push_back(std::move(first.insts.back()));
    first.insts.back() = ir::Inst(ir::Op::OpBranch, 0, 0, {second.label});
    module.functions[0].blocks.insert(module.functions[0].blocks.begin() + 1, second);
    const ir::Module again = ir::read_module(ir::write_module(module, true), "lines");
    const std::vector<ir::Block>& blocks = again.functions[0].blocks;
    EXPECT_EQ(blocks[0].insts[0].source.line, 7u);
    EXPECT_EQ(blocks[0].insts[1].source.line, 0u) << "a line reached behind OpNoLine";
    EXPECT_EQ(blocks[1].insts[0].source.line, 0u);
    // A line that a block leaves open does not reach the next one.
    module.functions[0].blocks[0].insts.back().source = {1, 9};
    const ir::Module open = ir::read_module(ir::write_module(module, true), "lines");
    EXPECT_EQ(open.functions[0].blocks[0].insts.back().source.line, 9u);
    EXPECT_EQ(open.functions[0].blocks[1].insts[0].source.line, 0u) << "a line reached into the next block";
}

// The linker's fuzzer: push constants are looked at before any stage is lowered, and so must validation be.
TEST(Malformed, PushConstantsOfNoType) {
    for (const char* type : {"%pp = OpTypePointer PushConstant %nothing\n",
                             "%block = OpTypeStruct %nothing\n%pp = OpTypePointer PushConstant %block\n",
                             "%block = OpTypeArray %uint %nothing\n%pp = OpTypePointer PushConstant %block\n"})
        expect_rejected(raygen_text(std::string(kPayload) + type + "%pc = OpVariable %pp PushConstant\n", kTrace,
                                    kPayloadLocation),
                        type);
}

TEST(Malformed, PipelineDescriptions) {
    PipelineInput input = pipeline({{StageKind::RayGen, good_raygen()}});
    expect_clear_error(link_pipeline({}, {}), "a pipeline without stages");

    PipelineInput bad = input;
    bad.groups[0].general = 7;
    expect_clear_error(link_pipeline(bad, {}), "a group that names stage 7 of 1");
    bad.groups[0].general = -2;
    expect_clear_error(link_pipeline(bad, {}), "a group that names stage -2");
    bad = input;
    bad.groups[0].kind = GroupKind::Triangles;
    bad.groups[0].general = -1;
    bad.groups[0].closest_hit = 0;
    expect_clear_error(link_pipeline(bad, {}), "a raygen stage as a closest-hit");
    bad = input;
    bad.stages[0].specialization = {{12345, 1}};
    const LinkResult unknown = link_pipeline(bad, {});
    EXPECT_FALSE(unknown.diagnostics.empty()) << "a specialisation id that no constant has went unnoticed";

    for (uint32_t depth : {32u, 0xffffffffu}) {
        LinkOptions options;
        options.max_recursion_depth = depth;
        expect_clear_error(link_pipeline(input, options), "recursion depth " + std::to_string(depth));
    }
    LinkOptions options;
    options.stop_after = "no-such-pass";
    const LinkResult result = link_pipeline(input, options);
    expect_clear_error(result, "a pass that does not exist");
    EXPECT_EQ(result.diagnostics.front().id, "unknown-pass");
}

}  // namespace
}  // namespace rtc::test

int main(int argc, char** argv) {
    testing::InitGoogleTest(&argc, argv);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    // A hostile module that asks for too much memory must fail here, not take the machine down.
    const rlimit limit{rlim_t{4} << 30, rlim_t{4} << 30};
    setrlimit(RLIMIT_AS, &limit);
#endif
    return RUN_ALL_TESTS();
}
