// Reflection beyond pipeline.h: reading it back whole, from a finished module or
// from its JSON.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pipeline.h"

namespace rtc {

const char* group_kind_name(GroupKind kind);  // "general", "triangles", "procedural"

// False with `error` when the module carries no reflection (it was stripped, or rtc
// did not make it), when it is damaged, or when it is of another ABI version.
bool read_reflection(const std::vector<uint32_t>& spirv, Reflection& reflection, std::string& error);

// The inverse of reflection_to_json.
bool reflection_from_json(const std::string& json, Reflection& reflection, std::string& error);

// reflection_to_json on one line, with source files by their last path component:
// what goes into a module must not depend on where it was compiled.
std::string embedded_json(const Reflection& reflection);

}  // namespace rtc
