// SPIR-V in memory: a module as lists of instructions, functions as lists of
// basic blocks. One Program-wide id space; types and constants are interned by
// ir/types.h. Thin on purpose: passes read and rewrite instructions directly.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <vector>

#include "ir/words.h"
#include "pipeline.h"

#include <spirv/unified1/spirv.hpp11>

namespace rtc::ir {

using Id = uint32_t;
using spv::Op;

struct OpInfo {
    const char* name;
    bool has_type;
    bool has_result;
    const char* pattern;  // see tools/update-grammar
};

// nullptr for an opcode the grammar does not know.
const OpInfo* op_info(Op op);

struct SourceLine {
    uint32_t file = 0;  // index into Module::files; 0: none
    uint32_t line = 0;
    bool operator==(const SourceLine&) const = default;
};

struct Inst {
    Op op = Op::OpNop;
    Id type = 0;
    Id result = 0;
    Words ops;  // everything after type and result
    SourceLine source;
    uint8_t switch_words = 1;  // literal words per OpSwitch case (2 for 64-bit selectors)

    Inst() = default;
    Inst(Op o, Id t, Id r, Words w) : op(o), type(t), result(r), ops(std::move(w)) {}

    bool is_terminator() const;
    bool is_merge() const { return op == Op::OpSelectionMerge || op == Op::OpLoopMerge; }
    // Calls fn on every id operand (not on type and result): fn(Id&), or fn(Id) on a const Inst.
    template <typename Fn>
    void for_each_id(Fn&& fn);
    template <typename Fn>
    void for_each_id(Fn&& fn) const;
};

struct Block {
    Id label = 0;
    std::vector<Inst> insts;  // the last one is the terminator

    Inst& terminator() { return insts.back(); }
    const Inst& terminator() const { return insts.back(); }
    // The merge instruction before the terminator, or nullptr.
    const Inst* merge() const;
    // Labels the terminator names, in order, duplicates kept.
    std::vector<Id> successors() const;
    template <typename Fn>
    void for_each_successor(Fn&& fn) const {
        if (insts.empty()) return;
        const Inst& last = insts.back();
        if (last.op == Op::OpBranch) {
            fn(last.ops[0]);
        } else if (last.op == Op::OpBranchConditional) {
            fn(last.ops[1]);
            fn(last.ops[2]);
        } else if (last.op == Op::OpSwitch) {
            fn(last.ops[1]);
            for (size_t i = 2 + last.switch_words; i < last.ops.size(); i += last.switch_words + 1u) fn(last.ops[i]);
        }
    }
};

struct Function {
    Inst def;  // OpFunction
    std::vector<Inst> params;
    std::vector<Block> blocks;
    bool prepared = false;  // part of traversal: cleaned up and validated when rtc was built

    Id id() const { return def.result; }
    Block* find_block(Id label);
};

struct EntryPoint {
    spv::ExecutionModel model = spv::ExecutionModel::GLCompute;
    Id function = 0;
    std::string name;
    std::vector<Id> interface;
};

struct Module {
    uint32_t version = 0x00010000;
    Id bound = 1;
    std::vector<spv::Capability> capabilities;
    std::vector<std::string> extensions;
    std::vector<Inst> ext_imports;
    spv::AddressingModel addressing = spv::AddressingModel::Logical;
    spv::MemoryModel memory_model = spv::MemoryModel::GLSL450;
    std::vector<EntryPoint> entry_points;
    std::vector<Inst> execution_modes;
    std::vector<Inst> names;        // OpName, OpMemberName
    std::vector<Inst> decorations;  // OpDecorate*, OpMemberDecorate*; groups are expanded by the reader
    std::vector<Inst> globals;      // types, constants, global variables, OpUndef
    std::vector<Function> functions;
    std::vector<std::string> files{""};  // source file names of SourceLine
    // Reflection chunks and other strings to carry, written as OpString.
    std::vector<std::string> strings;

    Id new_id() { return bound++; }
    Function* find_function(Id id);
    bool has_capability(spv::Capability capability) const;
    void add_capability(spv::Capability capability);
    void add_extension(const std::string& name);
    std::string name_of(Id id) const;  // OpName or ""
    void set_name(Id id, const std::string& name);
};

// Packs text as SPIR-V literal-string words, and back.
std::vector<uint32_t> string_words(const std::string& text);
std::string words_string(const uint32_t* words, size_t count, size_t* used = nullptr);

// Thrown by passes; link_pipeline turns it into LinkResult::diagnostics.
struct CompileError : std::runtime_error {
    Diagnostic diagnostic;
    explicit CompileError(Diagnostic d) : std::runtime_error(d.text), diagnostic(std::move(d)) {}
};

[[noreturn]] void fail(const std::string& id, const std::string& file, uint32_t line, const std::string& text);

// Parses a binary of either byte order. Every malformed input throws CompileError
// with id "spirv-malformed" (or a more specific one) naming `file`.
Module read_module(const std::vector<uint32_t>& words, const std::string& file);

std::vector<uint32_t> write_module(const Module& module, bool with_debug_info);

// Disassembly for dumps and tests.
std::string to_text(const std::vector<uint32_t>& words);

}  // namespace rtc::ir

#include "ir/operands.h"
