// Which operand words of an instruction are ids, by the grammar's patterns. Included by ir/module.h.
#pragma once

#include <algorithm>
#include <array>

#include "ir/module.h"

namespace rtc::ir {
namespace operands {

// What most patterns come to: so many ids first, then only ids, none, or what takes the pattern to tell.
enum class Rest : uint8_t { None, Ids, Mixed };
struct Shape {
    uint8_t leading = 0;
    Rest rest = Rest::None;
};
inline constexpr size_t kShapeCount = 8192;  // opcodes from here on have no known operands
extern const std::array<Shape, kShapeCount> kShapes;

inline constexpr uint32_t kMaskParameters_MemoryAccess_Id = 0x8 | 0x10 | 0x10000 | 0x20000;
inline constexpr uint32_t kMemoryAligned = 0x2;
inline constexpr uint32_t kImageGrad = 0x4;
inline constexpr uint32_t kImageFlagsWithoutOperand = 0x400 | 0x800 | 0x1000 | 0x2000 | 0x4000;

// Visits every id word of `words` under `pattern`; stops quietly at the end of the words.
template <typename Words, typename Fn>
void visit_ids(Op op, const char* pattern, Words& words, uint32_t switch_words, const Fn& fn) {
    size_t i = 0;
    const size_t n = words.size();
    for (const char* p = pattern; *p && i < n; ++p) {
        const char kind = *p;
        const bool star = p[1] == '*';
        if (p[1] == '*' || p[1] == '?') ++p;
        do {
            switch (kind) {
                case 'r': fn(words[i++]); break;
                case 'l':
                case 'x':
                case 'b': ++i; break;
                case 'S': {
                    const Op inner = static_cast<Op>(words[i++]);
                    // The embedded instruction's own operands follow.
                    const OpInfo* info = op_info(inner);
                    const char* q = info ? info->pattern : "r*";
                    for (; *q && i < n; ++q) {
                        const char inner_kind = *q;
                        const bool inner_star = q[1] == '*';
                        if (q[1] == '*' || q[1] == '?') ++q;
                        do {
                            if (inner_kind == 'r') fn(words[i]);
                            ++i;
                        } while (inner_star && i < n);
                    }
                    break;
                }
                case 's': {
                    while (i < n) {
                        const uint32_t word = words[i++];
                        if (!(word & 0xff000000u) || !(word & 0x00ff0000u) || !(word & 0x0000ff00u) || !(word & 0xffu))
                            break;
                    }
                    break;
                }
                case 'c': i = n; break;
                case 'p':
                    i += switch_words;
                    if (i < n) fn(words[i++]);
                    break;
                case 'q':
                    fn(words[i++]);
                    ++i;
                    break;
                case 'R':
                    fn(words[i++]);
                    if (i < n) fn(words[i++]);
                    break;
                case 'm': {
                    const uint32_t mask = words[i++];
                    for (uint32_t bit = 1; bit && i < n; bit <<= 1) {
                        if (!(mask & bit)) continue;
                        if (bit == kMemoryAligned)
                            ++i;
                        else if (bit & kMaskParameters_MemoryAccess_Id)
                            fn(words[i++]);
                    }
                    break;
                }
                case 'i': {
                    const uint32_t mask = words[i++];
                    for (uint32_t bit = 1; bit && i < n; bit <<= 1) {
                        if (!(mask & bit) || (bit & kImageFlagsWithoutOperand)) continue;
                        fn(words[i++]);
                        if (bit == kImageGrad && i < n) fn(words[i++]);
                    }
                    break;
                }
                case 'o': i = n; break;
                case 'd':
                    ++i;
                    if (op == Op::OpDecorateId)
                        while (i < n) fn(words[i++]);
                    i = n;
                    break;
                case 'e':
                    ++i;
                    if (op == Op::OpExecutionModeId)
                        while (i < n) fn(words[i++]);
                    i = n;
                    break;
                default: ++i; break;
            }
        } while (star && i < n);
    }
}

}  // namespace operands

namespace operands {

template <typename Words, typename Fn>
void for_each_id(Op op, Words& words, uint32_t switch_words, const Fn& fn) {
    const auto number = static_cast<uint32_t>(op);
    const Shape shape = number < kShapeCount ? kShapes[number] : Shape{};
    auto* const data = words.data();
    const size_t n = words.size();
    if (shape.rest == Rest::Mixed && n > shape.leading) {
        visit_ids(op, op_info(op)->pattern, words, switch_words, fn);
        return;
    }
    const size_t ids = shape.rest == Rest::Ids ? n : std::min<size_t>(n, shape.leading);
    for (size_t i = 0; i < ids; ++i) fn(data[i]);
}

}  // namespace operands

template <typename Fn>
void Inst::for_each_id(Fn&& fn) {
    operands::for_each_id(op, ops, switch_words, fn);
}

template <typename Fn>
void Inst::for_each_id(Fn&& fn) const {
    operands::for_each_id(op, ops, switch_words, fn);
}

}  // namespace rtc::ir
