#include "addressing.h"

#include "error.h"

namespace rtc::tools {

Addressing addressing_from_name(const std::string& name) {
    if (name.empty()) return Addressing::Recommended;
    if (name == "heap") return Addressing::Heap;
    if (name == "address") return Addressing::Address;
    throw Error("no addressing '" + name + "'; there are: heap, address");
}

bool by_address(const Context& context, Addressing wanted, bool recommended) {
    if (wanted == Addressing::Address && !context.device_addresses)
        throw Error(std::string(context.properties.deviceName) + " has no bufferDeviceAddress, which address mode needs");
    return wanted == Addressing::Recommended ? recommended && context.device_addresses : wanted == Addressing::Address;
}

}  // namespace rtc::tools
