// link::fold by itself: what it finds out from turn to turn, and that the code it leaves is valid.
#include <gtest/gtest.h>

#include "core_test_util.h"
#include "link/link.h"

namespace rtc::test {
namespace {

using ir::Id;

// A compute shader with an int, a bool, constants of them, a storage buffer %out of one uint (pointer %cell) and one
// of unknown content, %input.
std::string shader(const std::string& globals, const std::string& body) {
    return "OpCapability Shader\nOpMemoryModel Logical GLSL450\n"
           "OpEntryPoint GLCompute %main \"main\"\nOpExecutionMode %main LocalSize 1 1 1\n"
           "OpDecorate %block Block\nOpMemberDecorate %block 0 Offset 0\n"
           "OpDecorate %out DescriptorSet 0\nOpDecorate %out Binding 0\n"
           "%void = OpTypeVoid\n%fn = OpTypeFunction %void\n%bool = OpTypeBool\n%uint = OpTypeInt 32 0\n"
           "%true = OpConstantTrue %bool\n%false = OpConstantFalse %bool\n"
           "%uint_0 = OpConstant %uint 0\n%uint_1 = OpConstant %uint 1\n%uint_7 = OpConstant %uint 7\n"
           "%block = OpTypeStruct %uint\n%ptr_block = OpTypePointer StorageBuffer %block\n"
           "%ptr_cell = OpTypePointer StorageBuffer %uint\n%out = OpVariable %ptr_block StorageBuffer\n"
           "%ptr_uint = OpTypePointer Function %uint\n%ptr_bool = OpTypePointer Function %bool\n" +
           globals + "%main = OpFunction %void None %fn\n" + body + "OpFunctionEnd\n";
}

struct Folded {
    ir::Program program;
    size_t conditional = 0, blocks = 0, phis = 0, functions = 0;
    std::string text, problem;
};

Folded fold(const std::string& text) {
    Folded f;
    ir::IdMap<Id> map;
    const ir::Module source = ir::read_module(assemble(text), "test");
    f.program.module.functions = f.program.import(source, map);
    ir::Module& m = f.program.module;
    m.version = source.version;
    m.entry_points = source.entry_points;
    m.execution_modes = source.execution_modes;
    const Id main = map.get(source.entry_points[0].function);
    m.entry_points[0].function = main;
    for (ir::Inst& mode : m.execution_modes) mode.ops[0] = main;
    link::BitAnalysis::Tables tables;
    f.functions = link::fold(f.program, main, {}, tables).size();
    link::tidy(f.program, {main});
    for (const ir::Function& function : m.functions)
        for (const ir::Block& block : function.blocks) {
            ++f.blocks;
            for (const ir::Inst& inst : block.insts) {
                f.conditional += inst.op == ir::Op::OpBranchConditional;
                f.phis += inst.op == ir::Op::OpPhi;
            }
        }
    const std::vector<uint32_t> words = ir::write_module(m, false);
    f.text = ir::to_text(words);
    f.problem = link::validate(words, 1);
    return f;
}

// Each branch is decided by a variable that the branch before it stores to, or not: one is found out a turn.
TEST(Fold, FollowsAChainOfBranchesToItsEnd) {
    constexpr int kLength = 12;
    std::string variables, body;
    for (int i = 0; i <= kLength; ++i) {
        const std::string n = std::to_string(i);
        variables += "%v" + n + " = OpVariable %ptr_bool Function\n";
        body += "OpStore %v" + n + " %false\n";
    }
    for (int i = 0; i < kLength; ++i) {
        const std::string n = std::to_string(i), next = std::to_string(i + 1);
        body += "%c" + n + " = OpLoad %bool %v" + n + "\nOpSelectionMerge %m" + n + " None\n" +
                "OpBranchConditional %c" + n + " %t" + n + " %m" + n + "\n" +
                "%t" + n + " = OpLabel\nOpStore %v" + next + " %true\nOpBranch %m" + n + "\n%m" + n + " = OpLabel\n";
    }
    const Folded f = fold(shader("", "%first = OpLabel\n" + variables + body + "OpReturn\n"));
    EXPECT_EQ(f.problem, "") << f.text;
    EXPECT_EQ(f.conditional, 0u) << f.text;
    EXPECT_EQ(f.blocks, 1u) << f.text;
}

// Values that reach a variable one through the other, in the wrong order for one walk over the code.
TEST(Fold, FollowsAChainOfVariablesAgainstTheOrderOfTheCode) {
    std::string variables, body;
    for (int i = 30; i >= 0; --i) variables += "%v" + std::to_string(i) + " = OpVariable %ptr_uint Function\n";
    for (int i = 30; i > 0; --i) {
        const std::string n = std::to_string(i), before = std::to_string(i - 1);
        body += "%l" + n + " = OpLoad %uint %v" + before + "\nOpStore %v" + n + " %l" + n + "\n";
    }
    body += "OpStore %v0 %uint_7\n%last = OpLoad %uint %v30\n%cell = OpAccessChain %ptr_cell %out %uint_0\n"
            "OpStore %cell %last\n";
    const Folded f = fold(shader("", "%first = OpLabel\n" + variables + body + "OpReturn\n"));
    EXPECT_EQ(f.problem, "") << f.text;
    EXPECT_NE(f.text.find("%uint_7\n               OpReturn"), std::string::npos) << f.text;
}

// A phi is what arrives from live code.
TEST(Fold, PhisForgetOperandsOfDeadBlocks) {
    const Folded f = fold(shader("",
                                 "%first = OpLabel\n"
                                 "%cell = OpAccessChain %ptr_cell %out %uint_0\n%x = OpLoad %uint %cell\n"
                                 "OpSelectionMerge %end None\nOpBranchConditional %false %then %end\n"
                                 "%then = OpLabel\n%y = OpIAdd %uint %x %uint_1\nOpBranch %end\n"
                                 "%end = OpLabel\n%p = OpPhi %uint %y %then %x %first\nOpStore %cell %p\nOpReturn\n"));
    EXPECT_EQ(f.problem, "") << f.text;
    EXPECT_EQ(f.phis, 0u) << f.text;
    EXPECT_EQ(f.blocks, 1u) << f.text;
}

// A loop that always leaves keeps its continue block; a value that was made there is gone. (A parameter is no value
// that is known to be of the phi's type, so this phi stays.)
TEST(Fold, LoopsThatNeverGoOnStayValid) {
    const Folded f = fold(shader("%fn_uint = OpTypeFunction %uint %uint\n"
                                 "%f = OpFunction %uint None %fn_uint\n%x = OpFunctionParameter %uint\n"
                                 "%first = OpLabel\n%cell = OpAccessChain %ptr_cell %out %uint_0\n"
                                 "OpBranch %header\n"
                                 "%header = OpLabel\n%i = OpPhi %uint %x %first %next %more\n"
                                 "OpLoopMerge %end %more None\nOpBranch %body\n"
                                 "%body = OpLabel\n%j = OpLoad %uint %cell\n"
                                 "OpBranchConditional %true %end %more\n"
                                 "%more = OpLabel\n%next = OpIAdd %uint %i %j\nOpBranch %header\n"
                                 "%end = OpLabel\nOpStore %cell %i\nOpReturnValue %i\nOpFunctionEnd\n",
                                 "%start = OpLabel\n%cell_2 = OpAccessChain %ptr_cell %out %uint_0\n"
                                 "%y = OpLoad %uint %cell_2\n%z = OpFunctionCall %uint %f %y\n"
                                 "OpStore %cell_2 %z\nOpReturn\n"));
    EXPECT_EQ(f.problem, "") << f.text;
    EXPECT_EQ(f.conditional, 0u) << f.text;
    EXPECT_EQ(f.phis, 1u) << f.text;
}

// do { … } while (false): structured code wants the back edge.
TEST(Fold, LoopsKeepTheirBackEdge) {
    const Folded f = fold(shader("",
                                 "%first = OpLabel\nOpBranch %header\n"
                                 "%header = OpLabel\nOpLoopMerge %end %more None\nOpBranch %more\n"
                                 "%more = OpLabel\nOpBranchConditional %false %header %end\n"
                                 "%end = OpLabel\nOpReturn\n"));
    EXPECT_EQ(f.problem, "") << f.text;
    EXPECT_EQ(f.conditional, 1u) << f.text;
}

// What a function that nobody calls any more stores counts for nothing.
TEST(Fold, FunctionsThatAreNotCalledAnyMoreStoreNothing) {
    const Folded f = fold(shader("%ptr_private = OpTypePointer Private %bool\n"
                                 "%flag = OpVariable %ptr_private Private\n"
                                 "%raise = OpFunction %void None %fn\n%r = OpLabel\nOpStore %flag %true\nOpReturn\n"
                                 "OpFunctionEnd\n",
                                 "%first = OpLabel\nOpStore %flag %false\n"
                                 "OpSelectionMerge %after None\nOpBranchConditional %false %call %after\n"
                                 "%call = OpLabel\n%void_0 = OpFunctionCall %void %raise\nOpBranch %after\n"
                                 "%after = OpLabel\n%c = OpLoad %bool %flag\n"
                                 "OpSelectionMerge %end None\nOpBranchConditional %c %then %end\n"
                                 "%then = OpLabel\n%cell = OpAccessChain %ptr_cell %out %uint_0\n"
                                 "OpStore %cell %uint_7\nOpBranch %end\n%end = OpLabel\nOpReturn\n"));
    EXPECT_EQ(f.problem, "") << f.text;
    EXPECT_EQ(f.functions, 1u);
    EXPECT_EQ(f.conditional, 0u) << f.text;
    EXPECT_EQ(f.text.find("%uint_7"), std::string::npos) << f.text;
}

// A branch that input decides stays, and so does what depends on it.
TEST(Fold, UnknownBranchesStay) {
    const Folded f = fold(shader("",
                                 "%first = OpLabel\n%v = OpVariable %ptr_uint Function\nOpStore %v %uint_0\n"
                                 "%cell = OpAccessChain %ptr_cell %out %uint_0\n%x = OpLoad %uint %cell\n"
                                 "%c = OpIEqual %bool %x %uint_1\n"
                                 "OpSelectionMerge %end None\nOpBranchConditional %c %then %end\n"
                                 "%then = OpLabel\nOpStore %v %uint_7\nOpBranch %end\n"
                                 "%end = OpLabel\n%y = OpLoad %uint %v\nOpStore %cell %y\nOpReturn\n"));
    EXPECT_EQ(f.problem, "") << f.text;
    EXPECT_EQ(f.conditional, 1u) << f.text;
    EXPECT_NE(f.text.find("OpLoad"), f.text.rfind("OpLoad")) << f.text;
}

}  // namespace
}  // namespace rtc::test
