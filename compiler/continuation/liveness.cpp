// Which variables must survive a call: backward data flow over whole variables.
// A full store kills, a load or any other use keeps alive; a store to a part does neither.
#include <set>

#include "continuation/machine.h"

namespace rtc::continuation {
namespace {

using Set = std::set<Id>;

struct Effects {
    // In order within the block: true = use, false = full store.
    std::vector<std::pair<Id, bool>> events;
};

}  // namespace

std::map<Id, std::vector<Id>> live_across_calls(const lower::Stage& stage,
                                                const lower::CallKinds& kinds, const std::vector<Id>& candidates) {
    const Set candidate_set(candidates.begin(), candidates.end());

    // Module-scope variables a function may touch, callees included.
    std::map<Id, Set> touched;
    for (bool changed = true; changed;) {
        changed = false;
        for (const Function& function : stage.functions) {
            Set& set = touched[function.id()];
            const size_t before = set.size();
            for (const Block& block : function.blocks)
                for (const Inst& inst : block.insts) {
                    inst.for_each_id([&](Id id) {
                        if (candidate_set.count(id)) set.insert(id);
                    });
                    if (inst.op == Op::OpFunctionCall) {
                        const Set& callee = touched[inst.ops[0]];
                        set.insert(callee.begin(), callee.end());
                    }
                }
            changed |= set.size() != before;
        }
    }

    std::map<Id, Effects> effects;       // whole block
    std::map<Id, Effects> after_call;    // what follows the call inside its block
    std::map<Id, bool> has_call;
    for (const Block& block : stage.body.blocks) {
        // Pointers into a variable, within this block (memory form keeps them there).
        std::map<Id, Id> base;
        Effects& all = effects[block.label];
        auto root = [&](Id id) -> Id {
            if (candidate_set.count(id)) return id;
            const auto found = base.find(id);
            return found == base.end() ? 0 : found->second;
        };
        bool called = false;
        for (const Inst& inst : block.insts) {
            std::vector<std::pair<Id, bool>> events;
            if (inst.op == Op::OpAccessChain || inst.op == Op::OpInBoundsAccessChain || inst.op == Op::OpCopyObject) {
                if (const Id variable = root(inst.ops[0])) base[inst.result] = variable;
                for (size_t i = 1; i < inst.ops.size(); ++i)
                    if (const Id variable = root(inst.ops[i])) events.push_back({variable, true});
            } else if (inst.op == Op::OpStore) {
                if (const Id variable = root(inst.ops[1])) events.push_back({variable, true});
                if (candidate_set.count(inst.ops[0])) events.push_back({inst.ops[0], false});
            } else {
                // The outgoing payload travels in the shared words and comes back from them.
                const bool call = lower::is_call(inst, kinds);
                const size_t payload = lower::is_trace(inst.op) ? 10 : lower::is_callable(inst.op) ? 1 : ~size_t{0};
                for (size_t i = 0; i < inst.ops.size(); ++i) {
                    const Id variable = root(inst.ops[i]);
                    if (variable) events.push_back({variable, true});
                    if (call && i == payload && variable) after_call[block.label].events.push_back({variable, false});
                }
                if (inst.op == Op::OpFunctionCall)
                    for (Id variable : touched[inst.ops[0]]) events.push_back({variable, true});
                if (call) {
                    called = true;
                    all.events.insert(all.events.end(), events.begin(), events.end());
                    // What the call itself overwrites belongs to the time after it.
                    all.events.insert(all.events.end(), after_call[block.label].events.begin(),
                                      after_call[block.label].events.end());
                    continue;
                }
                // The epilogue reads the incoming data.
                if ((inst.op == Op::OpReturn || inst.op == Op::OpIgnoreIntersectionKHR ||
                     inst.op == Op::OpTerminateRayKHR) &&
                    stage.incoming)
                    events.push_back({stage.incoming, true});
            }
            all.events.insert(all.events.end(), events.begin(), events.end());
            if (called) {
                Effects& rest = after_call[block.label];
                rest.events.insert(rest.events.end(), events.begin(), events.end());
            }
        }
        has_call[block.label] = called;
    }

    auto before = [](Set live, const Effects& e) {
        for (auto it = e.events.rbegin(); it != e.events.rend(); ++it) {
            if (it->second)
                live.insert(it->first);
            else
                live.erase(it->first);
        }
        return live;
    };
    std::map<Id, Set> live_in;
    auto live_out = [&](const Block& block) {
        Set live;
        for (Id successor : block.successors()) live.insert(live_in[successor].begin(), live_in[successor].end());
        return live;
    };
    for (bool changed = true; changed;) {
        changed = false;
        for (auto block = stage.body.blocks.rbegin(); block != stage.body.blocks.rend(); ++block) {
            Set live = before(live_out(*block), effects[block->label]);
            if (live != live_in[block->label]) {
                live_in[block->label] = std::move(live);
                changed = true;
            }
        }
    }

    std::map<Id, std::vector<Id>> out;
    for (const Block& block : stage.body.blocks) {
        if (!has_call[block.label]) continue;
        const Set live = before(live_out(block), after_call[block.label]);
        std::vector<Id>& list = out[block.label];
        for (Id id : candidates)
            if (live.count(id)) list.push_back(id);
    }
    return out;
}

}  // namespace rtc::continuation
