// glslang's info log, line by line, as diagnostics.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "pipeline.h"

namespace rtc {

// Messages without a position are attributed to `file`. Summaries ("3 compilation
// errors") and messages that only repeat an earlier one's consequence are dropped.
void parse_glslang_log(std::string_view log, const std::string& file, std::vector<Diagnostic>& out);

bool has_errors(const std::vector<Diagnostic>& diagnostics);

}  // namespace rtc
