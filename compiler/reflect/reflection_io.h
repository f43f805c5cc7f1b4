// Reflection beyond pipeline.h: reading it back whole, from a finished module or
// from its JSON. The JSON object, keys in this order; integers unless said:
//
//   abiVersion, identity ("0x…"), flags (["resumable", "addressMode"]),
//   spirvVersion ("1.3"), instructions, states, accuracy ("fast", "watertight", "exact", "exact64"),
//   maxRecursionDepth, maxCallableDepth,
//   stackWords, scratchWords, payloadWords, attributeWords, callableWords, pushConstantBytes,
//   reserved {set, binding, bindings [{name, binding}]}   names: params, heapTexels, heap,
//            sbtRaygen, sbtMiss, sbtHit, sbtCallable, control, scratch
//   requiredFeatures [string]
//   stages [{name, kind ("rgen"…"rcall"), file, firstState, states, payloadWords, recordBytes}]
//   groups [{name, kind ("general", "triangles", "procedural"), handle [8 × "0x…"]}]
//   resources [{name, stage, set, binding, type, arraySize (0: runtime array)}]
//   specConstants [{stage, name, originalId, id, type, default ("0x…", its bit pattern)}]
//   traceSites [{stage, file, line, call ("trace", "callable"), frameBytes, variables [string]}]
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
