// Cuts a stage into states at its calls.
//
// The body is in memory form: no value crosses blocks except through variables. A
// region without a call stays as it is inside one state. A region with a call is
// dissolved: its blocks become states, or parts of the state that alone leads to
// them, and its branches become assignments to `state`. Code size stays linear.
#include <algorithm>

#include "continuation/machine.h"
#include "continuation/regions.h"
#include "rtc/abi.h"

namespace rtc::continuation {
namespace {

// Nested conditionals deeper than this start a state instead: lavapipe miscompiles
// (22.3) or crashes (25) above 80, and the arms themselves nest further.
constexpr int kMaxArmNesting = 8;

enum class Exit { Return, Ignore, Terminate };

class Splitter {
  public:
    Splitter(Program& program, lower::Stage& stage, const lower::CallKinds& kinds, Machine& machine)
        : p_(program), stage_(stage), kinds_(kinds), m_(machine), regions_(program, stage, kinds) {}

    void run() {
        take_variables();
        for (const Block& block : stage_.body.blocks) blocks_[block.label] = &block;
        find_starts();
        if (stage_.kind != StageKind::RayGen && stage_.kind != StageKind::AnyHit &&
            stage_.kind != StageKind::Intersection) {
            std::vector<std::pair<Id, Id>> typed;
            for (Id id : candidates_) typed.push_back({id, pointee_of(id)});
            live_ = live_across_calls(p_, stage_, kinds_, typed);
        }
        const Id entry = stage_.body.blocks.front().label;
        ids_[entry] = m_.entry_state(stage_.index);
        for (const Block& block : stage_.body.blocks)
            if (starts_.count(block.label) && block.label != entry) ids_[block.label] = m_.next_state_id++;
        emit_state(entry);
        // Emitting a state can make further blocks states (promote).
        for (bool more = true; more;) {
            more = false;
            for (const Block& block : stage_.body.blocks)
                if (starts_.count(block.label) && !emitted_.count(block.label)) {
                    emit_state(block.label);
                    more = true;
                }
        }
        emit_exit_states();
    }

  private:
    // The body's variables become the machine's: they must outlive a state.
    void take_variables() {
        std::vector<Inst>& first = stage_.body.blocks.front().insts;
        size_t count = 0;
        while (count < first.size() && first[count].op == Op::OpVariable) {
            candidates_.push_back(first[count].result);
            m_.variables().push_back(first[count]);
            ++count;
        }
        first.erase(first.begin(), first.begin() + count);
        for (Id id : stage_.variables)
            if (static_cast<spv::StorageClass>(p_.def(id)->ops[0]) == spv::StorageClass::Private)
                candidates_.push_back(id);
        if (stage_.record_base) candidates_.push_back(stage_.record_base);
    }

    // An empty block that only branches on stands for its target.
    Id forward(Id label) const {
        std::set<Id> seen;
        while (seen.insert(label).second) {
            const Block& block = *blocks_.at(label);
            if (block.insts.size() != 1 || block.insts[0].op != Op::OpBranch || !regions_.is_top(label)) break;
            label = block.insts[0].ops[0];
        }
        return label;
    }

    void find_starts() {
        starts_.insert(stage_.body.blocks.front().label);
        std::map<Id, int> arrivals;
        for (const Block& block : stage_.body.blocks) {
            if (!regions_.reachable.count(block.label)) continue;
            const bool top = regions_.is_top(block.label);
            const int headed = regions_.headed(block.label);
            if (top && (headed < 0 || regions_.constructs[headed].cut)) {
                for (Id target : block.successors()) ++arrivals[forward(target)];
                continue;
            }
            // Inside an intact region: only what leaves it counts, and always as a state.
            const int root = regions_.intact_root(block.label);
            const Construct& c = regions_.constructs[root];
            for (Id target : block.successors())
                if (!c.blocks.count(target) && target != c.merge) starts_.insert(forward(target));
        }
        for (const Construct& c : regions_.constructs)
            if (c.is_loop && c.can_suspend && !c.cut && regions_.is_top(c.header)) starts_.insert(c.header);
        for (const auto& [label, count] : arrivals) {
            const int headed = regions_.headed(label);
            const bool loop = headed >= 0 && regions_.constructs[headed].is_loop && regions_.constructs[headed].cut;
            if (count > 1 || loop) starts_.insert(label);
        }
    }

    // ---- emission ----
    struct Out {
        State state;
    };

