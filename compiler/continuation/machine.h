// The continuation machine: the variables all states share, the functions the
// traversal module gives, and the states themselves.
//
//   state = raygen; while (state != done) switch (state) { ... }
//
// A call (trace, callable, suspending report) ends a state: it puts the payload
// into the shared words, pushes what is live, names the state to return to, and
// sets `state` to the traversal or the callee. A callee ends with `state = return`.
// See docs/architecture.md.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "ir/emitter.h"
#include "lower/stage.h"

namespace rtc {
struct TraversalModule;
}

namespace rtc::continuation {

using ir::Block;
using ir::Emitter;
using ir::Function;
using ir::Id;
using ir::Inst;
using ir::Op;
using ir::Program;

// State ids. Shader entries follow kFirstEntry in stage order, so that a handle
// read from an SBT is checked with one comparison; resume states come after.
constexpr uint32_t kStateDone = 0;
constexpr uint32_t kStateTraverse = 1;
constexpr uint32_t kFirstEntry = 2;

// One `case` of the dispatcher.
struct State {
    uint32_t id = 0;
    uint32_t stage = 0;
    std::string name;           // "name", "name.1", ... for dumps
    std::vector<Block> blocks;  // every path ends in a branch to Machine::dispatch
};

// Functions, and module-scope variables each reads or writes.
using TouchedVariables = std::vector<std::pair<Id, std::set<Id>>>;

// A program as it is when a machine was begun and traversal imported.
struct PreparedTraversal {
    Program program;  // its functions are those of traversal
    Id begun = 0;     // the bound before traversal
    std::map<std::string, Id> exports;
    TouchedVariables touched;       // candidates' variables
    ir::IdMap<Id> result_types;     // by function
    std::map<uint32_t, Id> reserved;  // resources by RTC_BINDING_*
};

class Machine {
  public:
    Machine(Program& program, const LinkOptions& options);

    Program& p;
    const LinkOptions& options;

    // The value of an acceleration structure: a heap offset, or a device address as two words.
    bool addresses() const { return options.addressing == Addressing::Address; }
    Id base_type() const { return addresses() ? p.vector_type(p.uint_type(), 2) : p.uint_type(); }

    // ---- traversal exports, by the names of compiler/traversal ----
    std::vector<Function> traversal_functions;
    // `choices`: link constants (RTC_LINK_*) known already. Nothing but this machine may be in the program yet.
    void import_traversal(const TraversalModule& traversal, const std::map<uint32_t, uint32_t>& choices);
    // Gives the other link constants their values, once the stages are known.
    void freeze_link_constants(const std::map<uint32_t, uint32_t>& values);
    Id function(const std::string& name) const;
    Id find_export(const std::string& name) const;  // 0 when there is none
    Id variable(const std::string& name) const;
    Id call(Emitter& e, const std::string& name, const std::vector<Id>& arguments = {}) const;
    Id load(Emitter& e, const std::string& name) const;
    void store(Emitter& e, const std::string& name, Id value) const;

    // ---- variables of the machine's main function ----
    Id new_variable(Id type, const std::string& name);  // Function storage; survives from state to state
    Id u32_variable(const std::string& name) { return new_variable(p.uint_type(), name); }
    Id state = 0;        // next state
    Id ret = 0;          // return state of the current shader | frame words << 16
    Id depth = 0;        // trace calls below the ray generation shader
    Id push = 0, pop = 0;  // words the dispatcher moves before the next state
    Id leave = 0;        // bool: an intact loop is being left for another state
    Id fresh = 0;        // bool: the traversal state starts a new ray
    Id report_return = 0;  // state of an intersection shader waiting for its any-hit, or 0
    Id accepted = 0;     // uint: what that any-hit decided
    Id record = 0;       // Private: first word of the record of the shader being entered
    // Private: a launch error found by a state, reported by the dispatcher. The report is a storage buffer
    // access, and drivers pay for every place that holds one.
    Id error = 0, error_detail = 0;
    void report(Emitter& e, uint32_t kind, Id detail);
    Id callable_depth = 0;
    Id callable_ret = 0;  // as ret, for callables: they cannot trace, so the two never mix
    Id payload_word(uint32_t i) { return word(payload_words_, i, "payload"); }
    Id callable_word(uint32_t i) { return word(callable_words_, i, "callable"); }
    Id frame_word(uint32_t i) { return word(frame_words_, i, "frame"); }
    uint32_t payload_word_count() const { return static_cast<uint32_t>(payload_words_.size()); }
    uint32_t callable_word_count() const { return static_cast<uint32_t>(callable_words_.size()); }
    uint32_t frame_word_count() const { return static_cast<uint32_t>(frame_words_.size()); }
    const std::vector<Inst>& variables() const { return variables_; }
    std::vector<Inst>& variables() { return variables_; }

