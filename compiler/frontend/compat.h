// --compat=gdc2019: the spellings of "RTX on Vulkan" (GDC 2019) that have one meaning today.
#pragma once

#include <string>

namespace rtc {

// Rewrites what the talk's shaders do and GLSL_NV_ray_tracing does not allow: blocks without an instance that are
// used by their block's name, `}` without `;` after a block, opaque variables without `uniform`,
// gl_GlobalInvocationIDNV and gl_hitTNV. Lines stay where they are; everything else is left as it is.
std::string translate_gdc2019(const std::string& source);

}  // namespace rtc
