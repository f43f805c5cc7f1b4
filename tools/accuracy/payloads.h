// What a payload of 16 bits is worth: one picture with each, through whole pipelines of rtc's.
#pragma once

#include <vector>

#include "report.h"
#include "vulkan_context.h"

namespace rtc::lab {

// A picture of side by side paths, tier `watertight`, `repeats` times in turns. Times are the device's, or where the
// device is the processor, CPU time. Errors are of colours in 0 .. 1 against the first row's. Throws tools::Error.
std::vector<PayloadRow> measure_payloads(const tools::Context& context, uint32_t side, unsigned repeats);

}  // namespace rtc::lab
