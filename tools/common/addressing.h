// How modules reach acceleration structures.
#pragma once

#include <string>

#include "vulkan_context.h"

namespace rtc::tools {

// By device address, in a heap, or as the device recommends (RtrPhysicalDeviceSupport::recommendAddresses).
enum class Addressing { Recommended, Heap, Address };

Addressing addressing_from_name(const std::string& name);  // "heap", "address"; "": recommended. Else throws Error

// Whether it is to be by address. Throws Error where that was asked for and the device has no addresses.
bool by_address(const Context& context, Addressing wanted, bool recommended);

}  // namespace rtc::tools