    void emit_state(Id start) {
        emitted_.insert(start);
        out_ = Out{};
        out_.state.id = ids_.at(start);
        out_.state.stage = stage_.index;
        out_.state.name = stage_.name + (start == stage_.body.blocks.front().label
                                             ? ""
                                             : "." + std::to_string(states_emitted_));
        ++states_emitted_;
        Block head;
        head.label = p_.module.new_id();
        out_.state.blocks.push_back(head);
        if (start == stage_.body.blocks.front().label)
            append(stage_.prologue);
        lay_out(start, 0);
        m_.states.push_back(std::move(out_.state));
    }

    Block& current() { return out_.state.blocks.back(); }
    void append(const std::vector<Inst>& insts) {
        current().insts.insert(current().insts.end(), insts.begin(), insts.end());
    }
    Emitter emitter(ir::SourceLine source = {}) { return Emitter(p_, current().insts, source); }
    void begin_block(Id label) {
        Block block;
        block.label = label;
        out_.state.blocks.push_back(std::move(block));
    }

    // Code of `label` at the end of the current block.
    void lay_out(Id label, int nesting) {
        const Block& block = *blocks_.at(label);
        const int headed = regions_.headed(label);
        if (headed >= 0 && !regions_.constructs[headed].cut) {
            lay_out_intact(headed, nesting);
            return;
        }
        for (size_t i = 0; i < block.insts.size(); ++i) {
            const Inst& inst = block.insts[i];
            if (inst.is_merge()) continue;
            if (lower::is_call(inst, kinds_)) {
                emit_call(block, i);
                return;
            }
            if (!inst.is_terminator()) {
                current().insts.push_back(inst);
                continue;
            }
            emit_terminator(inst, nesting);
        }
    }

    void emit_terminator(const Inst& inst, int nesting) {
        switch (inst.op) {
            case Op::OpBranch: follow(inst.ops[0], nesting); return;
            case Op::OpBranchConditional: {
                const Id yes = forward(inst.ops[1]), no = forward(inst.ops[2]);
                if (yes == no) {
                    follow(yes, nesting);
                    return;
                }
                if (is_transition(yes, nesting) && is_transition(no, nesting)) {
                    Emitter e = emitter(inst.source);
                    m_.go_value(e, e.select(p_.uint_type(), inst.ops[0], p_.constant_u32(state_of(yes)),
                                            p_.constant_u32(state_of(no))));
                    return;
                }
                branch_to_arms(Inst(Op::OpBranchConditional, 0, 0, {inst.ops[0], yes, no}), {1, 2}, nesting);
                return;
            }
            case Op::OpSwitch: {
                Inst copy = inst;
                std::vector<size_t> places{1};
                for (size_t i = 2 + inst.switch_words; i < inst.ops.size(); i += inst.switch_words + 1u)
                    places.push_back(i);
                for (size_t i : places) copy.ops[i] = forward(copy.ops[i]);
                branch_to_arms(copy, places, nesting);
                return;
            }
            case Op::OpReturn: leave_shader(Exit::Return, inst.source); return;
            case Op::OpIgnoreIntersectionKHR: leave_shader(Exit::Ignore, inst.source); return;
            case Op::OpTerminateRayKHR: leave_shader(Exit::Terminate, inst.source); return;
            default: current().insts.push_back(inst); return;
        }
    }

    bool is_transition(Id label, int nesting) {
        if (starts_.count(label)) return true;
        return nesting >= kMaxArmNesting && promote(label);
    }

    // Makes a block met too deep in arms a state of its own.
    bool promote(Id label) {
        if (!ids_.count(label)) {
            ids_[label] = m_.next_state_id++;
            starts_.insert(label);
        }
        return true;
    }

    uint32_t state_of(Id label) { return ids_.at(label); }

    void follow(Id target, int nesting) {
        target = forward(target);
        if (starts_.count(target)) {
            Emitter e = emitter();
            m_.go(e, state_of(target));
            return;
        }
        const Id label = target;
        Emitter e = emitter();
        e.effect(Op::OpBranch, {label});
        begin_block(label);
        lay_out(label, nesting);
    }

    // A dissolved selection whose arms are not states: the arms are nested in this one, each ends in a
    // transition, and the merge block is never reached.
    void branch_to_arms(Inst inst, const std::vector<size_t>& places, int nesting) {
        const Id merge = p_.module.new_id();
        std::vector<std::pair<Id, Id>> arms;  // label in the state, original block
        std::map<Id, Id> arm_of;
        for (size_t i : places) {
            const Id target = inst.ops[i];
            Id& label = arm_of[target];
            if (!label) {
                label = is_transition(target, nesting) ? p_.module.new_id() : target;
                arms.push_back({label, target});
            }
            inst.ops[i] = label;
        }
        Emitter e = emitter();
        e.effect(Op::OpSelectionMerge, {merge, 0});
        current().insts.push_back(inst);
        for (const auto& [label, target] : arms) {
            begin_block(label);
            if (label != target) {
                Emitter a = emitter();
                m_.go(a, state_of(target));
            } else {
                lay_out(target, nesting + 1);
            }
        }
        begin_block(merge);
        emitter().effect(Op::OpUnreachable, {});
    }

