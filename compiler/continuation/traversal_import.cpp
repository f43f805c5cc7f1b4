// The traversal module, from the words that come with rtc to what a pipeline links.
//
// Everything that does not depend on the pipeline beyond a few switches is done once in a
// process and kept: small pipelines would spend most of their time on it otherwise. What is kept
// is the program that every link begins with, a machine's variables and the traversal; a link
// copies it, and no id has to be mapped.
#include <memory>
#include <mutex>
#include <set>

#include "continuation/machine.h"
#include "ir/cleanup.h"
#include "rtc/abi.h"
#include "traversal/traversal_modules.h"

namespace rtc::continuation {

void freeze_link_constants(ir::Module& module, const std::map<uint32_t, uint32_t>& values) {
    std::map<Id, uint32_t> frozen;
    std::erase_if(module.decorations, [&](const Inst& inst) {
        if (inst.op != Op::OpDecorate || inst.ops[1] != static_cast<uint32_t>(spv::Decoration::SpecId)) return false;
        const auto found = values.find(inst.ops[2]);
        if (found == values.end()) return false;
        frozen[inst.ops[0]] = found->second;
        return true;
    });
    for (Inst& inst : module.globals) {
        const auto found = frozen.find(inst.result);
        if (found == frozen.end()) continue;
        if (inst.op == Op::OpSpecConstant) {
            inst.op = Op::OpConstant;
            inst.ops = {found->second};
        } else {
            inst.op = found->second ? Op::OpConstantTrue : Op::OpConstantFalse;
        }
    }
}

namespace {

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

// glslang passes `in` parameters through pointers to copies. The functions states call take values
// instead, so that they can be called from anywhere without temporaries. (Others may have `out`
// parameters and stay as they are.)
constexpr const char* kCalled[] = {
    "rtc_report_begin",      "rtc_object_to_world",      "rtc_world_to_object",   "rtc_instance_custom_index",
    "rtc_object_ray_origin", "rtc_object_ray_direction", "rtc_hit_positions",     "rtc_sbt_raygen_word",
    "rtc_sbt_miss_word",
    "rtc_sbt_hit_word",      "rtc_sbt_callable_word",    "rtc_miss_record",       "rtc_hit_record_base",
    "rtc_callable_record",   "rtc_error",                "rtc_root",              "rtc_scratch_load",      "rtc_scratch_store",
    "rtc_trace_save",        "rtc_trace_restore"};

std::map<std::string, Id> exports_of(const ir::Module& module) {
    std::map<std::string, Id> exports;
    for (const Inst& inst : module.names) {
        if (inst.op != Op::OpName) continue;
        std::string name = ir::words_string(inst.ops.data() + 1, inst.ops.size() - 1);
        name = name.substr(0, name.find('('));
        if (name.rfind("rtc_", 0) == 0) exports.emplace(name, inst.ops[0]);
    }
    return exports;
}

void take_values(Program& p, std::vector<Function>& functions, const std::map<std::string, Id>& exports) {
    std::map<Id, std::vector<Id>> by_value;  // function -> parameter value types
    for (const char* name : kCalled) {
        const auto exported = exports.find(name);
        if (exported == exports.end()) continue;
        for (Function& function : functions) {
            if (function.id() != exported->second || function.params.empty()) continue;
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
            by_value[function.id()] = types;
        }
    }
    for (Function& function : functions)
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

// Functions no export reaches any more.
void drop_unreached(std::vector<Function>& functions, const std::map<std::string, Id>& exports) {
    ir::IdSet reached;
    ir::IdMap<uint32_t> index;
    for (size_t i = 0; i < functions.size(); ++i) index[functions[i].id()] = static_cast<uint32_t>(i + 1);
    std::vector<uint32_t> work;
    auto reach = [&](Id id) {
        const uint32_t at = index.get(id);
        if (at && reached.insert(id)) work.push_back(at - 1);
    };
    for (const auto& [name, id] : exports) reach(id);
    while (!work.empty()) {
        const uint32_t at = work.back();
        work.pop_back();
        for (const Block& block : functions[at].blocks)
            for (const Inst& inst : block.insts)
                if (inst.op == Op::OpFunctionCall) reach(inst.ops[0]);
    }
    std::erase_if(functions, [&](const Function& function) { return !reached.contains(function.id()); });
}

ir::Module prepare(const ir::Module& words, const std::map<uint32_t, uint32_t>& choices) {
    ir::Module source = words;
    freeze_link_constants(source, choices);
    source.entry_points.clear();
    Program p;
    ir::IdMap<Id> map;
    std::vector<Function> functions = p.import(source, map);
    p.module.version = source.version;
    p.module.addressing = source.addressing;
    const std::map<std::string, Id> exports = exports_of(p.module);
    take_values(p, functions, exports);
    for (Function& function : functions) ir::clean_up(p, function);
    drop_unreached(functions, exports);
    for (const Function& function : functions)
        for (const Block& block : function.blocks)
            for (const Inst& inst : block.insts) {
                if (is_banned(inst))
                    ir::fail("internal-traversal", "", 0,
                             std::string("traversal uses ") + ir::op_info(inst.op)->name +
                                 ", whose rounding is the driver's choice");
                // Numbers that hold in the source must hold in the binary.
                if (is_float_operation(inst.op) && !p.decoration(inst.result, spv::Decoration::NoContraction))
                    p.decorate(inst.result, spv::Decoration::NoContraction);
            }
    // Decorations and names of code that is gone.
    ir::IdSet there, named;
    for (const Inst& inst : p.module.globals) {
        there.insert(inst.result);
        named.insert(inst.result);
    }
    for (const Function& function : functions) {
        there.insert(function.id());
        named.insert(function.id());
        for (const Inst& inst : function.params) there.insert(inst.result);
        for (const Block& block : function.blocks)
            for (const Inst& inst : block.insts) there.insert(inst.result);
    }
    std::erase_if(p.module.decorations, [&](const Inst& inst) { return !there.contains(inst.ops[0]); });
    // Names of locals would cost every pipeline time and help nobody.
    std::erase_if(p.module.names, [&](const Inst& inst) { return !named.contains(inst.ops[0]); });
    for (Function& function : functions) function.prepared = true;
    p.module.functions = std::move(functions);
    return std::move(p.module);
}

// Which of the exported variables of a pending candidate each function reads or writes, itself or by calls.
TouchedVariables touched_candidates(const ir::Module& module, const std::map<std::string, Id>& exports) {
    ir::IdSet candidates;
    for (const auto& [name, id] : exports)
        if (name.rfind("rtc_cand_", 0) == 0) candidates.insert(id);
    std::map<Id, std::set<Id>> touched;
    std::vector<std::pair<Id, Id>> calls;
    for (const Function& function : module.functions)
        for (const Block& block : function.blocks)
            for (const Inst& inst : block.insts) {
                if (inst.op == Op::OpFunctionCall) calls.push_back({function.id(), inst.ops[0]});
                inst.for_each_id([&](Id id) {
                    if (candidates.contains(id)) touched[function.id()].insert(id);
                });
            }
    // There is no recursion, so this settles.
    for (bool changed = true; changed;) {
        changed = false;
        for (const auto& [caller, callee] : calls)
            for (Id id : std::set<Id>(touched[callee])) changed |= touched[caller].insert(id).second;
    }
    return {touched.begin(), touched.end()};
}

// Prepared traversals live as long as the process; there are as many as combinations of choices that occur.
const PreparedTraversal& prepared(const TraversalModule& module, const std::map<uint32_t, uint32_t>& choices) {
    static std::mutex mutex;
    static std::map<std::pair<const TraversalModule*, std::map<uint32_t, uint32_t>>,
                    std::unique_ptr<const PreparedTraversal>> known;
    const std::lock_guard lock(mutex);
    std::unique_ptr<const PreparedTraversal>& entry = known[{&module, choices}];
    if (entry) return *entry;
    const ir::Module source =
        prepare(ir::read_module({module.words, module.words + module.count}, "traversal"), choices);
    auto fresh = std::make_unique<PreparedTraversal>();
    Program& p = fresh->program;
    const LinkOptions any;
    const Machine machine(p, any);
    fresh->begun = p.module.bound;
    ir::IdMap<Id> map;
    p.module.functions = p.import(source, map);
    p.module.version = source.version;
    if (module.addresses) p.module.addressing = source.addressing;
    for (const auto& [name, id] : exports_of(source)) fresh->exports[name] = map.get(id);
    fresh->touched = touched_candidates(p.module, fresh->exports);
    for (const Function& function : p.module.functions) fresh->result_types[function.id()] = function.def.type;
    for (const Inst& inst : p.module.globals)
        if (inst.op == Op::OpVariable) {
            uint32_t binding = 0;
            if (p.decoration(inst.result, spv::Decoration::Binding, &binding)) fresh->reserved[binding] = inst.result;
        }
    for (const auto& [binding, id] : fresh->reserved) {
        p.remove_decorations(id, spv::Decoration::Binding);
        p.remove_decorations(id, spv::Decoration::DescriptorSet);
    }
    entry = std::move(fresh);
    return *entry;
}

}  // namespace

void Machine::import_traversal(const TraversalModule& module, const std::map<uint32_t, uint32_t>& choices) {
    traversal_ = &prepared(module, choices);
    if (p.module.bound != traversal_->begun)
        ir::fail("internal-traversal", "", 0, "traversal comes before everything but the machine");
    p = traversal_->program;
    traversal_functions = std::move(p.module.functions);
    p.module.functions.clear();
    reserved = traversal_->reserved;
}

}  // namespace rtc::continuation
