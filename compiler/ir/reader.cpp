// SPIR-V binary to ir::Module. Checks everything the rest of the compiler takes
// for granted about the words themselves: sizes, id bounds, section order of
// functions and blocks. What the instructions mean is spirv-val's business and check/'s.
#include <algorithm>
#include <set>
#include <unordered_map>

#include "ir/module.h"

namespace rtc::ir {
namespace {

// SPIR-V's universal limit on ids (SPIR-V 2.17).
constexpr uint32_t kMaxBound = 0x3fffff;

class Reader {
  public:
    Reader(const std::vector<uint32_t>& words, const std::string& file) : input_(words), file_(file) {}

    Module read() {
        read_header();
        size_t at = 5;
        while (at < words_.size()) {
            const uint32_t count = words_[at] >> 16;
            const uint16_t opcode = words_[at] & 0xffff;
            if (count == 0) malformed("instruction with a word count of 0 at word " + std::to_string(at));
            if (at + count > words_.size())
                malformed("instruction at word " + std::to_string(at) + " runs past the end of the module");
            read_instruction(static_cast<Op>(opcode), &words_[at + 1], count - 1, at);
            at += count;
        }
        if (in_function_) malformed("the last function has no OpFunctionEnd");
        if (!saw_memory_model_) malformed("the module has no OpMemoryModel");
        expand_decoration_groups();
        return std::move(module_);
    }

  private:
    [[noreturn]] void malformed(const std::string& text) const {
        fail("spirv-malformed", file_, 0, "malformed SPIR-V: " + text);
    }

    void read_header() {
        if (input_.size() < 5) malformed("a module has at least 5 words, this file has " + std::to_string(input_.size()));
        words_ = input_;
        if (words_[0] == 0x03022307) {
            for (uint32_t& w : words_) w = w >> 24 | (w >> 8 & 0xff00) | (w << 8 & 0xff0000) | w << 24;
        }
        if (words_[0] != 0x07230203) malformed("wrong magic number");
        module_.version = words_[1];
        if ((module_.version >> 16) != 1 || (module_.version >> 8 & 0xff) > 6 || (module_.version & 0xff) != 0)
            fail("spirv-version", file_, 0, "SPIR-V version " + std::to_string(module_.version >> 16) + "." +
                                                std::to_string(module_.version >> 8 & 0xff) +
                                                " is not supported (1.0 to 1.6 are)");
        module_.bound = words_[3];
        if (module_.bound == 0 || module_.bound > kMaxBound)
            malformed("id bound " + std::to_string(module_.bound) + " is outside 1.." + std::to_string(kMaxBound));
        // A result id takes at least two words, so a larger bound is not from any real producer;
        // refusing to size tables by it keeps damaged headers cheap.
        defined_.assign(std::min<size_t>(module_.bound, words_.size() + 1), false);
    }

    void check_id(Id id, const char* opname) const {
        if (id == 0 || id >= module_.bound)
            malformed(std::string(opname) + " names id " + std::to_string(id) + ", the bound is " +
                      std::to_string(module_.bound));
    }

    void define(Id id, const char* opname) {
        check_id(id, opname);
        if (id >= defined_.size()) {
            if (!sparse_defined_.insert(id).second) malformed("id " + std::to_string(id) + " is defined twice");
            return;
        }
        if (defined_[id]) malformed("id " + std::to_string(id) + " is defined twice");
        defined_[id] = true;
    }

    // Minimal operand words by pattern, so that passes may index operands without checks.
    void check_operand_count(const OpInfo& info, size_t have) const {
        size_t need = 0;
        for (const char* p = info.pattern; *p; ++p) {
            const bool optional = p[1] == '?' || p[1] == '*';
            if (!optional) need += *p == 'R' || *p == 'q' ? 2 : 1;
            if (optional) ++p;
        }
        if (have < need)
            malformed(std::string(info.name) + " has " + std::to_string(have) + " operand words, at least " +
                      std::to_string(need) + " are needed");
    }

