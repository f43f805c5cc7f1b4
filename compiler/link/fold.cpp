// Removes what is known not to happen: constant values, branches never taken. Drivers do much of this too, but not
// across the states of a loop, and not before they have parsed, inlined and paid for it.
//
// First everything is found out, then the code changes, once. A branch that always goes one way leaves code that
// nothing gets to; what stands there stores nothing, and without those stores more may be known. So analysis and
// branches take turns until no branch is new, and nothing moves under the analysis meanwhile.
#include <algorithm>
#include <optional>
#include <set>

#include "link/bits.h"
#include "link/link.h"

namespace rtc::link {
namespace {

using ir::Block;
using ir::Function;

struct Branch {
    const Block* block;       // ends in a conditional branch
    bool back_if, back_else;  // which of its ways go back to a loop's header
};

// A function that `main` reaches.
struct Part {
    Function* function = nullptr;
    std::vector<Branch> open;                     // branches that may still turn out to go one way
    std::vector<std::pair<Id, uint32_t>> calls;   // a block and the part it calls
    bool stores_constant = false;                 // stores to a variable of one known content
    bool folds = false;                           // a branch goes one way
    bool dead = false;
};

class Folder {
  public:
    // `constant`: variables of one known content.
    Folder(Program& program, Id main, const std::map<Id, Bits>& given, const ir::IdSet& constant,
           BitAnalysis::Tables& tables)
        : p_(program), constant_(constant) {
        for (Function& function : p_.module.functions) functions_[function.id()] = &function;
        add_part(main);
        std::vector<const Function*> functions;
        for (const Part& part : parts_) functions.push_back(part.function);
        bits_.emplace(p_, functions, given, true, tables);
    }

    // The functions that `main` still reaches, callees first.
    std::vector<Function*> run() {
        while (decide_branches()) {
            for (Part& part : parts_)
                if (part.folds && !part.dead) bury_blocks(part);
            bury_functions();
            bits_->settle();
        }
        replace_values();
        std::vector<Function*> left;
        for (Part& part : parts_) {
            if (part.dead) continue;
            if (part.folds) {
                change_branches(*part.function);
                remove_blocks(*part.function);
                join_blocks(*part.function);
            }
            left.push_back(part.function);
        }
        return left;
    }

  private:
    // ---- what there is ----------------------------------------------------------------------------------

    // Callees first.
    uint32_t add_part(Id id) {
        if (const uint32_t known = part_of_.get(id)) return known - 1;
        Part part;
        part.function = functions_.get(id);
        ir::IdSet headers;  // of the loops so far: a branch to one of them is its back edge
        for (const Block& block : part.function->blocks) {
            for (const Inst& inst : block.insts) {
                if (inst.op == Op::OpFunctionCall) part.calls.push_back({block.label, add_part(inst.ops[0])});
                if (inst.op == Op::OpStore) part.stores_constant |= constant_.contains(inst.ops[0]);
            }
            if (const Inst* merge = block.merge(); merge && merge->op == Op::OpLoopMerge) headers.insert(block.label);
            const Inst& end = block.terminator();
            if (end.op == Op::OpBranchConditional)
                part.open.push_back({&block, headers.contains(end.ops[1]), headers.contains(end.ops[2])});
        }
        parts_.push_back(std::move(part));
        const auto place = static_cast<uint32_t>(parts_.size());
        part_of_[id] = place;
        return place - 1;
    }

    // ---- what is known ----------------------------------------------------------------------------------

