// One stage instance on its way through the lowering passes, and the passes.
// They run in the order listed here (see link/pipeline.cpp for why).
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "ir/emitter.h"

namespace rtc {

namespace continuation {
class Machine;
}

namespace lower {

using ir::Block;
using ir::Function;
using ir::Id;
using ir::Inst;
using ir::Op;
using ir::Program;

// Code of an inlined function: entered at `entry` (an empty block), left to `exit`.
// Returns from nested constructs jump straight to `exit`, so both are state boundaries.
struct InlineRegion {
    Id entry = 0;
    Id exit = 0;
};

struct Stage {
    StageKind kind = StageKind::RayGen;
    uint32_t index = 0;
    std::string name;
    std::string file;
    Function body;                     // the entry point's function
    std::vector<Function> functions;   // functions it calls, those not inlined
    std::vector<InlineRegion> inlined;
    std::vector<Id> variables;         // its own module-scope variables, in order
    // Set by interface lowering; all are Private variables of this stage, 0 when unused.
    Id incoming = 0;                   // incoming payload or callable data
    Id attribute = 0;                  // hit attribute
    Id record_base = 0;                // first word of the shader record in its SBT region
    std::vector<Inst> prologue;        // runs when the stage is entered
    uint32_t record_bytes = 0;

    [[noreturn]] void fail(const std::string& id, const ir::SourceLine& source, const std::string& text,
                           const Program& program) const;
};

// Can the instruction suspend the stage? Set by the pipeline: reportIntersection
// does only where an any-hit shader may have to run in between.
struct CallKinds {
    bool report_suspends = false;
    bool loops_suspend = false;  // long loops can be left in the middle and resumed
};
bool is_call(const Inst& inst, const CallKinds& kinds);
inline bool is_trace(Op op) { return op == Op::OpTraceRayKHR; }
inline bool is_callable(Op op) { return op == Op::OpExecuteCallableKHR; }
inline bool is_report(Op op) { return op == Op::OpReportIntersectionKHR; }

// entry.cpp: checks the module's rules for its stage and picks the entry point's functions; sets
// Stage::body, functions, variables. `functions` and `module_variables` are what the stage's module brought.
void select_entry(Program& program, Stage& stage, std::vector<Function> functions, Id entry,
                  const std::set<Id>& module_variables);

// exits.cpp: NV's ignore/terminate become terminators; NV's trace and callable locations become variables.
void normalize_calls(Program& program, Stage& stage);

// inline.cpp: inlines every function on a path to a call or an exit.
void inline_calls(Program& program, Stage& stage, const CallKinds& kinds);

// interface.cpp: acceleration structures become root words; payload, attribute and callable variables become
// Private; built-ins become Private variables set on entry or globals of the traversal.
void lower_interface(Program& program, Stage& stage, continuation::Machine& machine);

// The same, for SPV_KHR_ray_tracing_position_fetch, which is younger than Debian's SPIR-V headers: its capability and
// built-in; whether an instruction decorates the latter, or a module declares the former.
constexpr auto kPositionFetch = static_cast<spv::Capability>(5336);  // RayTracingPositionFetchKHR
constexpr auto kHitPositions = static_cast<spv::BuiltIn>(5335);      // HitTriangleVertexPositionsKHR
bool decorates_positions(const Inst& inst);
bool fetches_positions(const ir::Module& module);

// records.cpp: loads from the shader record become word loads from the SBT; where Program::push_words is set,
// loads of push constants become loads of its words.
void lower_records(Program& program, Stage& stage, continuation::Machine& machine);

// memory.cpp: every call ends its block, no phi is left, and no value is used outside the block that makes it.
void to_memory_form(Program& program, Stage& stage, const CallKinds& kinds);

// indices.cpp: computed indices into small variables become selections. Needs memory form, and keeps it.
void select_elements(Program& program, Stage& stage);

// loops.cpp: counts loop iterations against the step budget. A short loop has a small constant trip count.
bool is_short_loop(const Program& program, const Function& function, const Block& header);
bool has_long_loop(const Program& program, const Function& function);
void count_loops(Program& program, Stage& stage, continuation::Machine& machine);

}  // namespace lower
}  // namespace rtc
