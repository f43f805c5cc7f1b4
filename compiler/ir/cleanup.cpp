#include "ir/cleanup.h"

#include <algorithm>
#include <map>

namespace rtc::ir {
namespace {

bool is_function_variable(const Inst& inst) { return inst.op == Op::OpVariable; }

// May be removed when nothing uses the result. (A load with memory operands may be volatile.)
bool is_pure(const Inst& inst) {
    switch (inst.op) {
        case Op::OpUndef:
        case Op::OpAccessChain:
        case Op::OpInBoundsAccessChain:
        case Op::OpVectorExtractDynamic:
        case Op::OpVectorInsertDynamic:
        case Op::OpVectorShuffle:
        case Op::OpCompositeConstruct:
        case Op::OpCompositeExtract:
        case Op::OpCompositeInsert:
        case Op::OpCopyObject:
        case Op::OpTranspose:
        case Op::OpPhi:
        case Op::OpSelect: return true;
        case Op::OpLoad: return inst.ops.size() == 1;
        default: break;
    }
    // Conversions, arithmetic, comparisons and bit operations stand together in the opcode space.
    const auto op = static_cast<uint32_t>(inst.op);
    const auto between = [op](Op first, Op last) {
        return op >= static_cast<uint32_t>(first) && op <= static_cast<uint32_t>(last);
    };
    return between(Op::OpConvertFToU, Op::OpFConvert) || between(Op::OpBitcast, Op::OpFUnordGreaterThanEqual) ||
           between(Op::OpShiftRightLogical, Op::OpBitCount);
}

class ConstantBools {
  public:
    explicit ConstantBools(const Program& program) : p_(program) {}

    // 1 true, 0 false, -1 unknown
    int value(Id id) const {
        if (const Inst* global = p_.def(id)) {
            if (global->op == Op::OpConstantTrue) return 1;
            if (global->op == Op::OpConstantFalse) return 0;
            if (global->op != Op::OpSpecConstantOp) return -1;
            return operation(static_cast<Op>(global->ops[0]), &global->ops[1]);
        }
        const auto known = local_.find(id);
        return known == local_.end() ? -1 : known->second;
    }
    void learn(const Inst& inst) {
        switch (inst.op) {
            case Op::OpLogicalNot:
            case Op::OpLogicalAnd:
            case Op::OpLogicalOr:
                if (const int known = operation(inst.op, inst.ops.data()); known >= 0) local_[inst.result] = known;
                break;
            default: break;
        }
    }

  private:
    int operation(Op op, const uint32_t* ops) const {
        if (op == Op::OpLogicalNot) {
            const int a = value(ops[0]);
            return a < 0 ? a : !a;
        }
        if (op != Op::OpLogicalAnd && op != Op::OpLogicalOr) return -1;
        const int a = value(ops[0]), b = value(ops[1]), decisive = op == Op::OpLogicalOr;
        if (a == decisive || b == decisive) return decisive;
        return a < 0 || b < 0 ? -1 : !decisive;
    }

