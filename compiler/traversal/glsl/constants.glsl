// What may change after this file was compiled.
//
// glslang accepts no specialisation id above 2046, so ids are written small
// here and moved to their real values when the module is embedded
// (embed_spirv.cmake): n < 0x80 becomes RTC_SPEC_BASE + n, the others
// RTC_LINK_BASE + n - 0x80.

// Specialisation constants of the finished pipeline (abi.h).
layout(local_size_x_id = 0x00, local_size_y = 1, local_size_z = 1) in; // RTC_SPEC_WORKGROUP_SIZE
layout(local_size_x = 64) in;
layout(constant_id = 0x01) const uint RTC_FETCH = RTC_FETCH_TEXEL; // RTC_SPEC_FETCH
layout(constant_id = 0x02) const uint RTC_WHILE_WHILE = 0u; // RTC_SPEC_WHILE_WHILE
layout(constant_id = 0x03) const uint RTC_STEP_BUDGET = 0xffffffffu; // RTC_SPEC_STEP_BUDGET
layout(constant_id = 0x04) const uint RTC_SHARED_STACK = 0u; // RTC_SPEC_SHARED_STACK

// Link constants: the linker knows the pipeline and freezes these, so that
// what a pipeline cannot need is not in it.
layout(constant_id = 0x80) const bool RTC_LINK_ANY_HIT = true; // false: every candidate triangle is accepted
layout(constant_id = 0x81) const bool RTC_LINK_AABBS = true; // false: no leaf holds AABBs
layout(constant_id = 0x82) const bool RTC_LINK_TRIANGLES = true; // false: no leaf holds triangles
layout(constant_id = 0x83) const bool RTC_LINK_RESUMABLE = true; // false: the step budget is ignored
layout(constant_id = 0x84) const bool RTC_LINK_POSITIONS = true; // false: nobody asks for the vertices of a hit
layout(constant_id = 0x90) const bool RTC_LINK_MIXED = true; // false: all instances hold the same kind
layout(constant_id = 0x91) const bool RTC_LINK_NON_OPAQUE = true; // false: geometries and instances are opaque
layout(constant_id = 0x92) const bool RTC_LINK_MASKS = true; // false: every instance mask is 0xff
layout(constant_id = 0x93) const bool RTC_LINK_INSTANCE_FLAGS = true; // false: no instance has flags
layout(constant_id = 0x94) const bool RTC_LINK_TRANSFORMS = true; // false: transforms are the identity
layout(constant_id = 0x95) const bool RTC_LINK_LEVELS = true; // false: one instance at most
layout(constant_id = 0x96) const uint RTC_LINK_ASSUMED = 0u; // assumptions that rays check as they begin

const uint RTC_NONE = 0xffffffffu;

const uint RTC_RAY_OPAQUE = 1u;
const uint RTC_RAY_NO_OPAQUE = 2u;
const uint RTC_RAY_TERMINATE_ON_FIRST_HIT = 4u;
const uint RTC_RAY_CULL_BACK = 16u;
const uint RTC_RAY_CULL_FRONT = 32u;
const uint RTC_RAY_CULL_OPAQUE = 64u;
const uint RTC_RAY_CULL_NO_OPAQUE = 128u;
const uint RTC_RAY_SKIP_TRIANGLES = 256u;
const uint RTC_RAY_SKIP_AABBS = 512u;

const uint RTC_HIT_KIND_FRONT = 0xfeu;
const uint RTC_HIT_KIND_BACK = 0xffu;
