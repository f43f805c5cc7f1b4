// The rules of check.h, per stage and across the pipeline.
#include "check/check.h"

#include <algorithm>
#include <map>

namespace rtc::check {
namespace {

using ir::Block;
using ir::Function;
using ir::Id;
using ir::Inst;
using ir::Op;
using ir::Program;
using lower::Stage;

class Checker {
  public:
    Checker(const Program& program, const Stage& stage, const PipelineInput& input, std::vector<Diagnostic>& warnings)
        : p_(program), stage_(stage), input_(input), warnings_(warnings) {}

    void run() {
        for (Id id : stage_.variables) check_storage(id);
        check_function(stage_.body);
        for (const Function& function : stage_.functions) check_function(function);
    }

  private:
    // Storage classes by stage: Vulkan "Shader Interfaces", SPV_KHR_ray_tracing.
    void check_storage(Id id) {
        const auto storage = static_cast<spv::StorageClass>(p_.def(id)->ops[0]);
        auto need = [&](std::initializer_list<StageKind> kinds, const char* what) {
            if (std::find(kinds.begin(), kinds.end(), stage_.kind) == kinds.end())
                stage_.fail("storage-stage", {},
                            std::string(what) + " '" + p_.module.name_of(id) + "' is not allowed in a " +
                                stage_kind_name(stage_.kind) + " shader",
                            p_);
        };
        using K = StageKind;
        switch (storage) {
            case spv::StorageClass::RayPayloadKHR:
                return need({K::RayGen, K::ClosestHit, K::Miss, K::AnyHit}, "ray payload");
            case spv::StorageClass::IncomingRayPayloadKHR:
                return need({K::AnyHit, K::ClosestHit, K::Miss}, "incoming ray payload");
            case spv::StorageClass::HitAttributeKHR:
                return need({K::AnyHit, K::ClosestHit, K::Intersection}, "hit attribute");
            case spv::StorageClass::CallableDataKHR:
                return need({K::RayGen, K::ClosestHit, K::Miss, K::Callable}, "callable data");
            case spv::StorageClass::IncomingCallableDataKHR: return need({K::Callable}, "incoming callable data");
            default: return;
        }
    }

    void check_function(const Function& function) {
        types_.clear();
        for (const Inst& param : function.params) types_[param.result] = param.type;
        for (const Block& block : function.blocks)
            for (const Inst& inst : block.insts)
                if (inst.result) types_[inst.result] = inst.type;
        for (const Block& block : function.blocks)
            for (const Inst& inst : block.insts) check_inst(inst);
    }

    Id type_of(Id id) const {
        const auto found = types_.find(id);
        if (found != types_.end()) return found->second;
        const Inst* global = p_.def(id);
        return global ? global->type : 0;
    }

    void need_stage(const Inst& inst, std::initializer_list<StageKind> kinds, const char* what) {
        if (std::find(kinds.begin(), kinds.end(), stage_.kind) == kinds.end())
            stage_.fail("call-stage", inst.source,
                        std::string(what) + " is not allowed in a " + stage_kind_name(stage_.kind) + " shader", p_);
    }

    void need_type(const Inst& inst, size_t operand, char kind, const char* what) {
        const Inst* type = p_.def(type_of(inst.ops[operand]));
        bool good = false;
        switch (kind) {
            case 'u': good = type && type->op == Op::OpTypeInt && type->ops[0] == 32; break;
            case 'f': good = type && type->op == Op::OpTypeFloat && type->ops[0] == 32; break;
            case 'v':
                good = type && type->op == Op::OpTypeVector && type->ops[1] == 3 &&
                       p_.type_op(type->ops[0]) == Op::OpTypeFloat;
                break;
            case 'a': good = type && type->op == Op::OpTypeAccelerationStructureKHR; break;
            case 'p': good = type && type->op == Op::OpTypePointer; break;
            default: break;
        }
        if (!good)
            stage_.fail("call-operand", inst.source,
                        std::string(ir::op_info(inst.op)->name) + ": operand " + std::to_string(operand + 1) +
                            " must be " + what,
                        p_);
    }

