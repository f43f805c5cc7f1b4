#include "link/bits.h"

#include <set>

namespace rtc::link {

using ir::Id;
using ir::Inst;
using ir::Op;

Bits exactly(uint32_t value) { return {~value, value}; }
Bits both(Bits a, Bits b) { return {a.zeros & b.zeros, a.ones & b.ones}; }

namespace {

Bits truth(bool value) { return value ? Bits{0, 1} : Bits{1, 0}; }

// Deeper chains are rare, and nothing is lost but knowledge.
constexpr int kMaxDepth = 64;

}  // namespace

BitAnalysis::BitAnalysis(const ir::Program& program, const ir::Function& function,
                         const std::map<Id, Bits>& contents, bool settle_locals)
    : p_(program), contents_(contents) {
    std::set<Id> other;
    for (const ir::Block& block : function.blocks)
        for (const Inst& inst : block.insts) {
            if (inst.result) defs_[inst.result] = &inst;
            if (inst.op == Op::OpVariable) {
                auto& values = stores_[inst.result];
                if (inst.ops.size() > 1) values.push_back(inst.ops[1]);
            } else if (inst.op == Op::OpStore) {
                stores_[inst.ops[0]].push_back(inst.ops[1]);
                other.insert(inst.ops[1]);
            } else if (inst.op != Op::OpLoad) {
                inst.for_each_id([&](Id id) { other.insert(id); });
            }
        }
    for (Id id : other) stores_.erase(id);
    if (settle_locals) settle();
}

// Starts from "everything is known", which no value satisfies, and takes away what a store does not keep.
// What stays true in a whole round is true by induction over the stores.
void BitAnalysis::settle() {
    for (const auto& [variable, values] : stores_) {
        const auto def = defs_.find(variable);
        if (values.empty() || def == defs_.end() || def->second->op != Op::OpVariable) continue;
        if (const uint32_t all = mask(p_.pointee(def->second->type))) settled_[variable] = {all, all};
    }
    for (int round = 0; round < 16; ++round) {
        known_.clear();
        open_.clear();
        std::map<Id, Bits> next;
        for (const auto& [variable, bits] : settled_) {
            const std::vector<Id>& values = stores_.at(variable);
            Bits joined = of(values.front());
            for (Id value : values) joined = both(joined, of(value));
            next[variable] = both(joined, bits);
        }
        if (next == settled_) break;
        settled_ = std::move(next);
        if (round == 15) settled_.clear();
    }
    std::erase_if(settled_, [](const auto& entry) { return (entry.second.zeros & entry.second.ones) != 0; });
    known_.clear();
    open_.clear();
}

uint32_t BitAnalysis::mask(Id type) const {
    const Inst* inst = p_.def(type);
    if (!inst) return 0;
    if (inst->op == Op::OpTypeBool) return 1;
    return inst->op == Op::OpTypeInt && inst->ops[0] == 32 ? 0xffffffffu : 0;
}

Bits BitAnalysis::of(Id id) {
    if (const auto found = known_.find(id); found != known_.end()) return found->second;
    if (open_[id] || depth_ >= kMaxDepth) return {};
    const auto local = defs_.find(id);
    const Inst* inst = local != defs_.end() ? local->second : p_.def(id);
    if (!inst || !inst->type) return {};
    open_[id] = true;
    ++depth_;
    Bits bits = compute(*inst);
    --depth_;
    open_[id] = false;
    const uint32_t all = mask(inst->type);
    bits.zeros &= all;
    bits.ones &= all;
    // Where a cycle or the depth cut the search, less is known than could be: never something wrong.
    return known_[id] = bits;
}

Bits BitAnalysis::stored(Id variable) {
    if (const auto found = settled_.find(variable); found != settled_.end()) return found->second;
    const auto found = stores_.find(variable);
    if (found == stores_.end() || found->second.empty()) return {};
    const auto def = defs_.find(variable);
    if (def == defs_.end() || def->second->op != Op::OpVariable) return {};
    Bits bits = of(found->second.front());
    for (Id value : found->second) bits = both(bits, of(value));
    return bits;
}

Bits BitAnalysis::compute(const Inst& inst) {
    switch (inst.op) {
        case Op::OpConstantTrue: return truth(true);
        case Op::OpConstantFalse: return truth(false);
        case Op::OpConstantNull: return {~0u, 0};
        case Op::OpConstant: return mask(inst.type) ? exactly(inst.ops[0]) : Bits{};
        case Op::OpSpecConstantOp:
            return operation(static_cast<Op>(inst.ops[0]), inst.type, inst.ops.data() + 1, inst.ops.size() - 1);
        case Op::OpLoad: {
            const auto found = contents_.find(inst.ops[0]);
            return found != contents_.end() ? found->second : stored(inst.ops[0]);
        }
        case Op::OpFunctionCall: {
            const auto found = contents_.find(inst.ops[0]);
            return found != contents_.end() ? found->second : Bits{};
        }
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
        const auto local = defs_.find(ops[0]);
        const Inst* inst = local != defs_.end() ? local->second : p_.def(ops[0]);
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
