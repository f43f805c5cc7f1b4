// The reserved bindings, as a linked module declares them; RESERVED_SET and
// RESERVED_BINDING place them.
#extension GL_GOOGLE_include_directive : require
#include "rtc/abi.h"
// glslang takes no ids above 2046; the test adds RTC_SPEC_BASE - 1900 to these.
layout(local_size_x_id = 1900) in;
layout(constant_id = 1901) const uint FETCH = RTC_FETCH_TEXEL;
layout(constant_id = 1903) const uint STEP_BUDGET = 0xffffffffu;
#define AT(b) set = RESERVED_SET, binding = RESERVED_BINDING + b
layout(AT(RTC_BINDING_PARAMS), std140) uniform Params { uvec4 params[RTC_PARAM_QUADS]; };
#ifndef ADDRESS_MODE
layout(AT(RTC_BINDING_HEAP_TEXELS)) uniform usamplerBuffer heap_texels;
layout(AT(RTC_BINDING_HEAP), std430) readonly buffer Heap { uvec4 heap[]; };
uvec4 heap_quad(uint i) { return FETCH == RTC_FETCH_TEXEL ? texelFetch(heap_texels, int(i)) : heap[i]; }
#endif
layout(AT(RTC_BINDING_SBT_RAYGEN), std430) readonly buffer SbtRaygen { uint sbt_raygen[]; };
layout(AT(RTC_BINDING_SBT_HIT), std430) readonly buffer SbtHit { uint sbt_hit[]; };
layout(AT(RTC_BINDING_CONTROL), std430) buffer Control { uint control[]; };
layout(AT(RTC_BINDING_SCRATCH), std430) buffer Scratch { uint scratch[]; };

uint param(uint i) { return params[i / 4u][i % 4u]; }

// Launch id of this lane, and whether it has one (abi.h, "Lanes").
bool launch_id(out uint lane, out uvec3 id) {
    uint local = (gl_WorkGroupID.x + RTC_MAX_GROUPS_X * gl_WorkGroupID.y) * gl_WorkGroupSize.x +
                 gl_LocalInvocationIndex;
    lane = param(RTC_PARAM_LANE_BASE) + local;
    uvec3 size = uvec3(param(RTC_PARAM_WIDTH), param(RTC_PARAM_HEIGHT), param(RTC_PARAM_DEPTH));
    if ((param(RTC_PARAM_FLAGS) & RTC_LAUNCH_TILE_8X4) != 0u) {
        uvec2 tiles = (size.xy + uvec2(7u, 3u)) / uvec2(8u, 4u);
        uint tile = lane / 32u;
        id = uvec3((tile % tiles.x) * 8u + lane % 8u, (tile / tiles.x % tiles.y) * 4u + lane / 8u % 4u,
                   tile / (tiles.x * tiles.y));
    } else {
        uint w = (size.x + 31u) / 32u * 32u;
        id = uvec3(lane % w, lane / w % size.y, lane / (w * size.y));
    }
    return local < param(RTC_PARAM_LANE_COUNT) && all(lessThan(id, size));
}
