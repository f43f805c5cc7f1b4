// Everything a linked pipeline takes from here, in dependency order.
// RTC_TIER_FAST chooses the tier; the watertight one is the default.
#include "rtc/abi.h"
#include "constants.glsl"
#include "resources.glsl"
#include "launch.glsl"
#include "sbt.glsl"
#include "ray.glsl"
#include "instance.glsl"
#ifdef RTC_TIER_FAST
#include "fast.glsl"
#else
#include "watertight.glsl"
#endif
#include "level.glsl"
#include "stack.glsl"
#include "traverse.glsl"
#include "save.glsl"
