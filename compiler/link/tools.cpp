// SPIRV-Tools as validator and optimiser.
#include <spirv-tools/libspirv.hpp>
#include <spirv-tools/optimizer.hpp>

#include "link/link.h"

namespace rtc::link {
namespace {

spv_target_env environment(uint32_t vulkan_minor) {
    switch (vulkan_minor) {
        case 1: return SPV_ENV_VULKAN_1_1_SPIRV_1_4;  // 1.4 rules are a superset for what an input may hold
        case 2: return SPV_ENV_VULKAN_1_2;
        default: return SPV_ENV_VULKAN_1_3;
    }
}

std::string validate_in(const std::vector<uint32_t>& spirv, spv_target_env environment) {
    std::string message;
    spvtools::SpirvTools tools(environment);
    tools.SetMessageConsumer([&](spv_message_level_t level, const char*, const spv_position_t&, const char* text) {
        if (level <= SPV_MSG_ERROR && message.empty()) message = text;
    });
    spvtools::ValidatorOptions options;
    options.SetScalarBlockLayout(true);
    options.SetUniversalLimit(spv_validator_limit_max_id_bound, 0x3fffff);
    // Names for messages are a third of the validator's work, and valid modules have no messages.
    options.SetFriendlyNames(false);
    if (tools.Validate(spirv.data(), spirv.size(), options)) return {};
    message.clear();
    options.SetFriendlyNames(true);
    tools.Validate(spirv.data(), spirv.size(), options);
    return message.empty() ? "invalid module" : message;
}

}  // namespace

std::string validate(const std::vector<uint32_t>& spirv, uint32_t vulkan_minor) {
    return validate_in(spirv, vulkan_minor == 1 ? SPV_ENV_VULKAN_1_1 : environment(vulkan_minor));
}

std::string validate_input(const ir::Module& module) {
    if (!lower::fetches_positions(module)) return validate_in(ir::write_module(module, false), SPV_ENV_VULKAN_1_3);
    // SPIRV-Tools of 2023 does not know position fetch; an input at a location is the same to its other rules.
    ir::Module known = module;
    std::erase(known.capabilities, lower::kPositionFetch);
    for (Inst& inst : known.decorations)
        if (lower::decorates_positions(inst)) {
            inst.ops[1] = static_cast<uint32_t>(spv::Decoration::Location);
            inst.ops[2] = 0;
        }
    return validate_in(ir::write_module(known, false), SPV_ENV_VULKAN_1_3);
}

bool optimize(std::vector<uint32_t>& spirv, Optimization level, bool chains, std::string& message) {
    spvtools::Optimizer optimizer(SPV_ENV_VULKAN_1_3);
    optimizer.SetMessageConsumer([&](spv_message_level_t severity, const char*, const spv_position_t&, const char* text) {
        if (severity <= SPV_MSG_ERROR && message.empty()) message = text;
    });
    // Local passes only. SPIRV-Tools' own recipes inline every function and turn the machine's
    // variables into phis of its loops: quadratic in the states, and drivers do it anyway.
    // Nothing here touches NoContraction, reorders float operations or renumbers ids (see partial.cpp).
    // Constant branches, known loads, dead code and short blocks are gone already (ir/cleanup.h).
    if (chains) optimizer.RegisterPass(spvtools::CreateLocalAccessChainConvertPass());
    optimizer.RegisterPass(spvtools::CreateLocalSingleBlockLoadStoreElimPass());
    optimizer.RegisterPass(spvtools::CreateSimplificationPass());
    if (level == Optimization::Performance) optimizer.RegisterPass(spvtools::CreateLocalRedundancyEliminationPass());
    optimizer.RegisterPass(spvtools::CreateAggressiveDCEPass());
    spvtools::OptimizerOptions options;
    options.set_preserve_spec_constants(true);
    options.set_run_validator(false);
    std::vector<uint32_t> out;
    if (!optimizer.Run(spirv.data(), spirv.size(), &out, options)) return false;
    spirv = std::move(out);
    return true;
}

}  // namespace rtc::link