    // Label every state branches to when it is done: the dispatch loop's continue target.
    Id dispatch = 0;

    // ---- states ----
    std::vector<State> states;
    uint32_t next_state_id = kFirstEntry;
    uint32_t entry_count = 0;
    uint32_t entry_state(uint32_t stage) const { return kFirstEntry + stage; }

    // ---- facts the passes collect ----
    bool has_stack = false;
    uint32_t max_frame_words = 0;
    uint32_t max_depth = 1;
    uint32_t max_callable_depth = 0;
    bool checks_scene = false;  // rays compare the scene with what is assumed of it
    bool any_hit = false, aabbs = false, traces = false, callables = false;
    std::vector<TraceSiteReport> sites;

    // `state = id` and back to the dispatcher.
    void go(Emitter& e, uint32_t id);
    void go_value(Emitter& e, Id value);
    // Return to the caller of the current shader.
    void go_return(Emitter& e) { go_to_saved(e, ret); }
    void go_callable_return(Emitter& e) { go_to_saved(e, callable_ret); }

    // uint f(uint record index, uint which): entry state of a record's shader, 0 for none or
    // (reported) a word that is no state of this module. `which`: 0 general or closest-hit,
    // 1 any-hit, 2 intersection. Sets `record`. region: "miss", "hit" or "callable".
    Id entry_function(const std::string& region);
    Id call_entry(Emitter& e, const std::string& region, Id index, uint32_t which);

    // bool: the lane has used up its step budget (never, when lanes cannot suspend).
    Id out_of_budget(Emitter& e) const;
    Id step_budget() const;  // the specialisation constant
    bool resumable = false;
    // Private variables that belong to shaders: what a suspended lane may have to keep.
    std::vector<Id> stage_variables;

    // ---- assembling (continuation/dispatch.cpp) ----
    // The entry point: launch, dispatch loop, states. Call when all stages are split.
    Function build_main(const std::vector<Function>& stage_functions);
    std::vector<Function> helper_functions;
    // Variables that some state reads before writing: they cross from state to state. (resume.cpp)
    std::vector<Id> carried_variables(const std::vector<Function>& stage_functions) const;
    // Moves those that are variables of `main`, which build_main has written, into memory. (park.cpp)
    void park(Function& main, std::vector<Id> wanted);
    // Functions that store and load all of `carried`, the ray and the word stack, in lane storage.
    // They run in main, so they are blocks, ending open. (resume.cpp)
    void emit_transfer(std::vector<Block>& blocks, const std::vector<Id>& carried, Id stack, Id top, bool saving);

    // Reserved resources by RTC_BINDING_*, set by import_traversal.
    std::map<uint32_t, Id> reserved;
    uint32_t stack_words = 0;
    uint32_t scratch_words = 0;  // per lane, when lanes can suspend

  private:
    Id word(std::vector<Id>& words, uint32_t i, const char* name);
    void go_to_saved(Emitter& e, Id saved);
    std::map<std::string, Id> entry_functions_;

    std::vector<Inst> variables_;
    std::vector<Id> payload_words_, callable_words_, frame_words_;
    const PreparedTraversal* traversal_ = nullptr;
};

// traversal_import.cpp
void freeze_link_constants(ir::Module& module, const std::map<uint32_t, uint32_t>& values);

// split.cpp: cuts a stage in memory form into states at its calls and adds them to the machine.
void split_stage(Program& program, lower::Stage& stage, const lower::CallKinds& kinds, Machine& machine);

// A variable whose value, or part of it, is needed after a call.
struct LiveVariable {
    Id variable = 0;
    std::vector<uint32_t> scalars;  // which of Program::flatten's leaves; empty: all
};

// liveness.cpp: for each call block of a body in memory form (by label), what is needed after the call.
// `candidates` are the variables looked at with what they hold, in order.
std::map<Id, std::vector<LiveVariable>> live_across_calls(const Program& program, const lower::Stage& stage,
                                                          const lower::CallKinds& kinds,
                                                          const std::vector<std::pair<Id, Id>>& candidates);

}  // namespace rtc::continuation
