#include "link/bits.h"

namespace rtc::link {

using ir::Id;
using ir::Inst;
using ir::Op;

Bits exactly(uint32_t value) { return {~value, value}; }
Bits both(Bits a, Bits b) { return {a.zeros & b.zeros, a.ones & b.ones}; }

namespace {

Bits truth(bool value) { return value ? Bits{0, 1} : Bits{1, 0}; }

// Whether anything can be said about results of this operation (BitAnalysis::compute).
bool can_be_known(Op op) {
    switch (op) {
        case Op::OpLoad:
        case Op::OpFunctionCall:
        case Op::OpPhi:
        case Op::OpCopyObject:
        case Op::OpBitcast:
        case Op::OpBitwiseAnd:
        case Op::OpLogicalAnd:
        case Op::OpBitwiseOr:
        case Op::OpLogicalOr:
        case Op::OpBitwiseXor:
        case Op::OpLogicalNotEqual:
        case Op::OpLogicalEqual:
        case Op::OpNot:
        case Op::OpLogicalNot:
        case Op::OpIEqual:
        case Op::OpINotEqual:
        case Op::OpSelect:
        case Op::OpShiftLeftLogical:
        case Op::OpShiftRightLogical:
        case Op::OpIAdd:
        case Op::OpISub:
        case Op::OpIMul:
        case Op::OpULessThan:
        case Op::OpUGreaterThan:
        case Op::OpULessThanEqual:
        case Op::OpUGreaterThanEqual: return true;
        default: return false;
    }
}

// Deeper chains are rare, and nothing is lost but knowledge.
constexpr int kMaxDepth = 64;

}  // namespace

BitAnalysis::BitAnalysis(const ir::Program& program, const std::vector<const ir::Function*>& functions,
                         const std::map<Id, Bits>& given, bool module_variables, Tables& tables)
    : p_(program), t_(tables) {
    ++t_.analysis;
    ++t_.epoch;
    for (const auto& [id, bits] : given) {
        Cell& fixed = cell(id);
        fixed.bits = bits;
        fixed.fixed = true;
    }
    collect(functions, module_variables);
    settle();
}

uint32_t BitAnalysis::cell_of(Id id) {
    Tables::Index& index = t_.cells[id];
    if (index.analysis != t_.analysis) {
        index = {static_cast<uint32_t>(cells_.size()), t_.analysis};
        cells_.push_back({id, 0, 0, {}, false});
    }
    return index.cell;
}

void BitAnalysis::collect(const std::vector<const ir::Function*>& functions, bool module_variables) {
    ir::IdSet open;  // touched by more than whole loads and stores
    std::vector<std::pair<uint32_t, Id>> stored;  // cell, value
    for (const ir::Function* function : functions) {
        for (const ir::Block& block : function->blocks)
            for (const Inst& inst : block.insts) {
                if (inst.result) {
                    t_.defs[inst.result] = {&inst, t_.analysis};
                    if (can_be_known(inst.op) && (mask(inst.type) || inst.op == Op::OpSelect || inst.op == Op::OpPhi))
                        candidates_.push_back(&inst);
                }
                switch (inst.op) {
                    case Op::OpLoad: break;
                    case Op::OpStore: {
                        open.insert(inst.ops[1]);
                        const Inst* variable = def(inst.ops[0]);
                        if (!variable || variable->op != Op::OpVariable || !mask(p_.pointee(variable->type))) break;
                        const auto storage = static_cast<spv::StorageClass>(variable->ops[0]);
                        if (storage == spv::StorageClass::Function ||
                            (storage == spv::StorageClass::Private && module_variables))
                            stored.push_back({cell_of(inst.ops[0]), inst.ops[1]});
                        break;
                    }
                    case Op::OpVariable:
                        if (inst.ops.size() > 1 && mask(p_.pointee(inst.type)))
                            stored.push_back({cell_of(inst.result), inst.ops[1]});
                        break;
                    case Op::OpReturnValue: stored.push_back({cell_of(function->id()), inst.ops[0]}); break;
                    case Op::OpAccessChain:
                    case Op::OpInBoundsAccessChain:
                    case Op::OpCopyObject: open.insert(inst.ops[0]); break;
                    case Op::OpFunctionCall:
                    case Op::OpCopyMemory:
                    case Op::OpExtInst:
                    case Op::OpPhi:
                    case Op::OpSelect:
                        for (uint32_t id : inst.ops) open.insert(id);
                        break;
                    default:
                        // Only pointers matter; conversions, arithmetic and comparisons take none.
                        if (inst.op < Op::OpConvertFToU || inst.op > Op::OpBitCount)
                            inst.for_each_id([&](Id id) { open.insert(id); });
                        break;
                }
            }
        candidate_ends_.push_back(candidates_.size());
    }
    for (const auto& [at, value] : stored) ++cells_[at].count;
    uint32_t place = 0;
    for (Cell& one : cells_) {
        one.first = place;
        place += one.count;
        one.count = 0;
    }
    values_.resize(place);
    for (const auto& [at, value] : stored) values_[cells_[at].first + cells_[at].count++] = value;
    for (Cell& one : cells_) {
        if (one.fixed) continue;
        const Inst* variable = def(one.id);
        const bool is_variable = variable && variable->op == Op::OpVariable;
        const bool global_with_initializer = is_variable && !local(one.id) && variable->ops.size() > 1;
        if ((is_variable && open.contains(one.id)) || global_with_initializer || one.count == 0) {
            one.fixed = true;  // of unknown content
            one.bits = {};
        } else {
            one.bits = {~0u, ~0u};
        }
    }
}

// Starts from "everything is known", which no value satisfies, and takes away what a store does not keep.
// What stays true in a whole round is true by induction over the stores.
void BitAnalysis::settle() {
    bool stable = false;
    for (int round = 0; round < 16 && !stable; ++round) {
        stable = true;
        ++t_.epoch;
        std::vector<Bits> next(cells_.size());
        for (size_t i = 0; i < cells_.size(); ++i) {
            next[i] = cells_[i].bits;
            if (cells_[i].fixed) continue;
            for (uint32_t k = 0; k < cells_[i].count; ++k) {
                if (!(next[i].zeros | next[i].ones)) break;
                next[i] = both(next[i], of(values_[cells_[i].first + k]));
            }
            stable &= next[i] == cells_[i].bits;
        }
        for (size_t i = 0; i < cells_.size(); ++i) cells_[i].bits = next[i];
    }
    bool given_up = false;
    for (Cell& one : cells_)
        if (!one.fixed && (!stable || (one.bits.zeros & one.bits.ones))) {
            one.bits = {};
            given_up = true;
        }
    // What the last round found out about values stays true when all its cells do.
    if (given_up) ++t_.epoch;
}

uint8_t BitAnalysis::look_at(Id type) const {
    const Inst* inst = p_.def(type);
    const uint8_t kind = !inst                                                  ? 1
                         : inst->op == Op::OpTypeBool                           ? 2
                         : inst->op == Op::OpTypeInt && inst->ops[0] == 32u ? 3
                                                                                : 1;
    if (inst) t_.masks[type] = kind;
    return kind;
}

Bits BitAnalysis::find(Id id) {
    if (depth_ >= kMaxDepth) return {};
    const Inst* inst = def(id);
    if (!inst || !inst->type) return {};
    const uint32_t all = mask(inst->type);
    t_.known[id] = {{}, t_.epoch};  // while it is computed, nothing is known: never something wrong
    if (!all) return {};
    ++depth_;
    Bits bits = compute(*inst);
    --depth_;
    bits.zeros &= all;
    bits.ones &= all;
    t_.known[id] = {bits, t_.epoch};
    return bits;
}

Bits BitAnalysis::content(Id id) const {
    const Tables::Index index = t_.cells.get(id);
    return index.analysis == t_.analysis ? cells_[index.cell].bits : Bits{};
}

Bits BitAnalysis::compute(const Inst& inst) {
    // (An operation that is added here goes into can_be_known too.)
    switch (inst.op) {
        case Op::OpConstantTrue: return truth(true);
        case Op::OpConstantFalse: return truth(false);
        case Op::OpConstantNull: return {~0u, 0};
        case Op::OpConstant: return mask(inst.type) ? exactly(inst.ops[0]) : Bits{};
        case Op::OpSpecConstantOp:
            return operation(static_cast<Op>(inst.ops[0]), inst.type, inst.ops.data() + 1, inst.ops.size() - 1);
        case Op::OpLoad:
        case Op::OpFunctionCall: return content(inst.ops[0]);
        case Op::OpPhi: {
            Bits bits = of(inst.ops[0]);
            for (size_t i = 2; i < inst.ops.size(); i += 2) bits = both(bits, of(inst.ops[i]));
            return bits;
        }
        default: return operation(inst.op, inst.type, inst.ops.data(), inst.ops.size());
    }
}

Bits BitAnalysis::operation(Op op, Id type, const uint32_t* ops, size_t count) {
    if (!mask(type) || count == 0) return {};
    const Bits a = of(ops[0]);
    const Bits b = count > 1 ? of(ops[1]) : Bits{};
    // Comparisons look at their operands' width, not at the result's.
    auto operand_mask = [&] {
        const Inst* inst = def(ops[0]);
        return inst ? mask(inst->type) : 0;
    };
    const bool differ = (a.ones & b.zeros) != 0 || (a.zeros & b.ones) != 0;
    switch (op) {
        case Op::OpCopyObject:
        case Op::OpBitcast:
            return operand_mask() ? a : Bits{};
        case Op::OpBitwiseAnd:
        case Op::OpLogicalAnd: return {a.zeros | b.zeros, a.ones & b.ones};
        case Op::OpBitwiseOr:
        case Op::OpLogicalOr: return {a.zeros & b.zeros, a.ones | b.ones};
        case Op::OpBitwiseXor:
        case Op::OpLogicalNotEqual:
            return {(a.zeros & b.zeros) | (a.ones & b.ones), (a.zeros & b.ones) | (a.ones & b.zeros)};
        case Op::OpLogicalEqual:
            return {(a.zeros & b.ones) | (a.ones & b.zeros), (a.zeros & b.zeros) | (a.ones & b.ones)};
        case Op::OpNot:
        case Op::OpLogicalNot: return {a.ones, a.zeros};
        case Op::OpIEqual:
        case Op::OpINotEqual: {
            const uint32_t all = operand_mask();
            if (!all) return {};
            if (differ) return truth(op == Op::OpINotEqual);
            if (a.constant(all) && b.constant(all)) return truth(op == Op::OpIEqual);
            return {};
        }
        case Op::OpSelect: {
            const Bits c = count > 2 ? of(ops[2]) : Bits{};
            return a.ones ? b : a.zeros ? c : both(b, c);
        }
        case Op::OpShiftLeftLogical:
            if (!b.constant(~0u) || b.ones > 31) return {};
            return {a.zeros << b.ones | ((1u << b.ones) - 1u), a.ones << b.ones};
        case Op::OpShiftRightLogical:
            if (!b.constant(~0u) || b.ones > 31) return {};
            return {a.zeros >> b.ones | ~(~0u >> b.ones), a.ones >> b.ones};
        case Op::OpIAdd:
        case Op::OpISub:
        case Op::OpIMul: {
            if (!a.constant(~0u) || !b.constant(~0u)) return {};
            return exactly(op == Op::OpIAdd ? a.ones + b.ones : op == Op::OpISub ? a.ones - b.ones : a.ones * b.ones);
        }
        case Op::OpULessThan:
        case Op::OpUGreaterThan:
        case Op::OpULessThanEqual:
        case Op::OpUGreaterThanEqual: {
            if (!operand_mask()) return {};
            // A value lies between its certain ones and everything that is not a certain zero.
            const bool less = op == Op::OpULessThan || op == Op::OpULessThanEqual;
            const Bits low = less ? a : b, high = less ? b : a;
            const bool strict = op == Op::OpULessThan || op == Op::OpUGreaterThan;
            const uint32_t low_max = ~low.zeros, high_min = high.ones, low_min = low.ones, high_max = ~high.zeros;
            if (strict ? low_max < high_min : low_max <= high_min) return truth(true);
            if (strict ? low_min >= high_max : low_min > high_max) return truth(false);
            return {};
        }
        default: return {};
    }
}

}  // namespace rtc::link
