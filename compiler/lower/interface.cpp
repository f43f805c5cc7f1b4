// Gives every interface variable of a ray tracing stage its place in a compute shader.
//
//   acceleration structure   -> storage buffer onto the AS header, at the same set and binding;
//                               the value of an AS is its root word
//   payload, attribute, data -> Private variable of this stage, copied from and to shared words
//   built-ins                -> the launch's: the traversal's own variables;
//                               the others: Private variables set when the stage is entered, so that a
//                               nested trace cannot change them (Vulkan "Shader Interfaces"; the
//                               intersection stage's RayTmax is read live, as it must be)
#include <set>

#include "continuation/machine.h"
#include "lower/stage.h"
#include "rtc/abi.h"

namespace rtc::lower {
namespace {

using continuation::Machine;
using spv::BuiltIn;
using spv::StorageClass;

class Interface {
  public:
    Interface(Program& program, Stage& stage, Machine& machine)
        : p_(program), stage_(stage), m_(machine), e_(program, stage.prologue) {}

    void run() {
        lower_record_base();
        for (Id id : std::vector<Id>(stage_.variables)) {
            const Inst variable = *p_.def(id);
            switch (static_cast<StorageClass>(variable.ops[0])) {
                case StorageClass::UniformConstant: lower_acceleration_structure(id, variable); break;
                case StorageClass::Input: lower_builtin(id, variable); break;
                case StorageClass::RayPayloadKHR:
                case StorageClass::CallableDataKHR: to_private(id, nullptr); break;
                case StorageClass::IncomingRayPayloadKHR:
                case StorageClass::IncomingCallableDataKHR: to_private(id, &stage_.incoming); break;
                case StorageClass::HitAttributeKHR: to_private(id, &stage_.attribute); break;
                case StorageClass::Private: lower_private(id); break;
                case StorageClass::Workgroup:
                    stage_.fail("shared-memory", {}, "ray tracing shaders cannot use shared memory", p_);
                default: break;
            }
        }
        rewrite_types();
        load_incoming();
    }

  private:
    void for_each_function(const std::function<void(Function&)>& fn) {
        fn(stage_.body);
        for (Function& function : stage_.functions) fn(function);
    }

    void replace_id(Id from, Id to) {
        for_each_function([&](Function& function) {
            for (Block& block : function.blocks)
                for (Inst& inst : block.insts) inst.for_each_id([&](Id& id) { id = id == from ? to : id; });
        });
        for (Id& id : stage_.variables)
            if (id == from) id = to;
    }

    // The stage reads its record relative to where the caller found it.
    void lower_record_base() {
        for (Id id : stage_.variables) {
            if (static_cast<StorageClass>(p_.def(id)->ops[0]) != StorageClass::ShaderRecordBufferKHR) continue;
            stage_.record_base = p_.add_variable(StorageClass::Private, p_.uint_type(), stage_.name + ".record");
            e_.store(stage_.record_base, e_.load(p_.uint_type(), m_.record));
            return;
        }
    }

    void to_private(Id id, Id* role) {
        if (role) {
            if (*role)
                stage_.fail("several-incoming", {},
                            "a stage may use only one incoming payload, callable data or hit attribute variable", p_);
            *role = id;
        }
        p_.remove_decorations(id, spv::Decoration::Location);
        set_storage(id, StorageClass::Private);
    }

    void set_storage(Id id, StorageClass storage) {
        Inst& variable = const_cast<Inst&>(*p_.def(id));
        const Id pointee = p_.pointee(variable.type);
        const Id type = p_.pointer_type(storage, pointee);
        Inst& again = const_cast<Inst&>(*p_.def(id));  // pointer_type may have moved the list
        again.type = type;
        again.ops[0] = static_cast<uint32_t>(storage);
        retyped_.insert(id);
    }

    // A Private variable's initialiser belongs to each run of the shader, not to the module.
    void lower_private(Id id) {
        Inst& variable = const_cast<Inst&>(*p_.def(id));
        if (variable.ops.size() < 2) return;
        const Id initializer = variable.ops[1];
        variable.ops.resize(1);
        e_.store(id, initializer);
    }

