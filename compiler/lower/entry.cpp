// Picks one entry point out of an imported module: the functions it reaches, and
// the module-scope variables it owns.
#include <set>

#include "ir/id_set.h"
#include "lower/stage.h"

namespace rtc::lower {

void Stage::fail(const std::string& id, const ir::SourceLine& source, const std::string& text,
                 const Program& program) const {
    if (source.file) ir::fail(id, program.module.files[source.file], source.line, text);
    ir::fail(id, file, 0, "in " + std::string(stage_kind_name(kind)) + " stage '" + name + "': " + text);
}

bool is_call(const Inst& inst, const CallKinds& kinds) {
    return is_trace(inst.op) || is_callable(inst.op) || (is_report(inst.op) && kinds.report_suspends);
}

namespace {

void visit_callees(const Function& function, const std::function<void(const Inst&)>& fn) {
    for (const Block& block : function.blocks)
        for (const Inst& inst : block.insts)
            if (inst.op == Op::OpFunctionCall) fn(inst);
}

}  // namespace

void select_entry(Program& program, Stage& stage, std::vector<Function> functions, Id entry,
                  const std::set<Id>& module_variables) {
    std::map<Id, size_t> by_id;
    for (size_t i = 0; i < functions.size(); ++i) by_id[functions[i].id()] = i;
    if (!by_id.count(entry)) stage.fail("entry-point-missing", {}, "the entry point names no function", program);

    // Depth-first walk; a function met again while it is still on the path is recursion.
    enum Mark { White, Grey, Black };
    std::vector<Mark> marks(functions.size(), White);
    std::function<void(size_t)> walk = [&](size_t i) {
        marks[i] = Grey;
        visit_callees(functions[i], [&](const Inst& call) {
            const auto found = by_id.find(call.ops[0]);
            if (found == by_id.end())
                stage.fail("function-missing", call.source, "a call names a function that is not in the module", program);
            if (functions[found->second].blocks.empty())
                stage.fail("function-missing", call.source, "a call names a function without a body", program);
            if (marks[found->second] == Grey)
                stage.fail("function-recursion", call.source,
                           "the call graph has a cycle; shaders must not recurse through functions", program);
            if (marks[found->second] == White) walk(found->second);
        });
        marks[i] = Black;
    };
    if (functions[by_id[entry]].blocks.empty())
        stage.fail("entry-point-missing", {}, "the entry point's function has no body", program);
    walk(by_id[entry]);

    ir::IdSet used, used_elsewhere;
    for (size_t i = 0; i < functions.size(); ++i) {
        ir::IdSet& set = marks[i] == Black ? used : used_elsewhere;
        for (const Block& block : functions[i].blocks)
            for (const Inst& inst : block.insts) inst.for_each_id([&](Id id) { set.insert(id); });
        if (marks[i] != Black) continue;
        if (functions[i].id() == entry)
            stage.body = std::move(functions[i]);
        else
            stage.functions.push_back(std::move(functions[i]));
    }
    // NV's calls name their data by location only, so data that nothing mentions belongs to the stage too. What only
    // another entry point of the module mentions does where this stage could pass it, after its own.
    const bool traces = stage.kind == StageKind::RayGen || stage.kind == StageKind::ClosestHit || stage.kind == StageKind::Miss;
    std::vector<Id> others;
    for (const Inst& inst : program.module.globals) {
        if (inst.op != Op::OpVariable || !module_variables.count(inst.result)) continue;
        const auto storage = static_cast<spv::StorageClass>(inst.ops[0]);
        if (used.contains(inst.result)) {
            stage.variables.push_back(inst.result);
            continue;
        }
        const bool elsewhere = used_elsewhere.contains(inst.result);
        const bool incoming = storage == spv::StorageClass::IncomingRayPayloadKHR ||
                              storage == spv::StorageClass::IncomingCallableDataKHR;
        const bool payload = storage == spv::StorageClass::RayPayloadKHR;
        const bool data = storage == spv::StorageClass::CallableDataKHR;
        if (!elsewhere && (incoming || payload || data))
            stage.variables.push_back(inst.result);
        else if (elsewhere && ((payload && traces) || (data && (traces || stage.kind == StageKind::Callable))))
            others.push_back(inst.result);
    }
    stage.variables.insert(stage.variables.end(), others.begin(), others.end());
}

}  // namespace rtc::lower
