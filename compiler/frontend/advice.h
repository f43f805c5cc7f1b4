// What to write instead: adds the replacement to messages about spellings of
// 2018/2019 (talks, early headers, NVX) and to extensions this glslang lacks.
#pragma once

#include <string>
#include <vector>

#include "pipeline.h"

namespace rtc {

// `source` is the text of the file `file`; messages about other files get only
// the advice that needs no text.
void add_advice(const std::string& file, const std::string& source, std::vector<Diagnostic>& diagnostics);

// The ray tracing extension whose words the text uses; empty when it uses none.
std::string extension_used(const std::string& source);

}  // namespace rtc
