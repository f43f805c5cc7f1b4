// Memory form: the shape in which a stage can be cut anywhere between blocks.
//
//   - every call is the last instruction of its block before a plain branch;
//   - there are no phis;
//   - no value is used outside the block that computes it: what crosses blocks goes
//     through Function variables, except pointers, opaque handles and other values
//     that must not be stored, which are computed again where they are used.
//
// Drivers turn the variables back into registers; nothing is lost by it.
#include <set>
#include <unordered_map>

#include "lower/stage.h"

namespace rtc::lower {
namespace {

class MemoryForm {
  public:
    MemoryForm(Program& program, Stage& stage, const CallKinds& kinds) : p_(program), stage_(stage), kinds_(kinds) {}

    void run() {
        isolate_calls();
        hoist_variables();
        demote_phis();
        demote_values();
        std::vector<Inst>& first = stage_.body.blocks.front().insts;
        first.insert(first.begin(), variables_.begin(), variables_.end());
    }

  private:
    Id new_variable(Id type) {
        Inst variable(Op::OpVariable, p_.pointer_type(spv::StorageClass::Function, type), p_.module.new_id(),
                      {static_cast<uint32_t>(spv::StorageClass::Function)});
        if (p_.type_op(type) == Op::OpTypePointer) p_.decorate(variable.result, spv::Decoration::AliasedPointer);
        variables_.push_back(variable);
        return variable.result;
    }

    void rename_predecessor(const std::vector<Id>& successors, Id from, Id to) {
        for (Id successor : successors)
            if (Block* block = stage_.body.find_block(successor))
                for (Inst& phi : block->insts) {
                    if (phi.op != Op::OpPhi) break;
                    for (size_t k = 1; k < phi.ops.size(); k += 2)
                        if (phi.ops[k] == from) phi.ops[k] = to;
                }
    }

    void isolate_calls() {
        std::vector<Block>& blocks = stage_.body.blocks;
        for (size_t b = 0; b < blocks.size(); ++b) {
            size_t at = 0;
            while (at < blocks[b].insts.size() && !is_call(blocks[b].insts[at], kinds_)) ++at;
            if (at == blocks[b].insts.size()) continue;

            Block tail;
            tail.label = p_.module.new_id();
            Block& head = blocks[b];
            const Inst* merge = head.merge();
            if (merge && merge->op == Op::OpLoopMerge) {
                // The header keeps its phis and its merge; the call belongs to the loop's body.
                size_t first = 0;
                while (head.insts[first].op == Op::OpPhi) ++first;
                const Inst loop_merge = *merge;
                tail.insts.assign(head.insts.begin() + first, head.insts.end());
                tail.insts.erase(tail.insts.end() - 2);
                head.insts.resize(first);
                head.insts.push_back(loop_merge);
            } else {
                tail.insts.assign(head.insts.begin() + at + 1, head.insts.end());
                head.insts.resize(at + 1);
            }
            head.insts.push_back(Inst(Op::OpBranch, 0, 0, {tail.label}));
            const Id head_label = head.label, tail_label = tail.label;
            const std::vector<Id> successors = tail.successors();
            blocks.insert(blocks.begin() + b + 1, std::move(tail));
            rename_predecessor(successors, head_label, tail_label);
        }
    }

    // Variables belong to the whole stage; their initialisers to its entry.
    void hoist_variables() {
        std::vector<Inst> stores;
        for (Block& block : stage_.body.blocks) {
            std::vector<Inst> kept;
            for (Inst& inst : block.insts) {
                if (inst.op != Op::OpVariable) {
                    kept.push_back(std::move(inst));
                    continue;
                }
                if (inst.ops.size() > 1) {
                    stores.push_back(Inst(Op::OpStore, 0, 0, {inst.result, inst.ops[1]}));
                    inst.ops.resize(1);
                }
                variables_.push_back(std::move(inst));
            }
            block.insts = std::move(kept);
        }
        std::vector<Inst>& first = stage_.body.blocks.front().insts;
        first.insert(first.begin(), stores.begin(), stores.end());
    }

    static void insert_before_end(Block& block, Inst inst) {
        const size_t tail = block.merge() ? 2 : 1;
        block.insts.insert(block.insts.end() - tail, std::move(inst));
    }