    void read_instruction(Op op, const uint32_t* w, size_t n, size_t at) {
        const OpInfo* info = op_info(op);
        if (!info)
            fail("spirv-unknown-opcode", file_, 0,
                 "unknown SPIR-V opcode " + std::to_string(static_cast<uint32_t>(op)) + " at word " + std::to_string(at));
        Inst inst;
        inst.op = op;
        inst.source = line_;
        size_t i = 0;
        if (info->has_type) {
            if (i >= n) malformed(std::string(info->name) + " is too short");
            inst.type = w[i++];
            check_id(inst.type, info->name);
        }
        if (info->has_result) {
            if (i >= n) malformed(std::string(info->name) + " is too short");
            inst.result = w[i++];
            define(inst.result, info->name);
        }
        inst.ops.assign(w + i, w + n);
        check_operand_count(*info, inst.ops.size());
        check_string(op, inst);
        if (op == Op::OpSwitch) {
            inst.switch_words = wide_values_.count(inst.ops[0]) ? 2 : 1;
            if ((inst.ops.size() - 2) % (inst.switch_words + 1u)) malformed("OpSwitch has an incomplete case");
        }
        inst.for_each_id([&](Id id) { check_id(id, info->name); });
        if (inst.result && wide_ints_.count(inst.type)) wide_values_.insert(inst.result);
        place(inst);
    }

    void check_string(Op op, const Inst& inst) const {
        size_t first = 0;
        switch (op) {
            case Op::OpString:
            case Op::OpExtension:
            case Op::OpExtInstImport:
            case Op::OpSourceExtension: break;
            case Op::OpName: first = 1; break;
            case Op::OpMemberName:
            case Op::OpEntryPoint: first = 2; break;
            default: return;
        }
        for (size_t i = first; i < inst.ops.size(); ++i)
            for (int shift = 0; shift < 32; shift += 8)
                if (!(inst.ops[i] >> shift & 0xff)) return;
        malformed(std::string(op_info(op)->name) + " holds a string without an end");
    }

    void place(Inst& inst) {
        switch (inst.op) {
            case Op::OpNop: return;
            case Op::OpSource:
            case Op::OpSourceContinued:
            case Op::OpSourceExtension:
            case Op::OpModuleProcessed: return;
            case Op::OpString: strings_[inst.result] = words_string(inst.ops.data(), inst.ops.size()); return;
            case Op::OpLine: {
                const auto found = strings_.find(inst.ops[0]);
                if (found == strings_.end()) malformed("OpLine names id " + std::to_string(inst.ops[0]) + ", no OpString");
                line_ = {file_index(found->second), inst.ops[1]};
                return;
            }
            case Op::OpNoLine: line_ = {}; return;
            case Op::OpCapability: module_.add_capability(static_cast<spv::Capability>(inst.ops[0])); return;
            case Op::OpExtension: module_.add_extension(words_string(inst.ops.data(), inst.ops.size())); return;
            case Op::OpExtInstImport: {
                const std::string name = words_string(inst.ops.data(), inst.ops.size());
                if (name != "GLSL.std.450" && name.rfind("NonSemantic.", 0) != 0 && name != "OpenCL.DebugInfo.100" &&
                    name != "DebugInfo")
                    fail("spirv-unknown-instruction-set", file_, 0,
                         "extended instruction set \"" + name + "\" is not supported");
                // Debug information in instructions cannot follow a shader through splitting.
                if (name != "GLSL.std.450" && name != "NonSemantic.DebugPrintf")
                    dropped_sets_.insert(inst.result);
                else
                    module_.ext_imports.push_back(std::move(inst));
                return;
            }
            case Op::OpMemoryModel:
                saw_memory_model_ = true;
                module_.addressing = static_cast<spv::AddressingModel>(inst.ops[0]);
                module_.memory_model = static_cast<spv::MemoryModel>(inst.ops[1]);
                return;
            case Op::OpEntryPoint: {
                EntryPoint entry;
                entry.model = static_cast<spv::ExecutionModel>(inst.ops[0]);
                entry.function = inst.ops[1];
                size_t used = 0;
                entry.name = words_string(inst.ops.data() + 2, inst.ops.size() - 2, &used);
                entry.interface.assign(inst.ops.begin() + 2 + used, inst.ops.end());
                module_.entry_points.push_back(std::move(entry));
                return;
            }
            case Op::OpExecutionMode:
            case Op::OpExecutionModeId: module_.execution_modes.push_back(std::move(inst)); return;
            case Op::OpName:
            case Op::OpMemberName: module_.names.push_back(std::move(inst)); return;
            case Op::OpDecorate:
            case Op::OpDecorateId:
            case Op::OpDecorateString:
            case Op::OpMemberDecorate:
            case Op::OpMemberDecorateString: module_.decorations.push_back(std::move(inst)); return;
            case Op::OpDecorationGroup: groups_.insert(inst.result); return;
            case Op::OpGroupDecorate:
            case Op::OpGroupMemberDecorate: group_uses_.push_back(std::move(inst)); return;
            case Op::OpExtInst:
                if (dropped_sets_.count(inst.ops[0])) return;
                break;
            case Op::OpFunction:
                if (in_function_) malformed("OpFunction inside a function");
                in_function_ = true;
                module_.functions.emplace_back();
                module_.functions.back().def = std::move(inst);
                line_ = {};
                return;
            case Op::OpFunctionEnd:
                if (!in_function_) malformed("OpFunctionEnd outside a function");
                if (block_open_) malformed("a block has no terminator");
                in_function_ = false;
                return;
            case Op::OpFunctionParameter:
                if (!in_function_ || !module_.functions.back().blocks.empty())
                    malformed("OpFunctionParameter outside a function's head");
                module_.functions.back().params.push_back(std::move(inst));
                return;
            case Op::OpLabel:
                if (!in_function_) malformed("OpLabel outside a function");
                if (block_open_) malformed("a block has no terminator");
                block_open_ = true;
                module_.functions.back().blocks.emplace_back();
                module_.functions.back().blocks.back().label = inst.result;
                return;
            default: break;
        }
        if (!in_function_) {
            // SPIR-V 2.4: functions come last. What a value's type is would depend on the order otherwise.
            if (!module_.functions.empty())
                malformed(std::string(op_info(inst.op)->name) + " stands behind a function");
            if (inst.op == Op::OpTypeInt && inst.ops[0] == 64) wide_ints_.insert(inst.result);
            module_.globals.push_back(std::move(inst));
            return;
        }
        if (!block_open_) malformed("an instruction stands outside a block");
        const bool ends = inst.is_terminator();
        module_.functions.back().blocks.back().insts.push_back(std::move(inst));
        if (ends) {
            block_open_ = false;
            line_ = {};  // SPIR-V 3.52.2: a line ends with its block
        }
    }