    // True when a branch was found to go one way.
    bool decide_branches() {
        bool any = false;
        for (Part& part : parts_) {
            if (part.dead) continue;
            std::erase_if(part.open, [&](const Branch& branch) {
                if (bits_->dead(branch.block->label)) return true;
                const Inst& end = branch.block->terminator();
                Id target = end.ops[1];
                if (end.ops[1] != end.ops[2]) {
                    const Bits condition = bits_->of(end.ops[0]);
                    if (!condition.constant(1)) return false;
                    if (!condition.ones) target = end.ops[2];
                    // A loop keeps its back edge, also where it is never taken: do { … } while (false).
                    if (condition.ones ? branch.back_else : branch.back_if) return true;
                }
                bits_->take(branch.block->label, target);
                part.folds = any = true;
                return true;
            });
        }
        return any;
    }

    void bury_blocks(const Part& part) {
        const std::vector<Block>& blocks = part.function->blocks;
        if (!block_at_.get(blocks.front().label))
            for (const Block& block : blocks) block_at_[block.label] = &block;
        ir::IdSet reached;
        std::vector<Id> work{blocks.front().label};
        while (!work.empty()) {
            const Id label = work.back();
            work.pop_back();
            if (!reached.insert(label)) continue;
            if (const Id only = bits_->taken(label))
                work.push_back(only);
            else
                block_at_.get(label)->for_each_successor([&](Id next) { work.push_back(next); });
        }
        for (const Block& block : blocks)
            if (!reached.contains(block.label)) bits_->bury(block.label);
    }

    void bury_functions() {
        std::vector<bool> reached(parts_.size(), false);
        std::vector<uint32_t> work{static_cast<uint32_t>(parts_.size() - 1)};  // main
        while (!work.empty()) {
            const uint32_t at = work.back();
            work.pop_back();
            if (reached[at]) continue;
            reached[at] = true;
            for (const auto& [label, callee] : parts_[at].calls)
                if (!bits_->dead(label)) work.push_back(callee);
        }
        for (size_t i = 0; i < parts_.size(); ++i) {
            if (reached[i] || parts_[i].dead) continue;
            parts_[i].dead = true;
            for (const Block& block : parts_[i].function->blocks) bits_->bury(block.label);
        }
    }

    // ---- values -----------------------------------------------------------------------------------------

    void replace_values() {
        // All is decided before the first instruction moves.
        bool everywhere = false;
        for (size_t i = 0; i < p_.module.globals.size(); ++i) {
            const Inst& inst = p_.module.globals[i];
            if (inst.op == Op::OpSpecConstantOp) everywhere |= decide(Id(inst.result), Id(inst.type));
        }
        std::vector<bool> changes(parts_.size(), everywhere);
        for (size_t i = 0; i < parts_.size(); ++i)
            for (const auto& [inst, block] : bits_->candidates(i)) {
                if (bits_->dead(block)) continue;
                if (decide(inst->result, inst->type)) {
                    changes[i] = true;
                    continue;
                }
                const Id same = same_as(*inst);
                if (same && bits_->def(same) && bits_->def(same)->type == inst->type) {
                    become_[inst->result] = same;
                    changes[i] = true;
                }
            }
        for (size_t i = 0; i < parts_.size(); ++i) {
            if (parts_[i].dead || !(changes[i] || parts_[i].stores_constant)) continue;
            for (Block& block : parts_[i].function->blocks) {
                if (bits_->dead(block.label)) continue;
                bool any = false;
                for (Inst& inst : block.insts) {
                    inst.for_each_id([&](Id& id) {
                        if (become_.get(id)) id = resolve(id);
                    });
                    any |= goes(inst);
                }
                if (any) std::erase_if(block.insts, [&](const Inst& inst) { return goes(inst); });
            }
        }
    }

    bool goes(const Inst& inst) const {
        if (inst.op == Op::OpStore) return constant_.contains(inst.ops[0]);
        // A call may do more than give its value.
        return inst.result && inst.op != Op::OpFunctionCall && become_.get(inst.result);
    }

    bool decide(Id id, Id type) {
        const uint32_t all = bits_->mask(type);
        if (!all) return false;
        const Bits known = bits_->of(id);
        if (!known.constant(all)) return false;
        become_[id] = p_.type_op(type) == Op::OpTypeBool ? p_.constant_bool(known.ones != 0)
                                                          : p_.constant_scalar(type, known.ones);
        return true;
    }

