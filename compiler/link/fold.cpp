// Removes what is known not to be needed: constant values, branches never taken,
// variables nobody reads. Drivers do much of this too, but not across the states of
// a loop, and not before they have parsed, inlined and paid for it.
#include <algorithm>
#include <memory>
#include <set>

#include "link/bits.h"
#include "link/link.h"

namespace rtc::link {
namespace {

using ir::Block;
using ir::Function;

// ---- constant values ------------------------------------------------------------------------------------

// What values become: constants, or other values they always equal.
class Values {
  public:
    Values(Program& program, const std::vector<Function*>& functions, const std::map<Id, Bits>& given,
           BitAnalysis::Tables& tables)
        : p_(program), functions_(functions), bits_(program, {functions.begin(), functions.end()}, given, true, tables) {}

    void replace() {
        // All is decided before the first instruction moves.
        bool everywhere = false;
        for (size_t i = 0; i < p_.module.globals.size(); ++i) {
            const Inst& inst = p_.module.globals[i];
            if (inst.op == Op::OpSpecConstantOp) everywhere |= decide(Id(inst.result), Id(inst.type));
        }
        for (const Function* function : functions_)
            for (const Inst& inst : function->params) params_.insert(inst.result);
        std::vector<bool> changes(functions_.size(), everywhere);
        for (size_t i = 0; i < functions_.size(); ++i)
            for (const Inst* inst : bits_.candidates(i)) {
                if (decide(inst->result, inst->type)) {
                    changes[i] = true;
                    continue;
                }
                const Id same = same_as(*inst);
                if (same && !params_.contains(same) && bits_.def(same) && bits_.def(same)->type == inst->type) {
                    become_[inst->result] = same;
                    changes[i] = true;
                }
            }
        for (size_t i = 0; i < functions_.size(); ++i) {
            if (!changes[i]) continue;
            for (Block& block : functions_[i]->blocks) {
                bool goes = false;
                for (Inst& inst : block.insts) {
                    inst.for_each_id([&](Id& id) {
                        if (become_.get(id)) id = resolve(id);
                    });
                    goes |= inst.result && become_.get(inst.result);
                }
                // A call may do more than give its value.
                if (goes)
                    std::erase_if(block.insts, [&](const Inst& inst) {
                        return inst.result && inst.op != Op::OpFunctionCall && become_.get(inst.result);
                    });
            }
        }
    }

  private:
    bool decide(Id id, Id type) {
        const uint32_t all = bits_.mask(type);
        if (!all) return false;
        const Bits known = bits_.of(id);
        if (!known.constant(all)) return false;
        become_[id] = p_.type_op(type) == Op::OpTypeBool ? p_.constant_bool(known.ones != 0)
                                                          : p_.constant_scalar(type, known.ones);
        return true;
    }

