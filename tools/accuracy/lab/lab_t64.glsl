// Laboratory only: `watertight` with t in double. Which triangle is hit is decided in floats as ever; where, by its
// plane in double, rounded once. In units of the scaled direction, as rtc_meet_triangle has it.
float rtc_lab_t(uint slot) {
    RtcBase at = rtc_advance(rtc_trav_base, rtc_trav_slots + slot * RTC_TRIANGLE_QUADS);
    dvec3 a = dvec3(uintBitsToFloat(rtc_quad(at, 0u).xyz));
    dvec3 b = dvec3(uintBitsToFloat(rtc_quad(at, 1u).xyz)) - a;
    dvec3 c = dvec3(uintBitsToFloat(rtc_quad(at, 2u).xyz)) - a;
    dvec3 n = dvec3(b.y * c.z - b.z * c.y, b.z * c.x - b.x * c.z, b.x * c.y - b.y * c.x);
    dvec3 o = a - dvec3(rtc_trav_origin), d = dvec3(rtc_trav_direction);
    double along = (n.x * d.x + n.y * d.y) + n.z * d.z;
    return float(((n.x * o.x + n.y * o.y) + n.z * o.z) / along);
}