    void lower_acceleration_structure(Id id, const Inst& variable) {
        const Id pointee = p_.pointee(variable.type);
        Id element = pointee;
        while (p_.type_op(element) == Op::OpTypeArray || p_.type_op(element) == Op::OpTypeRuntimeArray)
            element = p_.element_type(element, 0);
        if (p_.type_op(element) != Op::OpTypeAccelerationStructureKHR) return;
        uint32_t set = 0, binding = 0;
        p_.decoration(id, spv::Decoration::DescriptorSet, &set);
        p_.decoration(id, spv::Decoration::Binding, &binding);
        const Id type = map_type(p_.pointer_type(StorageClass::UniformConstant, pointee));
        Inst& again = const_cast<Inst&>(*p_.def(id));
        again.type = type;
        again.ops[0] = static_cast<uint32_t>(StorageClass::StorageBuffer);
        p_.decorate(id, spv::Decoration::NonWritable);
        retyped_.insert(id);
    }

    // struct { uint words[RTC_AS_HEADER_QUADS * 4]; } as a storage buffer block.
    Id header_type() {
        Id& type = m_.p.header_struct;
        if (type) return type;
        const Id words = p_.add_global(
            Inst(Op::OpTypeArray, 0, 0, {p_.uint_type(), p_.constant_u32(RTC_AS_HEADER_QUADS * 4)}));
        p_.decorate(words, spv::Decoration::ArrayStride, {4});
        type = p_.add_global(Inst(Op::OpTypeStruct, 0, 0, {words}));
        p_.decorate(type, spv::Decoration::Block);
        Inst offset(Op::OpMemberDecorate, 0, 0, {type, 0, static_cast<uint32_t>(spv::Decoration::Offset), 0});
        p_.module.decorations.push_back(offset);
        p_.module.set_name(type, "rtc_as_header");
        return type;
    }

    // Types after lowering: AS values are root words, pointers to AS are pointers to headers, and the
    // ray tracing storage classes are Private.
    Id map_type(Id type) {
        const auto known = type_map_.find(type);
        if (known != type_map_.end()) return known->second;
        const Inst* inst = p_.def(type);
        Id out = type;
        if (inst && inst->op == Op::OpTypeAccelerationStructureKHR) {
            out = m_.base_type();
        } else if (inst && inst->op == Op::OpTypePointer) {
            const StorageClass storage = p_.storage(type);
            const Id pointee = p_.pointee(type);
            switch (storage) {
                case StorageClass::UniformConstant: {
                    const Id header = map_as_pointee(pointee);
                    if (header) out = p_.pointer_type(StorageClass::StorageBuffer, header);
                    break;
                }
                case StorageClass::RayPayloadKHR:
                case StorageClass::IncomingRayPayloadKHR:
                case StorageClass::CallableDataKHR:
                case StorageClass::IncomingCallableDataKHR:
                case StorageClass::HitAttributeKHR: out = p_.pointer_type(StorageClass::Private, pointee); break;
                case StorageClass::Function:
                case StorageClass::Private: {
                    const Id mapped = map_type(pointee);
                    if (mapped != pointee) out = p_.pointer_type(storage, mapped);
                    break;
                }
                default: break;
            }
        } else if (inst && inst->op == Op::OpTypeFunction) {
            std::vector<Id> params;
            const Inst copy = *inst;
            for (size_t i = 1; i < copy.ops.size(); ++i) params.push_back(map_type(copy.ops[i]));
            out = p_.function_type(map_type(copy.ops[0]), params);
        }
        return type_map_[type] = out;
    }

    // AS, or arrays of AS, as headers; 0 for anything else.
    Id map_as_pointee(Id type) {
        const Inst* inst = p_.def(type);
        if (inst->op == Op::OpTypeAccelerationStructureKHR) return header_type();
        if (inst->op == Op::OpTypeArray || inst->op == Op::OpTypeRuntimeArray) {
            const Inst copy = *inst;
            const Id element = map_as_pointee(copy.ops[0]);
            if (!element) return 0;
            Id& array = m_.p.header_arrays[type];
            if (!array) {
                Inst mapped = copy;
                mapped.result = 0;
                mapped.ops[0] = element;
                array = p_.add_global(std::move(mapped));
            }
            return array;
        }
        return 0;
    }

