// Facts of a top level from what its instances left in the state words; `n`: active instances.
uint top_facts(uint n) {
    uint kept = (RTC_FACT_ALL_OPAQUE | RTC_FACT_IDENTITY_TRANSFORMS | RTC_FACT_FULL_MASKS |
                 RTC_FACT_NO_INSTANCE_FLAGS) & ~state[RTR_ST_BROKEN];
    return kept | state[RTR_ST_HAS] | (p.facts & RTC_FACT_ADDRESSES) | (n <= 1u ? RTC_FACT_SINGLE_LEVEL : 0u);
}

// Word RTC_HDR_OFFENDERS + bit of a header.
uint offender(uint bit, uint n) {
    if ((p.flags & RTR_BUILD_TOP) == 0u) return (1u << bit) == RTC_FACT_ALL_OPAQUE ? p.not_opaque : 0xffffffffu;
    if ((1u << bit) == RTC_FACT_SINGLE_LEVEL) return n <= 1u ? 0xffffffffu : n;
    return state[RTR_ST_OFFENDERS + bit];
}
