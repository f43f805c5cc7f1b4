#include "spirv_edit.h"

#include <cstring>
#include <string_view>
#include <unordered_map>

#include "error.h"

namespace rtc::lab {
namespace {

enum : uint32_t {
    OpName = 5,
    OpTypeFloat = 22,
    OpFunctionCall = 57,
    OpDecorate = 71,
    OpFNegate = 127,
    OpFAdd = 129,
    OpFSub = 131,
    OpFMul = 133,
    OpFDiv = 136,
    OpFRem = 140,
    OpVectorTimesScalar = 142,
    OpDot = 148,
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
    uint32_t float_type = 0, fused = 0;
    std::unordered_map<uint32_t, std::pair<uint32_t, uint32_t>> products;
    each_instruction(spirv, [&](uint32_t op, size_t at, size_t) {
        if (op == OpName) {
            const std::string_view name(reinterpret_cast<const char*>(&spirv[at + 2]));
            if (name.starts_with("lab_fused(")) fused = spirv[at + 1];
        } else if (op == OpTypeFloat && spirv[at + 2] == 32) {
            float_type = spirv[at + 1];
        } else if (op == OpFMul && spirv[at + 1] == float_type) {
            products[spirv[at + 2]] = {spirv[at + 3], spirv[at + 4]};
        }
    });
    if (!fused) throw tools::Error("the negative control lacks lab_fused");
    std::vector<uint32_t> out(spirv.begin(), spirv.begin() + 5);
    each_instruction(spirv, [&](uint32_t op, size_t at, size_t count) {
        const bool sum = (op == OpFAdd || op == OpFSub) && spirv[at + 1] == float_type;
        const auto left = sum ? products.find(spirv[at + 3]) : products.end();
        const auto right = sum ? products.find(spirv[at + 4]) : products.end();
        if (left == products.end() && right == products.end()) {
            out.insert(out.end(), spirv.begin() + at, spirv.begin() + at + count);
            return;
        }
        auto negate = [&](uint32_t id) {
            const uint32_t result = out[3]++;
            out.insert(out.end(), {4u << 16 | OpFNegate, float_type, result, id});
            return result;
        };
        uint32_t a, b, c;
        if (left != products.end()) {
            a = left->second.first;
            b = left->second.second;
            c = op == OpFSub ? negate(spirv[at + 4]) : spirv[at + 4];
        } else {
            a = op == OpFSub ? negate(right->second.first) : right->second.first;
            b = right->second.second;
            c = spirv[at + 3];
        }
        out.insert(out.end(), {7u << 16 | OpFunctionCall, float_type, spirv[at + 2], fused, a, b, c});
    });
    spirv = std::move(out);
}

}  // namespace rtc::lab
