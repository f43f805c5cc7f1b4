// Specialisation constants of a stage instance: baked in, or renumbered for the pipeline.
#include <set>

#include "link/link.h"

namespace rtc::link {
namespace {

std::string scalar_name(const ir::Module& module, Id type) {
    for (const Inst& inst : module.globals) {
        if (inst.result != type) continue;
        if (inst.op == Op::OpTypeBool) return "bool";
        if (inst.op == Op::OpTypeInt) return (inst.ops[1] ? "int" : "uint") + std::to_string(inst.ops[0]);
        if (inst.op == Op::OpTypeFloat) return "float" + std::to_string(inst.ops[0]);
    }
    return "unknown";
}

}  // namespace

void specialize(ir::Module& module, const StageInput& stage, std::map<uint32_t, uint32_t>& used,
                std::vector<SpecConstantReport>& report) {
    std::map<uint32_t, uint64_t> given;
    for (const SpecValue& value : stage.specialization) given[value.id] = value.value;
    // Which variable a call passes is decided here and now: an open constant that says so keeps its default.
    std::set<Id> locations;
    for (const ir::Function& function : module.functions)
        for (const ir::Block& block : function.blocks)
            for (const Inst& inst : block.insts) {
                if (inst.op == Op::OpTraceNV) locations.insert(inst.ops[10]);
                if (inst.op == Op::OpExecuteCallableNV) locations.insert(inst.ops[1]);
            }
    std::map<Id, uint32_t> spec_ids;
    std::map<uint32_t, bool> met;
    for (const Inst& inst : module.decorations)
        if (inst.op == Op::OpDecorate && inst.ops[1] == static_cast<uint32_t>(spv::Decoration::SpecId)) {
            spec_ids[inst.ops[0]] = inst.ops[2];
            met[inst.ops[2]] = true;
        }
    for (const auto& [id, value] : given)
        if (!met.count(id))
            ir::fail("spec-unknown", stage.file, 0,
                     "stage '" + stage.name + "' has no specialisation constant with id " + std::to_string(id));

    std::map<Id, uint32_t> renamed;
    for (Inst& inst : module.globals) {
        const auto found = spec_ids.find(inst.result);
        if (found == spec_ids.end()) continue;
        const bool is_bool = inst.op == Op::OpSpecConstantTrue || inst.op == Op::OpSpecConstantFalse;
        if (!is_bool && inst.op != Op::OpSpecConstant) continue;
        const auto value = given.find(found->second);
        if (value != given.end()) {
            if (is_bool) {
                inst.op = value->second ? Op::OpConstantTrue : Op::OpConstantFalse;
            } else {
                inst.op = Op::OpConstant;
                inst.ops[0] = static_cast<uint32_t>(value->second);
                if (inst.ops.size() > 1) inst.ops[1] = static_cast<uint32_t>(value->second >> 32);
            }
            continue;
        }
        if (locations.count(inst.result)) {
            inst.op = Op::OpConstant;
            continue;
        }
        uint32_t id = found->second;
        while (used.count(id)) id = id < 1000 ? 1000 : id + 1;
        used[id] = 1;
        renamed[inst.result] = id;
        SpecConstantReport entry;
        entry.stage = stage.name;
        entry.name = module.name_of(inst.result);
        entry.original_id = found->second;
        entry.id = id;
        entry.type = scalar_name(module, inst.type);
        entry.default_value = is_bool ? (inst.op == Op::OpSpecConstantTrue) : inst.ops[0];
        if (!is_bool && inst.ops.size() > 1) entry.default_value |= static_cast<uint64_t>(inst.ops[1]) << 32;
        report.push_back(std::move(entry));
    }
    std::erase_if(module.decorations, [&](Inst& inst) {
        if (inst.op != Op::OpDecorate || inst.ops[1] != static_cast<uint32_t>(spv::Decoration::SpecId)) return false;
        const auto found = renamed.find(inst.ops[0]);
        if (found == renamed.end()) return true;
        inst.ops[2] = found->second;
        return false;
    });
}

}  // namespace rtc::link
