// SPIRV-Tools on what a pipeline brought, without traversal.
//
// Traversal functions are the same in every pipeline: they come cleaned up, and the tests of rtc validate them.
// The optimiser and the validator see stubs in their place, which for a small pipeline saves most of their time.
#include "link/link.h"

namespace rtc::link {

ir::Module without_traversal(ir::Module& module) {
    // Bodies that are not there any more need no copy.
    std::vector<ir::Function> functions;
    functions.swap(module.functions);
    ir::Module out = module;
    functions.swap(module.functions);
    Id void_type = 0;
    for (const Inst& inst : out.globals)
        if (inst.op == Op::OpTypeVoid) void_type = inst.result;
    for (const ir::Function& whole : module.functions) {
        if (!whole.prepared) {
            out.functions.push_back(whole);
            continue;
        }
        ir::Function function;
        function.def = whole.def;
        function.params = whole.params;
        function.prepared = true;
        ir::Block block;
        block.label = whole.blocks.front().label;
        if (function.def.type == void_type) {
            block.insts.push_back(Inst(Op::OpReturn, 0, 0, {}));
        } else {
            const Id value = out.new_id();
            block.insts.push_back(Inst(Op::OpUndef, function.def.type, value, {}));
            block.insts.push_back(Inst(Op::OpReturnValue, 0, 0, {value}));
        }
        function.blocks.push_back(std::move(block));
        out.functions.push_back(std::move(function));
    }
    // Decorations and names of code that is not there.
    ir::IdSet there;
    for (const Inst& inst : out.globals) there.insert(inst.result);
    for (const ir::Function& function : out.functions) {
        there.insert(function.id());
        for (const Inst& inst : function.params) there.insert(inst.result);
        for (const ir::Block& block : function.blocks) {
            there.insert(block.label);
            for (const Inst& inst : block.insts) there.insert(inst.result);
        }
    }
    auto is_gone = [&](const Inst& inst) { return !there.contains(inst.ops[0]); };
    std::erase_if(out.decorations, is_gone);
    std::erase_if(out.names, is_gone);
    return out;
}

ir::Module with_traversal(ir::Module changed, const ir::Module& original) {
    // Ids below the original bound mean the same in both; tools only ever add ids above it, and may have
    // used ids that are free in the stubs' module alone for nothing that stays.
    ir::IdSet there;
    for (const Inst& inst : changed.globals) there.insert(inst.result);
    std::vector<Inst> globals;
    ir::IdMap<uint32_t> place;  // in changed.globals, plus one
    for (size_t i = 0; i < changed.globals.size(); ++i)
        if (changed.globals[i].result) place[changed.globals[i].result] = static_cast<uint32_t>(i + 1);
    for (const Inst& inst : original.globals) {
        const uint32_t at = inst.result ? place.get(inst.result) : 0;
        globals.push_back(at ? changed.globals[at - 1] : inst);
    }
    ir::IdSet known;
    for (const Inst& inst : original.globals) known.insert(inst.result);
    for (const Inst& inst : changed.globals)
        if (inst.result && !known.contains(inst.result)) globals.push_back(inst);
    changed.globals = std::move(globals);

    ir::IdMap<uint32_t> prepared;  // index in original.functions, plus one
    for (size_t i = 0; i < original.functions.size(); ++i)
        if (original.functions[i].prepared) prepared[original.functions[i].id()] = static_cast<uint32_t>(i + 1);
    ir::IdSet kept;  // ids that `changed` still defines
    for (ir::Function& function : changed.functions) {
        if (prepared.get(function.id())) continue;
        kept.insert(function.id());
        for (const Inst& inst : function.params) kept.insert(inst.result);
        for (const ir::Block& block : function.blocks) {
            kept.insert(block.label);
            for (const Inst& inst : block.insts) kept.insert(inst.result);
        }
    }
    // The optimiser drops functions that only stubs' bodies would have called.
    ir::IdSet present;
    for (const ir::Function& function : changed.functions) present.insert(function.id());
    std::vector<ir::Function> dropped;
    for (const ir::Function& function : original.functions)
        if (function.prepared && !present.contains(function.id())) dropped.push_back(function);
    changed.functions.insert(changed.functions.begin(), dropped.begin(), dropped.end());

    ir::IdSet restored;
    for (const Inst& inst : original.globals)
        if (inst.result && !there.contains(inst.result)) restored.insert(inst.result);
    for (ir::Function& function : changed.functions) {
        const uint32_t at = prepared.get(function.id());
        if (!at) continue;
        function = original.functions[at - 1];
        for (const Inst& inst : function.params) restored.insert(inst.result);
        for (ir::Block& block : function.blocks) {
            restored.insert(block.label);
            for (Inst& inst : block.insts) {
                inst.source = {};
                if (inst.result) restored.insert(inst.result);
            }
        }
    }
    std::erase_if(changed.decorations, [&](const Inst& inst) { return restored.contains(inst.ops[0]); });
    for (const Inst& inst : original.decorations)
        if (restored.contains(inst.ops[0]) && !kept.contains(inst.ops[0])) changed.decorations.push_back(inst);
    changed.ext_imports = original.ext_imports;
    changed.bound = std::max(changed.bound, original.bound);
    return changed;
}

}  // namespace rtc::link
