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

// t of a hit in the ray's own units. The power of two between the units can carry it out of the range of floats;
// then it is the last one inside, so that tmin < t < tmax stays true (but for a tmax of 2^-126 or less).
float rtc_hit_distance(float t) {
    t *= rtc_t_down();
    t = t > 0.0 ? t : 1.17549435e-38; // 2^-126: what lies below, some devices flush
    return min(t, 3.402823466e38);
}
