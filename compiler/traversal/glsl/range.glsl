// Which t counts, for the tiers that compare rounded ones: strictly between
// tmin and what is committed. (`exact` has its own.)
bool rtc_in_range(float t, uint slot, uint primitive, uint geometry) {
    if (RTC_LINK_POSITIONS) {
        rtc_cand_slot = slot;
    }
    return t > rtc_trav_tmin && t < rtc_trav_tmax;
}

bool rtc_report_in_range(float t) {
    if (RTC_LINK_POSITIONS) {
        rtc_cand_slot = RTC_NONE;
    }
    return t >= rtc_ray_tmin && t <= rtc_hit_t;
}

void rtc_accepted() {
    if (RTC_LINK_POSITIONS) {
        rtc_hit_slot = rtc_cand_slot;
    }
}
