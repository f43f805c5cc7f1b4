// Resumable launches: a lane that has used up its step budget stores what it needs
// in lane storage and ends; the next dispatch takes it up again. See docs/resumable.md.
//
// Lanes suspend only between states, so what must be kept is: the next state, every
// variable that some state reads before it writes, the ray (traversal keeps its own
// books: rtc_trace_save), and the word stack.
#include <set>

#include "continuation/machine.h"
#include "rtc/abi.h"
#include "traversal/traversal_modules.h"

namespace rtc::continuation {

Id Machine::step_budget() const {
    for (const Inst& inst : p.module.decorations)
        if (inst.op == Op::OpDecorate && inst.ops[1] == static_cast<uint32_t>(spv::Decoration::SpecId) &&
            inst.ops[2] == RTC_SPEC_STEP_BUDGET)
            return inst.ops[0];
    ir::fail("internal-traversal", "", 0, "the traversal module has no step budget");
}

Id Machine::out_of_budget(Emitter& e) const {
    if (!resumable) return p.constant_bool(false);
    const Id budget = step_budget();
    const Id turns = load(e, "rtc_turns");
    const Id limited = e.value(Op::OpINotEqual, p.bool_type(), {budget, p.constant_u32(0xffffffffu)});
    const Id spent = e.value(Op::OpUGreaterThanEqual, p.bool_type(), {turns, budget});
    return e.value(Op::OpLogicalAnd, p.bool_type(), {limited, spent});
}

std::vector<Id> Machine::carried_variables(const std::vector<Function>& stage_functions) const {
    std::vector<Id> candidates;
    for (const Inst& variable : variables_) candidates.push_back(variable.result);
    candidates.insert(candidates.end(), stage_variables.begin(), stage_variables.end());
    candidates.push_back(record);
    // A pending candidate, read by any-hit and intersection shaders.
    for (const auto& [name, id] : traversal_->exports)
        if (name.rfind("rtc_cand_", 0) == 0) candidates.push_back(id);
    ir::IdMap<uint32_t> number;  // of a candidate, plus one
    for (size_t i = 0; i < candidates.size(); ++i) number[candidates[i]] = static_cast<uint32_t>(i + 1);
    // Sets of candidates.
    const size_t words = candidates.size() / 64 + 1;
    using Set = std::vector<uint64_t>;
    auto add = [](Set& set, uint32_t n) { set[n / 64] |= uint64_t{1} << n % 64; };
    auto remove = [](Set& set, uint32_t n) { set[n / 64] &= ~(uint64_t{1} << n % 64); };
    auto join = [](Set& to, const Set& from) {
        uint64_t fresh = 0;
        for (size_t i = 0; i < from.size(); ++i) {
            fresh |= from[i] & ~to[i];
            to[i] |= from[i];
        }
        return fresh != 0;
    };

    // What each function touches: itself, then through what it calls (there is no recursion, so this settles).
    std::vector<Set> touched;
    ir::IdMap<uint32_t> function_index;  // in `touched`, plus one
    std::vector<std::pair<Id, Id>> calls;
    // (Traversal's functions know nothing but candidates.)
    for (const auto& [function, variables] : traversal_->touched) {
        Set& set = touched.emplace_back(words);
        function_index[function] = static_cast<uint32_t>(touched.size());
        for (Id id : variables) add(set, number.get(id) - 1);
    }
    for (const std::vector<Function>* functions : {&stage_functions, &helper_functions})
        for (const Function& function : *functions) {
            Set& set = touched.emplace_back(words);
            function_index[function.id()] = static_cast<uint32_t>(touched.size());
            for (const Block& block : function.blocks)
                for (const Inst& inst : block.insts) {
                    if (inst.op == Op::OpFunctionCall) calls.push_back({function.id(), inst.ops[0]});
                    inst.for_each_id([&](Id id) {
                        if (const uint32_t n = number.get(id)) add(set, n - 1);
                    });
                }
        }
    for (bool changed = true; changed;) {
        changed = false;
        for (const auto& [caller, callee] : calls)
            if (const uint32_t from = function_index.get(callee))
                changed |= join(touched[function_index.get(caller) - 1], touched[from - 1]);
    }

    Set live_first(words);
    for (const State& state : states) {
        // Blocks of a state are in an order in which each follows its dominators; one backward pass per
        // iteration settles quickly.
        std::map<Id, Set> live_in;
        Set live(words);
        std::map<Id, uint32_t> base;  // the candidate an access chain leads into, plus one
        for (bool changed = true; changed;) {
            changed = false;
            for (auto block = state.blocks.rbegin(); block != state.blocks.rend(); ++block) {
                std::fill(live.begin(), live.end(), 0);
                block->for_each_successor([&](Id successor) {
                    if (const auto found = live_in.find(successor); found != live_in.end()) join(live, found->second);
                });
                base.clear();
                for (const Inst& inst : block->insts)
                    if (inst.op == Op::OpAccessChain || inst.op == Op::OpInBoundsAccessChain) {
                        uint32_t into = number.get(inst.ops[0]);
                        if (const auto found = base.find(inst.ops[0]); !into && found != base.end()) into = found->second;
                        if (into) base[inst.result] = into;
                    }
                for (auto inst = block->insts.rbegin(); inst != block->insts.rend(); ++inst) {
                    if (inst->op == Op::OpStore)
                        if (const uint32_t n = number.get(inst->ops[0])) remove(live, n - 1);
                    if (inst->op == Op::OpAccessChain || inst->op == Op::OpInBoundsAccessChain) {
                        for (size_t i = 1; i < inst->ops.size(); ++i)
                            if (const uint32_t n = number.get(inst->ops[i])) add(live, n - 1);
                        continue;
                    }
                    for (size_t i = inst->op == Op::OpStore ? 1 : 0; i < inst->ops.size(); ++i) {
                        if (const uint32_t n = number.get(inst->ops[i])) add(live, n - 1);
                        if (base.empty()) continue;
                        if (const auto found = base.find(inst->ops[i]); found != base.end()) add(live, found->second - 1);
                    }
                    if (inst->op == Op::OpFunctionCall)
                        if (const uint32_t callee = function_index.get(inst->ops[0])) join(live, touched[callee - 1]);
                }
                Set& known = live_in.try_emplace(block->label, words).first->second;
                if (live != known) {
                    known = live;
                    changed = true;
                }
            }
        }
        join(live_first, live_in.at(state.blocks.front().label));
    }
    std::set<Id> carried;
    for (size_t i = 0; i < candidates.size(); ++i)
        if (live_first[i / 64] >> i % 64 & 1) carried.insert(candidates[i]);
    // The dispatcher's own.
    carried.insert({ret, depth, callable_depth, callable_ret, fresh, report_return, record});
    carried.erase(state);
    carried.erase(push);
    carried.erase(pop);
    carried.erase(leave);
    std::vector<Id> out;
    for (Id id : candidates)
        if (carried.count(id)) out.push_back(id);
    return out;
}

void Machine::emit_transfer(std::vector<Block>& blocks, const std::vector<Id>& carried, Id stack, Id top, bool saving) {
    const Id u32 = p.uint_type();
    auto code = [&] { return Emitter(p, blocks.back().insts); };
    auto begin = [&](Id label) {
        Block block;
        block.label = label;
        blocks.push_back(std::move(block));
    };
    Emitter e = code();
    uint32_t word = 0;
    auto put = [&](Id value) { call(e, "rtc_scratch_store", {p.constant_u32(word++), value}); };
    auto get = [&] { return call(e, "rtc_scratch_load", {p.constant_u32(word++)}); };
    if (saving)
        put(e.load(u32, state));
    else
        e.store(state, get());
    for (Id id : carried) {
        Id type = 0;
        if (const Inst* global = p.def(id))
            type = p.pointee(global->type);
        else
            for (const Inst& variable : variables_)
                if (variable.result == id) type = p.pointee(variable.type);
        if (saving) {
            for (Id value : e.to_words(e.load(type, id), type)) put(value);
        } else {
            const uint32_t count = p.word_count(type, "a variable");
            std::vector<Id> words;
            for (uint32_t i = 0; i < count; ++i) words.push_back(get());
            size_t at = 0;
            e.store(id, e.from_words(type, words, at));
        }
    }
    if (traces) {
        call(e, saving ? "rtc_trace_save" : "rtc_trace_restore", {p.constant_u32(word)});
        word += RTC_TRACE_STATE_WORDS;
    }
    scratch_words = word;
    if (!stack) return;
    scratch_words = word + 1 + stack_words;

    // The used part of the word stack.
    if (saving)
        put(e.load(u32, top));
    else
        e.store(top, get());
    const Id index = p.module.new_id();
    variables_.push_back(Inst(Op::OpVariable, p.pointer_type(spv::StorageClass::Function, u32), index,
                              {static_cast<uint32_t>(spv::StorageClass::Function)}));
    e.store_u32(index, 0);
    const Id header = p.module.new_id(), test = p.module.new_id(), body = p.module.new_id(), next = p.module.new_id(),
             done = p.module.new_id();
    e.effect(Op::OpBranch, {header});
    begin(header);
    code().effect(Op::OpLoopMerge, {done, next, 0});
    code().effect(Op::OpBranch, {test});
    begin(test);
    {
        Emitter t = code();
        const Id more = t.value(Op::OpULessThan, p.bool_type(), {t.load(u32, index), t.load(u32, top)});
        t.effect(Op::OpBranchConditional, {more, body, done});
    }
    begin(body);
    {
        Emitter b = code();
        const Id i = b.load(u32, index);
        const Id slot = b.chain(spv::StorageClass::Function, u32, stack, {i});
        const Id at = b.add(i, p.constant_u32(word));
        if (saving)
            call(b, "rtc_scratch_store", {at, b.load(u32, slot)});
        else
            b.store(slot, call(b, "rtc_scratch_load", {at}));
        b.effect(Op::OpBranch, {next});
    }
    begin(next);
    {
        Emitter n = code();
        n.store(index, n.add(n.load(u32, index), p.constant_u32(1)));
        n.effect(Op::OpBranch, {header});
    }
    begin(done);
}

}  // namespace rtc::continuation