    // The operand an operation equals whatever its other operand is; 0: none.
    Id same_as(const Inst& inst) {
        const uint32_t all = bits_->mask(inst.type);
        auto is = [&](Id id, uint32_t value) { return bits_->of(id) == Bits{~value & all, value}; };
        switch (inst.op) {
            case Op::OpSelect: {
                const Bits c = bits_->of(inst.ops[0]);  // a vector of booleans has no known bits
                return c.ones ? inst.ops[1] : c.zeros ? inst.ops[2] : inst.ops[1] == inst.ops[2] ? inst.ops[1] : 0;
            }
            case Op::OpLogicalAnd:
            case Op::OpBitwiseAnd:
                return !all ? 0 : is(inst.ops[0], all) ? inst.ops[1] : is(inst.ops[1], all) ? inst.ops[0] : 0;
            case Op::OpLogicalOr:
            case Op::OpBitwiseOr:
            case Op::OpIAdd:
                return !all ? 0 : is(inst.ops[0], 0) ? inst.ops[1] : is(inst.ops[1], 0) ? inst.ops[0] : 0;
            case Op::OpPhi: {
                Id one = 0;
                for (size_t i = 0; i < inst.ops.size(); i += 2) {
                    if (!bits_->arrives(inst.ops[i + 1], bits_->block_of(inst))) continue;
                    if (one && inst.ops[i] != one) return 0;
                    one = inst.ops[i];
                }
                return one == inst.result ? 0 : one;
            }
            default: return 0;
        }
    }

    Id resolve(Id id) const {
        for (int hops = 0; hops < 1000; ++hops) {
            const Id next = become_.get(id);
            if (!next) break;
            id = next;
        }
        return id;
    }

    // ---- branches and blocks ----------------------------------------------------------------------------

    void change_branches(Function& f) const {
        for (Block& block : f.blocks) {
            const Id target = bits_->taken(block.label);
            if (!target || bits_->dead(block.label)) continue;
            block.terminator() = Inst(Op::OpBranch, 0, 0, {target});
            if (const size_t n = block.insts.size(); n > 1 && block.insts[n - 2].op == Op::OpSelectionMerge)
                block.insts.erase(block.insts.end() - 2);
        }
    }

    void remove_blocks(Function& f) {
        ir::IdMap<Id> merges, continues;  // of live code: label -> header
        for (const Block& block : f.blocks) {
            const Inst* merge = block.merge();
            if (!merge || bits_->dead(block.label)) continue;
            merges[merge->ops[0]] = block.label;
            if (merge->op == Op::OpLoopMerge) continues[merge->ops[1]] = block.label;
        }
        // A merge or continue target must exist although nothing gets there.
        for (Block& block : f.blocks) {
            if (!bits_->dead(block.label)) continue;
            if (const Id header = continues.get(block.label))
                block.insts = {Inst(Op::OpBranch, 0, 0, {header})};
            else if (merges.get(block.label))
                block.insts = {Inst(Op::OpUnreachable, 0, 0, {})};
        }
        std::erase_if(f.blocks, [&](const Block& block) {
            return bits_->dead(block.label) && !merges.get(block.label) && !continues.get(block.label);
        });
        std::map<Id, std::set<Id>> sources;  // of blocks that begin with a phi
        for (const Block& block : f.blocks)
            if (!block.insts.empty() && block.insts.front().op == Op::OpPhi) sources[block.label];
        if (sources.empty()) return;
        for (const Block& block : f.blocks)
            block.for_each_successor([&](Id next) {
                if (const auto found = sources.find(next); found != sources.end()) found->second.insert(block.label);
            });
        for (Block& block : f.blocks)
            for (Inst& inst : block.insts) {
                if (inst.op != Op::OpPhi) continue;
                std::vector<uint32_t> pairs;
                std::set<Id> missing = sources[block.label];
                for (size_t i = 0; i < inst.ops.size(); i += 2)
                    if (missing.erase(inst.ops[i + 1])) {
                        // What came from code that is gone may be gone too.
                        const Id value = bits_->dead(inst.ops[i + 1]) ? p_.undef(inst.type) : inst.ops[i];
                        pairs.insert(pairs.end(), {value, inst.ops[i + 1]});
                    }
                for (Id label : missing) pairs.insert(pairs.end(), {p_.undef(inst.type), label});
                inst.ops = std::move(pairs);
            }
    }

