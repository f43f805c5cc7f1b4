// --report: what became of the shaders, for a reader.
#pragma once

#include <string>

#include "rtc/compiler.h"

namespace cli {

std::string report_text(const rtcc_reflection& reflection, const std::string& module);

}  // namespace cli
