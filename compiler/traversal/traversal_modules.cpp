#include "traversal/traversal_modules.h"

namespace rtc {
namespace {

constexpr uint32_t kWatertight[] = {
#include "traversal_watertight.inc"
};
constexpr uint32_t kFast[] = {
#include "traversal_fast.inc"
};

constexpr TraversalModule kModules[] = {
    {"watertight", kWatertight, std::size(kWatertight)},
    {"fast", kFast, std::size(kFast)},
};

}  // namespace

const TraversalModule* find_traversal_module(std::string_view tier) {
    for (const TraversalModule& module : kModules) {
        if (tier == module.name) return &module;
    }
    return nullptr;
}

}  // namespace rtc