    // A block that only one branch reaches continues the block it comes from.
    void join_blocks(Function& f) {
        for (size_t i = 0; i < f.blocks.size(); ++i) {
            const Block& block = f.blocks[i];
            labels_[block.label].place = static_cast<uint32_t>(i);
            block.for_each_successor([&](Id next) { ++labels_[next].arrivals; });
            if (const Inst* merge = block.merge()) {
                labels_[merge->ops[0]].named = true;
                if (merge->op == Op::OpLoopMerge) labels_[merge->ops[1]].named = true;
            }
        }
        bool any = false;
        std::vector<bool> gone(f.blocks.size(), false);
        for (size_t i = 0; i < f.blocks.size(); ++i) {
            if (gone[i]) continue;
            for (;;) {
                Block& block = f.blocks[i];
                if (block.terminator().op != Op::OpBranch || block.merge()) break;
                Label& next = labels_[block.terminator().ops[0]];
                if (next.arrivals != 1 || next.named || next.place == i || next.place == 0) break;
                Block& tail = f.blocks[next.place];
                if (!tail.insts.empty() && tail.insts.front().op == Op::OpPhi) break;  // becomes a value first
                block.insts.pop_back();
                std::move(tail.insts.begin(), tail.insts.end(), std::back_inserter(block.insts));
                gone[next.place] = true;
                next.joined = block.label;
                any = true;
            }
        }
        if (!any) return;
        auto resolve = [&](Id label) {
            while (const Id into = labels_.get(label).joined) label = into;
            return label;
        };
        size_t kept = 0;
        for (size_t i = 0; i < f.blocks.size(); ++i) {
            if (gone[i]) continue;
            if (kept != i) f.blocks[kept] = std::move(f.blocks[i]);
            ++kept;
        }
        f.blocks.resize(kept);
        for (Block& block : f.blocks)
            for (Inst& inst : block.insts) {
                if (inst.op != Op::OpPhi) break;
                for (size_t i = 1; i < inst.ops.size(); i += 2) inst.ops[i] = resolve(inst.ops[i]);
            }
    }

    struct Label {
        uint32_t place = 0, arrivals = 0;
        bool named = false;  // as a merge or continue target
        Id joined = 0;       // the block it is part of now
    };

    Program& p_;
    const ir::IdSet& constant_;
    ir::IdMap<Function*> functions_;
    std::vector<Part> parts_;      // callees first
    ir::IdMap<uint32_t> part_of_;  // by function: in parts_, plus one
    std::optional<BitAnalysis> bits_;
    // Of functions with a branch that goes one way:
    ir::IdMap<const Block*> block_at_;
    ir::IdMap<Label> labels_;
    ir::IdMap<Id> become_;              // a value -> the constant, or the other value, it always equals
};

}  // namespace

std::vector<Function*> fold(Program& program, Id main, const std::map<Id, Bits>& given, BitAnalysis::Tables& tables) {
    // A variable of one known content is that content.
    ir::IdSet constant;
    for (const auto& [variable, bits] : given)
        if (bits.constant(0xffffffffu)) constant.insert(variable);
    tables.reserve(program.module.bound);
    return Folder(program, main, given, constant, tables).run();
}

}  // namespace rtc::link
