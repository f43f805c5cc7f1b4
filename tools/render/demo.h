// The three pictures of tools/demo.
#pragma once

#include <string>

#include "renderer.h"

namespace rtc::tools {

// Draws them into `folder` with what `base` says about size and quiet; prints where they are.
void draw_demo(const RtcDevice& device, const std::string& folder, const RenderOptions& base);

}  // namespace rtc::tools
