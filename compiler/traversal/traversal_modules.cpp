#include "traversal/traversal_modules.h"

namespace rtc {
namespace {

constexpr uint32_t kWatertight[] = {
#include "traversal_watertight.inc"
};
constexpr uint32_t kWatertightAddress[] = {
#include "traversal_watertight_address.inc"
};
constexpr uint32_t kWatertightChecked[] = {
#include "traversal_watertight_checked.inc"
};
constexpr uint32_t kWatertightAddressChecked[] = {
#include "traversal_watertight_address_checked.inc"
};
constexpr uint32_t kFast[] = {
#include "traversal_fast.inc"
};
constexpr uint32_t kFastAddress[] = {
#include "traversal_fast_address.inc"
};
constexpr uint32_t kFastChecked[] = {
#include "traversal_fast_checked.inc"
};
constexpr uint32_t kFastAddressChecked[] = {
#include "traversal_fast_address_checked.inc"
};
constexpr uint32_t kExact[] = {
#include "traversal_exact.inc"
};
constexpr uint32_t kExactAddress[] = {
#include "traversal_exact_address.inc"
};
constexpr uint32_t kExactChecked[] = {
#include "traversal_exact_checked.inc"
};
constexpr uint32_t kExactAddressChecked[] = {
#include "traversal_exact_address_checked.inc"
};
constexpr uint32_t kExact64[] = {
#include "traversal_exact64.inc"
};
constexpr uint32_t kExact64Address[] = {
#include "traversal_exact64_address.inc"
};
constexpr uint32_t kExact64Checked[] = {
#include "traversal_exact64_checked.inc"
};
constexpr uint32_t kExact64AddressChecked[] = {
#include "traversal_exact64_address_checked.inc"
};

#define TIER(name, words)                                                              \
    {name, false, false, words, std::size(words)},                                      \
        {name, true, false, words##Address, std::size(words##Address)},                 \
        {name, false, true, words##Checked, std::size(words##Checked)},                 \
    {                                                                                   \
        name, true, true, words##AddressChecked, std::size(words##AddressChecked)       \
    }
constexpr TraversalModule kModules[] = {TIER("watertight", kWatertight), TIER("fast", kFast), TIER("exact", kExact),
                                        TIER("exact64", kExact64)};
#undef TIER

}  // namespace

const TraversalModule* find_traversal_module(std::string_view tier, bool addresses, bool checked) {
    for (const TraversalModule& module : kModules) {
        if (tier == module.name && addresses == module.addresses && checked == module.checked) return &module;
    }
    return nullptr;
}

}  // namespace rtc