    void demote_phis() {
        for (size_t b = 0; b < stage_.body.blocks.size(); ++b) {
            Block& block = stage_.body.blocks[b];
            for (size_t i = 0; i < block.insts.size() && block.insts[i].op == Op::OpPhi; ++i) {
                const Inst phi = block.insts[i];
                if (p_.is_opaque(phi.type) ||
                    (p_.is_pointer(phi.type) && p_.storage(phi.type) != spv::StorageClass::PhysicalStorageBuffer))
                    stage_.fail("pointer-phi", phi.source,
                                "a pointer or opaque handle that depends on control flow is not supported; select an "
                                "index instead",
                                p_);
                const Id variable = new_variable(phi.type);
                for (size_t k = 0; k + 1 < phi.ops.size(); k += 2) {
                    if (Block* predecessor = stage_.body.find_block(phi.ops[k + 1]))
                        insert_before_end(*predecessor, Inst(Op::OpStore, 0, 0, {variable, phi.ops[k]}));
                }
                Inst load(Op::OpLoad, phi.type, phi.result, {variable});
                load.source = phi.source;
                block.insts[i] = std::move(load);
            }
        }
    }

    // Values that must not, or need not, be stored: computed again at each use.
    bool is_rematerialized(const Inst& inst) const {
        switch (inst.op) {
            case Op::OpAccessChain:
            case Op::OpInBoundsAccessChain:
            case Op::OpImageTexelPointer:
            case Op::OpSampledImage:
            case Op::OpImage:
            case Op::OpUndef: return true;
            case Op::OpLoad:
            case Op::OpCopyObject:
                return p_.is_opaque(inst.type) ||
                       (p_.is_pointer(inst.type) && p_.storage(inst.type) != spv::StorageClass::PhysicalStorageBuffer);
            default: return false;
        }
    }

    void demote_values() {
        std::vector<Block>& blocks = stage_.body.blocks;
        struct Def {
            size_t block;
            Inst inst;
        };
        std::unordered_map<Id, Def> defs;
        for (size_t b = 0; b < blocks.size(); ++b)
            for (const Inst& inst : blocks[b].insts)
                if (inst.result) defs.emplace(inst.result, Def{b, inst});

        // Everything needed outside its block, following what rematerialised values need.
        std::set<Id> crossing;
        std::function<void(Id, size_t)> need = [&](Id id, size_t user) {
            const auto found = defs.find(id);
            if (found == defs.end() || found->second.block == user) return;
            if (is_rematerialized(found->second.inst)) {
                found->second.inst.for_each_id([&](Id operand) { need(operand, user); });
                return;
            }
            crossing.insert(id);
        };
        for (size_t b = 0; b < blocks.size(); ++b)
            for (const Inst& inst : blocks[b].insts) inst.for_each_id([&](Id id) { need(id, b); });
        // A call's result exists only after it returns, so even the branch's block must load it.
        std::map<Id, Id> slots;
        for (Id id : crossing) {
            const Inst& inst = defs.at(id).inst;
            if (p_.is_opaque(inst.type) ||
                (p_.is_pointer(inst.type) && p_.storage(inst.type) != spv::StorageClass::PhysicalStorageBuffer))
                stage_.fail("value-not-storable", inst.source, "a handle or pointer made here cannot be kept", p_);
            slots[id] = new_variable(inst.type);
        }

        for (size_t b = 0; b < blocks.size(); ++b) {
            std::vector<Inst> out;
            std::unordered_map<Id, Id> local;  // crossing or rematerialised value -> its copy in this block
            std::function<Id(Id)> use = [&](Id id) -> Id {
                const auto found = defs.find(id);
                if (found == defs.end() || found->second.block == b) return id;
                const auto known = local.find(id);
                if (known != local.end()) return known->second;
                Inst copy;
                if (is_rematerialized(found->second.inst)) {
                    copy = found->second.inst;
                    copy.for_each_id([&](Id& operand) { operand = use(operand); });
                } else {
                    copy = Inst(Op::OpLoad, found->second.inst.type, 0, {slots.at(id)});
                    copy.source = found->second.inst.source;
                }
                copy.result = p_.module.new_id();
                p_.copy_decorations(id, copy.result);
                out.push_back(copy);
                return local[id] = copy.result;
            };
            for (Inst& inst : blocks[b].insts) {
                // A merge instruction stays right before its terminator: give both their operands first.
                if (inst.is_merge()) {
                    Inst& terminator = blocks[b].terminator();
                    terminator.for_each_id([&](Id& id) { id = use(id); });
                    out.push_back(std::move(inst));
                    continue;
                }
                inst.for_each_id([&](Id& id) { id = use(id); });
                const Id result = inst.result;
                out.push_back(std::move(inst));
                const auto slot = slots.find(result);
                if (result && slot != slots.end()) out.push_back(Inst(Op::OpStore, 0, 0, {slot->second, result}));
            }
            // The result of a suspending call is stored after it, by the splitter, through the same store.
            blocks[b].insts = std::move(out);
        }
    }

    Program& p_;
    Stage& stage_;
    const CallKinds& kinds_;
    std::vector<Inst> variables_;
};

}  // namespace

void to_memory_form(Program& program, Stage& stage, const CallKinds& kinds) { MemoryForm(program, stage, kinds).run(); }

}  // namespace rtc::lower
