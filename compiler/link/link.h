// The steps of link_pipeline that are not about one stage.
#pragma once

#include "continuation/machine.h"
#include "link/bits.h"
#include "lower/stage.h"

namespace rtc::link {

using ir::Id;
using ir::Inst;
using ir::Op;
using ir::Program;

// specialize.cpp: bakes a stage instance's specialisation into its module, and gives the constants left
// open ids that are unique in the pipeline. `used` collects the ids given out.
void specialize(ir::Module& module, const StageInput& stage, std::map<uint32_t, uint32_t>& used,
                std::vector<SpecConstantReport>& report);

// fold.cpp: constants and branches never taken, in everything `main` reaches; what it still reaches then, callees
// first. `given`: what loads of these variables give, whatever is stored; stores to those whose content is one
// constant are dropped.
std::vector<ir::Function*> fold(Program& program, Id main, const std::map<Id, Bits>& given, BitAnalysis::Tables& tables);
// dead.cpp: values, stores and calls that nobody needs. `functions`: all that runs, callees first. Words of a waiting
// ray (`save` calling `scratch_store`) are kept only where somebody reads their variable.
void remove_dead(Program& program, const std::vector<ir::Function*>& functions, Id save, Id scratch_store);

// facts.cpp: what is known about a pipeline's rays and scene, see docs/specialisation.md.
struct TraceFacts {
    uint32_t sites = 0;
    Bits flags, mask, offset, stride, miss;  // certain at every trace site
};
// Adds a stage's trace sites. The stage is in memory form. `tables`: one for all stages.
void collect_trace_facts(const Program& program, const lower::Stage& stage, TraceFacts& facts,
                         BitAnalysis::Tables& tables);

// What of the traversal a pipeline needs.
struct Needs {
    bool any_hit = true;
    bool aabbs = true;
    bool triangles = true;
    bool mixed = true;           // instances may hold either
    bool non_opaque = true;      // geometries or instances may be not opaque
    bool masks = true;           // instance masks other than 0xff
    bool instance_flags = true;
    bool transforms = true;
    bool levels = true;          // more than one instance
};
// Of the scene alone, as the user promised: all but any_hit, aabbs and triangles.
Needs scene_needs(const LinkOptions& options);
// `reports` receives a line per fact. `records`, `nested`: some stage reads its record; traces from a hit or miss.
struct PipelineShape {
    bool has_any_hit = false, has_intersection = false;
    bool records = false, nested = false;
    uint32_t recursion_depth = 1;
};
Needs decide(const TraceFacts& traces, const PipelineShape& shape, const LinkOptions& options,
             std::vector<FactReport>& reports);

// resources.cpp: one variable per resource, whichever stages declare it; conflicts are errors. `known` holds
// what earlier stages declared, by set, binding and type.
struct ResourceTable {
    std::map<std::vector<uint32_t>, Id> variables;
    std::map<std::pair<uint32_t, uint32_t>, std::pair<std::string, std::string>> kinds;  // (set, binding) -> kind, stage
    std::map<std::pair<uint32_t, uint32_t>, Id> first;  // the first variable at (set, binding)
    Id push_constants = 0;
};
// push_constants.cpp: looks at all stages' push-constant blocks before any is lowered. When they differ, makes
// Program::push_words.
void prepare_push_constants(Program& program, const std::vector<ir::Module>& modules, Reflection& reflection);
void unify_resources(Program& program, lower::Stage& stage, ResourceTable& table, Reflection& reflection);

// finish.cpp
// Picks the reserved set and places our resources in it.
void place_reserved(Program& program, continuation::Machine& machine, const LinkOptions& options,
                    Reflection& reflection);
// Removes what nothing uses, orders globals, and numbers ids by first appearance.
void tidy(Program& program, const std::vector<Id>& roots);
// The entry point's declaration, capabilities, extensions and version.
void declare_entry(Program& program, Id main, const LinkOptions& options, Reflection& reflection);
// The entry point's interface: what its version asks for of the variables tidy has left.
void declare_interface(ir::Module& module);
std::vector<std::string> required_features(const ir::Module& module);

// tools.cpp: SPIRV-Tools as a validator and an optimiser. Empty string: valid.
std::string validate(const std::vector<uint32_t>& spirv, uint32_t vulkan_minor);
std::string validate_input(const ir::Module& module);  // a stage's
// `chains`: stores to parts of local variables become insertions into the whole.
bool optimize(std::vector<uint32_t>& spirv, Optimization level, bool chains, std::string& message);

// partial.cpp: a finished module with stubs in place of its traversal functions, and back: `changed` is what
// a tool that keeps ids made of the former.
ir::Module without_traversal(const ir::Module& module);
ir::Module with_traversal(ir::Module changed, ir::Module original);

}  // namespace rtc::link