    const Program& p_;
    std::map<Id, int> local_;
};

}  // namespace

void fold_constant_branches(const Program& program, Function& function) {
    ConstantBools bools(program);
    bool changed = false;
    IdSet headers;  // of the loops so far: a branch to one of them is its back edge
    for (Block& block : function.blocks) {
        for (const Inst& inst : block.insts) bools.learn(inst);
        if (const Inst* merge = block.merge(); merge && merge->op == Op::OpLoopMerge) headers.insert(block.label);
        Inst& end = block.terminator();
        if (end.op != Op::OpBranchConditional) continue;
        const int known = bools.value(end.ops[0]);
        if (known < 0) continue;
        // A loop keeps its back edge, also where it is never taken: do { … } while (false).
        if (headers.contains(end.ops[known ? 2 : 1])) continue;
        end.ops = {end.ops[known ? 1 : 2]};
        end.op = Op::OpBranch;
        if (block.merge() && block.merge()->op == Op::OpSelectionMerge)
            block.insts.erase(block.insts.end() - 2);
        changed = true;
    }
    if (!changed) return;

    IdMap<uint32_t> index;  // of a label, plus one
    for (size_t i = 0; i < function.blocks.size(); ++i) index[function.blocks[i].label] = static_cast<uint32_t>(i + 1);
    IdSet reached, named;
    std::vector<Id> work{function.blocks.front().label};
    reached.insert(work[0]);
    while (!work.empty()) {
        const Block& block = function.blocks[index.get(work.back()) - 1];
        work.pop_back();
        block.for_each_successor([&](Id next) {
            if (reached.insert(next)) work.push_back(next);
        });
    }
    std::map<Id, Id> back_edges;  // unreached continue target -> its loop's header
    for (const Block& block : function.blocks)
        if (const Inst* merge = block.merge(); merge && reached.contains(block.label)) {
            named.insert(merge->ops[0]);
            if (merge->op == Op::OpLoopMerge) {
                named.insert(merge->ops[1]);
                back_edges[merge->ops[1]] = block.label;
            }
        }
    std::erase_if(function.blocks,
                  [&](const Block& block) { return !reached.contains(block.label) && !named.contains(block.label); });
    for (Block& block : function.blocks) {
        if (reached.contains(block.label)) continue;
        const auto back = back_edges.find(block.label);
        block.insts.clear();
        if (back != back_edges.end())
            block.insts.push_back(Inst(Op::OpBranch, 0, 0, {back->second}));
        else
            block.insts.push_back(Inst(Op::OpUnreachable, 0, 0, {}));
    }
    // Phis name exactly the predecessors there are.
    std::map<Id, IdSet> predecessors;
    for (const Block& block : function.blocks)
        block.for_each_successor([&](Id next) { predecessors[next].insert(block.label); });
    for (Block& block : function.blocks)
        for (Inst& phi : block.insts) {
            if (phi.op != Op::OpPhi) break;
            const IdSet& from = predecessors[block.label];
            Words kept;
            for (size_t k = 0; k + 1 < phi.ops.size(); k += 2)
                if (from.contains(phi.ops[k + 1])) {
                    kept.push_back(phi.ops[k]);
                    kept.push_back(phi.ops[k + 1]);
                }
            // A continue block nothing continues to is entered from nowhere; a loop header keeps its back edge.
            phi.ops = std::move(kept);
        }
}

void forward_local_loads(const Program& program, Function& function) {
    // Variables used by plain loads and stores alone.
    IdSet simple;
    for (const Inst& inst : function.blocks.front().insts)
        if (is_function_variable(inst) && inst.ops.size() == 1) simple.insert(inst.result);
    for (const Block& block : function.blocks)
        for (const Inst& inst : block.insts) {
            if (is_function_variable(inst)) continue;
            if ((inst.op == Op::OpLoad && inst.ops.size() == 1)) continue;
            if (inst.op == Op::OpStore && inst.ops.size() == 2) {
                simple.erase(inst.ops[1]);
                continue;
            }
            inst.for_each_id([&](Id id) { simple.erase(id); });
        }
    IdMap<Id> replaced;
    bool any = false;
    for (Block& block : function.blocks) {
        std::map<Id, Id> known;
        for (Inst& inst : block.insts) {
            inst.for_each_id([&](Id& id) {
                if (const Id to = replaced.get(id)) id = to;
            });
            if (inst.op == Op::OpLoad && simple.contains(inst.ops[0])) {
                auto [value, fresh] = known.emplace(inst.ops[0], inst.result);
                // A decorated load says something of its own: that an index is not uniform, for one.
                if (fresh || program.is_decorated(inst.result)) continue;
                replaced[inst.result] = value->second;
                any = true;
                inst.op = Op::OpNop;
            } else if (inst.op == Op::OpStore && simple.contains(inst.ops[0])) {
                known[inst.ops[0]] = inst.ops[1];
            }
        }
    }
    if (!any) return;
    for (Block& block : function.blocks) {
        std::erase_if(block.insts, [](const Inst& inst) { return inst.op == Op::OpNop; });
        for (Inst& inst : block.insts)
            inst.for_each_id([&](Id& id) {
                if (const Id to = replaced.get(id)) id = to;
            });
    }
}

void remove_dead_code(Function& function) {
    struct Place {
        uint32_t block = 0, inst = 0;
    };
    IdMap<Place> defs;
    IdSet live;
    std::vector<Id> work;
    // Stores to local variables count when something reads the variable.
    IdMap<std::vector<Id>> stored;  // variable -> values stored to it
    IdSet variables;
    auto need = [&](Id id) {
        if (live.insert(id)) work.push_back(id);
    };
    for (const Inst& inst : function.blocks.front().insts)
        if (is_function_variable(inst)) variables.insert(inst.result);
    for (uint32_t b = 0; b < function.blocks.size(); ++b) {
        const Block& block = function.blocks[b];
        for (uint32_t i = 0; i < block.insts.size(); ++i) {
            const Inst& inst = block.insts[i];
            if (inst.result) defs[inst.result] = {b + 1, i};
            if (is_function_variable(inst) || (inst.result && is_pure(inst))) continue;
            if (inst.op == Op::OpStore && variables.contains(inst.ops[0]) && inst.ops.size() == 2) {
                stored[inst.ops[0]].push_back(inst.ops[1]);
                continue;
            }
            inst.for_each_id(need);
        }
    }
    while (!work.empty()) {
        const Id id = work.back();
        work.pop_back();
        const Place place = defs.get(id);
        if (!place.block) continue;
        const Inst& inst = function.blocks[place.block - 1].insts[place.inst];
        if (is_function_variable(inst)) {
            inst.for_each_id(need);
            for (Id value : std::vector<Id>(stored[id])) need(value);
        } else {
            inst.for_each_id(need);
        }
    }
    for (Block& block : function.blocks)
        std::erase_if(block.insts, [&](const Inst& inst) {
            if (is_function_variable(inst) || (inst.result && is_pure(inst))) return !live.contains(inst.result);
            return inst.op == Op::OpStore && variables.contains(inst.ops[0]) && inst.ops.size() == 2 &&
                   !live.contains(inst.ops[0]);
        });
}

void merge_blocks(Function& function) {
    IdMap<uint32_t> arrivals;
    IdSet named;
    for (const Block& block : function.blocks) {
        block.for_each_successor([&](Id next) { ++arrivals[next]; });
        if (const Inst* merge = block.merge())
            for (size_t i = 0; i < (merge->op == Op::OpLoopMerge ? 2u : 1u); ++i) named.insert(merge->ops[i]);
    }
    IdMap<uint32_t> index;
    for (size_t i = 0; i < function.blocks.size(); ++i) index[function.blocks[i].label] = static_cast<uint32_t>(i + 1);
    IdMap<Id> renamed;  // a block that was taken in -> the block that holds its code
    IdSet gone;
    for (Block& block : function.blocks) {
        if (gone.contains(block.label)) continue;
        while (true) {
            const Inst& end = block.terminator();
            if (end.op != Op::OpBranch || block.merge()) break;
            const Id next = end.ops[0];
            if (arrivals.get(next) != 1 || named.contains(next) || next == block.label) break;
            Block& target = function.blocks[index.get(next) - 1];
            if (gone.contains(next) || (!target.insts.empty() && target.insts.front().op == Op::OpPhi)) break;
            // A loop header stays a block of its own: its back edge names it.
            if (target.merge() && target.merge()->op == Op::OpLoopMerge) break;
            block.insts.pop_back();
            block.insts.insert(block.insts.end(), std::make_move_iterator(target.insts.begin()),
                               std::make_move_iterator(target.insts.end()));
            gone.insert(next);
            renamed[next] = block.label;
        }
    }
    std::erase_if(function.blocks, [&](const Block& block) { return gone.contains(block.label); });
    auto holder = [&](Id label) {
        while (const Id to = renamed.get(label)) label = to;
        return label;
    };
    for (Block& block : function.blocks)
        for (Inst& inst : block.insts) {
            if (inst.op != Op::OpPhi) break;
            for (size_t k = 1; k < inst.ops.size(); k += 2) inst.ops[k] = holder(inst.ops[k]);
        }
}

void split_nested_inserts(Program& program, Function& function) {
    for (Block& block : function.blocks) {
        const bool any = std::any_of(block.insts.begin(), block.insts.end(), [](const Inst& inst) {
            return inst.op == Op::OpCompositeInsert && inst.ops.size() > 3;
        });
        if (!any) continue;
        std::vector<Inst> out;
        out.reserve(block.insts.size() + 8);
        for (Inst& inst : block.insts) {
            if (inst.op != Op::OpCompositeInsert || inst.ops.size() <= 3) {
                out.push_back(std::move(inst));
                continue;
            }
            // From the whole down to the part that changes, and up again.
            std::vector<Inst> whole{Inst(Op::OpCopyObject, inst.type, inst.ops[1], {})};
            for (size_t i = 2; i + 1 < inst.ops.size(); ++i) {
                const Inst& outer = whole.back();
                Inst part(Op::OpCompositeExtract, program.element_type(outer.type, inst.ops[i]),
                          program.module.new_id(), {outer.result, inst.ops[i]});
                part.source = inst.source;
                out.push_back(part);
                whole.push_back(std::move(part));
            }
            Id value = inst.ops[0];
            for (size_t level = whole.size(); level-- > 0;) {
                Inst changed(Op::OpCompositeInsert, whole[level].type, level ? program.module.new_id() : inst.result,
                             {value, whole[level].result, inst.ops[2 + level]});
                changed.source = inst.source;
                value = changed.result;
                out.push_back(std::move(changed));
            }
        }
        block.insts = std::move(out);
    }
}

bool stores_deep(const Function& function) {
    IdSet variables, deep;
    for (const Inst& inst : function.blocks.front().insts)
        if (is_function_variable(inst)) variables.insert(inst.result);
    for (const Block& block : function.blocks)
        for (const Inst& inst : block.insts) {
            const bool chain = inst.op == Op::OpAccessChain || inst.op == Op::OpInBoundsAccessChain;
            if (chain && inst.ops.size() > 2 && variables.contains(inst.ops[0])) deep.insert(inst.result);
            if (inst.op == Op::OpStore && deep.contains(inst.ops[0])) return true;
        }
    return false;
}

void clean_up(const Program& program, Function& function) {
    if (function.blocks.empty()) return;
    fold_constant_branches(program, function);
    forward_local_loads(program, function);
    remove_dead_code(function);
    merge_blocks(function);
    forward_local_loads(program, function);
    remove_dead_code(function);
}

}  // namespace rtc::ir