    // A region without calls: verbatim, except where it leaves for another state or ends the shader.
    void lay_out_intact(int root, int nesting) {
        const Construct& region = regions_.constructs[root];
        // Loops that something leaves early get a check at their merge block.
        std::map<Id, Id> loop_checks;  // merge label -> label of the check in front of it
        std::map<Id, int> loop_of_check;
        for (size_t c = 0; c < regions_.constructs.size(); ++c) {
            const Construct& loop = regions_.constructs[c];
            if (!loop.is_loop || !region.blocks.count(loop.header)) continue;
            if (leaves_early(loop, region) || suspends(loop, region)) loop_checks[loop.merge] = p_.module.new_id();
            loop_of_check[loop.merge] = static_cast<int>(c);
        }
        bool first = true;
        for (const Block& block : stage_.body.blocks) {
            if (!region.blocks.count(block.label) || !regions_.reachable.count(block.label)) continue;
            if (const auto check = loop_checks.find(block.label); check != loop_checks.end())
                emit_check(check->second, block.label, loop_of_check.at(block.label), root, loop_checks);
            if (!first) begin_block(block.label);
            else if (current().label != block.label) {
                // The state's first block holds the prologue; the region's header needs its own label.
                emitter().effect(Op::OpBranch, {block.label});
                begin_block(block.label);
            }
            first = false;
            emit_intact_block(block, root, loop_checks);
        }
        // Unreachable merge and continue blocks of constructs inside must exist all the same.
        for (const Block& block : stage_.body.blocks) {
            if (regions_.reachable.count(block.label)) continue;
            bool named = false;
            for (const Construct& c : regions_.constructs)
                if (region.blocks.count(c.header) && (c.merge == block.label || c.continue_target == block.label) &&
                    &c != &region)
                    named = true;
            if (region.is_loop && region.continue_target == block.label) named = true;
            if (!named) continue;
            if (const auto check = loop_checks.find(block.label); check != loop_checks.end())
                emit_check(check->second, block.label, loop_of_check.at(block.label), root, loop_checks);
            begin_block(block.label);
            Id back = 0;
            for (const Construct& c : regions_.constructs)
                if (c.is_loop && c.continue_target == block.label) back = c.header;
            if (back)
                emitter().effect(Op::OpBranch, {back});
            else
                emitter().effect(Op::OpUnreachable, {});
        }
        if (const auto check = loop_checks.find(region.merge); check != loop_checks.end())
            emit_check(check->second, region.merge, root, -1, loop_checks);
        begin_block(region.merge);
        if (!regions_.reachable.count(region.merge)) {
            emitter().effect(Op::OpUnreachable, {});
        } else if (starts_.count(region.merge)) {
            Emitter e = emitter();
            m_.go(e, state_of(region.merge));
        } else {
            lay_out(region.merge, nesting);
        }
    }

    static bool suspends(const Construct& loop, const Construct& region) {
        return loop.can_suspend && loop.header == region.header;
    }

    bool leaves_early(const Construct& loop, const Construct& region) const {
        for (Id label : loop.blocks) {
            if (!regions_.reachable.count(label)) continue;
            const Block& block = *blocks_.at(label);
            const Op op = block.terminator().op;
            if (op == Op::OpReturn || op == Op::OpIgnoreIntersectionKHR || op == Op::OpTerminateRayKHR) return true;
            for (Id target : block.successors())
                if (!region.blocks.count(target) && target != region.merge) return true;
        }
        return false;
    }

    // Innermost loop of the intact region `root` around a block, or -1.
    int enclosing_loop(Id label, int root) const {
        int c = regions_.headed(label);
        if (c < 0) c = regions_.around(label);
        for (; c >= 0; c = regions_.constructs[c].parent) {
            if (regions_.constructs[c].is_loop && regions_.constructs[c].blocks.count(label)) return c;
            if (c == root) break;
        }
        return -1;
    }