    void rewrite_types() {
        for_each_function([&](Function& function) {
            function.def.type = map_type(function.def.type);
            function.def.ops[1] = map_type(function.def.ops[1]);
            for (Inst& param : function.params) param.type = map_type(param.type);
            std::map<Id, Id> pointer_types, value_types;  // of ids defined in this function
            for (Inst& param : function.params) pointer_types[param.result] = value_types[param.result] = param.type;
            for (Block& block : function.blocks) {
                std::vector<Inst> out;
                for (Inst& inst : block.insts) {
                    if (inst.result && inst.type) value_types[inst.result] = inst.type;
                    if (inst.op == Op::OpConvertUToAccelerationStructureKHR) {
                        if (!m_.addresses())
                            stage_.fail("as-from-address", inst.source,
                                        "an acceleration structure from a device address needs address mode: compile "
                                        "with --addressing=address (rtcc_options_set_addressing)",
                                        p_);
                        // A handle is the device address, as uint64_t or uvec2; a base is a uvec2.
                        inst.op = Op::OpBitcast;
                        const Inst* value = p_.def(inst.ops[0]);
                        const Id given = value ? value->type : value_types[inst.ops[0]];
                        if (given == m_.base_type()) inst.op = Op::OpCopyObject;
                    }
                    const bool as_load = inst.op == Op::OpLoad &&
                                         p_.type_op(inst.type) == Op::OpTypeAccelerationStructureKHR;
                    if (inst.op == Op::OpTypeRayQueryKHR) continue;
                    if (inst.type) inst.type = map_type(inst.type);
                    // Through an input variable that is Private now.
                    if ((inst.op == Op::OpAccessChain || inst.op == Op::OpInBoundsAccessChain ||
                         inst.op == Op::OpCopyObject) &&
                        p_.type_op(inst.type) == Op::OpTypePointer && p_.storage(inst.type) == StorageClass::Input &&
                        private_bases_.count(inst.ops[0])) {
                        inst.type = p_.pointer_type(StorageClass::Private, p_.pointee(inst.type));
                        private_bases_.insert(inst.result);
                    }
                    if (as_load) {
                        const Inst* base = p_.def(inst.ops[0]);
                        const Id type = base ? base->type : pointer_types[inst.ops[0]];
                        if (type && p_.storage(type) == StorageClass::StorageBuffer) {
                            ir::Emitter e(p_, out, inst.source);
                            auto self = [&](uint32_t word) {
                                return e.chain(StorageClass::StorageBuffer, p_.uint_type(), inst.ops[0],
                                               {p_.constant_u32(0), p_.constant_u32(word)});
                            };
                            const Id low = e.load(p_.uint_type(), self(RTC_HDR_SELF_LO));
                            const Id high = e.load(p_.uint_type(), self(RTC_HDR_SELF_HI));
                            inst.op = Op::OpCopyObject;
                            inst.ops = {m_.call(e, "rtc_root", {low, high})};
                        }
                    }
                    if (inst.result && p_.is_pointer(inst.type)) pointer_types[inst.result] = inst.type;
                    out.push_back(std::move(inst));
                }
                block.insts = std::move(out);
            }
        });
    }

    bool is_candidate_stage() const {
        return stage_.kind == StageKind::AnyHit || stage_.kind == StageKind::Intersection;
    }

