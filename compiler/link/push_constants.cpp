// Native pipelines give every stage its own view of the push constants; one compute
// shader has one block. Equal blocks become that block. Different ones become words,
// which each stage then reads through its own offsets.
#include <algorithm>
#include <set>

#include "link/link.h"

namespace rtc::link {
namespace {

class Layout {
  public:
    explicit Layout(const ir::Module& module) {
        for (const Inst& inst : module.globals)
            if (inst.result) defs_[inst.result] = &inst;
        for (const Inst& inst : module.decorations) decorations_[inst.ops[0]].push_back(&inst);
        for (const Inst& inst : module.globals)
            if (inst.op == Op::OpVariable &&
                static_cast<spv::StorageClass>(inst.ops[0]) == spv::StorageClass::PushConstant)
                blocks.push_back(defs_[inst.type]->ops[1]);
    }

    std::vector<Id> blocks;

    // Everything that says where in the block which bits lie, and as what.
    std::string text(Id type) {
        const Inst& inst = *defs_[type];
        std::string out = std::to_string(static_cast<uint32_t>(inst.op)) + "(";
        std::vector<std::string> parts;
        for (const Inst* decoration : decorations_[type]) {
            std::string part;
            for (size_t i = 1; i < decoration->ops.size(); ++i) part += std::to_string(decoration->ops[i]) + ".";
            parts.push_back(part);
        }
        std::sort(parts.begin(), parts.end());
        for (const std::string& part : parts) out += part + ",";
        switch (inst.op) {
            case Op::OpTypeStruct:
                for (Id member : inst.ops) out += text(member) + ",";
                break;
            case Op::OpTypeArray: out += text(inst.ops[0]) + "," + std::to_string(defs_[inst.ops[1]]->ops[0]); break;
            case Op::OpTypePointer: out += "pointer"; break;  // what it points to may name the block again
            case Op::OpTypeVector:
            case Op::OpTypeMatrix: out += text(inst.ops[0]) + "," + std::to_string(inst.ops[1]); break;
            default:
                for (uint32_t word : inst.ops) out += std::to_string(word) + ",";
                break;
        }
        return out + ")";
    }

    bool has_pointer(Id type) {
        const Inst& inst = *defs_[type];
        if (inst.op == Op::OpTypePointer) return true;
        if (inst.op == Op::OpTypeArray) return has_pointer(inst.ops[0]);
        if (inst.op == Op::OpTypeStruct)
            for (Id member : inst.ops)
                if (has_pointer(member)) return true;
        return false;
    }

    uint32_t bytes(Id type) {
        const Inst& inst = *defs_[type];
        switch (inst.op) {
            case Op::OpTypeInt:
            case Op::OpTypeFloat: return inst.ops[0] / 8;
            case Op::OpTypePointer: return 8;
            case Op::OpTypeVector:
            case Op::OpTypeMatrix: return inst.ops[1] * bytes(inst.ops[0]);
            case Op::OpTypeArray: {
                uint32_t stride = 0;
                for (const Inst* d : decorations_[type])
                    if (d->op == Op::OpDecorate && d->ops[1] == static_cast<uint32_t>(spv::Decoration::ArrayStride))
                        stride = d->ops[2];
                return stride * defs_[inst.ops[1]]->ops[0];
            }
            case Op::OpTypeStruct: {
                uint32_t end = 0;
                for (uint32_t i = 0; i < inst.ops.size(); ++i) {
                    const uint32_t offset = member(type, i, spv::Decoration::Offset);
                    uint32_t size = bytes(inst.ops[i]);
                    if (const uint32_t stride = member(type, i, spv::Decoration::MatrixStride);
                        stride && defs_[inst.ops[i]]->op == Op::OpTypeMatrix) {
                        const Inst& matrix = *defs_[inst.ops[i]];
                        bool row_major = false;
                        for (const Inst* d : decorations_[type])
                            row_major |= d->op == Op::OpMemberDecorate && d->ops[1] == i &&
                                         d->ops[2] == static_cast<uint32_t>(spv::Decoration::RowMajor);
                        size = stride * (row_major ? defs_[matrix.ops[0]]->ops[1] : matrix.ops[1]);
                    }
                    end = std::max(end, offset + size);
                }
                return end;
            }
            default: return 0;
        }
    }

  private:
    uint32_t member(Id type, uint32_t index, spv::Decoration decoration) {
        for (const Inst* d : decorations_[type])
            if (d->op == Op::OpMemberDecorate && d->ops[1] == index && d->ops[2] == static_cast<uint32_t>(decoration) &&
                d->ops.size() > 3)
                return d->ops[3];
        return 0;
    }

    std::map<Id, const Inst*> defs_;
    std::map<Id, std::vector<const Inst*>> decorations_;
};

}  // namespace

void prepare_push_constants(Program& p, const std::vector<ir::Module>& modules, Reflection& reflection) {
    std::set<std::string> texts;
    bool pointers = false;
    for (const ir::Module& module : modules) {
        Layout layout(module);
        for (Id block : layout.blocks) {
            texts.insert(layout.text(block));
            pointers |= layout.has_pointer(block);
            reflection.push_constant_bytes = std::max(reflection.push_constant_bytes, layout.bytes(block));
        }
    }
    // (Blocks with buffer references are types of their own in each module, so two of them never are one.)
    size_t blocks = 0;
    for (const ir::Module& module : modules) blocks += Layout(module).blocks.size();
    if (texts.size() <= 1 && !(pointers && blocks > 1)) return;
    const Id words =
        p.add_global(Inst(Op::OpTypeArray, 0, 0, {p.uint_type(), p.constant_u32((reflection.push_constant_bytes + 3) / 4)}));
    p.decorate(words, spv::Decoration::ArrayStride, {4});
    const Id block = p.add_global(Inst(Op::OpTypeStruct, 0, 0, {words}));
    p.decorate(block, spv::Decoration::Block);
    p.member_decorate(block, 0, spv::Decoration::Offset, {0});
    p.push_words = p.add_variable(spv::StorageClass::PushConstant, block, "rtc_push_constants");
}

}  // namespace rtc::link