    // The operand an operation equals whatever its other operand is; 0: none.
    Id same_as(const Inst& inst) {
        const uint32_t all = bits_.mask(inst.type);
        auto is = [&](Id id, uint32_t value) { return bits_.of(id) == Bits{~value & all, value}; };
        switch (inst.op) {
            case Op::OpSelect: {
                const Bits c = bits_.of(inst.ops[0]);  // a vector of booleans has no known bits
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
                for (size_t i = 2; i < inst.ops.size(); i += 2)
                    if (inst.ops[i] != inst.ops[0]) return 0;
                return inst.ops[0] == inst.result ? 0 : inst.ops[0];
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

    Program& p_;
    const std::vector<Function*>& functions_;
    BitAnalysis bits_;
    ir::IdSet params_;
    ir::IdMap<Id> become_;
};

// ---- branches of one function ---------------------------------------------------------------------------

class Branches {
  public:
    Branches(Program& program, Function& function) : p_(program), f_(function) {}

    // True when one was folded.
    bool fold() {
        if (!fold_branches()) return false;
        remove_unreachable();
        join_blocks();
        return true;
    }

  private:
    bool fold_branches() {
        bool changed = false;
        ir::IdSet headers;  // of the loops so far: a branch to one of them is its back edge
        for (Block& block : f_.blocks) {
            if (const Inst* merge = block.merge(); merge && merge->op == Op::OpLoopMerge) headers.insert(block.label);
            Inst& end = block.terminator();
            if (end.op != Op::OpBranchConditional) continue;
            const Inst* condition = p_.def(end.ops[0]);
            const bool same = end.ops[1] == end.ops[2];
            if (!same && (!condition || (condition->op != Op::OpConstantTrue && condition->op != Op::OpConstantFalse)))
                continue;
            const Id target = same || condition->op == Op::OpConstantTrue ? end.ops[1] : end.ops[2];
            // A loop keeps its back edge, also where it is never taken: do { … } while (false).
            if (!same && headers.count(end.ops[1] == target ? end.ops[2] : end.ops[1])) continue;
            end = Inst(Op::OpBranch, 0, 0, {target});
            if (const size_t n = block.insts.size(); n > 1 && block.insts[n - 2].op == Op::OpSelectionMerge)
                block.insts.erase(block.insts.end() - 2);
            changed = true;
        }
        return changed;
    }

    void remove_unreachable() {
        ir::IdMap<Block*> blocks;
        for (Block& block : f_.blocks) blocks[block.label] = &block;
        ir::IdSet reachable;
        std::vector<Id> work{f_.blocks.front().label};
        ir::IdMap<Id> merges, continues;  // label -> header
        while (!work.empty()) {
            const Id label = work.back();
            work.pop_back();
            if (!reachable.insert(label)) continue;
            const Block& block = *blocks.get(label);
            block.for_each_successor([&](Id next) { work.push_back(next); });
            if (const Inst* merge = block.merge()) {
                merges[merge->ops[0]] = label;
                if (merge->op == Op::OpLoopMerge) continues[merge->ops[1]] = label;
            }
        }
        // A merge or continue target must exist although nothing gets there.
        for (Block& block : f_.blocks) {
            if (reachable.count(block.label)) continue;
            if (const Id header = continues.get(block.label))
                block.insts = {Inst(Op::OpBranch, 0, 0, {header})};
            else if (merges.get(block.label))
                block.insts = {Inst(Op::OpUnreachable, 0, 0, {})};
        }
        std::erase_if(f_.blocks, [&](const Block& block) {
            return !reachable.count(block.label) && !merges.get(block.label) && !continues.get(block.label);
        });
        std::map<Id, std::set<Id>> sources;  // of blocks that begin with a phi
        for (const Block& block : f_.blocks)
            if (!block.insts.empty() && block.insts.front().op == Op::OpPhi) sources[block.label];
        if (sources.empty()) return;
        for (const Block& block : f_.blocks)
            block.for_each_successor([&](Id next) {
                if (const auto found = sources.find(next); found != sources.end()) found->second.insert(block.label);
            });
        for (Block& block : f_.blocks)
            for (Inst& inst : block.insts) {
                if (inst.op != Op::OpPhi) continue;
                std::vector<uint32_t> pairs;
                std::set<Id> missing = sources[block.label];
                for (size_t i = 0; i < inst.ops.size(); i += 2)
                    if (missing.erase(inst.ops[i + 1])) pairs.insert(pairs.end(), {inst.ops[i], inst.ops[i + 1]});
                for (Id label : missing) pairs.insert(pairs.end(), {p_.undef(inst.type), label});
                inst.ops = std::move(pairs);
            }
    }

    // A block that only one branch reaches continues the block it comes from.
    void join_blocks() {
        ir::IdMap<uint32_t> arrivals, index;
        ir::IdSet named;
        for (size_t i = 0; i < f_.blocks.size(); ++i) {
            const Block& block = f_.blocks[i];
            index[block.label] = static_cast<uint32_t>(i);
            block.for_each_successor([&](Id next) { ++arrivals[next]; });
            if (const Inst* merge = block.merge()) {
                named.insert(merge->ops[0]);
                if (merge->op == Op::OpLoopMerge) named.insert(merge->ops[1]);
            }
        }
        ir::IdMap<Id> joined;  // label -> the block it is part of now
        bool any = false;
        std::vector<bool> gone(f_.blocks.size(), false);
        for (size_t i = 0; i < f_.blocks.size(); ++i) {
            if (gone[i]) continue;
            for (;;) {
                Block& block = f_.blocks[i];
                if (block.terminator().op != Op::OpBranch || block.merge()) break;
                const Id next = block.terminator().ops[0];
                const size_t at = index.get(next);
                if (arrivals.get(next) != 1 || named.count(next) || at == i || at == 0) break;
                Block& tail = f_.blocks[at];
                if (!tail.insts.empty() && tail.insts.front().op == Op::OpPhi) break;  // becomes a value first
                block.insts.pop_back();
                std::move(tail.insts.begin(), tail.insts.end(), std::back_inserter(block.insts));
                gone[at] = true;
                joined[next] = block.label;
                any = true;
            }
        }
        if (!any) return;
        auto resolve = [&](Id label) {
            while (const Id into = joined.get(label)) label = into;
            return label;
        };
        std::vector<Block> left;
        for (size_t i = 0; i < f_.blocks.size(); ++i)
            if (!gone[i]) left.push_back(std::move(f_.blocks[i]));
        f_.blocks = std::move(left);
        for (Block& block : f_.blocks)
            for (Inst& inst : block.insts)
                if (inst.op == Op::OpPhi)
                    for (size_t i = 1; i < inst.ops.size(); i += 2) inst.ops[i] = resolve(inst.ops[i]);
    }

    Program& p_;
    Function& f_;
};

// ---- what nobody needs ---------------------------------------------------------------------------------------

// Operations without an effect besides their result.
bool is_plain(const Inst& inst) {
    switch (inst.op) {
        case Op::OpVariable:
        case Op::OpUndef:
        case Op::OpAccessChain:
        case Op::OpInBoundsAccessChain:
        case Op::OpCopyObject:
        case Op::OpPhi:
        case Op::OpSelect:
        case Op::OpBitcast:
        case Op::OpCompositeExtract:
        case Op::OpCompositeConstruct:
        case Op::OpCompositeInsert:
        case Op::OpVectorShuffle:
        case Op::OpVectorExtractDynamic:
        case Op::OpArrayLength:
        case Op::OpImage: return true;
        case Op::OpLoad: return inst.ops.size() < 2 || !(inst.ops[1] & 1u);  // not Volatile
        case Op::OpExtInst: return inst.ops[1] != 35 && inst.ops[1] != 51;   // Modf, Frexp write through pointers
        default: {
            const uint32_t op = static_cast<uint32_t>(inst.op);
            return (op >= static_cast<uint32_t>(Op::OpConvertFToU) && op <= static_cast<uint32_t>(Op::OpConvertUToPtr)) ||
                   (op >= static_cast<uint32_t>(Op::OpSNegate) && op <= static_cast<uint32_t>(Op::OpSMulExtended)) ||
                   (op >= static_cast<uint32_t>(Op::OpAny) && op <= static_cast<uint32_t>(Op::OpFUnordGreaterThanEqual)) ||
                   (op >= static_cast<uint32_t>(Op::OpShiftRightLogical) && op <= static_cast<uint32_t>(Op::OpBitCount)) ||
                   inst.op == Op::OpImageFetch;
        }
    }
}

class Liveness {
  public:
    // `functions`: callees first.
    Liveness(Program& program, std::vector<Function*> functions, Id save, Id scratch_store)
        : p_(program), save_(save), store_(scratch_store), order_(std::move(functions)) {
        for (ir::IdSet* set : {&pure_, &read_, &live_}) set->reserve(p_.module.bound);
        defs_.reserve(p_.module.bound);
        writer_heads_.reserve(p_.module.bound);
    }

    void run() {
        for (Function* function : order_) {
            // What a pointer is made of stands before it.
            bool pure = true;
            for (const Block& block : function->blocks)
                for (const Inst& inst : block.insts) {
                    if (inst.result) defs_[inst.result] = &inst;
                    pure = start(*function, inst) && pure;
                }
            if (pure) pure_.insert(function->id());
        }
        while (!work_.empty()) {
            const Inst* inst = work_.back();
            work_.pop_back();
            follow(*inst);
        }
        uint32_t store = 0;
        for (Function* function : order_)
            for (Block& block : function->blocks)
                std::erase_if(block.insts, [&](const Inst& inst) {
                    if (inst.op == Op::OpStore) return !live_stores_[store++];
                    return inst.result && !live_.contains(inst.result);
                });
    }

  private:
    // The variable a pointer leads to when it is one that only this invocation sees; 0 otherwise.
    Id own_variable(Id pointer) const {
        for (;;) {
            const Inst* local = defs_.get(pointer);
            const Inst* inst = local ? local : p_.def(pointer);
            if (!inst) return 0;
            switch (inst->op) {
                case Op::OpVariable: {
                    const auto storage = static_cast<spv::StorageClass>(inst->ops[0]);
                    return storage == spv::StorageClass::Private || storage == spv::StorageClass::Function ? pointer : 0;
                }
                case Op::OpAccessChain:
                case Op::OpInBoundsAccessChain:
                case Op::OpCopyObject: pointer = inst->ops[0]; break;
                default: return 0;
            }
        }
    }

    bool is_local(Id variable) const { return variable && !p_.def(variable); }

    // Variables whose loads a value is made of.
    void sources(Id value, std::set<Id>& out, int depth = 0) const {
        const Inst* local = defs_.get(value);
        if (!local || depth > 16) return;
        if (local->op == Op::OpLoad) {
            out.insert(own_variable(local->ops[0]));
            return;
        }
        if (!is_plain(*local)) {
            out.insert(0);
            return;
        }
        local->for_each_id([&](Id id) { sources(id, out, depth + 1); });
    }

    // Takes in an instruction; true when all it does is give a value, or write a variable of its function.
    bool start(const Function& function, const Inst& inst) {
        if (inst.op == Op::OpStore) {
            const Id variable = own_variable(inst.ops[0]);
            const uint32_t number = store_count_++;
            live_stores_.push_back(false);
            if (!variable)
                mark({&inst, number});
            else
                add_writer(variable, {&inst, number});
            return is_local(variable);
        }
        if (inst.op == Op::OpFunctionCall) {
            const bool pure = pure_.contains(inst.ops[0]);
            if (function.id() == save_ && inst.ops[0] == store_) {
                // A word of a waiting ray is kept only for those who read it.
                std::set<Id> variables;
                sources(inst.ops[2], variables);
                if (!variables.empty() && !variables.count(0)) {
                    for (Id variable : variables) add_writer(variable, {&inst, 0});
                    return pure;
                }
            }
            if (!pure) mark({&inst, 0});
            return pure;
        }
        if (is_plain(inst)) return true;
        mark({&inst, 0});
        return inst.is_merge() ||
               (inst.is_terminator() && inst.op != Op::OpKill && inst.op != Op::OpTerminateInvocation);
    }

    // What has a result is known by it, stores by their number; everything else stays.
    struct Writer {
        const Inst* inst = nullptr;
        uint32_t number = 0;
        uint32_t next = 0;  // writer of the same variable, plus one
    };
    void add_writer(Id variable, Writer writer) {
        uint32_t& head = writer_heads_[variable];
        writer.next = head;
        writers_.push_back(writer);
        head = static_cast<uint32_t>(writers_.size());
    }

    void mark(Writer writer) {
        if (writer.inst->result) {
            if (!live_.insert(writer.inst->result)) return;
        } else if (writer.inst->op == Op::OpStore) {
            if (live_stores_[writer.number]) return;
            live_stores_[writer.number] = true;
        }
        work_.push_back(writer.inst);
    }

    void read(Id variable) {
        if (!variable || !read_.insert(variable)) return;
        for (uint32_t at = writer_heads_.get(variable); at; at = writers_[at - 1].next) mark(writers_[at - 1]);
    }

    void follow(const Inst& inst) {
        const bool passes = inst.op == Op::OpAccessChain || inst.op == Op::OpInBoundsAccessChain ||
                            inst.op == Op::OpCopyObject || inst.op == Op::OpVariable;
        bool first = true;
        inst.for_each_id([&](Id id) {
            if (const Inst* local = defs_.get(id)) mark({local, 0});
            const bool target = inst.op == Op::OpStore && first;
            first = false;
            if (!passes && !target) read(own_variable(id));
        });
    }

    Program& p_;
    Id save_, store_;
    std::vector<Function*> order_;
    ir::IdMap<const Inst*> defs_;
    ir::IdSet pure_, read_, live_;
    std::vector<Writer> writers_;
    ir::IdMap<uint32_t> writer_heads_;  // by variable: its last writer, plus one
    std::vector<bool> live_stores_;
    uint32_t store_count_ = 0;
    std::vector<const Inst*> work_;
};

// The functions `main` reaches; what each calls is kept until it changes.
class CallGraph {
  public:
    CallGraph(Program& program, Id main) : main_(main) {
        for (Function& function : program.module.functions) {
            nodes_.push_back({&function, false, {}});
            index_[function.id()] = static_cast<uint32_t>(nodes_.size());
        }
    }

    std::vector<Function*> reachable() {  // callees first
        std::vector<bool> seen(nodes_.size(), false);
        std::vector<Function*> out;
        auto visit = [&](auto& self, Id id) -> void {
            const uint32_t at = index_.get(id);
            if (!at || seen[at - 1]) return;
            seen[at - 1] = true;
            Node& node = nodes_[at - 1];
            if (!node.known) {
                node.calls.clear();
                for (const Block& block : node.function->blocks)
                    for (const Inst& inst : block.insts)
                        if (inst.op == Op::OpFunctionCall) node.calls.push_back(inst.ops[0]);
                node.known = true;
            }
            for (Id callee : node.calls) self(self, callee);
            out.push_back(node.function);
        };
        visit(visit, main_);
        return out;
    }
    void changed(const Function& function) { nodes_[index_.get(function.id()) - 1].known = false; }

  private:
    struct Node {
        Function* function;
        bool known;
        std::vector<Id> calls;
    };
    Id main_;
    std::vector<Node> nodes_;
    ir::IdMap<uint32_t> index_;  // in nodes_, plus one
};

}  // namespace

void fold(Program& program, Id main, const std::map<Id, Bits>& given) {
    // A variable of one known content is that content.
    std::set<Id> constant;
    for (const auto& [variable, bits] : given)
        if (bits.constant(0xffffffffu)) constant.insert(variable);
    CallGraph graph(program, main);
    BitAnalysis::Tables tables;
    tables.reserve(program.module.bound);
    for (int round = 0; round < 3; ++round) {
        const std::vector<Function*> functions = graph.reachable();
        if (round == 0 && !constant.empty())
            for (Function* function : functions)
                for (Block& block : function->blocks)
                    std::erase_if(block.insts, [&](const Inst& inst) {
                        return inst.op == Op::OpStore && constant.count(inst.ops[0]) != 0;
                    });
        Values(program, functions, given, tables).replace();
        // Stores in branches that turn out dead say nothing about their variables: once more.
        bool folded = false;
        for (Function* function : functions)
            if (Branches(program, *function).fold()) {
                graph.changed(*function);
                folded = true;
            }
        if (!folded) break;
    }
}

void remove_dead(Program& program, Id main, Id save, Id scratch_store) {
    Liveness(program, CallGraph(program, main).reachable(), save, scratch_store).run();
}

}  // namespace rtc::link