    void lower_builtin(Id id, const Inst& variable) {
        uint32_t builtin = 0;
        if (!p_.decoration(id, spv::Decoration::BuiltIn, &builtin))
            stage_.fail("input-without-builtin", {}, "an input variable is not a built-in", p_);
        const Id type = p_.pointee(variable.type);
        const std::string hit = is_candidate_stage() ? "rtc_cand_" : "rtc_hit_";
        const auto kind = static_cast<BuiltIn>(builtin);
        const bool hit_stage = stage_.kind == StageKind::ClosestHit || is_candidate_stage();
        auto need = [&](bool allowed, const char* name) {
            if (!allowed)
                stage_.fail("builtin-stage", {},
                            std::string("built-in ") + name + " is not available in a " + stage_kind_name(stage_.kind) +
                                " shader",
                            p_);
        };
        if (kind == kHitPositions) {
            need(hit_stage && stage_.kind != StageKind::Intersection, "HitTriangleVertexPositions");
            return snapshot(id, type, [&] { return hit_positions(type, hit); });
        }
        switch (kind) {
            case BuiltIn::LaunchIdKHR: return alias(id, m_.variable("rtc_launch_id"), type);
            case BuiltIn::LaunchSizeKHR: return alias(id, m_.variable("rtc_launch_size"), type);
            case BuiltIn::RayTmaxKHR:
                need(stage_.kind != StageKind::RayGen && stage_.kind != StageKind::Callable, "RayTmax");
                if (stage_.kind == StageKind::Intersection) return alias(id, m_.variable("rtc_hit_t"), type);
                return snapshot(id, type, [&] {
                    return m_.load(e_, stage_.kind == StageKind::AnyHit       ? "rtc_cand_t"
                                       : stage_.kind == StageKind::ClosestHit ? "rtc_hit_t"
                                                                              : "rtc_ray_tmax");
                });
            case BuiltIn::HitTNV:
                need(stage_.kind == StageKind::AnyHit || stage_.kind == StageKind::ClosestHit, "HitT");
                return snapshot(id, type, [&] { return m_.load(e_, hit + "t"); });
            case BuiltIn::HitKindKHR:
                need(stage_.kind == StageKind::AnyHit || stage_.kind == StageKind::ClosestHit, "HitKind");
                return snapshot(id, type, [&] { return as(m_.load(e_, hit + "kind"), type); });
            case BuiltIn::PrimitiveId:
                need(hit_stage, "PrimitiveId");
                return snapshot(id, type, [&] { return as(m_.load(e_, hit + "primitive"), type); });
            case BuiltIn::InstanceId:
                need(hit_stage, "InstanceId");
                return snapshot(id, type, [&] { return as(m_.load(e_, hit + "instance"), type); });
            case BuiltIn::RayGeometryIndexKHR:
                need(hit_stage, "RayGeometryIndex");
                return snapshot(id, type, [&] { return as(m_.load(e_, hit + "geometry"), type); });
            case BuiltIn::InstanceCustomIndexKHR:
                need(hit_stage, "InstanceCustomIndex");
                return snapshot(id, type, [&] {
                    return as(m_.call(e_, "rtc_instance_custom_index", instance_arguments(hit)), type);
                });
            case BuiltIn::ObjectToWorldKHR:
                need(hit_stage, "ObjectToWorld");
                return snapshot(id, type, [&] { return m_.call(e_, "rtc_object_to_world", instance_arguments(hit)); });
            case BuiltIn::WorldToObjectKHR:
                need(hit_stage, "WorldToObject");
                return snapshot(id, type, [&] { return m_.call(e_, "rtc_world_to_object", instance_arguments(hit)); });
            case BuiltIn::WorldRayOriginKHR:
            case BuiltIn::WorldRayDirectionKHR:
                need(hit_stage || stage_.kind == StageKind::Miss, "WorldRayOrigin/Direction");
                return snapshot(id, type, [&] {
                    return m_.load(e_, kind == BuiltIn::WorldRayOriginKHR ? "rtc_ray_origin" : "rtc_ray_direction");
                });
            case BuiltIn::ObjectRayOriginKHR:
            case BuiltIn::ObjectRayDirectionKHR: {
                // Meaningless in a miss shader (GLSL_NV_ray_tracing issue 8), where the world ray is given.
                const bool origin = kind == BuiltIn::ObjectRayOriginKHR;
                need(hit_stage || stage_.kind == StageKind::Miss, "ObjectRayOrigin/Direction");
                return snapshot(id, type, [&] {
                    const Id world = m_.load(e_, origin ? "rtc_ray_origin" : "rtc_ray_direction");
                    if (stage_.kind == StageKind::Miss) return world;
                    std::vector<Id> arguments = instance_arguments(hit);
                    arguments.push_back(world);
                    return m_.call(e_, origin ? "rtc_object_ray_origin" : "rtc_object_ray_direction", arguments);
                });
            }
            case BuiltIn::RayTminKHR:
                need(hit_stage || stage_.kind == StageKind::Miss, "RayTmin");
                return snapshot(id, type, [&] { return m_.load(e_, "rtc_ray_tmin"); });
            case BuiltIn::IncomingRayFlagsKHR:
                need(hit_stage || stage_.kind == StageKind::Miss, "IncomingRayFlags");
                return snapshot(id, type, [&] { return as(m_.load(e_, "rtc_ray_flags"), type); });
            case BuiltIn::CullMaskKHR:
                need(hit_stage || stage_.kind == StageKind::Miss, "CullMask");
                return snapshot(id, type, [&] { return as(m_.load(e_, "rtc_ray_mask"), type); });
            case BuiltIn::SubgroupSize:
            case BuiltIn::SubgroupLocalInvocationId:
            case BuiltIn::SubgroupEqMask:
            case BuiltIn::SubgroupGeMask:
            case BuiltIn::SubgroupGtMask:
            case BuiltIn::SubgroupLeMask:
            case BuiltIn::SubgroupLtMask:
            case BuiltIn::DeviceIndex: return;  // compute shaders have these
            default:
                stage_.fail("builtin-unsupported", {},
                            "built-in " + std::to_string(builtin) + " is not available to ray tracing shaders here", p_);
        }
    }

