// The instruction grammar and the small services of ir/module.h.
#include "ir/module.h"

#include <algorithm>
#include <array>
#include <cstring>

namespace rtc {

const char* stage_kind_name(StageKind kind) {
    switch (kind) {
        case StageKind::RayGen: return "rgen";
        case StageKind::Intersection: return "rint";
        case StageKind::AnyHit: return "rahit";
        case StageKind::ClosestHit: return "rchit";
        case StageKind::Miss: return "rmiss";
        case StageKind::Callable: return "rcall";
    }
    return "?";
}

namespace ir {
namespace {

struct Row {
    uint16_t value;
    OpInfo info;
};

constexpr Row kRows[] = {
#define RTC_OP(value, name, has_type, has_result, pattern) {value, {name, has_type != 0, has_result != 0, pattern}},
#include "ir/grammar.inc"
#undef RTC_OP
};

// Opcode to row of the table plus one; 0 for none.
constexpr auto kIndex = [] {
    std::array<uint16_t, 8192> index{};
    for (size_t i = 0; i < std::size(kRows); ++i)
        if (kRows[i].value < index.size()) index[kRows[i].value] = static_cast<uint16_t>(i + 1);
    return index;
}();

}  // namespace

namespace operands {
namespace {

constexpr Shape shape_of(const char* pattern) {
    Shape shape;
    while (*pattern == 'r' && pattern[1] != '*') {
        ++shape.leading;
        pattern += pattern[1] == '?' ? 2 : 1;
    }
    if (pattern[0] == 'r' && pattern[1] == '*' && !pattern[2])
        shape.rest = Rest::Ids;
    else
        for (; *pattern; ++pattern)
            if (*pattern != 'l' && *pattern != '*' && *pattern != '?') shape.rest = Rest::Mixed;
    return shape;
}

}  // namespace

constinit const std::array<Shape, kShapeCount> kShapes = [] {
    std::array<Shape, kShapeCount> shapes{};
    for (const Row& row : kRows)
        if (row.value < shapes.size()) shapes[row.value] = shape_of(row.info.pattern);
    return shapes;
}();

}  // namespace operands

const OpInfo* op_info(Op op) {
    const auto value = static_cast<uint32_t>(op);
    const uint16_t row = value < kIndex.size() ? kIndex[value] : uint16_t{0};
    return row ? &kRows[row - 1].info : nullptr;
}

bool Inst::is_terminator() const {
    switch (op) {
        case Op::OpBranch:
        case Op::OpBranchConditional:
        case Op::OpSwitch:
        case Op::OpReturn:
        case Op::OpReturnValue:
        case Op::OpKill:
        case Op::OpTerminateInvocation:
        case Op::OpUnreachable:
        case Op::OpIgnoreIntersectionKHR:
        case Op::OpTerminateRayKHR: return true;
        default: return false;
    }
}

const Inst* Block::merge() const {
    if (insts.size() < 2) return nullptr;
    const Inst& inst = insts[insts.size() - 2];
    return inst.is_merge() ? &inst : nullptr;
}

std::vector<Id> Block::successors() const {
    std::vector<Id> out;
    for_each_successor([&](Id label) { out.push_back(label); });
    return out;
}

Block* Function::find_block(Id label) {
    for (Block& block : blocks)
        if (block.label == label) return &block;
    return nullptr;
}

Function* Module::find_function(Id id) {
    for (Function& function : functions)
        if (function.id() == id) return &function;
    return nullptr;
}

bool Module::has_capability(spv::Capability capability) const {
    return std::find(capabilities.begin(), capabilities.end(), capability) != capabilities.end();
}

void Module::add_capability(spv::Capability capability) {
    if (!has_capability(capability)) capabilities.push_back(capability);
}

void Module::add_extension(const std::string& name) {
    if (std::find(extensions.begin(), extensions.end(), name) == extensions.end()) extensions.push_back(name);
}

std::string Module::name_of(Id id) const {
    for (const Inst& inst : names)
        if (inst.op == Op::OpName && inst.ops[0] == id)
            return words_string(inst.ops.data() + 1, inst.ops.size() - 1);
    return {};
}

void Module::set_name(Id id, const std::string& name) {
    Inst inst(Op::OpName, 0, 0, {id});
    const std::vector<uint32_t> words = string_words(name);
    inst.ops.insert(inst.ops.end(), words.begin(), words.end());
    names.push_back(std::move(inst));
}

std::vector<uint32_t> string_words(const std::string& text) {
    std::vector<uint32_t> words(text.size() / 4 + 1, 0);
    for (size_t i = 0; i < text.size(); ++i)
        words[i / 4] |= static_cast<uint32_t>(static_cast<unsigned char>(text[i])) << (8 * (i % 4));
    return words;
}

std::string words_string(const uint32_t* words, size_t count, size_t* used) {
    std::string text;
    for (size_t i = 0; i < count; ++i) {
        for (int shift = 0; shift < 32; shift += 8) {
            const char c = static_cast<char>(words[i] >> shift & 0xff);
            if (!c) {
                if (used) *used = i + 1;
                return text;
            }
            text += c;
        }
    }
    if (used) *used = count;
    return text;
}

void fail(const std::string& id, const std::string& file, uint32_t line, const std::string& text) {
    throw CompileError(Diagnostic{Severity::Error, id, file, line, text});
}

}  // namespace ir
}  // namespace rtc
