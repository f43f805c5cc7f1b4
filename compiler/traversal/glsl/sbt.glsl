// Shader binding table. Words count from the start of a region; the region's
// place in its buffer is a dispatch parameter.
uint rtc_region_word(uint parameter) {
    return (rtc_param(parameter) >> 2u) | (rtc_param(parameter + 1u) << 30u);
}

uint rtc_sbt_raygen_word(uint word) {
    return rtc_sbt_raygen.w[rtc_region_word(RTC_PARAM_RAYGEN_OFFSET) + word];
}
uint rtc_sbt_miss_word(uint word) { return rtc_sbt_miss.w[rtc_region_word(RTC_PARAM_MISS_OFFSET) + word]; }
uint rtc_sbt_hit_word(uint word) { return rtc_sbt_hit.w[rtc_region_word(RTC_PARAM_HIT_OFFSET) + word]; }
uint rtc_sbt_callable_word(uint word) {
    return rtc_sbt_callable.w[rtc_region_word(RTC_PARAM_CALLABLE_OFFSET) + word];
}

// First word of a record, or RTC_NONE when its handle does not fit the region.
uint rtc_record_word(uint index, uint stride, uint size, uint size_high) {
    uint high, low;
    umulExtended(index, stride, high, low);
    uint end = size_high != 0u ? 0xffffffffu : size;
    bool fits = high == 0u && end >= RTC_HANDLE_BYTES && low <= end - RTC_HANDLE_BYTES;
    return fits ? low >> 2u : RTC_NONE;
}

uint rtc_miss_record(uint index) {
    return rtc_record_word(index, rtc_param(RTC_PARAM_MISS_STRIDE), rtc_param(RTC_PARAM_MISS_SIZE),
                           rtc_param(RTC_PARAM_MISS_SIZE + 1u));
}

uint rtc_hit_record_base(uint record_index) {
    return rtc_record_word(record_index, rtc_param(RTC_PARAM_HIT_STRIDE), rtc_param(RTC_PARAM_HIT_SIZE),
                           rtc_param(RTC_PARAM_HIT_SIZE + 1u));
}

uint rtc_callable_record(uint index) {
    return rtc_record_word(index, rtc_param(RTC_PARAM_CALLABLE_STRIDE), rtc_param(RTC_PARAM_CALLABLE_SIZE),
                           rtc_param(RTC_PARAM_CALLABLE_SIZE + 1u));
}
