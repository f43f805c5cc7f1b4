// The laboratory's rays through Embree 3 on the host's cores: what a ray tracer of good name does with them.
#pragma once

#include <memory>

#include "ray_tracer.h"

namespace rtc::lab {

enum class EmbreeMode { Fast, Robust };  // Robust: RTC_SCENE_FLAG_ROBUST

bool have_embree();  // built with it
// Triangles only; no mode but kIgnore; masks and flags of instances are not looked at. Throws tools::Error without
// Embree. `threads`: of trace, 0: all the machine has.
std::unique_ptr<RayTracer> make_embree_tracer(EmbreeMode mode, unsigned threads = 0);

}  // namespace rtc::lab
