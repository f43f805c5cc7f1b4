// Everything a linked pipeline takes from here, in dependency order.
// RTC_TIER_FAST or RTC_TIER_EXACT (with RTC_EXACT_FLOAT64 or without) chooses the
// tier; the watertight one is the default.
#include "rtc/abi.h"
#include "constants.glsl"
#include "resources.glsl"
#include "launch.glsl"
#include "sbt.glsl"
#include "ray.glsl"
#include "instance.glsl"
#include "checked.glsl"
#if defined(RTC_TIER_EXACT)
#include "exact.glsl"
#elif defined(RTC_TIER_FAST)
#include "fast.glsl"
#include "range.glsl"
#else
#include "watertight.glsl"
#include "range.glsl"
#endif
#include "level.glsl"
#include "stack.glsl"
#include "traverse.glsl"
#include "save.glsl"
