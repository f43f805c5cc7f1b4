// The checking variant (RTC_CHECKED, rtc --checked): nothing that is read from acceleration structure memory is
// followed before it is known to lead somewhere. What leads nowhere is reported once, as the launch
// error BAD_MEMORY, and the ray ends as a miss.
//
// A level's nodes and slots lie where its header says, and the header must fit together. In a heap, every
// read also stays inside it. By device address that a header tells the truth about its size cannot be known
// here: the runtime compares it with the object before the launch (validation).
#ifdef RTC_CHECKED
#define RTC_CHECK(statement) statement

uint rtc_node_count; // of this level's structure
uint rtc_slot_count;
uint rtc_top_visits; // nodes visited in the top level, in this instance; instances entered: a tree has no cycles
uint rtc_level_visits;
uint rtc_entries;

void rtc_check_begin() {
    rtc_bad = 0u;
    rtc_node_count = 0u;
    rtc_slot_count = 0u;
    rtc_top_visits = 0u;
    rtc_level_visits = 0u;
    rtc_entries = 0u;
}

void rtc_bad_memory(uint what, uint number) {
    if (rtc_bad == 0u) {
        rtc_bad = 1u;
        rtc_error(RTC_LAUNCH_ERROR_BAD_MEMORY, number, what << RTC_BAD_SHIFT | (rtc_trav_instance & RTC_BAD_INSTANCE_MASK));
    }
}

// Whether a structure's header can be one; then its counts are this level's.
bool rtc_check_header(RtcBase base, uint kind) {
    uvec4 ids = rtc_quad(base, 0u);
    bool good = rtc_bad == 0u && rtc_base(ids.x, ids.y) == base && ids.z == RTC_AS_MAGIC && ids.w == kind;
    uvec4 places = rtc_quad(base, RTC_HDR_NODES / 4u); // nodes, slots, node count, slot count
    uint room = (places.y - RTC_AS_HEADER_QUADS) / RTC_NODE_QUADS;
    good = good && places.x == RTC_AS_HEADER_QUADS && places.y >= RTC_AS_HEADER_QUADS && places.y < 0x80000000u &&
           places.z <= room && places.w <= RTC_REF_INDEX_MASK;
    rtc_node_count = good ? places.z : 0u;
    rtc_slot_count = good ? places.w : 0u;
    return good;
}

uint rtc_checked_node(uint node) {
    bool top = RTC_LINK_LEVELS && rtc_trav_instance == RTC_NONE;
    rtc_top_visits += top ? 1u : 0u;
    rtc_level_visits += top ? 0u : 1u;
    bool there = node < rtc_node_count;
    if (!there) {
        rtc_bad_memory(RTC_BAD_NODE, node);
    } else if ((top ? rtc_top_visits : rtc_level_visits) > rtc_node_count) {
        rtc_bad_memory(RTC_BAD_CYCLE, node);
    }
    return there ? node : 0u;
}

uint rtc_checked_slot(uint slot) {
    bool there = slot < rtc_slot_count;
    if (!there) {
        rtc_bad_memory(RTC_BAD_SLOT, slot);
        rtc_trav_slots = 0u; // the header can always be read
    }
    return there ? slot : 0u;
}

// Of the top level, whose header may not have been looked at.
bool rtc_check_instance(uint instance) {
    rtc_entries++;
    bool there = rtc_check_header(rtc_ray_root, RTC_AS_KIND_TOP) && instance < rtc_slot_count;
    if (!there) {
        rtc_bad_memory(RTC_BAD_INSTANCE_INDEX, instance);
    } else if (rtc_entries > rtc_slot_count) {
        rtc_bad_memory(RTC_BAD_CYCLE, instance);
    }
    return there;
}
#else
#define RTC_CHECK(statement)
#endif
