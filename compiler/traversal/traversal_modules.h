// Traversal as SPIR-V, ready to be linked into a pipeline. What a module
// exports, under which names, and how the exports are called: EXPORTS.md.
#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string_view>

namespace rtc {

struct TraversalModule {
    const char* name;  // tier
    bool addresses;
    bool checked;
    const uint32_t* words;
    size_t count;
};

// "watertight" (the default tier), "fast", "exact" or "exact64" (needs Float64); null for a tier that does
// not exist. `addresses`: the variant that reads acceleration structures by device address (its RtcBase is a
// uvec2, not a uint); `checked` the one that follows nothing it has not checked (glsl/checked.glsl).
const TraversalModule* find_traversal_module(std::string_view tier, bool addresses = false, bool checked = false);

// Link constants: SpecIds of bool constants that the linker freezes.
inline constexpr uint32_t RTC_LINK_BASE = 0x52540100u;
inline constexpr uint32_t RTC_LINK_ANY_HIT = 0x52540100u;    // false: every candidate triangle is accepted
inline constexpr uint32_t RTC_LINK_AABBS = 0x52540101u;      // false: no leaf holds AABBs
inline constexpr uint32_t RTC_LINK_TRIANGLES = 0x52540102u;  // false: no leaf holds triangles
inline constexpr uint32_t RTC_LINK_RESUMABLE = 0x52540103u;  // false: RTC_SPEC_STEP_BUDGET is ignored
inline constexpr uint32_t RTC_LINK_POSITIONS = 0x52540104u;  // false: no shader reads the vertices of its hit

// What only some scenes need (link/facts.cpp decides); true is the general case.
inline constexpr uint32_t RTC_LINK_MIXED = 0x52540110u;           // false: all instances hold the same kind
inline constexpr uint32_t RTC_LINK_NON_OPAQUE = 0x52540111u;      // false: all geometries and instances are opaque
inline constexpr uint32_t RTC_LINK_MASKS = 0x52540112u;           // false: every instance mask is 0xff
inline constexpr uint32_t RTC_LINK_INSTANCE_FLAGS = 0x52540113u;  // false: no instance has flags
inline constexpr uint32_t RTC_LINK_TRANSFORMS = 0x52540114u;      // false: every instance transform is the identity
inline constexpr uint32_t RTC_LINK_LEVELS = 0x52540115u;          // false: a top level has one instance at most
inline constexpr uint32_t RTC_LINK_ASSUMED = 0x52540116u;         // uint: bits of Assumption, checked as rays begin

// Words of lane storage that rtc_trace_save writes at most: 32 for ray, hit and
// cursor, RTC_TRAVERSAL_STACK for the stack. (A lane whose stack is deeper does
// not suspend until it is not.)
inline constexpr uint32_t RTC_TRACE_STATE_WORDS = 32u + 64u;

// Results of rtc_trace_step.
inline constexpr uint32_t RTC_STEP_DONE = 0u;
inline constexpr uint32_t RTC_STEP_TRIANGLE = 1u;
inline constexpr uint32_t RTC_STEP_AABB = 2u;
inline constexpr uint32_t RTC_STEP_SUSPEND = 3u;

}  // namespace rtc
