// Who am I in this launch, and what do I do when something goes wrong or takes
// too long.
uvec3 rtc_launch_id;
uvec3 rtc_launch_size;
uint rtc_lane; // global lane index of this dispatch
uint rtc_turns; // loop iterations of this invocation in this dispatch

bool rtc_launch_begin() {
    uint first = rtc_param(RTC_PARAM_LANE_BASE);
    uint group = gl_WorkGroupID.x + RTC_MAX_GROUPS_X * gl_WorkGroupID.y;
    uint local = group * gl_WorkGroupSize.x + gl_LocalInvocationIndex;
    uint lane = first + local;
    uvec3 size = uvec3(rtc_param(RTC_PARAM_WIDTH), rtc_param(RTC_PARAM_HEIGHT), rtc_param(RTC_PARAM_DEPTH));
    rtc_lane = lane;
    rtc_launch_size = size;
    rtc_launch_id = uvec3(0u);
    rtc_turns = 0u;
    // An empty grid would divide by zero below.
    bool inside = local < rtc_param(RTC_PARAM_LANE_COUNT) && size.x != 0u && size.y != 0u && size.z != 0u;
    if (inside) {
        uvec3 id;
        if ((rtc_param(RTC_PARAM_FLAGS) & RTC_LAUNCH_TILE_8X4) != 0u) {
            uint tiles_x = (size.x + 7u) >> 3u;
            uint tiles_y = (size.y + 3u) >> 2u;
            uint tile = lane >> 5u;
            uint row = tile / tiles_x;
            uint slice = row / tiles_y;
            id = uvec3((tile - row * tiles_x) * 8u + (lane & 7u),
                       (row - slice * tiles_y) * 4u + ((lane >> 3u) & 3u), slice);
        } else {
            uint width = (size.x + 31u) & 0xffffffe0u;
            uint row = lane / width;
            uint slice = row / size.y;
            id = uvec3(lane - row * width, row - slice * size.y, slice);
        }
        rtc_launch_id = id;
        inside = id.x < size.x && id.y < size.y && id.z < size.z;
    }
    return inside;
}

// The first error of a launch is kept, all are counted.
void rtc_error(uint kind, uint detail, uint detail2) {
    uint block = rtc_param(RTC_PARAM_CONTROL_WORD);
    atomicAdd(rtc_control.w[block + RTC_CTRL_ERROR_COUNT], 1u);
    uint before = atomicCompSwap(rtc_control.w[block + RTC_CTRL_ERROR], RTC_LAUNCH_ERROR_NONE, kind);
    if (before == RTC_LAUNCH_ERROR_NONE) {
        rtc_control.w[block + RTC_CTRL_ERROR_LANE] = rtc_launch_id.x;
        rtc_control.w[block + RTC_CTRL_ERROR_LANE + 1u] = rtc_launch_id.y;
        rtc_control.w[block + RTC_CTRL_ERROR_LANE + 2u] = rtc_launch_id.z;
        rtc_control.w[block + RTC_CTRL_ERROR_DETAIL] = detail;
        rtc_control.w[block + RTC_CTRL_ERROR_DETAIL2] = detail2;
    }
}

// What a ray starts at: the base in the header that a descriptor shows. Rays look for it in the heap that is set, or
// by device address; a structure that is elsewhere is an error, and they miss.
RtcBase rtc_root(uint low, uint high) {
#ifdef RTC_ADDRESS_MODE
    uint heap = 0u;
    bool here = (high & RTC_HEAP_TAG) == 0u;
#else
    uint heap = rtc_param(RTC_PARAM_HEAP_ID);
    bool here = high == heap || (low | high) == 0u;
#endif
    if (!here) {
        rtc_error(RTC_LAUNCH_ERROR_HEAP, high, heap);
    }
    return rtc_base(here ? low : 0u, here ? high : 0u);
}

// Asks for another round of this dispatch's shape.
void rtc_suspend() {
    uint block = rtc_param(RTC_PARAM_CONTROL_WORD);
    uint arguments = block + RTC_CTRL_ARGS + 4u * (rtc_param(RTC_PARAM_ROUND) + 1u);
    atomicAdd(rtc_control.w[block + RTC_CTRL_SUSPENDED], 1u);
    atomicMax(rtc_control.w[arguments], gl_NumWorkGroups.x);
    atomicMax(rtc_control.w[arguments + 1u], gl_NumWorkGroups.y);
    atomicMax(rtc_control.w[arguments + 2u], 1u);
}

// Lane storage is interleaved, so that neighbouring lanes touch neighbouring
// words.
uint rtc_scratch_base() {
    return rtc_param(RTC_PARAM_SCRATCH_WORD) + (rtc_lane - rtc_param(RTC_PARAM_LANE_BASE));
}

uint rtc_scratch_load(uint i) {
    return rtc_scratch.w[rtc_scratch_base() + i * rtc_param(RTC_PARAM_LANE_COUNT)];
}

void rtc_scratch_store(uint i, uint v) {
    rtc_scratch.w[rtc_scratch_base() + i * rtc_param(RTC_PARAM_LANE_COUNT)] = v;
}
