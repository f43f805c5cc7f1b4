// What a state word (RTR_ST_*, below RTR_ST_SUMS) is when a build or an update begins.
uint first_state(uint word) {
    bool all_ones = word < RTR_ST_CENTER_MIN + 3u || word == RTR_ST_OFFENDER || word == RTR_ST_BAD_INSTANCE ||
                    word == RTR_ST_BAD_UPDATE || (word >= RTR_ST_OFFENDERS && word < RTR_ST_OFFENDERS + 12u);
    bool level_groups_z = word >= RTR_ST_LEVELS && (word - RTR_ST_LEVELS) % RTR_LEVEL_WORDS == 2u;
    return all_ones ? 0xffffffffu : level_groups_z ? 1u : 0u;
}
