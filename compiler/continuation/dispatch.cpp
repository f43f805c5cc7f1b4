// The entry point: launch, dispatch loops, traversal state, word stack, and the
// switch over all states.
//
// Shaped by what lavapipe's LLVM compiles fast (docs/architecture.md): one place
// that moves frame words, one traversal, a flat switch up to 16 states and two
// levels of 16 above.
#include <algorithm>

#include "continuation/machine.h"
#include "rtc/abi.h"
#include "traversal/traversal_modules.h"

namespace rtc::continuation {
namespace {

// Writes structured code block by block.
class Code {
  public:
    explicit Code(Machine& machine) : m(machine), p(machine.p) { begin(p.module.new_id()); }

    Machine& m;
    Program& p;
    std::vector<Block> blocks;

    Emitter e() { return Emitter(p, blocks.back().insts); }
    void begin(Id label) {
        Block block;
        block.label = label;
        blocks.push_back(std::move(block));
    }
    Id equal(Id a, uint32_t b) { return e().value(Op::OpIEqual, p.bool_type(), {a, p.constant_u32(b)}); }
    Id not_equal(Id a, uint32_t b) { return e().value(Op::OpINotEqual, p.bool_type(), {a, p.constant_u32(b)}); }
    Id load(Id variable) { return e().load(p.uint_type(), variable); }

