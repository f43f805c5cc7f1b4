// What the linker does to traversal's floats, and what compilers would do to
// them if it did not.
#pragma once

#include <cstdint>
#include <vector>

namespace rtc::lab {

// NoContraction on every float operation.
void decorate_no_contraction(std::vector<uint32_t>& spirv);

// Every a * b + c of scalar floats gets one rounding, by way of doubles: the module needs Float64 then.
// The negative control.
void contract(std::vector<uint32_t>& spirv);

}  // namespace rtc::lab