    // In front of a loop's merge block: was the loop left for another state?
    void emit_check(Id check, Id merge, int loop, int root, const std::map<Id, Id>& checks) {
        begin_block(check);
        Emitter e = emitter();
        const Id left = e.load(p_.bool_type(), m_.leave);
        const Id out = p_.module.new_id();
        e.effect(Op::OpSelectionMerge, {merge, 0});
        e.effect(Op::OpBranchConditional, {left, out, merge});
        begin_block(out);
        int outer = -1;
        if (root >= 0)
            for (int c = regions_.constructs[loop].parent; c >= 0; c = regions_.constructs[c].parent) {
                if (regions_.constructs[c].is_loop && !regions_.constructs[c].cut) {
                    outer = c;
                    break;
                }
                if (c == root) break;
            }
        emitter().effect(Op::OpBranch, {outer >= 0 ? checks.at(regions_.constructs[outer].merge) : m_.dispatch});
    }

    void emit_intact_block(const Block& block, int root, const std::map<Id, Id>& checks) {
        const Construct& region = regions_.constructs[root];
        size_t first = 0;
        if (block.label == region.header && suspends(region, region)) first = emit_budget_check(block, checks);
        for (size_t i = first; i + 1 < block.insts.size(); ++i) {
            Inst inst = block.insts[i];
            if (inst.op == Op::OpLoopMerge) {
                if (first) continue;  // emitted with the budget check
                if (const auto check = checks.find(inst.ops[0]); check != checks.end()) inst.ops[0] = check->second;
            }
            current().insts.push_back(std::move(inst));
        }
        Inst terminator = block.terminator();
        std::vector<std::pair<Id, Id>> stubs;  // label, target outside
        const int loop = enclosing_loop(block.label, root);
        switch (terminator.op) {
            case Op::OpReturn: leave_intact(exit_state(Exit::Return), loop, checks); return;
            case Op::OpIgnoreIntersectionKHR: leave_intact(exit_state(Exit::Ignore), loop, checks); return;
            case Op::OpTerminateRayKHR: leave_intact(exit_state(Exit::Terminate), loop, checks); return;
            default: break;
        }
        std::vector<size_t> places;
        if (terminator.op == Op::OpBranch) places = {0};
        if (terminator.op == Op::OpBranchConditional) places = {1, 2};
        if (terminator.op == Op::OpSwitch) {
            places = {1};
            for (size_t i = 2 + terminator.switch_words; i < terminator.ops.size(); i += terminator.switch_words + 1u)
                places.push_back(i);
        }
        for (size_t i : places) {
            const Id target = terminator.ops[i];
            if (region.blocks.count(target) || target == region.merge) {
                // A break goes through the loop's check.
                const auto check = checks.find(target);
                if (check != checks.end() && is_break(block.label, target)) terminator.ops[i] = check->second;
                continue;
            }
            if (terminator.op == Op::OpBranch) {
                leave_intact(state_of(forward(target)), loop, checks);
                return;
            }
            const Id stub = p_.module.new_id();
            stubs.push_back({stub, forward(target)});
            terminator.ops[i] = stub;
        }
        // A conditional exit without a merge instruction was a conditional break; as an ordinary
        // branch it needs one.
        Id rest = 0;
        if (!stubs.empty() && terminator.op == Op::OpBranchConditional && !block.merge()) {
            rest = p_.module.new_id();
            const size_t other = terminator.ops[1] == stubs[0].first ? 2 : 1;
            const Id other_target = terminator.ops[other];
            emitter().effect(Op::OpSelectionMerge, {rest, 0});
            if (stubs.size() == 1) terminator.ops[other] = rest;
            current().insts.push_back(terminator);
            for (const auto& [stub, target] : stubs) {
                begin_block(stub);
                leave_intact(state_of(target), loop, checks);
            }
            begin_block(rest);
            if (stubs.size() == 1)
                emitter().effect(Op::OpBranch, {other_target});
            else
                emitter().effect(Op::OpUnreachable, {});
            return;
        }
        current().insts.push_back(terminator);
        for (const auto& [stub, target] : stubs) {
            begin_block(stub);
            leave_intact(state_of(target), loop, checks);
        }
    }

