// Removes what nobody needs: values nobody uses, stores to variables nobody reads, calls without an effect. Not only
// within a function: what a state stores, another may read, or none.
#include <set>

#include "link/link.h"

namespace rtc::link {
namespace {

using ir::Block;
using ir::Function;

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
        // Conversions, arithmetic and comparisons take no pointers.
        if (inst.op >= Op::OpConvertFToU && inst.op <= Op::OpBitCount && inst.op != Op::OpSelect) {
            inst.for_each_id([&](Id id) {
                if (const Inst* local = defs_.get(id)) mark({local, 0});
            });
            return;
        }
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

}  // namespace

void remove_dead(Program& program, const std::vector<Function*>& functions, Id save, Id scratch_store) {
    Liveness(program, functions, save, scratch_store).run();
}

}  // namespace rtc::link
