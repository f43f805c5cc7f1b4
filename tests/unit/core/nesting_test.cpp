// The rule of docs/architecture.md about the shape of the code: no conditional is nested deeper than 80, however many
// shaders a pipeline has. (Above that, lavapipe 25 crashes and 22.3 computes wrong values.)
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "core_test_util.h"
#include "ir/program.h"

namespace rtc::test {
namespace {

constexpr uint32_t kMaxNesting = 80;

// Selections and loops around the innermost block of a function, those of the functions it calls included: drivers
// inline.
uint32_t nesting(const ir::Module& module) {
    ir::IdMap<const ir::Function*> functions;
    ir::IdMap<uint32_t> known;  // plus one
    for (const ir::Function& function : module.functions) functions[function.id()] = &function;
    std::function<uint32_t(ir::Id)> of = [&](ir::Id id) -> uint32_t {
        if (const uint32_t done = known.get(id)) return done - 1;
        const ir::Function& function = *functions.get(id);
        ir::IdMap<const ir::Block*> blocks;
        for (const ir::Block& block : function.blocks) blocks[block.label] = &block;
        ir::IdMap<uint32_t> depth;  // plus one; a header gives its merge block's before anything inside is looked at
        depth[function.blocks.front().label] = 1;
        std::vector<ir::Id> work{function.blocks.front().label};
        uint32_t deepest = 0;
        while (!work.empty()) {
            const ir::Block& block = *blocks.get(work.back());
            work.pop_back();
            const uint32_t here = depth.get(block.label);
            auto reach = [&](ir::Id label, uint32_t at) {
                if (depth.get(label)) return;
                depth[label] = at;
                work.push_back(label);
            };
            const ir::Inst* merge = block.merge();
            if (merge) reach(merge->ops[0], here);
            block.for_each_successor([&](ir::Id next) { reach(next, here + (merge ? 1 : 0)); });
            uint32_t inside = 0;
            for (const ir::Inst& inst : block.insts)
                if (inst.op == ir::Op::OpFunctionCall) inside = std::max(inside, of(inst.ops[0]));
            deepest = std::max(deepest, here - 1 + inside);
        }
        known[id] = deepest + 1;
        return deepest;
    };
    return of(module.entry_points[0].function);
}

uint32_t nesting_of_pipeline(int closest_hits, LinkOptions options) {
    std::vector<Stage> stages{{StageKind::RayGen, assemble(raygen_text(kPayload, kTrace, kPayloadLocation))}};
    StageText hit;
    hit.model = "ClosestHitNV";
    hit.globals = kPayload;
    hit.body = kTrace;
    hit.annotations = kPayloadLocation;
    const std::vector<uint32_t> words = assemble(stage_text(hit));
    for (int i = 0; i < closest_hits; ++i) stages.push_back({StageKind::ClosestHit, words});
    const LinkResult result = link(stages, options);
    EXPECT_TRUE(result.ok) << describe(result);
    return result.ok ? nesting(ir::read_module(result.spirv, "linked")) : 0;
}

TEST(Nesting, IsBoundedHoweverManyShadersThereAre) {
    for (const bool resumable : {true, false}) {
        LinkOptions options;
        options.resumable = resumable;
        const uint32_t few = nesting_of_pipeline(3, options);
        EXPECT_GT(few, 3u) << "a loop, a switch, traversal's loops: this test would not see deep code";
        for (const int count : {48, 300}) {
            const uint32_t many = nesting_of_pipeline(count, options);
            EXPECT_LE(many, kMaxNesting) << count << " closest hits";
            // A switch of switches is one level more, and what selects among them another; not one a shader.
            EXPECT_LE(many, few + 4) << count << " closest hits";
        }
    }
}

// What the measure calls nested.
TEST(Nesting, CountsSelectionsAndLoopsThroughCalls) {
    const ir::Module module = ir::read_module(
        assemble("OpCapability Shader\nOpMemoryModel Logical GLSL450\nOpEntryPoint GLCompute %main \"main\"\n"
                 "OpExecutionMode %main LocalSize 1 1 1\n"
                 "%void = OpTypeVoid\n%fn = OpTypeFunction %void\n%bool = OpTypeBool\n%true = OpConstantTrue %bool\n"
                 "%f = OpFunction %void None %fn\n%fl = OpLabel\nOpSelectionMerge %fe None\n"
                 "OpBranchConditional %true %ft %fe\n%ft = OpLabel\nOpBranch %fe\n%fe = OpLabel\nOpReturn\nOpFunctionEnd\n"
                 "%main = OpFunction %void None %fn\n%l = OpLabel\nOpBranch %h\n%h = OpLabel\n"
                 "OpLoopMerge %e %c None\nOpBranch %b\n%b = OpLabel\nOpSelectionMerge %m None\n"
                 "OpBranchConditional %true %t %m\n%t = OpLabel\n%r = OpFunctionCall %void %f\nOpBranch %m\n"
                 "%m = OpLabel\nOpBranch %c\n%c = OpLabel\nOpBranchConditional %true %h %e\n"
                 "%e = OpLabel\nOpReturn\nOpFunctionEnd\n"),
        "test");
    EXPECT_EQ(nesting(module), 3u);
}

}  // namespace
}  // namespace rtc::test
