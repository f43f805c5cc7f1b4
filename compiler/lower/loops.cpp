// Loops and the step budget.
//
// A lane may only run so many loop iterations in one dispatch (lavapipe 22.3 ends
// every loop of an invocation group, silently, after 65 535 iterations; GPUs have
// watchdogs). Every loop iteration is counted into the traversal's `rtc_turns`.
// A loop that may be long can also suspend: the splitter makes its header a state.
// Short ones, with a constant trip count, only count.
#include <algorithm>

#include "continuation/machine.h"
#include "lower/stage.h"

namespace rtc::lower {
namespace {

// Constant trip counts up to this stay out of the state machine.
constexpr uint64_t kShortTrips = 256;

const Inst* find_def(const Function& function, Id id) {
    for (const Block& block : function.blocks)
        for (const Inst& inst : block.insts)
            if (inst.result == id) return &inst;
    return nullptr;
}

}  // namespace

bool is_short_loop(const Program& p, const Function& function, const Block& header) {
    // glslang's shape: header -> condition block: load i; i < constant; and i stepped by a constant once.
    const Block* condition = &header;
    auto block_of = [&](Id label) -> const Block* {
        for (const Block& block : function.blocks)
            if (block.label == label) return &block;
        return nullptr;
    };
    if (header.terminator().op == Op::OpBranch) condition = block_of(header.terminator().ops[0]);
    if (!condition || condition->terminator().op != Op::OpBranchConditional) return false;
    const Inst* compare = find_def(function, condition->terminator().ops[0]);
    if (!compare) return false;
    switch (compare->op) {
        case Op::OpSLessThan:
        case Op::OpSLessThanEqual:
        case Op::OpULessThan:
        case Op::OpULessThanEqual: break;
        default: return false;
    }
    uint64_t limit = 0;
    const Inst* load = find_def(function, compare->ops[0]);
    if (!load || load->op != Op::OpLoad || !p.constant_value(compare->ops[1], limit) || limit > kShortTrips) return false;
    const Id variable = load->ops[0];
    int stores = 0, steps = 0;
    for (const Block& block : function.blocks)
        for (const Inst& inst : block.insts) {
            bool names = false;
            inst.for_each_id([&](Id id) { names |= id == variable; });
            if (!names || inst.op == Op::OpLoad) continue;
            if (inst.op != Op::OpStore || inst.ops[0] != variable) return false;
            ++stores;
            uint64_t start = 0;
            if (p.constant_value(inst.ops[1], start)) {
                if (start > kShortTrips) return false;  // also negative starts
                continue;
            }
            const Inst* sum = find_def(function, inst.ops[1]);
            uint64_t step = 0;
            if (!sum || sum->op != Op::OpIAdd || !p.constant_value(sum->ops[1], step) || step == 0 ||
                step > kShortTrips)
                return false;
            const Inst* base = find_def(function, sum->ops[0]);
            if (!base || base->op != Op::OpLoad || base->ops[0] != variable) return false;
            ++steps;
        }
    return stores == 2 && steps == 1;
}

bool has_long_loop(const Program& program, const Function& function) {
    for (const Block& block : function.blocks) {
        const Inst* merge = block.merge();
        if (merge && merge->op == Op::OpLoopMerge && !is_short_loop(program, function, block)) return true;
    }
    return false;
}

void count_loops(Program& program, Stage& stage, continuation::Machine& machine) {
    auto count = [&](Function& function) {
        for (Block& block : function.blocks) {
            const Inst* merge = block.merge();
            if (!merge || merge->op != Op::OpLoopMerge) continue;
            std::vector<Inst> insts;
            ir::Emitter e(program, insts);
            const Id turns = machine.variable("rtc_turns");
            e.store(turns, e.add(e.load(program.uint_type(), turns), program.constant_u32(1)));
            size_t at = 0;
            while (block.insts[at].op == Op::OpPhi) ++at;
            block.insts.insert(block.insts.begin() + at, insts.begin(), insts.end());
        }
    };
    count(stage.body);
    for (Function& function : stage.functions) count(function);
}

}  // namespace rtc::lower