    void warn(const char* id, const Inst& inst, const std::string& text) {
        Diagnostic d;
        d.severity = Severity::Warning;
        d.id = id;
        d.file = inst.source.file ? p_.module.files[inst.source.file] : stage_.file;
        d.line = inst.source.line;
        d.text = text;
        warnings_.push_back(std::move(d));
    }

    void check_inst(const Inst& inst) {
        using K = StageKind;
        switch (inst.op) {
            case Op::OpTraceRayKHR:
                need_stage(inst, {K::RayGen, K::ClosestHit, K::Miss}, "tracing a ray");
                need_type(inst, 0, 'a', "an acceleration structure");
                for (size_t i = 1; i <= 5; ++i) need_type(inst, i, 'u', "a 32-bit integer");
                need_type(inst, 6, 'v', "a vector of three 32-bit floats");
                need_type(inst, 7, 'f', "a 32-bit float");
                need_type(inst, 8, 'v', "a vector of three 32-bit floats");
                need_type(inst, 9, 'f', "a 32-bit float");
                need_type(inst, 10, 'p', "a payload variable");
                check_trace_constants(inst);
                return;
            case Op::OpExecuteCallableKHR:
                need_stage(inst, {K::RayGen, K::ClosestHit, K::Miss, K::Callable}, "executing a callable");
                need_type(inst, 0, 'u', "a 32-bit integer");
                need_type(inst, 1, 'p', "a callable data variable");
                return;
            case Op::OpReportIntersectionKHR:
                need_stage(inst, {K::Intersection}, "reporting an intersection");
                need_type(inst, 0, 'f', "a 32-bit float");
                need_type(inst, 1, 'u', "a 32-bit integer");
                return;
            case Op::OpIgnoreIntersectionKHR: need_stage(inst, {K::AnyHit}, "ignoring an intersection"); return;
            case Op::OpTerminateRayKHR: need_stage(inst, {K::AnyHit}, "terminating a ray"); return;
            case Op::OpVariable:
                if (p_.type_op(p_.pointee(inst.type)) != Op::OpTypeRayQueryKHR) return;
                [[fallthrough]];
            case Op::OpRayQueryInitializeKHR:
                stage_.fail("ray-query-unsupported", inst.source, "ray queries are not supported yet", p_);
            case Op::OpControlBarrier:
                stage_.fail("barrier", inst.source, "ray tracing shaders cannot use execution barriers", p_);
            case Op::OpKill:
            case Op::OpTerminateInvocation:
                stage_.fail("kill", inst.source, "discard is not allowed in ray tracing shaders", p_);
            default: return;
        }
    }

    void check_trace_constants(const Inst& inst) {
        uint64_t value = 0;
        if (p_.constant_value(inst.ops[2], value) && (value & 0xff) == 0)
            warn("cull-mask-zero", inst, "the cull mask is 0: this trace can hit nothing; 0xff hits every instance");
        if (p_.constant_value(inst.ops[1], value)) {
            const auto several = [&](uint64_t mask) { return (value & mask & ((value & mask) - 1)) != 0; };
            // Vulkan environment for SPIR-V, VUID 06892, 06893, 06552.
            if (several(1 | 2 | 64 | 128))
                warn("ray-flags-contradict", inst,
                     "at most one of the ray flags Opaque, NoOpaque, CullOpaque and CullNoOpaque may be set");
            if (several(16 | 32 | 256))
                warn("ray-flags-contradict", inst,
                     "at most one of the ray flags CullBackFacingTriangles, CullFrontFacingTriangles and "
                     "SkipTriangles may be set");
            if (several(256 | 512))
                warn("ray-flags-contradict", inst, "the ray flags SkipTriangles and SkipAABBs together hit nothing");
        }
        if (input_.groups.empty()) return;
        // An index counts within its kind of group or, in tables that hold all groups, among all of them.
        auto out_of_range = [&](uint64_t index, bool hit) {
            size_t of_kind = 0;
            for (const GroupInput& group : input_.groups) of_kind += is_kind(group, hit);
            return index >= of_kind && (index >= input_.groups.size() || !is_kind(input_.groups[index], hit));
        };
        if (p_.constant_value(inst.ops[5], value) && out_of_range(value & 0xffff, false))
            warn("miss-index-range", inst,
                 "miss index " + std::to_string(value & 0xffff) + " is outside the miss shaders of this pipeline");
        if (p_.constant_value(inst.ops[3], value) && (value & 0xf) && out_of_range(value & 0xf, true))
            warn("sbt-offset-range", inst,
                 "SBT offset " + std::to_string(value & 0xf) + " is outside the hit groups of this pipeline");
    }