    // Header of a loop that can suspend: at the start of each turn, a lane out of budget leaves and comes back
    // to this very state. Returns the index of the first instruction still to be emitted.
    size_t emit_budget_check(const Block& block, const std::map<Id, Id>& checks) {
        const Inst& merge = *block.merge();
        const Id check = checks.at(merge.ops[0]);
        const Id test = p_.module.new_id(), out = p_.module.new_id(), rest = p_.module.new_id();
        // The turn counter in front (lower/loops.cpp) stays in front.
        size_t first = 0;
        while (first < 3) current().insts.push_back(block.insts[first++]);
        Emitter head = emitter();
        head.effect(Op::OpLoopMerge, {check, merge.ops[1], 0});
        head.effect(Op::OpBranch, {test});
        begin_block(test);
        Emitter e = emitter();
        const Id exhausted = m_.out_of_budget(e);
        e.effect(Op::OpSelectionMerge, {rest, 0});
        e.effect(Op::OpBranchConditional, {exhausted, out, rest});
        begin_block(out);
        Emitter leave = emitter();
        leave.store_u32(m_.state, state_of(block.label));
        leave.store(m_.leave, p_.constant_bool(true));
        leave.effect(Op::OpBranch, {check});
        begin_block(rest);
        return first;
    }

    bool is_break(Id from, Id merge) const {
        for (const Construct& c : regions_.constructs)
            if (c.is_loop && c.merge == merge) return c.blocks.count(from) != 0;
        return false;
    }

    // From inside an intact region to a state: directly, or loop by loop outward.
    void leave_intact(uint32_t state, int loop, const std::map<Id, Id>& checks) {
        Emitter e = emitter();
        e.store_u32(m_.state, state);
        if (loop < 0) {
            e.effect(Op::OpBranch, {m_.dispatch});
            return;
        }
        e.store(m_.leave, p_.constant_bool(true));
        e.effect(Op::OpBranch, {checks.at(regions_.constructs[loop].merge)});
    }

    // ---- ends of the shader ----
    uint32_t exit_state(Exit exit) {
        const auto known = exit_states_.find(exit);
        if (known != exit_states_.end()) return known->second;
        return exit_states_[exit] = m_.next_state_id++;
    }

    void emit_exit_states() {
        for (const auto& [exit, id] : exit_states_) {
            out_ = Out{};
            out_.state.id = id;
            out_.state.stage = stage_.index;
            out_.state.name = stage_.name + ".exit";
            begin_block(p_.module.new_id());
            leave_shader(exit, {});
            m_.states.push_back(std::move(out_.state));
        }
    }

    void leave_shader(Exit exit, ir::SourceLine source) {
        Emitter e = emitter(source);
        const Id u32 = p_.uint_type();
        if (stage_.incoming) {
            const Id type = p_.pointee(p_.def(stage_.incoming)->type);
            const std::vector<Id> words = e.to_words(e.load(type, stage_.incoming), type);
            for (uint32_t i = 0; i < words.size(); ++i)
                e.store(stage_.kind == StageKind::Callable ? m_.callable_word(i) : m_.payload_word(i), words[i]);
        }
        switch (stage_.kind) {
            case StageKind::RayGen: m_.go(e, kStateDone); return;
            case StageKind::ClosestHit:
            case StageKind::Miss: m_.go_return(e); return;
            case StageKind::Callable: m_.go_callable_return(e); return;
            case StageKind::Intersection: m_.go(e, kStateTraverse); return;
            case StageKind::AnyHit: break;
        }
        if (exit != Exit::Ignore) m_.call(e, "rtc_trace_accept");
        if (exit == Exit::Terminate) {
            // An intersection shader waiting for this any-hit ends too.
            m_.call(e, "rtc_trace_stop");
            m_.go(e, kStateTraverse);
            return;
        }
        e.store_u32(m_.accepted, exit == Exit::Ignore ? 0 : 1);
        Id back = e.load(u32, m_.report_return);
        back = e.select(u32, e.value(Op::OpINotEqual, p_.bool_type(), {back, p_.constant_u32(0)}), back,
                        p_.constant_u32(kStateTraverse));
        if (exit == Exit::Return) {
            const Id flags = e.value(Op::OpBitwiseAnd, u32, {m_.load(e, "rtc_ray_flags"), p_.constant_u32(4)});
            back = e.select(u32, e.value(Op::OpINotEqual, p_.bool_type(), {flags, p_.constant_u32(0)}),
                            p_.constant_u32(kStateTraverse), back);
        }
        m_.go_value(e, back);
    }

