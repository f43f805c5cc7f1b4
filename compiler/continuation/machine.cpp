// The machine's variables, its ties to the traversal module, and the small code
// sequences every state ends with.
#include "continuation/machine.h"

#include "rtc/abi.h"

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

void Machine::freeze_link_constants(const std::map<uint32_t, uint32_t>& values) {
    continuation::freeze_link_constants(p.module, values);
    p.reindex();
}

Id Machine::function(const std::string& name) const { return variable(name); }

Id Machine::find_export(const std::string& name) const {
    const auto found = traversal_->exports.find(name);
    return found == traversal_->exports.end() ? 0 : found->second;
}

Id Machine::variable(const std::string& name) const {
    const Id id = find_export(name);
    if (!id) ir::fail("internal-traversal", "", 0, "the traversal module does not export " + name);
    return id;
}

Id Machine::call(Emitter& e, const std::string& name, const std::vector<Id>& arguments) const {
    const Id id = function(name);
    return e.call(id, traversal_->result_types.get(id), arguments);
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
