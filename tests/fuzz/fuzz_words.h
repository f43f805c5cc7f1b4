// What the fuzz targets share: an input is a byte of choices and the words of a SPIR-V module behind it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace rtc::fuzz {

using Words = std::vector<uint32_t>;

Words words_of(const uint8_t* data, size_t size);

}  // namespace rtc::fuzz
