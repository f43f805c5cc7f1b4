// ir::Module to SPIR-V binary, and to text for dumps.
#include <spirv-tools/libspirv.h>

#include "ir/module.h"

namespace rtc::ir {
namespace {

// Generator magic: 0 is "unregistered"; the low half is the version of this writer.
constexpr uint32_t kGenerator = 0x00000001;

class Writer {
  public:
    Writer(const Module& module, bool debug) : module_(module), debug_(debug) {}

    std::vector<uint32_t> write() {
        Id bound = module_.bound;
        out_ = {0x07230203, module_.version, kGenerator, 0, 0};
        for (spv::Capability capability : module_.capabilities)
            emit(Inst(Op::OpCapability, 0, 0, {static_cast<uint32_t>(capability)}));
        for (const std::string& name : module_.extensions) emit(Inst(Op::OpExtension, 0, 0, string_words(name)));
        for (const Inst& inst : module_.ext_imports) emit(inst);
        emit(Inst(Op::OpMemoryModel, 0, 0,
                  {static_cast<uint32_t>(module_.addressing), static_cast<uint32_t>(module_.memory_model)}));
        for (const EntryPoint& entry : module_.entry_points) {
            Inst inst(Op::OpEntryPoint, 0, 0, {static_cast<uint32_t>(entry.model), entry.function});
            const std::vector<uint32_t> name = string_words(entry.name);
            inst.ops.insert(inst.ops.end(), name.begin(), name.end());
            inst.ops.insert(inst.ops.end(), entry.interface.begin(), entry.interface.end());
            emit(inst);
        }
        for (const Inst& inst : module_.execution_modes) emit(inst);
        std::vector<Id> file_ids(module_.files.size(), 0);
        if (debug_) {
            for (size_t i = 1; i < module_.files.size(); ++i) {
                file_ids[i] = bound++;
                emit(Inst(Op::OpString, 0, file_ids[i], string_words(module_.files[i])));
            }
        }
        for (const std::string& text : module_.strings) emit(Inst(Op::OpString, 0, bound++, string_words(text)));
        if (debug_)
            for (const Inst& inst : module_.names) emit(inst);
        for (const Inst& inst : module_.decorations) emit(inst);
        for (const Inst& inst : module_.globals) emit(inst);
        for (const Function& function : module_.functions) {
            emit(function.def);
            for (const Inst& inst : function.params) emit(inst);
            for (const Block& block : function.blocks) {
                emit(Inst(Op::OpLabel, 0, block.label, {}));
                SourceLine current;
                for (const Inst& inst : block.insts) {
                    // OpLine must not stand between a merge instruction and its terminator.
                    const bool after_merge = &inst != block.insts.data() && (&inst - 1)->is_merge();
                    if (debug_ && !(inst.source == current) && !after_merge && inst.op != Op::OpVariable &&
                        inst.op != Op::OpPhi) {
                        if (inst.source.file)
                            emit(Inst(Op::OpLine, 0, 0, {file_ids[inst.source.file], inst.source.line, 0}));
                        else
                            emit(Inst(Op::OpNoLine, 0, 0, {}));
                        current = inst.source;
                    }
                    emit(inst);
                }
            }
            emit(Inst(Op::OpFunctionEnd, 0, 0, {}));
        }
        out_[3] = bound;
        return std::move(out_);
    }

  private:
    void emit(const Inst& inst) {
        const uint32_t count = 1 + (inst.type ? 1 : 0) + (inst.result ? 1 : 0) + static_cast<uint32_t>(inst.ops.size());
        if (count > 0xffff)
            fail("instruction-too-long", "", 0, std::string(op_info(inst.op)->name) + " needs more than 65535 words");
        out_.push_back(count << 16 | static_cast<uint32_t>(inst.op));
        if (inst.type) out_.push_back(inst.type);
        if (inst.result) out_.push_back(inst.result);
        out_.insert(out_.end(), inst.ops.begin(), inst.ops.end());
    }

    const Module& module_;
    bool debug_;
    std::vector<uint32_t> out_;
};

}  // namespace

std::vector<uint32_t> write_module(const Module& module, bool with_debug_info) {
    return Writer(module, with_debug_info).write();
}

std::string to_text(const std::vector<uint32_t>& words) {
    spv_context context = spvContextCreate(SPV_ENV_UNIVERSAL_1_6);
    spv_text text = nullptr;
    spv_diagnostic diagnostic = nullptr;
    std::string out;
    const spv_result_t result =
        spvBinaryToText(context, words.data(), words.size(),
                        SPV_BINARY_TO_TEXT_OPTION_NO_HEADER | SPV_BINARY_TO_TEXT_OPTION_INDENT |
                            SPV_BINARY_TO_TEXT_OPTION_FRIENDLY_NAMES,
                        &text, &diagnostic);
    if (result == SPV_SUCCESS)
        out.assign(text->str, text->length);
    else
        out = diagnostic ? std::string("; cannot disassemble: ") + diagnostic->error + "\n" : "; cannot disassemble\n";
    spvTextDestroy(text);
    spvDiagnosticDestroy(diagnostic);
    spvContextDestroy(context);
    return out;
}

}  // namespace rtc::ir
