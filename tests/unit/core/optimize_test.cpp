// -O: what the optimiser is asked to do, and what must be kept from it.
#include <gtest/gtest.h>

#include "core_test_util.h"
#include "ir/cleanup.h"
#include "link/link.h"

namespace rtc::test {
namespace {

const char* const kNested =
    "%uint_1 = OpConstant %uint 1\n%uint_2 = OpConstant %uint 2\n%inner = OpTypeStruct %float %float\n"
    "%list = OpTypeArray %inner %uint_2\n%outer = OpTypeStruct %float %list\n"
    "%ptr_outer = OpTypePointer Function %outer\n%ptr_part = OpTypePointer Function %float\n";

// An array of structs in a struct, stored to member by member: SPIRV-Tools 2023.1 crashes on what it makes of these
// stores itself.
const char* const kStores =
    "%v = OpVariable %ptr_outer Function\n"
    "%p0 = OpAccessChain %ptr_part %v %uint_0\nOpStore %p0 %float_0\n"
    "%p1 = OpAccessChain %ptr_part %v %uint_1 %uint_0 %uint_0\nOpStore %p1 %float_1\n"
    "%p2 = OpAccessChain %ptr_part %v %uint_1 %uint_1 %uint_0\nOpStore %p2 %float_1\n"
    "%p3 = OpAccessChain %ptr_part %v %uint_1 %uint_0 %uint_1\nOpStore %p3 %float_0\n"
    "%p4 = OpAccessChain %ptr_part %v %uint_1 %uint_1 %uint_1\nOpStore %p4 %float_0\n"
    "%w = OpLoad %outer %v\n%x = OpCompositeExtract %float %w 1 0 0\nOpStore %payload %x\n";

TEST(Optimize, NestedStructsStoredMemberByMember) {
    for (Optimization level : {Optimization::Performance, Optimization::Size}) {
        LinkOptions options;
        options.optimize = level;
        const LinkResult result =
            link({{StageKind::RayGen, assemble(raygen_text(std::string(kPayload) + kNested,
                                                           std::string(kStores) + kTrace, kPayloadLocation))}},
                 options);
        EXPECT_TRUE(result.ok) << describe(result);
    }
}

// An insertion two levels deep is one of each level afterwards, and gives the same value under the same id.
TEST(Optimize, DeepInsertionsAreSplit) {
    const ir::Module source = ir::read_module(
        assemble("OpCapability Shader\nOpCapability Linkage\nOpMemoryModel Logical GLSL450\n"
                 "%float = OpTypeFloat 32\n%inner = OpTypeStruct %float %float\n%outer = OpTypeStruct %float %inner\n"
                 "%fn = OpTypeFunction %outer %outer %float\n%f = OpFunction %outer None %fn\n"
                 "%whole = OpFunctionParameter %outer\n%part = OpFunctionParameter %float\n%l = OpLabel\n"
                 "%r = OpCompositeInsert %outer %part %whole 1 0\nOpReturnValue %r\nOpFunctionEnd\n"),
        "test");
    ir::Program program;
    ir::IdMap<ir::Id> map;
    program.module.functions = program.import(source, map);
    ir::Function& function = program.module.functions[0];
    ir::split_nested_inserts(program, function);
    const std::vector<ir::Inst>& insts = function.blocks[0].insts;
    ASSERT_EQ(insts.size(), 4u);
    EXPECT_EQ(insts[0].op, ir::Op::OpCompositeExtract);
    EXPECT_EQ(insts[1].op, ir::Op::OpCompositeInsert);
    EXPECT_EQ(insts[1].ops[2], 0u);
    EXPECT_EQ(insts[2].op, ir::Op::OpCompositeInsert);
    EXPECT_EQ(insts[2].ops[2], 1u);
    EXPECT_EQ(insts[2].result, insts[3].ops[0]);
    program.module.capabilities = source.capabilities;
    EXPECT_EQ(link::validate(ir::write_module(program.module, false), 1).find("CompositeInsert"), std::string::npos);
}

}  // namespace
}  // namespace rtc::test
