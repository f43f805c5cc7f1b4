// The facts of one instruction from those of its operands, and the rounds that settle what variables hold.
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
// So are long chains of variables against the order of the code.
constexpr int kMaxRounds = 64;

}  // namespace

BitAnalysis::BitAnalysis(const ir::Program& program, const std::vector<const ir::Function*>& functions,
                         const std::map<Id, Bits>& given, bool module_variables, Tables& tables)
    : p_(program), t_(tables) {
    ++t_.analysis;
    for (const auto& [id, bits] : given) {
        Cell& cell = cells_[make_cell(id)];
        cell.bits = bits;
        cell.given = true;
    }
    if (module_variables)
        for (const Inst& inst : p_.module.globals)
            if (inst.op == Op::OpVariable &&
                static_cast<spv::StorageClass>(inst.ops[0]) == spv::StorageClass::Private && mask(p_.pointee(inst.type)))
                make_cell(inst.result);
    for (const ir::Function* function : functions) collect(*function);
    settle();
}

uint32_t BitAnalysis::make_cell(Id id) {
    Tables::Entry& known = entry(id);
    if (!known.cell) {
        cells_.push_back({id, 0, 0, {}, false, false});
        known.cell = static_cast<uint32_t>(cells_.size());
    }
    return known.cell - 1;
}

bool BitAnalysis::find_cell(Id id, uint32_t& cell) const {
    const Tables::Entry& known = t_.entries.get(id);
    if (known.analysis != t_.analysis || !known.cell) return false;
    cell = known.cell - 1;
    return true;
}

void BitAnalysis::collect(const ir::Function& function) {
    for (const ir::Block& block : function.blocks) {
        auto open = [&](Id id) {
            if (uint32_t cell; find_cell(id, cell)) openings_.push_back({cell, block.label});
        };
        for (const Inst& inst : block.insts) {
            if (inst.result) {
                entry(inst.result).inst = &inst;
                if (can_be_known(inst.op) && (mask(inst.type) || inst.op == Op::OpSelect || inst.op == Op::OpPhi))
                    candidates_.push_back({&inst, block.label});
            }
            switch (inst.op) {
                case Op::OpLoad: break;
                case Op::OpStore:
                    if (uint32_t cell; find_cell(inst.ops[0], cell))
                        stored_.push_back({cell, inst.ops[1], block.label});
                    open(inst.ops[1]);
                    break;
                case Op::OpVariable:
                    if (!mask(p_.pointee(inst.type))) break;
                    make_cell(inst.result);
                    if (inst.ops.size() > 1)
                        stored_.push_back({t_.entries.get(inst.result).cell - 1, inst.ops[1], block.label});
                    break;
                case Op::OpReturnValue: stored_.push_back({make_cell(function.id()), inst.ops[0], block.label}); break;
                case Op::OpFunctionCall:
                    for (size_t i = 1; i < inst.ops.size(); ++i) open(inst.ops[i]);
                    break;
                case Op::OpPhi:
                    entry(inst.result).block = block.label;
                    phis_.push_back(&inst);
                    [[fallthrough]];
                default:
                    // Only pointers matter; conversions, arithmetic and comparisons take none.
                    if (inst.op < Op::OpConvertFToU || inst.op > Op::OpBitCount || inst.op == Op::OpSelect)
                        inst.for_each_id(open);
                    break;
            }
        }
    }
    candidate_ends_.push_back(candidates_.size());
}

// What values are made of in live code: stores, phis' operands, and what keeps variables from being followed.
// Code only ever dies, so equal numbers mean equal things.
size_t BitAnalysis::count_live() const {
    size_t live = 0;
    for (const Stored& stored : stored_) live += !dead(stored.block);
    for (const Opening& opening : openings_) live += !dead(opening.block);
    for (const Inst* phi : phis_)
        for (size_t i = 1; i < phi->ops.size(); i += 2) live += arrives(phi->ops[i], block_of(*phi));
    return live;
}

// What each cell may hold, by the stores of live code; and from where settle starts.
void BitAnalysis::place_values() {
    for (Cell& cell : cells_) {
        cell.count = 0;
        cell.fixed = cell.given;
    }
    for (const Stored& stored : stored_)
        if (!dead(stored.block)) ++cells_[stored.cell].count;
    uint32_t place = 0;
    for (Cell& cell : cells_) {
        cell.first = place;
        place += cell.count;
        if (cell.given) continue;
        const Inst* variable = def(cell.id);
        const bool is_variable = variable && variable->op == Op::OpVariable;
        const bool global_with_initializer = is_variable && !local(cell.id) && variable->ops.size() > 1;
        cell.fixed = cell.count == 0 || global_with_initializer;
    }
    for (const Opening& opening : openings_)
        if (!dead(opening.block)) cells_[opening.cell].fixed = true;
    for (Cell& cell : cells_) {
        cell.count = 0;
        if (!cell.given) cell.bits = cell.fixed ? Bits{} : Bits{~0u, ~0u};
    }
    values_.resize(place);
    for (const Stored& stored : stored_)
        if (!dead(stored.block)) {
            Cell& cell = cells_[stored.cell];
            values_[cell.first + cell.count++] = stored.value;
        }
}

// Starts from "everything is known", which no value satisfies, and takes away what a store does not keep.
// What stays true in a whole round is true by induction over the stores.
void BitAnalysis::settle() {
    const size_t live = count_live() + 1;
    if (live == live_) return;
    live_ = live;
    place_values();
    bool stable = false;
    for (int round = 0; round < kMaxRounds && !stable; ++round) {
        stable = true;
        ++t_.epoch;
        for (Cell& cell : cells_) {
            if (cell.fixed) continue;
            Bits bits = cell.bits;
            for (uint32_t k = 0; k < cell.count && (bits.zeros | bits.ones); ++k)
                bits = both(bits, of(values_[cell.first + k]));
            stable &= bits == cell.bits;
            cell.bits = bits;  // for the rest of the round already
        }
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
    auto know = [&](Bits bits) {
        Tables::Entry& known = entry(id);
        known.bits = bits;
        known.epoch = t_.epoch;
    };
    know({});  // while it is computed, nothing is known: never something wrong
    if (!all) return {};
    ++depth_;
    Bits bits = compute(*inst);
    --depth_;
    bits.zeros &= all;
    bits.ones &= all;
    know(bits);
    return bits;
}

Bits BitAnalysis::content(Id id) const {
    uint32_t cell;
    return find_cell(id, cell) ? cells_[cell].bits : Bits{};
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
            Bits bits{~0u, ~0u};
            bool any = false;
            const Id here = block_of(inst);
            for (size_t i = 0; i < inst.ops.size(); i += 2) {
                if (!arrives(inst.ops[i + 1], here)) continue;
                bits = both(bits, of(inst.ops[i]));
                any = true;
            }
            return any ? bits : Bits{};
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
