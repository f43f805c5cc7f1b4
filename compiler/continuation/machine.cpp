// The machine's variables, its ties to the traversal module, and the small code
// sequences every state ends with.
#include "continuation/machine.h"

#include "rtc/abi.h"
#include "traversal/traversal_modules.h"

namespace rtc::continuation {

Machine::Machine(Program& program, const LinkOptions& link_options) : p(program), options(link_options) {
    state = u32_variable("rtc_state");
    ret = u32_variable("rtc_return");
    depth = u32_variable("rtc_depth");
    push = u32_variable("rtc_push");
    pop = u32_variable("rtc_pop");
    leave = new_variable(p.bool_type(), "rtc_leave");
    fresh = new_variable(p.bool_type(), "rtc_fresh");
    report_return = u32_variable("rtc_report_return");
    accepted = u32_variable("rtc_accepted");
    callable_depth = u32_variable("rtc_callable_depth");
    callable_ret = u32_variable("rtc_callable_return");
    record = p.add_variable(spv::StorageClass::Private, p.uint_type(), "rtc_record");
    error = p.add_variable(spv::StorageClass::Private, p.uint_type(), "rtc_pending_error");
    error_detail = p.add_variable(spv::StorageClass::Private, p.uint_type(), "rtc_pending_detail");
    dispatch = p.module.new_id();
    p.module.set_name(dispatch, "rtc_dispatch");
}

Id Machine::new_variable(Id type, const std::string& name) {
    Inst variable(Op::OpVariable, p.pointer_type(spv::StorageClass::Function, type), p.module.new_id(),
                  {static_cast<uint32_t>(spv::StorageClass::Function)});
    p.module.set_name(variable.result, name);
    variables_.push_back(variable);
    return variable.result;
}

Id Machine::word(std::vector<Id>& words, uint32_t i, const char* name) {
    while (words.size() <= i)
        words.push_back(u32_variable(std::string("rtc_") + name + std::to_string(words.size())));
    return words[i];
}

namespace {

void freeze_link_constants(ir::Module& module, const std::map<uint32_t, bool>& values) {
    std::map<Id, bool> frozen;
    std::erase_if(module.decorations, [&](const Inst& inst) {
        if (inst.op != Op::OpDecorate || inst.ops[1] != static_cast<uint32_t>(spv::Decoration::SpecId)) return false;
        const auto found = values.find(inst.ops[2]);
        if (found == values.end()) return false;
        frozen[inst.ops[0]] = found->second;
        return true;
    });
    for (Inst& inst : module.globals)
        if (const auto found = frozen.find(inst.result); found != frozen.end())
            inst.op = found->second ? Op::OpConstantTrue : Op::OpConstantFalse;
}

bool is_float_operation(Op op) {
    switch (op) {
        case Op::OpFNegate:
        case Op::OpFAdd:
        case Op::OpFSub:
        case Op::OpFMul:
        case Op::OpFDiv:
        case Op::OpFRem:
        case Op::OpFMod:
        case Op::OpVectorTimesScalar: return true;
        default: return false;
    }
}

// Operations a driver may evaluate in more than one way even when told not to contract.
bool is_banned(const Inst& inst) {
    switch (inst.op) {
        case Op::OpDot:
        case Op::OpMatrixTimesVector:
        case Op::OpVectorTimesMatrix:
        case Op::OpMatrixTimesMatrix:
        case Op::OpMatrixTimesScalar:
        case Op::OpOuterProduct: return true;
        default: return false;
    }
}

}  // namespace

void Machine::import_traversal(const ir::Module& traversal, bool with_any_hit, bool with_aabbs, bool resumable) {
    any_hit = with_any_hit;
    aabbs = with_aabbs;
    ir::Module source = traversal;
    freeze_link_constants(source, {{RTC_LINK_ANY_HIT, with_any_hit},
                                   {RTC_LINK_AABBS, with_aabbs},
                                   {RTC_LINK_TRIANGLES, true},
                                   {RTC_LINK_RESUMABLE, resumable}});
    source.entry_points.clear();
    std::unordered_map<Id, Id> map;
    traversal_functions = p.import(source, map);

    for (const Inst& inst : source.names) {
        if (inst.op != Op::OpName) continue;
        std::string name = ir::words_string(inst.ops.data() + 1, inst.ops.size() - 1);
        name = name.substr(0, name.find('('));
        const auto found = map.find(inst.ops[0]);
        if (found != map.end() && name.rfind("rtc_", 0) == 0) exports_.emplace(name, found->second);
    }
    for (const Inst& inst : p.module.globals)
        if (inst.op == Op::OpVariable) {
            uint32_t binding = 0;
            if (p.decoration(inst.result, spv::Decoration::Binding, &binding)) reserved[binding] = inst.result;
        }
    for (const auto& [binding, id] : reserved) {
        p.remove_decorations(id, spv::Decoration::Binding);
        p.remove_decorations(id, spv::Decoration::DescriptorSet);
    }

    for (Function& function : traversal_functions) {
        export_types_[std::to_string(function.id())] = function.def.type;
        for (Block& block : function.blocks)
            for (Inst& inst : block.insts) {
                if (is_banned(inst))
                    ir::fail("internal-traversal", "", 0,
                             std::string("traversal uses ") + ir::op_info(inst.op)->name +
                                 ", whose rounding is the driver's choice");
                // Numbers that hold in the source must hold in the binary.
                if (is_float_operation(inst.op) && !p.decoration(inst.result, spv::Decoration::NoContraction))
                    p.decorate(inst.result, spv::Decoration::NoContraction);
            }
    }

    // glslang passes `in` parameters through pointers to copies. The functions states call take values
    // instead, so that they can be called from anywhere without temporaries. (Others may have `out`
    // parameters and stay as they are.)
    static const char* const kCalled[] = {
        "rtc_report_begin",      "rtc_object_to_world",      "rtc_world_to_object",   "rtc_instance_custom_index",
        "rtc_object_ray_origin", "rtc_object_ray_direction", "rtc_sbt_raygen_word",   "rtc_sbt_miss_word",
        "rtc_sbt_hit_word",      "rtc_sbt_callable_word",    "rtc_miss_record",       "rtc_hit_record_base",
        "rtc_callable_record",   "rtc_error",                "rtc_scratch_load",      "rtc_scratch_store",
        "rtc_trace_save",        "rtc_trace_restore"};
    std::map<Id, std::vector<Id>> by_value;  // function -> parameter value types
    for (const char* name : kCalled) {
        const Id id = function(name);
        for (Function& function : traversal_functions) {
            if (function.id() != id || function.params.empty()) continue;
            std::vector<Id> types;
            std::vector<Inst> prologue, stores;
            for (Inst& param : function.params) {
                if (!p.is_pointer(param.type)) {
                    types.push_back(param.type);
                    continue;
                }
                const Id value_type = p.pointee(param.type);
                types.push_back(value_type);
                const Id value = p.module.new_id();
                prologue.push_back(Inst(Op::OpVariable, param.type, param.result,
                                        {static_cast<uint32_t>(spv::StorageClass::Function)}));
                stores.push_back(Inst(Op::OpStore, 0, 0, {param.result, value}));
                param.result = value;
                param.type = value_type;
            }
            std::vector<Inst>& first = function.blocks.front().insts;
            size_t at = 0;
            while (at < first.size() && first[at].op == Op::OpVariable) ++at;
            first.insert(first.begin() + at, stores.begin(), stores.end());
            first.insert(first.begin(), prologue.begin(), prologue.end());
            function.def.ops[1] = p.function_type(function.def.type, types);
            by_value[id] = types;
        }
    }
    for (Function& function : traversal_functions)
        for (Block& block : function.blocks) {
            std::vector<Inst> out;
            for (Inst& inst : block.insts) {
                if (inst.op == Op::OpFunctionCall)
                    if (const auto found = by_value.find(inst.ops[0]); found != by_value.end())
                        for (size_t i = 1; i < inst.ops.size(); ++i) {
                            Inst load(Op::OpLoad, found->second[i - 1], p.module.new_id(), {inst.ops[i]});
                            inst.ops[i] = load.result;
                            out.push_back(std::move(load));
                        }
                out.push_back(std::move(inst));
            }
            block.insts = std::move(out);
        }
}

Id Machine::function(const std::string& name) const { return variable(name); }

Id Machine::variable(const std::string& name) const {
    const auto found = exports_.find(name);
    if (found == exports_.end()) ir::fail("internal-traversal", "", 0, "the traversal module does not export " + name);
    return found->second;
}

Id Machine::call(Emitter& e, const std::string& name, const std::vector<Id>& arguments) const {
    const Id id = function(name);
    return e.call(id, export_types_.at(std::to_string(id)), arguments);
}

Id Machine::load(Emitter& e, const std::string& name) const {
    const Id id = variable(name);
    return e.load(p.pointee(p.def(id)->type), id);
}

void Machine::store(Emitter& e, const std::string& name, Id value) const { e.store(variable(name), value); }

void Machine::report(Emitter& e, uint32_t kind, Id detail) {
    e.store_u32(error, kind);
    e.store(error_detail, detail);
}

void Machine::go(Emitter& e, uint32_t id) { go_value(e, p.constant_u32(id)); }

void Machine::go_value(Emitter& e, Id value) {
    e.store(state, value);
    e.effect(Op::OpBranch, {dispatch});
}

void Machine::go_to_saved(Emitter& e, Id saved) {
    const Id u32 = p.uint_type();
    const Id back = e.load(u32, saved);
    e.store(pop, e.value(Op::OpShiftRightLogical, u32, {back, p.constant_u32(16)}));
    go_value(e, e.value(Op::OpBitwiseAnd, u32, {back, p.constant_u32(0xffff)}));
}

}  // namespace rtc::continuation
