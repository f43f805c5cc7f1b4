// A record of every ray and of what it found, for comparing two ways of tracing ray by ray
// (rtc-render --classify). Without RTC_TRACE_LOG, the number of records a pixel, nothing is left of it.
#ifndef TRACE_LOG_GLSL
#define TRACE_LOG_GLSL

const uint kLogNone = 0u;
const uint kLogClosest = 1u;  // hit as hit.rchit writes it
const uint kLogShadow = 2u;   // hit.x: 1 when nothing stood in the way

#ifdef RTC_TRACE_LOG
// Three quads a record: origin and kind; direction and the end of the ray; hit. Every place in a pixel's
// path has a record of its own, so that rays can be compared though one side traced fewer.
layout(set = 1, binding = 3, std430) writeonly buffer TraceLog { uvec4 trace_log[]; };

void log_ray(uvec2 pixel, uint width, uint place, uint kind, vec3 origin, vec3 direction, float end, uvec4 hit) {
    if (place >= uint(RTC_TRACE_LOG)) return;
    uint at = 3u * ((pixel.y * width + pixel.x) * uint(RTC_TRACE_LOG) + place);
    trace_log[at] = uvec4(floatBitsToUint(origin), kind);
    trace_log[at + 1u] = uvec4(floatBitsToUint(direction), floatBitsToUint(end));
    trace_log[at + 2u] = hit;
}
#define LOG_RAY(pixel, width, place, kind, origin, direction, end, hit) \
    log_ray(pixel, width, place, kind, origin, direction, end, hit)
#else
#define LOG_RAY(pixel, width, place, kind, origin, direction, end, hit)
#endif

#endif
