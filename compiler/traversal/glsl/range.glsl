// Which t counts, for the tiers that compare rounded ones: strictly between
// tmin and what is committed. (`exact` has its own.)
bool rtc_in_range(float t, uint slot, uint primitive, uint geometry) {
    return t > rtc_trav_tmin && t < rtc_trav_tmax;
}

bool rtc_report_in_range(float t) { return t >= rtc_ray_tmin && t <= rtc_hit_t; }

void rtc_accepted() {}
