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

// ---- values and branches of one function -----------------------------------------------------------------

// Large functions are the machine's main, whose variables are not stored in terms of themselves.
bool settles(const Function& function) { return function.blocks.size() < 200; }

class Folder {
  public:
    Folder(Program& program, Function& function, const std::map<Id, Bits>& contents)
        : p_(program), f_(function), contents_(contents) {}

    void run() {
        // Each round can only make code shorter; most functions settle in two.
        for (int round = 0; round < 8; ++round) {
            bool changed = fold_values();
            changed |= fold_branches();
            if (changed) remove_unreachable();
            changed |= join_blocks();
            if (!changed) return;
        }
    }

  private:
    Id constant(Id type, uint32_t bits) {
        return p_.type_op(type) == Op::OpTypeBool ? p_.constant_bool(bits != 0) : p_.constant_scalar(type, bits);
    }

    bool is_constant(Id id) const {
        const Inst* inst = p_.def(id);
        return inst && (inst->op == Op::OpConstant || inst->op == Op::OpConstantTrue ||
                        inst->op == Op::OpConstantFalse || inst->op == Op::OpConstantNull);
    }

    // The operand an operation equals whatever its other operand is; 0: none.
    Id same_as(BitAnalysis& bits, const Inst& inst) {
        const uint32_t all = bits.mask(inst.type);
        auto is = [&](Id id, uint32_t value) { return bits.of(id) == Bits{~value & all, value}; };
        switch (inst.op) {
            case Op::OpSelect: {
                const Bits c = bits.of(inst.ops[0]);
                // A vector of booleans has no known bits.
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

    Id type_of(Id id, const std::unordered_map<Id, Id>& types) const {
        if (const auto found = types.find(id); found != types.end()) return found->second;
        const Inst* inst = p_.def(id);
        return inst ? inst->type : 0;
    }

    bool fold_values() {
        BitAnalysis bits(p_, f_, contents_, settles(f_));
        std::unordered_map<Id, Id> types;
        for (const Block& block : f_.blocks)
            for (const Inst& inst : block.insts)
                if (inst.result) types[inst.result] = inst.type;
        for (const Inst& inst : f_.params) types[inst.result] = inst.type;
        std::unordered_map<Id, Id> become;
        for (const Block& block : f_.blocks)
            for (const Inst& inst : block.insts) {
                if (!inst.result || inst.op == Op::OpVariable) continue;
                const uint32_t all = bits.mask(inst.type);
                const Bits known = all ? bits.of(inst.result) : Bits{};
                if (all && known.constant(all)) {
                    become[inst.result] = constant(inst.type, known.ones);
                } else if (const Id same = same_as(bits, inst); same && type_of(same, types) == inst.type) {
                    become[inst.result] = same;
                }
            }
        auto resolve = [&](Id id) {
            for (int hops = 0; hops < 1000; ++hops) {
                const auto found = become.find(id);
                if (found == become.end()) break;
                id = found->second;
            }
            return id;
        };
        bool changed = false;
        for (Block& block : f_.blocks) {
            for (Inst& inst : block.insts)
                inst.for_each_id([&](Id& id) {
                    Id to = resolve(id);
                    if (const Inst* global = p_.def(to); global && global->op == Op::OpSpecConstantOp)
                        if (const uint32_t all = bits.mask(global->type); all && bits.of(to).constant(all))
                            to = constant(global->type, bits.of(to).ones);
                    changed |= to != id;
                    id = to;
                });
            changed |= std::erase_if(block.insts, [&](const Inst& inst) {
                           // A call may do more than give its value.
                           return inst.result && inst.op != Op::OpFunctionCall && become.count(inst.result) != 0;
                       }) != 0;
        }
        return changed;
    }

    bool fold_branches() {
        bool changed = false;
        for (Block& block : f_.blocks) {
            Inst& end = block.terminator();
            if (end.op != Op::OpBranchConditional) continue;
            const Inst* condition = p_.def(end.ops[0]);
            const bool same = end.ops[1] == end.ops[2];
            if (!same && (!condition || (condition->op != Op::OpConstantTrue && condition->op != Op::OpConstantFalse)))
                continue;
            const Id target = same || condition->op == Op::OpConstantTrue ? end.ops[1] : end.ops[2];
            end = Inst(Op::OpBranch, 0, 0, {target});
            if (const size_t n = block.insts.size(); n > 1 && block.insts[n - 2].op == Op::OpSelectionMerge)
                block.insts.erase(block.insts.end() - 2);
            changed = true;
        }
        return changed;
    }

    void remove_unreachable() {
        std::unordered_map<Id, Block*> blocks;
        for (Block& block : f_.blocks) blocks[block.label] = &block;
        std::set<Id> reachable;
        std::vector<Id> work{f_.blocks.front().label};
        std::map<Id, Id> merges, continues;  // label -> header
        while (!work.empty()) {
            const Id label = work.back();
            work.pop_back();
            if (!reachable.insert(label).second) continue;
            const Block& block = *blocks.at(label);
            for (Id next : block.successors()) work.push_back(next);
            if (const Inst* merge = block.merge()) {
                merges[merge->ops[0]] = label;
                if (merge->op == Op::OpLoopMerge) continues[merge->ops[1]] = label;
            }
        }
        // A merge or continue target must exist although nothing gets there.
        for (Block& block : f_.blocks) {
            if (reachable.count(block.label)) continue;
            if (const auto found = continues.find(block.label); found != continues.end())
                block.insts = {Inst(Op::OpBranch, 0, 0, {found->second})};
            else if (merges.count(block.label))
                block.insts = {Inst(Op::OpUnreachable, 0, 0, {})};
        }
        std::erase_if(f_.blocks, [&](const Block& block) {
            return !reachable.count(block.label) && !merges.count(block.label) && !continues.count(block.label);
        });
        std::map<Id, std::set<Id>> sources;
        for (const Block& block : f_.blocks)
            for (Id next : block.successors()) sources[next].insert(block.label);
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
    bool join_blocks() {
        std::map<Id, int> arrivals;
        std::set<Id> named;
        std::unordered_map<Id, size_t> index;
        for (size_t i = 0; i < f_.blocks.size(); ++i) {
            const Block& block = f_.blocks[i];
            index[block.label] = i;
            for (Id next : block.successors()) ++arrivals[next];
            if (const Inst* merge = block.merge()) {
                named.insert(merge->ops[0]);
                if (merge->op == Op::OpLoopMerge) named.insert(merge->ops[1]);
            }
        }
        std::unordered_map<Id, Id> joined;  // label -> the block it is part of now
        std::vector<bool> gone(f_.blocks.size(), false);
        for (size_t i = 0; i < f_.blocks.size(); ++i) {
            if (gone[i]) continue;
            for (;;) {
                Block& block = f_.blocks[i];
                if (block.terminator().op != Op::OpBranch || block.merge()) break;
                const Id next = block.terminator().ops[0];
                const size_t at = index.at(next);
                if (arrivals[next] != 1 || named.count(next) || at == i || at == 0) break;
                Block& tail = f_.blocks[at];
                if (!tail.insts.empty() && tail.insts.front().op == Op::OpPhi) break;  // becomes a value first
                block.insts.pop_back();
                std::move(tail.insts.begin(), tail.insts.end(), std::back_inserter(block.insts));
                gone[at] = true;
                joined[next] = block.label;
            }
        }
        if (joined.empty()) return false;
        auto resolve = [&](Id label) {
            for (auto found = joined.find(label); found != joined.end(); found = joined.find(label))
                label = found->second;
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
        return true;
    }

    Program& p_;
    Function& f_;
    const std::map<Id, Bits>& contents_;
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
        for (Function* function : order_)
            for (const Block& block : function->blocks)
                for (const Inst& inst : block.insts)
                    if (inst.result) defs_[inst.result] = &inst;
    }

    void run() {
        find_pure();
        for (Function* function : order_)
            for (const Block& block : function->blocks)
                for (const Inst& inst : block.insts) start(*function, inst);
        while (!work_.empty()) {
            const Inst* inst = work_.back();
            work_.pop_back();
            follow(*inst);
        }
        for (Function* function : order_)
            for (Block& block : function->blocks)
                std::erase_if(block.insts, [&](const Inst& inst) { return !live_.count(&inst); });
    }

  private:
    // The variable a pointer leads to when it is one that only this invocation sees; 0 otherwise.
    Id own_variable(Id pointer) const {
        for (;;) {
            const auto local = defs_.find(pointer);
            const Inst* inst = local != defs_.end() ? local->second : p_.def(pointer);
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

    void find_pure() {
        for (Function* function : order_) {
            bool pure = true;
            for (const Block& block : function->blocks)
                for (const Inst& inst : block.insts) {
                    if (inst.op == Op::OpStore)
                        pure &= is_local(own_variable(inst.ops[0]));
                    else if (inst.op == Op::OpFunctionCall)
                        pure &= pure_.count(inst.ops[0]) != 0;
                    else
                        pure &= is_plain(inst) || inst.is_merge() ||
                                (inst.is_terminator() && inst.op != Op::OpKill && inst.op != Op::OpTerminateInvocation);
                }
            if (pure) pure_.insert(function->id());
        }
    }

    // Variables whose loads a value is made of.
    void sources(Id value, std::set<Id>& out, int depth = 0) const {
        const auto local = defs_.find(value);
        if (local == defs_.end() || depth > 16) return;
        if (local->second->op == Op::OpLoad) {
            out.insert(own_variable(local->second->ops[0]));
            return;
        }
        if (!is_plain(*local->second)) {
            out.insert(0);
            return;
        }
        local->second->for_each_id([&](Id id) { sources(id, out, depth + 1); });
    }

    void start(const Function& function, const Inst& inst) {
        if (inst.op == Op::OpStore) {
            const Id variable = own_variable(inst.ops[0]);
            if (!variable)
                mark(&inst);
            else
                stores_[variable].push_back(&inst);
        } else if (inst.op == Op::OpFunctionCall) {
            if (function.id() == save_ && inst.ops[0] == store_) {
                // A word of a waiting ray is kept only for those who read it.
                std::set<Id> variables;
                sources(inst.ops[2], variables);
                if (!variables.empty() && !variables.count(0)) {
                    for (Id variable : variables) stores_[variable].push_back(&inst);
                    return;
                }
            }
            if (!pure_.count(inst.ops[0])) mark(&inst);
        } else if (!is_plain(inst)) {
            mark(&inst);
        }
    }

    void mark(const Inst* inst) {
        if (live_.insert(inst).second) work_.push_back(inst);
    }

    void read(Id variable) {
        if (!variable || !read_.insert(variable).second) return;
        const auto found = stores_.find(variable);
        if (found == stores_.end()) return;
        for (const Inst* store : found->second) mark(store);
    }

    void follow(const Inst& inst) {
        const bool passes = inst.op == Op::OpAccessChain || inst.op == Op::OpInBoundsAccessChain ||
                            inst.op == Op::OpCopyObject || inst.op == Op::OpVariable;
        bool first = true;
        inst.for_each_id([&](Id id) {
            const auto local = defs_.find(id);
            if (local != defs_.end()) mark(local->second);
            const bool target = inst.op == Op::OpStore && first;
            first = false;
            if (!passes && !target) read(own_variable(id));
        });
    }

    Program& p_;
    Id save_, store_;
    std::vector<Function*> order_;
    std::unordered_map<Id, const Inst*> defs_;
    std::set<Id> pure_, read_;
    std::unordered_map<Id, std::vector<const Inst*>> stores_;
    std::set<const Inst*> live_;
    std::vector<const Inst*> work_;
};

}  // namespace

std::map<Id, Bits> contents_of(const Program& program, const std::vector<const Function*>& functions,
                               const std::map<Id, Bits>& given, bool variables) {
    std::set<Id> open;  // variables that are reached otherwise than by whole loads and stores
    for (const Function* function : functions)
        for (const Block& block : function->blocks)
            for (const Inst& inst : block.insts) {
                bool first = true;
                inst.for_each_id([&](Id id) {
                    const bool pointer = first && (inst.op == Op::OpLoad || inst.op == Op::OpStore);
                    first = false;
                    if (!pointer) open.insert(id);
                });
            }
    std::map<Id, Bits> contents = given;
    std::map<Id, std::vector<std::pair<size_t, Id>>> values;  // variable or function -> function index, value
    for (size_t i = 0; i < functions.size(); ++i)
        for (const Block& block : functions[i]->blocks)
            for (const Inst& inst : block.insts) {
                if (variables && inst.op == Op::OpStore && !given.count(inst.ops[0]) && !open.count(inst.ops[0])) {
                    const Inst* variable = program.def(inst.ops[0]);
                    if (variable && variable->op == Op::OpVariable && variable->ops.size() == 1 &&
                        static_cast<spv::StorageClass>(variable->ops[0]) == spv::StorageClass::Private)
                        values[inst.ops[0]].push_back({i, inst.ops[1]});
                } else if (inst.op == Op::OpReturnValue) {
                    values[functions[i]->id()].push_back({i, inst.ops[0]});
                }
            }
    // Nothing is taken for granted at first, so that every round's answer is true; later ones know more.
    for (int round = 0; round < 2; ++round) {
        std::vector<std::unique_ptr<BitAnalysis>> analyses(functions.size());
        std::map<Id, Bits> next = given;
        for (const auto& [id, list] : values) {
            bool first = true;
            Bits bits;
            for (const auto& [function, value] : list) {
                if (!analyses[function])
                    analyses[function] = std::make_unique<BitAnalysis>(program, *functions[function], contents,
                                                                          settles(*functions[function]));
                const Bits one = analyses[function]->of(value);
                bits = first ? one : both(bits, one);
                first = false;
            }
            if (bits.zeros | bits.ones) next[id] = bits;
        }
        if (next == contents) break;
        contents = std::move(next);
    }
    return contents;
}

namespace {

std::vector<Function*> reachable(Program& program, Id main) {
    std::unordered_map<Id, Function*> functions;
    for (Function& function : program.module.functions) functions[function.id()] = &function;
    std::set<Id> seen;
    std::vector<Function*> out;  // callees first
    std::function<void(Id)> visit = [&](Id id) {
        const auto found = functions.find(id);
        if (found == functions.end() || !seen.insert(id).second) return;
        for (const Block& block : found->second->blocks)
            for (const Inst& inst : block.insts)
                if (inst.op == Op::OpFunctionCall) visit(inst.ops[0]);
        out.push_back(found->second);
    };
    visit(main);
    return out;
}

}  // namespace

void fold(Program& program, Id main, const std::map<Id, Bits>& given) {
    // A variable of one known content is that content.
    std::set<Id> constant;
    for (const auto& [variable, bits] : given)
        if (bits.constant(0xffffffffu)) constant.insert(variable);
    // Twice: stores in branches that turn out dead say nothing about their variables.
    for (int round = 0; round < 2; ++round) {
        const std::vector<Function*> functions = reachable(program, main);
        const std::map<Id, Bits> contents = contents_of(program, {functions.begin(), functions.end()}, given, true);
        for (Function* function : functions) {
            for (Block& block : function->blocks)
                std::erase_if(block.insts, [&](const Inst& inst) {
                    return inst.op == Op::OpStore && constant.count(inst.ops[0]) != 0;
                });
            Folder(program, *function, contents).run();
        }
    }
}

void remove_dead(Program& program, Id main, Id save, Id scratch_store) {
    Liveness(program, reachable(program, main), save, scratch_store).run();
}

}  // namespace rtc::link
