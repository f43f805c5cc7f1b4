// The steps of link_pipeline that are not about one stage.
#pragma once

#include "continuation/machine.h"
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
std::string validate(const std::vector<uint32_t>& spirv, uint32_t vulkan_minor, bool input);
bool optimize(std::vector<uint32_t>& spirv, Optimization level, std::string& message);

// partial.cpp: a finished module with stubs in place of its traversal functions, and back: `changed` is what
// a tool that keeps ids made of the former.
ir::Module without_traversal(const ir::Module& module);
ir::Module with_traversal(ir::Module changed, const ir::Module& original);

}  // namespace rtc::link
