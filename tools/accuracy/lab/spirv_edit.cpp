#include "spirv_edit.h"

#include <cstddef>
#include <tuple>
#include <unordered_map>

namespace rtc::lab {
namespace {

enum : uint32_t {
    OpCapability = 17,
    OpTypeFloat = 22,
    OpDecorate = 71,
    OpFConvert = 115,
    OpFNegate = 127,
    OpFAdd = 129,
    OpFSub = 131,
    OpFMul = 133,
    OpFDiv = 136,
    OpFRem = 140,
    OpVectorTimesScalar = 142,
    OpDot = 148,
    CapabilityFloat64 = 10,
    DecorationNoContraction = 42,
};

template <typename Visit>
void each_instruction(const std::vector<uint32_t>& spirv, Visit visit) {
    for (size_t at = 5; at < spirv.size(); at += spirv[at] >> 16)
        visit(spirv[at] & 0xffff, at, spirv[at] >> 16);
}

}  // namespace

void decorate_no_contraction(std::vector<uint32_t>& spirv) {
    std::vector<uint32_t> decorations;
    size_t first = 0;
    each_instruction(spirv, [&](uint32_t op, size_t at, size_t) {
        if (op == OpDecorate && first == 0) first = at;
        const bool arithmetic =
            op == OpFNegate || op == OpFAdd || op == OpFSub || op == OpFMul || (op >= OpFDiv && op <= OpDot);
        if (arithmetic)
            decorations.insert(decorations.end(),
                               {3u << 16 | OpDecorate, spirv[at + 2], DecorationNoContraction});
    });
    spirv.insert(spirv.begin() + first, decorations.begin(), decorations.end());
}

void contract(std::vector<uint32_t>& spirv) {
    uint32_t float_type = 0, double_type = 0;
    bool capable = false;
    std::unordered_map<uint32_t, std::pair<uint32_t, uint32_t>> products;
    each_instruction(spirv, [&](uint32_t op, size_t at, size_t) {
        if (op == OpCapability) {
            capable = capable || spirv[at + 1] == CapabilityFloat64;
        } else if (op == OpTypeFloat) {
            if (spirv[at + 2] == 32) float_type = spirv[at + 1];
            if (spirv[at + 2] == 64) double_type = spirv[at + 1];
        } else if (op == OpFMul && spirv[at + 1] == float_type) {
            products[spirv[at + 2]] = {spirv[at + 3], spirv[at + 4]};
        }
    });
    std::vector<uint32_t> out(spirv.begin(), spirv.begin() + 5);
    if (!capable) out.insert(out.end(), {2u << 16 | OpCapability, CapabilityFloat64});
    const bool declare = double_type == 0;
    if (declare) double_type = out[3]++;
    auto emit = [&](uint32_t op, uint32_t type, uint32_t a, uint32_t b = 0) {
        const uint32_t result = out[3]++;
        out.insert(out.end(), {(b ? 5u : 4u) << 16 | op, type, result, a});
        if (b) out.push_back(b);
        return result;
    };
    each_instruction(spirv, [&](uint32_t op, size_t at, size_t count) {
        const bool sum = (op == OpFAdd || op == OpFSub) && spirv[at + 1] == float_type;
        const auto left = sum ? products.find(spirv[at + 3]) : products.end();
        const auto right = sum ? products.find(spirv[at + 4]) : products.end();
        // What is no arithmetic any more must not be decorated as such.
        if (op == OpDecorate && spirv[at + 2] == DecorationNoContraction) return;
        if (left == products.end() && right == products.end()) {
            out.insert(out.end(), spirv.begin() + at, spirv.begin() + at + count);
            if (declare && op == OpTypeFloat) out.insert(out.end(), {3u << 16 | OpTypeFloat, double_type, 64});
            return;
        }
        uint32_t a, b, c;
        bool negate_product = false;
        if (left != products.end()) {
            std::tie(a, b) = left->second;
            c = spirv[at + 4];
        } else {
            std::tie(a, b) = right->second;
            c = spirv[at + 3];
            negate_product = op == OpFSub;
        }
        const uint32_t product = emit(OpFMul, double_type, emit(OpFConvert, double_type, a),
                                      emit(OpFConvert, double_type, b));
        const uint32_t third = emit(OpFConvert, double_type, c);
        const uint32_t total = negate_product ? emit(OpFSub, double_type, third, product)
                                              : emit(op, double_type, product, third);
        out.insert(out.end(), {4u << 16 | OpFConvert, float_type, spirv[at + 2], total});
    });
    spirv = std::move(out);
}

}  // namespace rtc::lab
