// Inlines the functions on a path to a call (trace, callable, suspending report)
// or to an exit of the shader (ignore, terminate). All others stay functions.
//
// A `return` inside a nested construct of an inlined function becomes a direct
// branch to the code after the call. That is not structured control flow, and
// need not be: the splitter makes the target a state of its own, and leaving a
// construct for another state is what it does anyway. InlineRegion tells it where.
#include <algorithm>
#include <set>
#include <unordered_map>

#include "lower/stage.h"

namespace rtc::lower {
namespace {

class Inliner {
  public:
    Inliner(Program& program, Stage& stage, const CallKinds& kinds) : p_(program), stage_(stage), kinds_(kinds) {}

    void run() {
        for (size_t i = 0; i < stage_.functions.size(); ++i) by_id_[stage_.functions[i].id()] = i;
        find_suspending();
        if (suspending_.empty()) return;
        for (size_t b = 0; b < stage_.body.blocks.size(); ++b) {
            for (size_t i = 0; i < stage_.body.blocks[b].insts.size(); ++i) {
                const Inst& inst = stage_.body.blocks[b].insts[i];
                if (inst.op == Op::OpFunctionCall && suspending_.count(inst.ops[0])) {
                    inline_at(b, i);
                    break;  // the rest of the block is a later block now
                }
            }
            if (stage_.body.blocks.size() > 100000)
                stage_.fail("inline-too-large", {}, "inlining the functions that trace makes more than 100000 blocks", p_);
        }
        std::erase_if(stage_.functions, [&](const Function& f) { return suspending_.count(f.id()) != 0; });
    }

  private:
    // Functions from which a call, an exit or a loop that can suspend is reached.
    void find_suspending() {
        if (kinds_.loops_suspend)
            for (const Function& function : stage_.functions)
                if (has_long_loop(p_, function)) suspending_.insert(function.id());
        for (bool changed = true; changed;) {
            changed = false;
            for (const Function& function : stage_.functions) {
                if (suspending_.count(function.id())) continue;
                for (const Block& block : function.blocks)
                    for (const Inst& inst : block.insts)
                        if (is_call(inst, kinds_) || is_report(inst.op) || inst.op == Op::OpIgnoreIntersectionKHR ||
                            inst.op == Op::OpTerminateRayKHR ||
                            (inst.op == Op::OpFunctionCall && suspending_.count(inst.ops[0])))
                            changed |= suspending_.insert(function.id()).second;
            }
        }
    }

    void inline_at(size_t block_index, size_t at) {
        std::vector<Block>& blocks = stage_.body.blocks;
        const Function& callee = stage_.functions[by_id_.at(blocks[block_index].insts[at].ops[0])];
        const Inst call = blocks[block_index].insts[at];
        Block& head = blocks[block_index];

        Block tail;
        tail.label = p_.module.new_id();
        Block entry;
        entry.label = p_.module.new_id();

        std::unordered_map<Id, Id> map;
        for (size_t k = 0; k < callee.params.size(); ++k) map[callee.params[k].result] = call.ops[1 + k];
        for (const Block& block : callee.blocks) {
            map[block.label] = p_.module.new_id();
            for (const Inst& inst : block.insts)
                if (inst.result) map[inst.result] = p_.module.new_id();
        }
        auto mapped = [&](Id id) {
            const auto found = map.find(id);
            return found == map.end() ? id : found->second;
        };

        // The caller's block up to the call. A loop header keeps its merge instruction: the back
        // edge comes to it, and the code after the call is the loop's body then.
        std::vector<Inst> before(head.insts.begin(), head.insts.begin() + at);
        std::vector<Inst> after(head.insts.begin() + at + 1, head.insts.end());
        const Inst* merge = head.merge();
        Inst loop_merge;
        const bool is_loop_header = merge && merge->op == Op::OpLoopMerge;
        if (is_loop_header) {
            loop_merge = *merge;
            after.erase(after.end() - 2);
        }
        const Id head_label = head.label;

        // Return value through a variable: the region may have several returns.
        Id result_variable = 0;
        const Id result_type = call.type;
        std::vector<Inst> variables;
        if (p_.type_op(result_type) != Op::OpTypeVoid) {
            const Id pointer = p_.pointer_type(spv::StorageClass::Function, result_type);
            Inst variable(Op::OpVariable, pointer, p_.module.new_id(),
                          {static_cast<uint32_t>(spv::StorageClass::Function)});
            result_variable = variable.result;
            variables.push_back(std::move(variable));
            Inst load(Op::OpLoad, result_type, call.result, {result_variable});
            load.source = call.source;
            tail.insts.push_back(std::move(load));
        }
        tail.insts.insert(tail.insts.end(), after.begin(), after.end());

        std::vector<Block> inlined;
        std::vector<Inst> initializers;
        for (const Block& block : callee.blocks) {
            Block copy;
            copy.label = mapped(block.label);
            for (const Inst& inst : block.insts) {
                Inst clone = inst;
                if (clone.result) {
                    clone.result = mapped(clone.result);
                    p_.copy_decorations(inst.result, clone.result);
                }
                clone.for_each_id([&](Id& id) { id = mapped(id); });
                if (clone.op == Op::OpVariable) {
                    if (clone.ops.size() > 1) {
                        initializers.push_back(Inst(Op::OpStore, 0, 0, {clone.result, clone.ops[1]}));
                        clone.ops.resize(1);
                    }
                    variables.push_back(std::move(clone));
                    continue;
                }
                if (clone.op == Op::OpReturnValue)
                    copy.insts.push_back(Inst(Op::OpStore, 0, 0, {result_variable, clone.ops[0]}));
                if (clone.op == Op::OpReturnValue || clone.op == Op::OpReturn) {
                    Inst branch(Op::OpBranch, 0, 0, {tail.label});
                    branch.source = clone.source;
                    copy.insts.push_back(std::move(branch));
                    continue;
                }
                copy.insts.push_back(std::move(clone));
            }
            inlined.push_back(std::move(copy));
        }
        entry.insts = std::move(initializers);
        entry.insts.push_back(Inst(Op::OpBranch, 0, 0, {inlined.front().label}));

        if (is_loop_header) before.push_back(loop_merge);
        before.push_back(Inst(Op::OpBranch, 0, 0, {entry.label}));
        head.insts = std::move(before);

        // The block that ends with the old terminator is `tail` now.
        for (Id successor : tail.successors())
            for (Block& block : blocks)
                if (block.label == successor)
                    for (Inst& phi : block.insts) {
                        if (phi.op != Op::OpPhi) break;
                        for (size_t k = 1; k < phi.ops.size(); k += 2)
                            if (phi.ops[k] == head_label) phi.ops[k] = tail.label;
                    }
        // A loop whose continue target or back edge was this block keeps it: labels of edges into it are unchanged.

        stage_.inlined.push_back({entry.label, tail.label});
        inlined.insert(inlined.begin(), std::move(entry));
        inlined.push_back(std::move(tail));
        blocks.insert(blocks.begin() + block_index + 1, std::make_move_iterator(inlined.begin()),
                      std::make_move_iterator(inlined.end()));
        std::vector<Inst>& first = blocks.front().insts;
        first.insert(first.begin(), variables.begin(), variables.end());
    }

    Program& p_;
    Stage& stage_;
    const CallKinds& kinds_;
    std::unordered_map<Id, size_t> by_id_;
    std::set<Id> suspending_;
};

}  // namespace

void inline_calls(Program& program, Stage& stage, const CallKinds& kinds) { Inliner(program, stage, kinds).run(); }

}  // namespace rtc::lower
