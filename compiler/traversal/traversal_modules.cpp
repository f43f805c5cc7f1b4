#include "traversal/traversal_modules.h"

namespace rtc {
namespace {

constexpr uint32_t kWatertight[] = {
#include "traversal_watertight.inc"
};
constexpr uint32_t kFast[] = {
#include "traversal_fast.inc"
};
constexpr uint32_t kWatertightAddress[] = {
#include "traversal_watertight_address.inc"
};
constexpr uint32_t kFastAddress[] = {
#include "traversal_fast_address.inc"
};

constexpr TraversalModule kModules[] = {
    {"watertight", false, kWatertight, std::size(kWatertight)},
    {"watertight", true, kWatertightAddress, std::size(kWatertightAddress)},
    {"fast", false, kFast, std::size(kFast)},
    {"fast", true, kFastAddress, std::size(kFastAddress)},
};

}  // namespace

const TraversalModule* find_traversal_module(std::string_view tier, bool addresses) {
    for (const TraversalModule& module : kModules) {
        if (tier == module.name && addresses == module.addresses) return &module;
    }
    return nullptr;
}

}  // namespace rtc
