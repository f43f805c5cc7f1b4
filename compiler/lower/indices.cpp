// Computed indices into small variables of a shader become selections between their elements.
//
// A shader's variables live from state to state in the machine's loop, and NVIDIA's compiler (580.159.04) crashes on
// some such loops that write arrays of a few elements by a computed index: testdata/driver-cases. Registers have no
// addresses anyway: drivers make such selections themselves, or keep the array in memory. Larger arrays stay as they
// are, and so do elements that are arrays or structures.
#include "lower/stage.h"

namespace rtc::lower {
namespace {

using spv::StorageClass;

constexpr uint32_t kMostElements = 8;

struct Chain {
    Inst inst;
    size_t at = 0;        // which operand is the computed index
    uint32_t length = 0;  // how many elements it chooses from
    Id type = 0;          // what the chain points to
};

class Indices {
  public:
    Indices(Program& program, Function& function) : p_(program), function_(function) {}

    void run() {
        for (const Inst& param : function_.params) types_[param.result] = param.type;
        for (const Block& block : function_.blocks)
            for (const Inst& inst : block.insts) {
                if (inst.result && inst.type) types_[inst.result] = inst.type;
                if (inst.op == Op::OpVariable) locals_[inst.result] = inst.type;
            }
        for (Block& block : function_.blocks) {
            std::map<Id, Chain> chains;  // of this block: in memory form no pointer crosses blocks
            std::vector<Inst> out;
            for (Inst& inst : block.insts) {
                Chain chain;
                if ((inst.op == Op::OpAccessChain || inst.op == Op::OpInBoundsAccessChain) && suits(inst, chain))
                    chains[inst.result] = std::move(chain);
                // Accesses with memory operands (volatile ones) stay.
                const bool load = inst.op == Op::OpLoad && inst.ops.size() == 1;
                const bool store = inst.op == Op::OpStore && inst.ops.size() == 2;
                const auto found = load || store ? chains.find(inst.ops[0]) : chains.end();
                if (found == chains.end())
                    out.push_back(std::move(inst));
                else
                    access(out, inst, found->second);
            }
            if (!chains.empty()) {  // those that nothing else uses
                std::set<Id> used;
                for (const Inst& inst : out) inst.for_each_id([&](Id id) { used.insert(id); });
                std::erase_if(out, [&](const Inst& inst) { return chains.count(inst.result) && !used.count(inst.result); });
            }
            block.insts = std::move(out);
        }
    }

  private:
    bool suits(const Inst& inst, Chain& chain) const {
        const Inst* global = p_.def(inst.ops[0]);
        const auto local = locals_.find(inst.ops[0]);
        if ((!global || global->op != Op::OpVariable) && local == locals_.end()) return false;
        const Id pointer = global ? global->type : local->second;
        if (p_.storage(pointer) != StorageClass::Private && p_.storage(pointer) != StorageClass::Function) return false;
        Id type = p_.pointee(pointer);
        for (size_t i = 1; i < inst.ops.size(); ++i) {
            uint64_t index = 0;
            if (p_.def(inst.ops[i])) {
                // (A specialisation constant may be anything, but all elements of what it indexes are alike.)
                if (!p_.constant_value(inst.ops[i], index) && p_.type_op(type) == Op::OpTypeStruct) return false;
            } else {
                if (chain.length) return false;  // two computed indices
                const auto known = types_.find(inst.ops[i]);
                const Inst* number = known == types_.end() ? nullptr : p_.def(known->second);
                if (p_.type_op(type) == Op::OpTypeStruct || !number || number->op != Op::OpTypeInt || number->ops[0] != 32)
                    return false;
                chain.length = elements(type);
                chain.at = i;
                if (!chain.length || chain.length > kMostElements) return false;
            }
            type = p_.element_type(type, static_cast<uint32_t>(index));
        }
        chain.inst = inst;
        chain.type = type;
        return chain.length && selectable(type);
    }

    uint32_t elements(Id type) const {
        uint64_t length = 0;
        switch (p_.type_op(type)) {
            case Op::OpTypeArray: return p_.constant_value(p_.def(type)->ops[1], length) ? p_.element_count(type) : 0;
            case Op::OpTypeVector:
            case Op::OpTypeMatrix: return p_.element_count(type);
            default: return 0;
        }
    }

    bool selectable(Id type) const {
        switch (p_.type_op(type)) {
            case Op::OpTypeBool:
            case Op::OpTypeInt:
            case Op::OpTypeFloat:
            case Op::OpTypeVector: return true;
            default: return false;
        }
    }

    void access(std::vector<Inst>& out, const Inst& inst, const Chain& chain) {
        const bool load = inst.op == Op::OpLoad;
        const Id index = chain.inst.ops[chain.at];
        Id chosen = 0;
        for (uint32_t element = 0; element < chain.length; ++element) {
            Inst pointer = chain.inst;
            pointer.result = p_.module.new_id();
            pointer.ops[chain.at] = p_.constant_u32(element);
            const Id at = pointer.result;
            out.push_back(std::move(pointer));
            ir::Emitter e(p_, out, inst.source);
            const Id there = e.load(chain.type, at);
            if (load && element == 0) {  // also what an index out of bounds gives
                chosen = there;
                continue;
            }
            Id same = e.value(Op::OpIEqual, p_.bool_type(), {index, p_.constant_u32(element)});
            if (p_.type_op(chain.type) == Op::OpTypeVector) {
                const uint32_t width = p_.element_count(chain.type);
                same = e.construct(p_.vector_type(p_.bool_type(), width), std::vector<Id>(width, same));
            }
            if (load)
                chosen = e.select(chain.type, same, there, chosen);
            else
                e.store(at, e.select(chain.type, same, inst.ops[1], there));
        }
        if (!load) return;
        Inst copy(Op::OpCopyObject, inst.type, inst.result, {chosen});
        copy.source = inst.source;
        out.push_back(std::move(copy));
    }

    Program& p_;
    Function& function_;
    std::map<Id, Id> locals_;  // variables and their types
    std::map<Id, Id> types_;   // of all values
};

}  // namespace

void select_elements(Program& program, Stage& stage) {
    Indices(program, stage.body).run();
    for (Function& function : stage.functions) Indices(program, function).run();
}

}  // namespace rtc::lower
