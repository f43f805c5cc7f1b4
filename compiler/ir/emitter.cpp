// Instruction appending and word conversion; see emitter.h.
#include "ir/emitter.h"

namespace rtc::ir {

Id Emitter::value(Op op, Id type, Words ops) {
    Inst inst(op, type, p.module.new_id(), std::move(ops));
    inst.source = source_;
    out_.push_back(std::move(inst));
    return out_.back().result;
}

void Emitter::effect(Op op, Words ops) {
    Inst inst(op, 0, 0, std::move(ops));
    inst.source = source_;
    out_.push_back(std::move(inst));
}

Id Emitter::chain(spv::StorageClass storage, Id type, Id base, std::vector<Id> indices) {
    indices.insert(indices.begin(), base);
    return value(Op::OpAccessChain, p.pointer_type(storage, type), std::move(indices));
}

Id Emitter::extract(Id type, Id composite, const std::vector<uint32_t>& path) {
    if (path.empty()) return composite;
    Words ops{composite};
    ops.insert(ops.end(), path.begin(), path.end());
    return value(Op::OpCompositeExtract, type, std::move(ops));
}

Id Emitter::construct(Id type, const std::vector<Id>& parts) { return value(Op::OpCompositeConstruct, type, parts); }

Id Emitter::call(Id function, Id result_type, const std::vector<Id>& arguments) {
    Words ops{function};
    ops.insert(ops.end(), arguments.begin(), arguments.end());
    return value(Op::OpFunctionCall, result_type, std::move(ops));
}

Id Emitter::as_uint(Id v, Id type) { return type == p.uint_type() ? v : value(Op::OpBitcast, p.uint_type(), {v}); }
Id Emitter::from_uint(Id v, Id type) { return type == p.uint_type() ? v : value(Op::OpBitcast, type, {v}); }

std::vector<Id> Emitter::to_words(Id whole, Id whole_type) {
    std::vector<Leaf> leaves;
    p.flatten(whole_type, leaves, "a value");
    std::vector<Id> words;
    const Id u32 = p.uint_type();
    for (const Leaf& leaf : leaves) {
        const Id v = extract(leaf.type, whole, leaf.path);
        const Inst* type = p.def(leaf.type);
        if (type->op == Op::OpTypeBool) {
            words.push_back(select(u32, v, p.constant_u32(1), p.constant_u32(0)));
        } else if (leaf.words == 2) {
            const Id pair = value(Op::OpBitcast, p.vector_type(u32, 2), {v});
            words.push_back(extract(u32, pair, {0}));
            words.push_back(extract(u32, pair, {1}));
        } else if (type->ops[0] == 32) {
            words.push_back(as_uint(v, leaf.type));
        } else if (type->op == Op::OpTypeFloat) {
            // Exact in both directions, and needs no 16-bit integers.
            words.push_back(as_uint(value(Op::OpFConvert, p.float_type(32), {v}), p.float_type(32)));
        } else {
            const Id narrow = p.int_type(p.def(leaf.type)->ops[0], false);
            const Id bits = narrow == leaf.type ? v : value(Op::OpBitcast, narrow, {v});
            words.push_back(value(Op::OpUConvert, u32, {bits}));
        }
    }
    return words;
}

Id Emitter::from_words(Id type_id, const std::vector<Id>& words, size_t& at) {
    const Op op = p.type_op(type_id);
    switch (op) {
        case Op::OpTypeVector:
        case Op::OpTypeMatrix:
        case Op::OpTypeArray:
        case Op::OpTypeStruct: {
            std::vector<Id> parts;
            const uint32_t count = p.element_count(type_id);
            for (uint32_t i = 0; i < count; ++i) parts.push_back(from_words(p.element_type(type_id, i), words, at));
            return construct(type_id, parts);
        }
        default: break;
    }
    auto next = [&] { return at < words.size() ? words[at++] : (++at, p.constant_u32(0)); };
    const Id u32 = p.uint_type();
    if (op == Op::OpTypeBool) return value(Op::OpINotEqual, type_id, {next(), p.constant_u32(0)});
    const Inst type = *p.def(type_id);
    if (op == Op::OpTypePointer || type.ops[0] == 64) {
        const Id low = next();
        const Id high = next();
        const Id pair = construct(p.vector_type(u32, 2), {low, high});
        return value(Op::OpBitcast, type_id, {pair});
    }
    if (type.ops[0] == 32) return from_uint(next(), type_id);
    if (op == Op::OpTypeFloat) return value(Op::OpFConvert, type_id, {from_uint(next(), p.float_type(32))});
    const Id narrow = p.int_type(type.ops[0], false);
    const Id bits = value(Op::OpUConvert, narrow, {next()});
    return narrow == type_id ? bits : value(Op::OpBitcast, type_id, {bits});
}

}  // namespace rtc::ir
