// One stack for both levels. A level's entries never outnumber the inner nodes
// on a root-to-leaf path, which builders keep at RTC_MAX_DEPTH: twice that
// suffices for any tree they make. Anything deeper ends in a launch error.
const uint RTC_STACK_ENTRIES = 2u * RTC_MAX_DEPTH;
uint rtc_trav_stack[RTC_STACK_ENTRIES + 1u]; // one more for rtc_make_level_again

// The first RTC_SHARED_STACK entries of each lane, where a device likes that
// better (lavapipe 22.3).
shared uint rtc_shared_stack[RTC_SHARED_STACK * gl_WorkGroupSize.x + 1u];

uint rtc_shared_slot(uint i) { return i * gl_WorkGroupSize.x + gl_LocalInvocationIndex; }

uint rtc_stack_get(uint i) {
    uint value;
    if (RTC_SHARED_STACK == 0u) {
        value = rtc_trav_stack[i];
    } else if (i < RTC_SHARED_STACK) {
        value = rtc_shared_stack[rtc_shared_slot(i)];
    } else {
        value = rtc_trav_stack[i - RTC_SHARED_STACK];
    }
    return value;
}

void rtc_stack_set(uint i, uint value) {
    if (RTC_SHARED_STACK == 0u) {
        rtc_trav_stack[i] = value;
    } else if (i < RTC_SHARED_STACK) {
        rtc_shared_stack[rtc_shared_slot(i)] = value;
    } else {
        rtc_trav_stack[i - RTC_SHARED_STACK] = value;
    }
}