    // ---- calls ----
    void emit_call(const Block& block, size_t at) {
        const Inst& inst = block.insts[at];
        // The instructions between the call and the branch run after the return.
        const Id next = forward(block.terminator().ops[0]);
        const uint32_t resume = m_.next_state_id++;
        if (lower::is_trace(inst.op))
            emit_trace(block, inst, resume);
        else if (lower::is_callable(inst.op))
            emit_callable(block, inst, resume);
        else
            emit_report(inst, resume);
        State saved = std::move(out_.state);

        out_.state = State{};
        out_.state.id = resume;
        out_.state.stage = stage_.index;
        out_.state.name = stage_.name + "." + std::to_string(states_emitted_++);
        begin_block(p_.module.new_id());
        emit_resume(block, inst);
        for (size_t i = at + 1; i + 1 < block.insts.size(); ++i) current().insts.push_back(block.insts[i]);
        follow(next, 0);
        m_.states.push_back(std::move(out_.state));
        out_.state = std::move(saved);
    }

    bool pushes_frame(const Inst& inst) const {
        return lower::is_trace(inst.op) ? stage_.kind != StageKind::RayGen
                                        : lower::is_callable(inst.op) && stage_.kind == StageKind::Callable;
    }

    // Copies what is live, and the return state, to the frame words; returns their number.
    uint32_t save_frame(Emitter& e, const Block& block, const Inst& inst, Id return_variable) {
        uint32_t count = 0;
        TraceSiteReport site;
        site.stage = stage_.name;
        site.callable = lower::is_callable(inst.op);
        site.file = p_.module.files[inst.source.file];
        site.line = inst.source.line;
        if (pushes_frame(inst)) {
            for (const LiveVariable& live : live_[block.label]) {
                const std::string name = p_.name_of(live.variable);
                for_each_live(e, live, [&](Id pointer, Id type) {
                    for (Id word : e.to_words(e.load(type, pointer), type)) e.store(m_.frame_word(count++), word);
                });
                site.variables.push_back(name.empty() ? "(temporary)" : name);
            }
            e.store(m_.frame_word(count++), e.load(p_.uint_type(), return_variable));
            m_.has_stack = true;
            m_.max_frame_words = std::max(m_.max_frame_words, count);
        }
        site.frame_bytes = count * 4;
        m_.sites.push_back(std::move(site));
        return count;
    }

    // The whole variable, or its live scalars one by one.
    void for_each_live(Emitter& e, const LiveVariable& live, const std::function<void(Id pointer, Id type)>& fn) {
        const Id type = pointee_of(live.variable);
        if (live.scalars.empty()) return fn(live.variable, type);
        std::vector<ir::Leaf> leaves;
        p_.flatten(type, leaves, "a live value");
        const Inst* global = p_.def(live.variable);
        const auto storage = global ? static_cast<spv::StorageClass>(global->ops[0]) : spv::StorageClass::Function;
        for (uint32_t i : live.scalars) {
            std::vector<Id> path;
            for (uint32_t index : leaves[i].path) path.push_back(p_.constant_u32(index));
            fn(e.chain(storage, leaves[i].type, live.variable, path), leaves[i].type);
        }
    }

    Id pointee_of(Id variable) const {
        if (const Inst* global = p_.def(variable)) return p_.pointee(global->type);
        for (const Inst& inst : m_.variables())
            if (inst.result == variable) return p_.pointee(inst.type);
        return 0;
    }

    void restore_frame(Emitter& e, const Block& block, const Inst& inst, Id return_variable) {
        if (!pushes_frame(inst)) return;
        uint32_t at = 0;
        for (const LiveVariable& live : live_[block.label])
            for_each_live(e, live, [&](Id pointer, Id type) {
                const uint32_t count = p_.word_count(type, "a live value");
                std::vector<Id> words;
                for (uint32_t i = 0; i < count; ++i) words.push_back(e.load(p_.uint_type(), m_.frame_word(at++)));
                size_t used = 0;
                e.store(pointer, e.from_words(type, words, used));
            });
        e.store(return_variable, e.load(p_.uint_type(), m_.frame_word(at)));
    }

    Id as_uint(Emitter& e, Id value) {
        const Id type = value_type(value);
        return e.as_uint(value, type);
    }

    Id value_type(Id value) {
        if (const Inst* global = p_.def(value)) return global->type;
        for (auto block = out_.state.blocks.rbegin(); block != out_.state.blocks.rend(); ++block)
            for (auto inst = block->insts.rbegin(); inst != block->insts.rend(); ++inst)
                if (inst->result == value) return inst->type;
        return p_.uint_type();
    }

