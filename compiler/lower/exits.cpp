// Brings NV's instructions into KHR's shape, so that later passes know one form.
//
// OpIgnoreIntersectionNV and OpTerminateRayNV are ordinary instructions to SPIR-V,
// and glslang goes on emitting code after them, but the shader ends there
// (GLSL_NV_ray_tracing 8.19). They become KHR's terminators; what followed them in
// the block is dropped.
//
// Scope ShaderCallKHR is the set of calls one invocation makes. All of them run in one compute invocation, so
// barriers of that scope are none, and atomics and accesses take the workgroup's scope, which holds it.
//
// OpTraceNV and OpExecuteCallableNV name their data by a constant location. The
// location is resolved within the calling stage only: the callee's own location
// means nothing (real shaders get it wrong and drivers do not look).
#include "lower/stage.h"

namespace rtc::lower {
namespace {

Id variable_at_location(const Program& program, const Stage& stage, const Inst& call, uint32_t operand,
                        spv::StorageClass outgoing, spv::StorageClass incoming, const char* what) {
    uint64_t location = 0;
    if (!program.constant_value(call.ops[operand], location))
        stage.fail("trace-location-not-constant", call.source,
                   std::string("the ") + what + " location of a call must be a 32-bit integer constant", program);
    for (Id id : stage.variables) {
        const Inst* variable = program.def(id);
        const auto storage = static_cast<spv::StorageClass>(variable->ops[0]);
        if (storage != outgoing && storage != incoming) continue;
        uint32_t at = 0;
        const bool decorated = program.decoration(id, spv::Decoration::Location, &at);
        if (decorated ? at == location : location == 0) return id;
    }
    stage.fail("trace-location-unknown", call.source,
               "no " + std::string(what) + " variable of this stage has location " + std::to_string(location) +
                   "; declare one with layout(location = " + std::to_string(location) + ")",
               program);
}

bool is_shader_call(const Program& program, Id scope) {
    uint64_t value = 0;
    return program.constant_value(scope, value) && value == static_cast<uint64_t>(spv::Scope::ShaderCallKHR);
}

void normalize_scopes(Program& program, Function& function) {
    const Id workgroup = program.constant_u32(static_cast<uint32_t>(spv::Scope::Workgroup));
    auto widen = [&](Id& scope) {
        if (is_shader_call(program, scope)) scope = workgroup;
    };
    // Memory operands from `at` on: a mask, then an alignment and scopes for the bits that have one.
    auto memory = [&](ir::Words& ops, size_t at) {
        if (at >= ops.size()) return;
        const uint32_t mask = ops[at++];
        if (mask & 0x2) ++at;
        for (uint32_t bit : {0x8u, 0x10u})
            if ((mask & bit) && at < ops.size()) widen(ops[at++]);
    };
    for (Block& block : function.blocks) {
        std::erase_if(block.insts, [&](const Inst& inst) {
            return inst.op == Op::OpMemoryBarrier && is_shader_call(program, inst.ops[0]);
        });
        for (Inst& inst : block.insts) {
            const auto op = static_cast<uint32_t>(inst.op);
            if (op >= static_cast<uint32_t>(Op::OpAtomicLoad) && op <= static_cast<uint32_t>(Op::OpAtomicXor))
                widen(inst.ops[1]);
            else if (inst.op == Op::OpLoad)
                memory(inst.ops, 1);
            else if (inst.op == Op::OpStore || inst.op == Op::OpCopyMemory)
                memory(inst.ops, 2);
            else if (inst.op == Op::OpImageRead || inst.op == Op::OpImageWrite)
                for (size_t i = inst.op == Op::OpImageRead ? 3 : 4; i < inst.ops.size(); ++i) widen(inst.ops[i]);
        }
    }
}

void normalize_function(Program& program, Stage& stage, Function& function) {
    for (Block& block : function.blocks) {
        for (size_t i = 0; i < block.insts.size(); ++i) {
            Inst& inst = block.insts[i];
            switch (inst.op) {
                case Op::OpIgnoreIntersectionNV:
                case Op::OpTerminateRayNV: {
                    const std::vector<Id> successors = block.successors();
                    inst.op = inst.op == Op::OpIgnoreIntersectionNV ? Op::OpIgnoreIntersectionKHR : Op::OpTerminateRayKHR;
                    block.insts.resize(i + 1);
                    // The successors lose this predecessor.
                    for (Id successor : successors) {
                        Block* target = function.find_block(successor);
                        if (!target) continue;
                        for (Inst& phi : target->insts) {
                            if (phi.op != Op::OpPhi) break;
                            for (size_t k = 0; k + 1 < phi.ops.size();) {
                                if (phi.ops[k + 1] == block.label)
                                    phi.ops.erase(phi.ops.begin() + k, phi.ops.begin() + k + 2);
                                else
                                    k += 2;
                            }
                            if (phi.ops.empty()) {
                                phi.op = Op::OpUndef;
                                phi.ops.clear();
                            }
                        }
                    }
                    break;
                }
                case Op::OpTraceNV:
                    inst.ops[10] = variable_at_location(program, stage, inst, 10, spv::StorageClass::RayPayloadKHR,
                                                        spv::StorageClass::IncomingRayPayloadKHR, "payload");
                    inst.op = Op::OpTraceRayKHR;
                    break;
                case Op::OpExecuteCallableNV:
                    inst.ops[1] = variable_at_location(program, stage, inst, 1, spv::StorageClass::CallableDataKHR,
                                                       spv::StorageClass::IncomingCallableDataKHR, "callable data");
                    inst.op = Op::OpExecuteCallableKHR;
                    break;
                case Op::OpTraceMotionNV:
                case Op::OpTraceRayMotionNV:
                    stage.fail("motion-unsupported", inst.source, "ray tracing motion blur is not supported", program);
                default: break;
            }
            if (block.insts[i].is_terminator()) break;
        }
    }
}

}  // namespace

void normalize_calls(Program& program, Stage& stage) {
    auto normalize = [&](Function& function) {
        normalize_function(program, stage, function);
        normalize_scopes(program, function);
    };
    normalize(stage.body);
    for (Function& function : stage.functions) normalize(function);
}

}  // namespace rtc::lower
