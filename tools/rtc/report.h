// --report: what became of the shaders, for a reader.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "rtc/compiler.h"

namespace cli {

std::string report_text(const rtcc_reflection& reflection, const std::string& module);
// What specialisation removed: `before` is the same pipeline without it.
std::string comparison_text(const rtcc_reflection& before, const rtcc_reflection& now);
// The same fact by fact: instructions of the pipeline with that fact alone unknown, by the fact's name.
std::string facts_text(const std::vector<std::pair<std::string, uint32_t>>& without, const rtcc_reflection& now);

}  // namespace cli
