// SPIRV-Tools on what a pipeline brought, without traversal.
//
// Traversal functions are the same in every pipeline: they come cleaned up, and the tests of rtc validate them.
// The optimiser and the validator see stubs in place of those that the rest calls, and nothing of what only traversal
// uses; for a small pipeline that saves most of their time.
#include "link/link.h"

namespace rtc::link {
namespace {

// The functions and variables that everything but traversal's bodies uses.
ir::IdSet used_without_bodies(const ir::Module& module) {
    ir::IdSet variables, used;
    ir::IdMap<const ir::Function*> functions;
    for (const Inst& inst : module.globals)
        if (inst.op == Op::OpVariable) variables.insert(inst.result);
    for (const ir::Function& function : module.functions) functions[function.id()] = &function;
    for (const ir::Function& function : module.functions) {
        if (function.prepared) continue;
        used.insert(function.id());
        for (const ir::Block& block : function.blocks)
            for (const Inst& inst : block.insts)
                inst.for_each_id([&](Id id) {
                    if (functions.get(id) || variables.contains(id)) used.insert(id);
                });
    }
    return used;
}

ir::Function stub_of(const ir::Function& whole, Id void_type, ir::Module& module) {
    ir::Function function;
    function.def = whole.def;
    function.params = whole.params;
    function.prepared = true;
    ir::Block block;
    block.label = whole.blocks.front().label;
    if (function.def.type == void_type) {
        block.insts.push_back(Inst(Op::OpReturn, 0, 0, {}));
    } else {
        const Id value = module.new_id();
        block.insts.push_back(Inst(Op::OpUndef, function.def.type, value, {}));
        block.insts.push_back(Inst(Op::OpReturnValue, 0, 0, {value}));
    }
    function.blocks.push_back(std::move(block));
    return function;
}

}  // namespace

ir::Module without_traversal(const ir::Module& module) {
    const ir::IdSet used = used_without_bodies(module);
    ir::Module out;
    out.version = module.version;
    out.bound = module.bound;
    out.capabilities = module.capabilities;
    out.extensions = module.extensions;
    out.ext_imports = module.ext_imports;
    out.addressing = module.addressing;
    out.memory_model = module.memory_model;
    out.entry_points = module.entry_points;
    out.execution_modes = module.execution_modes;
    out.files = module.files;
    out.strings = module.strings;
    for (ir::EntryPoint& entry : out.entry_points)
        std::erase_if(entry.interface, [&](Id id) { return !used.contains(id); });
    ir::IdSet there;
    Id void_type = 0;
    // Types stay, used or not: a tool that misses one makes it, and then there would be two.
    for (const Inst& inst : module.globals) {
        if (inst.op == Op::OpVariable && !used.contains(inst.result)) continue;
        if (inst.op == Op::OpTypeVoid) void_type = inst.result;
        there.insert(inst.result);
        out.globals.push_back(inst);
    }
    for (const ir::Function& whole : module.functions) {
        if (!used.contains(whole.id())) continue;
        out.functions.push_back(whole.prepared ? stub_of(whole, void_type, out) : whole);
        const ir::Function& function = out.functions.back();
        there.insert(function.id());
        for (const Inst& inst : function.params) there.insert(inst.result);
        for (const ir::Block& block : function.blocks) {
            there.insert(block.label);
            for (const Inst& inst : block.insts) there.insert(inst.result);
        }
    }
    for (const Inst& inst : module.decorations)
        if (there.contains(inst.ops[0])) out.decorations.push_back(inst);
    for (const Inst& inst : module.names)
        if (there.contains(inst.ops[0])) out.names.push_back(inst);
    return out;
}

ir::Module with_traversal(ir::Module changed, ir::Module original) {
    // Ids below the original bound mean the same in both; tools only ever add ids above it, and may have
    // used ids that are free in the stubs' module alone for nothing that stays.
    ir::IdMap<uint32_t> place;  // in changed.globals, plus one
    for (size_t i = 0; i < changed.globals.size(); ++i)
        if (changed.globals[i].result) place[changed.globals[i].result] = static_cast<uint32_t>(i + 1);
    ir::IdSet known, restored;  // ids of the original, and those of them that the tool did not see or dropped
    std::vector<Inst> globals;
    globals.reserve(original.globals.size() + changed.globals.size());
    for (Inst& inst : original.globals) {
        const uint32_t at = inst.result ? place.get(inst.result) : 0;
        if (inst.result && !at) restored.insert(inst.result);
        known.insert(inst.result);
        globals.push_back(std::move(at ? changed.globals[at - 1] : inst));
    }
    for (Inst& inst : changed.globals)
        if (inst.result && !known.contains(inst.result)) globals.push_back(std::move(inst));
    changed.globals = std::move(globals);

    ir::IdMap<ir::Function*> prepared;
    for (ir::Function& function : original.functions)
        if (function.prepared) prepared[function.id()] = &function;
    ir::IdSet present, kept;  // functions that `changed` has; ids that it still defines
    for (const ir::Function& function : changed.functions) {
        present.insert(function.id());
        if (prepared.get(function.id())) continue;
        kept.insert(function.id());
        for (const Inst& inst : function.params) kept.insert(inst.result);
        for (const ir::Block& block : function.blocks) {
            kept.insert(block.label);
            for (const Inst& inst : block.insts) kept.insert(inst.result);
        }
    }
    std::vector<ir::Function> functions;
    functions.reserve(original.functions.size());
    auto restore = [&](ir::Function& function) {
        restored.insert(function.id());
        for (const Inst& inst : function.params) restored.insert(inst.result);
        for (ir::Block& block : function.blocks) {
            restored.insert(block.label);
            for (Inst& inst : block.insts) {
                inst.source = {};
                if (inst.result) restored.insert(inst.result);
            }
        }
        functions.push_back(std::move(function));
    };
    // Functions that only stubs' bodies would have called come first.
    for (ir::Function& function : original.functions)
        if (function.prepared && !present.contains(function.id())) restore(function);
    for (ir::Function& function : changed.functions)
        if (ir::Function* whole = prepared.get(function.id()))
            restore(*whole);
        else
            functions.push_back(std::move(function));
    changed.functions = std::move(functions);

    auto bring_back = [&](std::vector<Inst>& to, std::vector<Inst>& from) {
        std::erase_if(to, [&](const Inst& inst) { return restored.contains(inst.ops[0]); });
        for (Inst& inst : from)
            if (restored.contains(inst.ops[0]) && !kept.contains(inst.ops[0])) to.push_back(std::move(inst));
    };
    bring_back(changed.decorations, original.decorations);
    bring_back(changed.names, original.names);
    changed.ext_imports = std::move(original.ext_imports);
    changed.bound = std::max(changed.bound, original.bound);
    return changed;
}

}  // namespace rtc::link