    bool is_kind(const GroupInput& group, bool hit) const {
        if (group.kind != GroupKind::General) return hit;
        return !hit && group.general >= 0 && group.general < static_cast<int>(input_.stages.size()) &&
               input_.stages[group.general].kind == StageKind::Miss;
    }

    const Program& p_;
    const Stage& stage_;
    const PipelineInput& input_;
    std::vector<Diagnostic>& warnings_;
    std::map<Id, Id> types_;
};

// Scalars of a type as text, so that prefixes can be compared.
std::vector<std::pair<Op, uint32_t>> scalars(const Program& p, Id type) {
    std::vector<ir::Leaf> leaves;
    p.flatten(type, leaves, "a payload");
    std::vector<std::pair<Op, uint32_t>> out;
    for (const ir::Leaf& leaf : leaves) out.push_back({p.type_op(leaf.type), leaf.words});
    return out;
}

void match(const Program& p, const std::vector<std::pair<std::string, Id>>& outgoing,
           const std::vector<std::pair<std::string, Id>>& incoming, const char* what, std::vector<Diagnostic>& warnings) {
    if (outgoing.empty()) return;
    for (const auto& [stage, type] : incoming) {
        const auto in = scalars(p, type);
        bool exact = false, prefix = false;
        for (const auto& [caller, out_type] : outgoing) {
            const auto out = scalars(p, out_type);
            const size_t common = std::min(in.size(), out.size());
            const bool same = std::equal(in.begin(), in.begin() + common, out.begin());
            exact |= same && in.size() == out.size();
            prefix |= same;
        }
        if (exact) continue;
        Diagnostic d;
        d.severity = Severity::Warning;
        d.id = "payload-mismatch";
        d.text = "the incoming " + std::string(what) + " of stage '" + stage + "' has the type of no " + what +
                 " passed in this pipeline; " +
                 (prefix ? "the common first members are matched" : "its words are reinterpreted");
        warnings.push_back(std::move(d));
    }
}

}  // namespace

void check_stage(const ir::Program& program, const lower::Stage& stage, const PipelineInput& input,
                 std::vector<Diagnostic>& warnings) {
    Checker(program, stage, input, warnings).run();
}

void collect_data_types(const ir::Program& program, const lower::Stage& stage, DataTypes& types) {
    for (Id id : stage.variables) {
        const Inst* variable = program.def(id);
        const Id type = program.pointee(variable->type);
        switch (static_cast<spv::StorageClass>(variable->ops[0])) {
            case spv::StorageClass::RayPayloadKHR: types.outgoing.push_back({stage.name, type}); break;
            case spv::StorageClass::IncomingRayPayloadKHR: types.incoming.push_back({stage.name, type}); break;
            case spv::StorageClass::CallableDataKHR: types.callable_outgoing.push_back({stage.name, type}); break;
            case spv::StorageClass::IncomingCallableDataKHR:
                types.callable_incoming.push_back({stage.name, type});
                break;
            default: break;
        }
    }
}

void check_data_types(const ir::Program& program, const DataTypes& types, std::vector<Diagnostic>& warnings) {
    match(program, types.outgoing, types.incoming, "payload", warnings);
    match(program, types.callable_outgoing, types.callable_incoming, "callable data", warnings);
}

}  // namespace rtc::check