    void emit_trace(const Block& block, const Inst& inst, uint32_t resume) {
        m_.traces = true;
        Emitter e = emitter(inst.source);
        const Id u32 = p_.uint_type();
        // OpTraceRayKHR: AS, flags, cull mask, SBT offset, SBT stride, miss index, origin, tmin, direction, tmax, payload
        const Id payload = inst.ops[10];
        const Id type = pointee_of(payload);
        const std::vector<Id> words = e.to_words(e.load(type, payload), type);
        for (uint32_t i = 0; i < words.size(); ++i) e.store(m_.payload_word(i), words[i]);
        const std::vector<Id> ops(inst.ops.begin(), inst.ops.end());
        auto masked = [&](Id value, uint32_t mask) {
            uint64_t constant = 0;
            if (p_.constant_value(value, constant)) return p_.constant_u32(static_cast<uint32_t>(constant) & mask);
            return e.value(Op::OpBitwiseAnd, u32, {as_uint(e, value), p_.constant_u32(mask)});
        };
        m_.store(e, "rtc_ray_root", ops[0]);
        m_.store(e, "rtc_ray_flags", as_uint(e, ops[1]));
        // Operand bits that count: SPV_KHR_ray_tracing, OpTraceRayKHR.
        m_.store(e, "rtc_ray_mask", masked(ops[2], 0xff));
        m_.store(e, "rtc_ray_sbt_offset", masked(ops[3], 0xf));
        m_.store(e, "rtc_ray_sbt_stride", masked(ops[4], 0xf));
        m_.store(e, "rtc_ray_miss", masked(ops[5], 0xffff));
        m_.store(e, "rtc_ray_origin", ops[6]);
        m_.store(e, "rtc_ray_tmin", ops[7]);
        m_.store(e, "rtc_ray_direction", ops[8]);
        m_.store(e, "rtc_ray_tmax", ops[9]);
        const uint32_t frame = save_frame(e, block, inst, m_.ret);
        e.store_u32(m_.ret, resume | frame << 16);
        if (stage_.kind == StageKind::RayGen) {
            e.store_u32(m_.depth, 1);
            e.store(m_.fresh, p_.constant_bool(true));
            m_.go(e, kStateTraverse);
            return;
        }
        const Id depth = e.add(e.load(u32, m_.depth), p_.constant_u32(1));
        e.store(m_.depth, depth);
        const Id fits = e.value(Op::OpULessThanEqual, p_.bool_type(), {depth, p_.constant_u32(m_.max_depth)});
        branch_call(e, fits, RTC_LAUNCH_ERROR_RECURSION_DEPTH, p_.constant_u32(resume), resume, [&](Emitter& go) {
            go.store_u32(m_.push, frame);
            go.store(m_.fresh, p_.constant_bool(true));
            m_.go(go, kStateTraverse);
        });
    }

    // if (ok) { call } else { report; go on as if the call had returned }
    void branch_call(Emitter& e, Id ok, uint32_t error, Id detail, uint32_t resume,
                     const std::function<void(Emitter&)>& call) {
        const Id yes = p_.module.new_id(), no = p_.module.new_id(), merge = p_.module.new_id();
        e.effect(Op::OpSelectionMerge, {merge, 0});
        e.effect(Op::OpBranchConditional, {ok, yes, no});
        begin_block(yes);
        Emitter taken = emitter();
        call(taken);
        begin_block(no);
        Emitter dropped = emitter();
        if (error) m_.report(dropped, error, detail);
        m_.go(dropped, resume);
        begin_block(merge);
        emitter().effect(Op::OpUnreachable, {});
    }

    void emit_callable(const Block& block, const Inst& inst, uint32_t resume) {
        m_.callables = true;
        Emitter e = emitter(inst.source);
        const Id u32 = p_.uint_type();
        const Id data = inst.ops[1];
        const Id type = pointee_of(data);
        const std::vector<Id> words = e.to_words(e.load(type, data), type);
        for (uint32_t i = 0; i < words.size(); ++i) e.store(m_.callable_word(i), words[i]);
        const Id index = as_uint(e, inst.ops[0]);
        const uint32_t frame = save_frame(e, block, inst, m_.callable_ret);
        e.store_u32(m_.callable_ret, resume | frame << 16);
        const Id depth = e.add(e.load(u32, m_.callable_depth), p_.constant_u32(1));
        e.store(m_.callable_depth, depth);
        const Id fits = e.value(Op::OpULessThanEqual, p_.bool_type(), {depth, p_.constant_u32(m_.max_callable_depth)});
        branch_call(e, fits, RTC_LAUNCH_ERROR_CALLABLE_DEPTH, p_.constant_u32(resume), resume, [&](Emitter& go) {
            const Id entry = m_.call_entry(go, "callable", index, 0);
            const Id found = go.value(Op::OpINotEqual, p_.bool_type(), {entry, p_.constant_u32(0)});
            go.store(m_.push, go.select(u32, found, p_.constant_u32(frame), p_.constant_u32(0)));
            m_.go_value(go, go.select(u32, found, entry, p_.constant_u32(resume)));
        });
    }