    // Either arm may end its own block (go); otherwise it falls to the merge block.
    void branch(Id condition, const std::function<void()>& yes, const std::function<void()>& no = {}) {
        const Id y = p.module.new_id(), n = p.module.new_id(), merge = p.module.new_id();
        e().effect(Op::OpSelectionMerge, {merge, 0});
        e().effect(Op::OpBranchConditional, {condition, y, no ? n : merge});
        begin(y);
        yes();
        close(merge);
        if (no) {
            begin(n);
            no();
            close(merge);
        }
        begin(merge);
    }
    void close(Id target) {
        const std::vector<Inst>& insts = blocks.back().insts;
        if (insts.empty() || !insts.back().is_terminator()) e().effect(Op::OpBranch, {target});
    }
};

}  // namespace

Id Machine::entry_function(const std::string& region) {
    Id& known = entry_functions_[region];
    if (known) return known;
    Function function;
    const Id u32 = p.uint_type();
    function.def = Inst(Op::OpFunction, u32, p.module.new_id(), {0, p.function_type(u32, {u32, u32})});
    known = function.id();
    p.module.set_name(known, "rtc_entry_" + region);
    function.params.push_back(Inst(Op::OpFunctionParameter, u32, p.module.new_id(), {}));
    function.params.push_back(Inst(Op::OpFunctionParameter, u32, p.module.new_id(), {}));
    const Id index = function.params[0].result, which = function.params[1].result;

    Code code(*this);
    const Id result = p.module.new_id();
    code.blocks.back().insts.push_back(Inst(Op::OpVariable, p.pointer_type(spv::StorageClass::Function, u32), result,
                                            {static_cast<uint32_t>(spv::StorageClass::Function)}));
    code.e().store_u32(result, 0);
    Emitter e0 = code.e();
    const Id at = call(e0, region == "hit" ? "rtc_hit_record_base" : "rtc_" + region + "_record", {index});
    code.branch(code.not_equal(at, 0xffffffffu), [&] {
        Emitter e = code.e();
        e.store(record, at);
        const Id word = call(e, "rtc_sbt_" + region + "_word", {e.add(at, which)});
        code.branch(code.not_equal(word, 0), [&] {
            Emitter c = code.e();
            const Id offset = c.value(Op::OpISub, u32, {word, p.constant_u32(kFirstEntry)});
            const Id good = c.value(Op::OpULessThan, p.bool_type(), {offset, p.constant_u32(entry_count)});
            code.branch(
                good, [&] { code.e().store(result, word); },
                [&] {
                    Emitter bad = code.e();
                    report(bad, RTC_LAUNCH_ERROR_BAD_HANDLE, word);
                });
        });
    });
    Emitter last = code.e();
    last.effect(Op::OpReturnValue, {last.load(u32, result)});
    function.blocks = std::move(code.blocks);
    helper_functions.push_back(std::move(function));
    return known;
}

namespace {

// case kStateTraverse: start or continue the ray, and enter what it met.
std::vector<Block> traverse_state(Machine& m) {
    Program& p = m.p;
    const Id u32 = p.uint_type();
    Code code(m);
    auto start = [&] {
        Emitter e = code.e();
        e.store(m.fresh, p.constant_bool(false));
        e.store_u32(m.report_return, 0);
        m.call(e, "rtc_trace_begin");
    };
    // A walk that nothing interrupts is never gone on with: said so, none of it is alive in shaders.
    if (m.any_hit || m.aabbs || m.resumable)
        code.branch(code.e().load(p.bool_type(), m.fresh), start);
    else
        start();
    Emitter step = code.e();
    const Id event = m.call(step, "rtc_trace_step");
    if (m.checks_scene) {
        // The scene is not what was assumed: whatever the lane would write, it would be wrong.
        Emitter e = code.e();
        const Id refused = m.load(e, "rtc_refused");
        code.branch(code.not_equal(refused, 0), [&] {
            Emitter end = code.e();
            m.go(end, kStateDone);
        });
    }

    code.branch(code.equal(event, RTC_STEP_DONE), [&] {
        const Id entry = p.module.new_id();
        m.variables().push_back(Inst(Op::OpVariable, p.pointer_type(spv::StorageClass::Function, u32), entry,
                                     {static_cast<uint32_t>(spv::StorageClass::Function)}));
        code.e().store_u32(entry, 0);
        Emitter e = code.e();
        const Id instance = m.load(e, "rtc_hit_instance");
        code.branch(
            code.equal(instance, 0xffffffffu),
            [&] {
                Emitter miss = code.e();
                miss.store(entry, m.call_entry(miss, "miss", m.load(miss, "rtc_ray_miss"), 0));
            },
            [&] {
                // SkipClosestHitShader
                Emitter hit = code.e();
                const Id skip = hit.value(Op::OpBitwiseAnd, u32, {m.load(hit, "rtc_ray_flags"), p.constant_u32(8)});
                code.branch(code.equal(skip, 0), [&] {
                    Emitter run = code.e();
                    run.store(entry, m.call_entry(run, "hit", m.load(run, "rtc_hit_record"), 0));
                });
            });
        code.branch(
            code.not_equal(code.load(entry), 0),
            [&] {
                Emitter enter = code.e();
                m.go_value(enter, enter.load(u32, entry));
            },
            [&] {
                Emitter back = code.e();
                m.go_return(back);
            });
        code.e().effect(Op::OpUnreachable, {});
    });
    if (m.any_hit)
        code.branch(code.equal(event, RTC_STEP_TRIANGLE), [&] {
            Emitter e = code.e();
            const Id shader = m.call_entry(e, "hit", m.load(e, "rtc_cand_record"), 1);
            code.branch(
                code.equal(shader, 0),
                [&] {
                    Emitter accept = code.e();
                    m.call(accept, "rtc_trace_accept");
                    accept.effect(Op::OpBranch, {m.dispatch});
                },
                [&] {
                    Emitter run = code.e();
                    run.store_u32(m.report_return, 0);
                    m.go_value(run, shader);
                });
            code.e().effect(Op::OpUnreachable, {});
        });
    if (m.aabbs)
        code.branch(code.equal(event, RTC_STEP_AABB), [&] {
            Emitter e = code.e();
            const Id shader = m.call_entry(e, "hit", m.load(e, "rtc_cand_record"), 2);
            const Id none = e.value(Op::OpIEqual, p.bool_type(), {shader, p.constant_u32(0)});
            m.go_value(e, e.select(u32, none, p.constant_u32(kStateTraverse), shader));
        });
    code.e().effect(Op::OpBranch, {m.dispatch});
    return std::move(code.blocks);
}

// `switch (selector)` over `cases`; each case's blocks end by themselves.
void emit_switch(Code& code, Id selector, const std::vector<std::pair<uint32_t, std::vector<Block>*>>& cases) {
    Program& p = code.p;
    const Id merge = p.module.new_id(), other = p.module.new_id();
    Inst inst(Op::OpSwitch, 0, 0, {selector, other});
    for (const auto& [value, blocks] : cases) {
        inst.ops.push_back(value);
        inst.ops.push_back(blocks->front().label);
    }
    code.e().effect(Op::OpSelectionMerge, {merge, 0});
    code.blocks.back().insts.push_back(inst);
    for (const auto& [value, blocks] : cases)
        code.blocks.insert(code.blocks.end(), std::make_move_iterator(blocks->begin()),
                           std::make_move_iterator(blocks->end()));
    code.begin(other);
    // No state has this id: end rather than loop.
    code.e().store_u32(code.m.state, kStateDone);
    code.e().effect(Op::OpBranch, {merge});
    code.begin(merge);
    code.e().effect(Op::OpBranch, {code.m.dispatch});
}

}  // namespace

Id Machine::call_entry(Emitter& e, const std::string& region, Id index, uint32_t which) {
    return e.call(entry_function(region), p.uint_type(), {index, p.constant_u32(which)});
}

Function Machine::build_main(const std::vector<Function>& stage_functions) {
    const Id u32 = p.uint_type();
    Function main;
    main.def = Inst(Op::OpFunction, p.void_type(), p.module.new_id(), {0, p.function_type(p.void_type(), {})});
    p.module.set_name(main.id(), "main");
    Code code(*this);

    std::sort(states.begin(), states.end(), [](const State& a, const State& b) { return a.id < b.id; });
    for (const State& s : states) p.module.set_name(s.blocks.front().label, "state." + std::to_string(s.id) + "." + s.name);

    // The word stack holds the frames of every suspended shader below the ray generation shader.
    Id stack = 0, top = 0;
    if (has_stack) {
        const uint32_t frames = (traces ? max_depth - 1 : 0) + (callables ? max_callable_depth : 0);
        stack_words = std::max(1u, frames) * max_frame_words;
        stack = new_variable(p.array_type(u32, stack_words), "rtc_stack");
        top = u32_variable("rtc_stack_top");
    }

    // Launch.
    Emitter begin = code.e();
    const Id inside = call(begin, "rtc_launch_begin");
    code.branch(begin.value(Op::OpLogicalNot, p.bool_type(), {inside}), [&] { code.e().effect(Op::OpReturn, {}); });
    const bool parks = addresses();  // the form for GPUs
    const std::vector<Id> carried = resumable || parks ? carried_variables(stage_functions) : std::vector<Id>{};
    auto start = [&] {
        Emitter e = code.e();
        const Id first = call(e, "rtc_sbt_raygen_word", {p.constant_u32(0)});
        const Id offset = e.value(Op::OpISub, u32, {first, p.constant_u32(kFirstEntry)});
        const Id good = e.value(Op::OpULessThan, p.bool_type(), {offset, p.constant_u32(entry_count)});
        e.store(state, e.select(u32, good, first, p.constant_u32(kStateDone)));
        code.branch(e.value(Op::OpLogicalNot, p.bool_type(), {good}), [&] {
            Emitter bad = code.e();
            report(bad, RTC_LAUNCH_ERROR_BAD_HANDLE, first);
        });
        Emitter init = code.e();
        for (Id variable : {record, depth, callable_depth, report_return, accepted}) init.store_u32(variable, 0);
        init.store(fresh, p.constant_bool(false));
        if (top) init.store_u32(top, 0);
    };
    for (Id variable : {push, pop, error}) code.e().store_u32(variable, 0);
    code.e().store(leave, p.constant_bool(false));
    if (resumable) {
        // Word RTC_PARAM_ROUND of the dispatch parameters.
        Emitter e = code.e();
        const Id round = e.load(u32, e.chain(spv::StorageClass::Uniform, u32, reserved.at(RTC_BINDING_PARAMS),
                                             {p.constant_u32(0), p.constant_u32(RTC_PARAM_ROUND / 4),
                                              p.constant_u32(RTC_PARAM_ROUND % 4)}));
        // Written so that it depends on the lane: lavapipe re-optimises a whole shader at each launch for
        // the sake of a branch on uniforms alone.
        const Id started = e.value(Op::OpINotEqual, p.bool_type(), {round, p.constant_u32(0)});
        const Id limit = e.select(u32, started, p.constant_u32(0xffffffffu), p.constant_u32(0));
        const Id first = e.value(Op::OpUGreaterThanEqual, p.bool_type(), {load(e, "rtc_lane"), limit});
        code.branch(first, start, [&] {
            Emitter again = code.e();
            const Id saved = call(again, "rtc_scratch_load", {p.constant_u32(0)});
            code.branch(code.equal(saved, kStateDone), [&] { code.e().effect(Op::OpReturn, {}); });
            emit_transfer(code.blocks, carried, stack, top, false);
        });
    } else {
        start();
    }

    // Two loops: shading states run until every lane of the group wants to trace or is done, then
    // traversal runs for all of them together. (Drivers that execute untaken branches masked run
    // shading code only when some lane needs it.)
    const Id again = p.module.new_id(), exit = p.module.new_id(), next = p.module.new_id();
    const Id header = p.module.new_id(), body = p.module.new_id(), shaded = p.module.new_id();
    auto count_turn = [&] {
        if (!resumable) return;
        Emitter e = code.e();
        const Id turns = variable("rtc_turns");
        e.store(turns, e.add(e.load(u32, turns), p.constant_u32(1)));
    };
    code.e().effect(Op::OpBranch, {again});
    code.begin(again);
    code.e().effect(Op::OpLoopMerge, {exit, next, 0});
    code.e().effect(Op::OpBranch, {header});
    code.begin(header);
    code.e().effect(Op::OpLoopMerge, {shaded, dispatch, 0});
    code.e().effect(Op::OpBranch, {body});
    code.begin(body);
    if (has_stack) {
        auto move_words = [&](bool pushing) {
            const Id count = code.load(pushing ? push : pop);
            code.branch(code.not_equal(count, 0), [&] {
                Emitter e = code.e();
                Id at = e.load(u32, top);
                if (!pushing) {
                    at = e.value(Op::OpISub, u32, {at, count});
                    e.store(top, at);
                }
                for (uint32_t i = 0; i < max_frame_words; i += 8) {
                    auto chunk = [&] {
                        Emitter c = code.e();
                        for (uint32_t k = i; k < std::min(i + 8, max_frame_words); ++k) {
                            // Words past a small frame are moved too. They fit: there is room for a frame of the
                            // largest site wherever a frame may start.
                            const Id index = c.add(at, p.constant_u32(k));
                            const Id slot = c.chain(spv::StorageClass::Function, u32, stack, {index});
                            if (pushing)
                                c.store(slot, c.load(u32, frame_word(k)));
                            else
                                c.store(frame_word(k), c.load(u32, slot));
                        }
                    };
                    if (i == 0)
                        chunk();
                    else
                        code.branch(code.e().value(Op::OpUGreaterThan, p.bool_type(), {count, p.constant_u32(i)}), chunk);
                }
                Emitter done = code.e();
                if (pushing) done.store(top, done.add(at, count));
                done.store_u32(pushing ? push : pop, 0);
            });
        };
        move_words(true);
        move_words(false);
    }
    code.branch(code.not_equal(code.load(error), 0), [&] {
        Emitter e = code.e();
        call(e, "rtc_error", {e.load(u32, error), e.load(u32, error_detail), p.constant_u32(0)});
        e.store_u32(error, 0);
    });
    code.e().store(leave, p.constant_bool(false));
    const Id current = code.load(state);
    const Id running = p.module.new_id(), stop = p.module.new_id();
    count_turn();
    {
        Emitter e = code.e();
        static_assert(kStateDone < kFirstEntry && kStateTraverse < kFirstEntry);
        Id wait = e.value(Op::OpULessThan, p.bool_type(), {current, p.constant_u32(kFirstEntry)});
        if (resumable) wait = e.value(Op::OpLogicalOr, p.bool_type(), {wait, out_of_budget(e)});
        e.effect(Op::OpSelectionMerge, {running, 0});
        e.effect(Op::OpBranchConditional, {wait, stop, running});
    }
    code.begin(stop);
    code.e().effect(Op::OpBranch, {shaded});
    code.begin(running);

    if (states.size() <= 16) {
        std::vector<std::pair<uint32_t, std::vector<Block>*>> cases;
        for (State& s : states) cases.push_back({s.id, &s.blocks});
        emit_switch(code, current, cases);
    } else {
        std::map<uint32_t, std::vector<std::pair<uint32_t, std::vector<Block>*>>> groups;
        for (State& s : states) groups[s.id / 16].push_back({s.id, &s.blocks});
        std::vector<std::vector<Block>> inner;
        inner.reserve(groups.size());
        std::vector<std::pair<uint32_t, std::vector<Block>*>> outer;
        for (auto& [group, cases] : groups) {
            Code part(*this);
            emit_switch(part, current, cases);
            inner.push_back(std::move(part.blocks));
            outer.push_back({group, &inner.back()});
        }
        const Id high = code.e().value(Op::OpShiftRightLogical, u32, {current, p.constant_u32(4)});
        emit_switch(code, high, outer);
    }
    code.begin(dispatch);
    code.e().effect(Op::OpBranch, {header});
    code.begin(shaded);
    {
        Emitter e = code.e();
        Id leave_loop = e.value(Op::OpINotEqual, p.bool_type(), {e.load(u32, state), p.constant_u32(kStateTraverse)});
        if (resumable) leave_loop = e.value(Op::OpLogicalOr, p.bool_type(), {leave_loop, out_of_budget(e)});
        const Id trace = p.module.new_id(), done = p.module.new_id();
        e.effect(Op::OpSelectionMerge, {trace, 0});
        e.effect(Op::OpBranchConditional, {leave_loop, done, trace});
        code.begin(done);
        code.e().effect(Op::OpBranch, {exit});
        code.begin(trace);
    }
    count_turn();
    if (traces) {
        const Id shading = dispatch;
        dispatch = next;
        std::vector<Block> blocks = traverse_state(*this);
        dispatch = shading;
        p.module.set_name(blocks.front().label, "state.1.traverse");
        code.e().effect(Op::OpBranch, {blocks.front().label});
        code.blocks.insert(code.blocks.end(), std::make_move_iterator(blocks.begin()),
                           std::make_move_iterator(blocks.end()));
    } else {
        code.e().effect(Op::OpBranch, {next});
    }
    code.begin(next);
    code.e().effect(Op::OpBranch, {again});
    code.begin(exit);
    if (resumable) {
        Emitter e = code.e();
        const Id budget = e.value(Op::OpINotEqual, p.bool_type(), {step_budget(), p.constant_u32(0xffffffffu)});
        code.branch(budget, [&] {
            code.branch(
                code.not_equal(code.load(state), kStateDone),
                [&] {
                    emit_transfer(code.blocks, carried, stack, top, true);
                    Emitter s = code.e();
                    call(s, "rtc_suspend");
                },
                [&] {
                    Emitter s = code.e();
                    call(s, "rtc_scratch_store", {p.constant_u32(0), p.constant_u32(kStateDone)});
                });
        });
    }
    code.e().effect(Op::OpReturn, {});

    main.blocks = std::move(code.blocks);
    if (parks) park(main, carried);
    std::vector<Inst>& first = main.blocks.front().insts;
    first.insert(first.begin(), variables_.begin(), variables_.end());
    return main;
}

}  // namespace rtc::continuation
