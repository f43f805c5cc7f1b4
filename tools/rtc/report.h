// --report: what became of the shaders, for a reader.
#pragma once

#include <string>

#include "rtc/compiler.h"

namespace cli {

std::string report_text(const rtcc_reflection& reflection, const std::string& module);
// What specialisation removed: `before` is the same pipeline without it.
std::string comparison_text(const rtcc_reflection& before, const rtcc_reflection& now);


}  // namespace cli