    // OpReportIntersectionKHR: t, kind. Accepts at once when no any-hit shader has to decide.
    void emit_report(const Inst& inst, uint32_t resume) {
        Emitter e = emitter(inst.source);
        const Id u32 = p_.uint_type();
        e.store_u32(m_.accepted, 0);
        const Id in_range = m_.call(e, "rtc_report_begin", {inst.ops[0], as_uint(e, inst.ops[1])});
        branch_call(e, in_range, 0, 0, resume, [&](Emitter&) {
            Emitter a = emitter(inst.source);
            if (stage_.attribute) {
                const Id type = pointee_of(stage_.attribute);
                const std::vector<Id> words = a.to_words(a.load(type, stage_.attribute), type);
                for (size_t i = 0; i < words.size() && i < 8; ++i)
                    m_.store(a, "rtc_cand_attr" + std::to_string(i), words[i]);
            }
            Id shader = p_.constant_u32(0);
            if (m_.any_hit) {
                const Id opaque = a.value(Op::OpINotEqual, p_.bool_type(),
                                          {m_.load(a, "rtc_cand_opaque"), p_.constant_u32(0)});
                const Id entry = m_.call_entry(a, "hit", m_.load(a, "rtc_cand_record"), 1);
                shader = a.select(u32, opaque, p_.constant_u32(0), entry);
            }
            const Id none = a.value(Op::OpIEqual, p_.bool_type(), {shader, p_.constant_u32(0)});
            const Id yes = p_.module.new_id(), no = p_.module.new_id(), merge = p_.module.new_id();
            a.effect(Op::OpSelectionMerge, {merge, 0});
            a.effect(Op::OpBranchConditional, {none, yes, no});
            begin_block(yes);
            Emitter accept = emitter();
            m_.call(accept, "rtc_trace_accept");
            accept.store_u32(m_.accepted, 1);
            const Id flag = accept.value(Op::OpBitwiseAnd, u32, {m_.load(accept, "rtc_ray_flags"), p_.constant_u32(4)});
            const Id first = accept.value(Op::OpINotEqual, p_.bool_type(), {flag, p_.constant_u32(0)});
            m_.go_value(accept, accept.select(u32, first, p_.constant_u32(kStateTraverse), p_.constant_u32(resume)));
            begin_block(no);
            Emitter ask = emitter();
            ask.store_u32(m_.report_return, resume);
            m_.go_value(ask, shader);
            begin_block(merge);
            emitter().effect(Op::OpUnreachable, {});
        });
    }

    void emit_resume(const Block& block, const Inst& inst) {
        Emitter e = emitter(inst.source);
        const Id u32 = p_.uint_type();
        if (lower::is_report(inst.op)) {
            current().insts.push_back(Inst(Op::OpINotEqual, p_.bool_type(), inst.result,
                                           {e.load(u32, m_.accepted), p_.constant_u32(0)}));
            return;
        }
        const bool trace = lower::is_trace(inst.op);
        restore_frame(e, block, inst, trace ? m_.ret : m_.callable_ret);
        const Id counter = trace ? m_.depth : m_.callable_depth;
        e.store(counter, e.value(Op::OpISub, u32, {e.load(u32, counter), p_.constant_u32(1)}));
        const Id data = inst.ops[trace ? 10 : 1];
        const Id type = pointee_of(data);
        const uint32_t count = p_.word_count(type, "a payload");
        std::vector<Id> words;
        for (uint32_t i = 0; i < count; ++i)
            words.push_back(e.load(u32, trace ? m_.payload_word(i) : m_.callable_word(i)));
        size_t at = 0;
        e.store(data, e.from_words(type, words, at));
    }

    Program& p_;
    lower::Stage& stage_;
    const lower::CallKinds& kinds_;
    Machine& m_;
    Regions regions_;
    std::vector<Id> candidates_;
    std::map<Id, std::vector<LiveVariable>> live_;
    std::map<Id, const Block*> blocks_;
    std::set<Id> starts_, emitted_;
    std::map<Id, uint32_t> ids_;
    std::map<Exit, uint32_t> exit_states_;
    Out out_;
    uint32_t states_emitted_ = 0;
};

}  // namespace

void split_stage(Program& program, lower::Stage& stage, const lower::CallKinds& kinds, Machine& machine) {
    Splitter(program, stage, kinds, machine).run();
}

}  // namespace rtc::continuation
