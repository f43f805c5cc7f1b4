#include "traversal/traversal_modules.h"

namespace rtc {
namespace {

constexpr uint32_t kWatertight[] = {
#include "traversal_watertight.inc"
};
constexpr uint32_t kFast[] = {
#include "traversal_fast.inc"
};
constexpr uint32_t kExact[] = {
#include "traversal_exact.inc"
};
constexpr uint32_t kExact64[] = {
#include "traversal_exact64.inc"
};
constexpr uint32_t kWatertightAddress[] = {
#include "traversal_watertight_address.inc"
};
constexpr uint32_t kFastAddress[] = {
#include "traversal_fast_address.inc"
};
constexpr uint32_t kExactAddress[] = {
#include "traversal_exact_address.inc"
};
constexpr uint32_t kExact64Address[] = {
#include "traversal_exact64_address.inc"
};

constexpr TraversalModule kModules[] = {
    {"watertight", false, kWatertight, std::size(kWatertight)},
    {"watertight", true, kWatertightAddress, std::size(kWatertightAddress)},
    {"fast", false, kFast, std::size(kFast)},
    {"fast", true, kFastAddress, std::size(kFastAddress)},
    {"exact", false, kExact, std::size(kExact)},
    {"exact", true, kExactAddress, std::size(kExactAddress)},
    {"exact64", false, kExact64, std::size(kExact64)},
    {"exact64", true, kExact64Address, std::size(kExact64Address)},
};

}  // namespace

const TraversalModule* find_traversal_module(std::string_view tier, bool addresses) {
    for (const TraversalModule& module : kModules) {
        if (tier == module.name && addresses == module.addresses) return &module;
    }
    return nullptr;
}

}  // namespace rtc