    uint32_t file_index(const std::string& name) {
        const auto found = file_indices_.find(name);
        if (found != file_indices_.end()) return found->second;
        module_.files.push_back(name);
        return file_indices_[name] = static_cast<uint32_t>(module_.files.size() - 1);
    }

    void expand_decoration_groups() {
        if (groups_.empty()) return;
        std::vector<Inst> kept;
        std::multimap<Id, Inst> by_group;
        // Groups multiply: uses times decorations. No real module comes near this.
        constexpr size_t kMaxDecorations = 1000000;
        auto keep = [&](Inst copy) {
            if (kept.size() >= kMaxDecorations) malformed("decoration groups expand to over a million decorations");
            kept.push_back(std::move(copy));
        };
        for (Inst& inst : module_.decorations) {
            if (inst.op == Op::OpDecorate && groups_.count(inst.ops[0]))
                by_group.emplace(inst.ops[0], std::move(inst));
            else
                kept.push_back(std::move(inst));
        }
        for (const Inst& use : group_uses_) {
            const auto range = by_group.equal_range(use.ops[0]);
            for (auto it = range.first; it != range.second; ++it) {
                if (use.op == Op::OpGroupDecorate) {
                    for (size_t i = 1; i < use.ops.size(); ++i) {
                        Inst copy = it->second;
                        copy.ops[0] = use.ops[i];
                        keep(std::move(copy));
                    }
                } else {
                    for (size_t i = 1; i + 1 < use.ops.size(); i += 2) {
                        Inst copy = it->second;
                        copy.op = Op::OpMemberDecorate;
                        copy.ops[0] = use.ops[i];
                        copy.ops.insert(copy.ops.begin() + 1, use.ops[i + 1]);
                        keep(std::move(copy));
                    }
                }
            }
        }
        module_.decorations = std::move(kept);
    }

    const std::vector<uint32_t>& input_;
    std::vector<uint32_t> words_;
    std::string file_;
    Module module_;
    SourceLine line_;
    bool in_function_ = false;
    bool block_open_ = false;
    bool saw_memory_model_ = false;
    std::vector<bool> defined_;
    std::set<Id> sparse_defined_;
    std::set<Id> wide_values_;  // results of 64-bit integer type
    std::set<Id> wide_ints_;
    std::set<Id> dropped_sets_;
    std::set<Id> groups_;
    std::vector<Inst> group_uses_;
    std::unordered_map<Id, std::string> strings_;
    std::map<std::string, uint32_t> file_indices_;
};

}  // namespace

Module read_module(const std::vector<uint32_t>& words, const std::string& file) { return Reader(words, file).read(); }

}  // namespace rtc::ir