    std::vector<Id> instance_arguments(const std::string& hit) {
        return {m_.load(e_, "rtc_ray_root"), m_.load(e_, hit + "instance")};
    }

    // SPV_KHR_ray_tracing_position_fetch: the vertices as they lie in the structure, after the geometry's transform.
    Id hit_positions(Id type, const std::string& hit) {
        const Id vertex = p_.vector_type(p_.float_type(32), 3);
        uint64_t count = 0;
        if (p_.type_op(type) != Op::OpTypeArray || !p_.constant_value(p_.def(type)->ops[1], count) || count != 3 ||
            p_.element_type(type, 0) != vertex)
            stage_.fail("position-fetch", {},
                        "HitTriangleVertexPositionsKHR must be an array of three vectors of three 32-bit floats", p_);
        std::vector<Id> arguments = instance_arguments(hit);
        arguments.push_back(m_.load(e_, hit + "slot"));
        const Id columns = m_.call(e_, "rtc_hit_positions", arguments);
        std::vector<Id> vertices;
        for (uint32_t i = 0; i < 3; ++i) vertices.push_back(e_.extract(vertex, columns, {i}));
        return e_.construct(type, vertices);
    }

    Id as(Id value, Id type) { return e_.from_uint(value, type); }

    // The variable's uses become uses of a Private variable set on entry.
    void snapshot(Id id, Id type, const std::function<Id()>& value) {
        const Id variable = p_.add_variable(StorageClass::Private, type, p_.name_of(id));
        e_.store(variable, value());
        replace_id(id, variable);
        private_bases_.insert(variable);
    }

    void alias(Id id, Id variable, Id type) {
        if (p_.pointee(p_.def(variable)->type) != type) {
            // Another front end's choice of signedness.
            return snapshot(id, type, [&] {
                return e_.value(Op::OpBitcast, type, {e_.load(p_.pointee(p_.def(variable)->type), variable)});
            });
        }
        replace_id(id, variable);
        std::erase(stage_.variables, variable);
        private_bases_.insert(variable);
    }

    // Payload, callable data and attributes arrive in shared words.
    void load_incoming() {
        if (stage_.incoming) {
            const bool callable = stage_.kind == StageKind::Callable;
            copy_in(stage_.incoming, [&](uint32_t i) {
                return e_.load(p_.uint_type(), callable ? m_.callable_word(i) : m_.payload_word(i));
            });
        }
        if (stage_.attribute && stage_.kind != StageKind::Intersection) {
            const std::string base = stage_.kind == StageKind::AnyHit ? "rtc_cand_attr" : "rtc_hit_attr";
            const uint32_t words = p_.word_count(p_.pointee(p_.def(stage_.attribute)->type), "a hit attribute");
            if (words > 8)
                stage_.fail("attribute-too-large", {},
                            "a hit attribute of " + std::to_string(words * 4) + " bytes; at most 32 are supported", p_);
            copy_in(stage_.attribute, [&](uint32_t i) { return m_.load(e_, base + std::to_string(i)); });
        }
    }

    void copy_in(Id variable, const std::function<Id(uint32_t)>& word) {
        const Id type = p_.pointee(p_.def(variable)->type);
        const uint32_t count = p_.word_count(type, "the incoming data of stage '" + stage_.name + "'");
        std::vector<Id> words;
        for (uint32_t i = 0; i < count; ++i) words.push_back(word(i));
        size_t at = 0;
        e_.store(variable, e_.from_words(type, words, at));
    }

    Program& p_;
    Stage& stage_;
    Machine& m_;
    ir::Emitter e_;
    std::map<Id, Id> type_map_;
    std::set<Id> retyped_;
    std::set<Id> private_bases_;
};

}  // namespace

bool decorates_positions(const Inst& inst) {
    return inst.op == Op::OpDecorate && inst.ops.size() > 2 &&
           inst.ops[1] == static_cast<uint32_t>(spv::Decoration::BuiltIn) &&
           inst.ops[2] == static_cast<uint32_t>(kHitPositions);
}

bool fetches_positions(const ir::Module& module) { return module.has_capability(kPositionFetch); }

void lower_interface(Program& program, Stage& stage, continuation::Machine& machine) {
    Interface(program, stage, machine).run();
}

}  // namespace rtc::lower
