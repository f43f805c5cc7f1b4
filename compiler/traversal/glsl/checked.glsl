// The checking variant (RTC_CHECKED, rtc --checked): nothing that is read from acceleration structure memory is
// followed before it is known to lead somewhere. What leads nowhere is reported once, as the launch
// error BAD_MEMORY, and the ray ends as a miss.
//
// A level's nodes and slots lie where its header says, and the header must fit together. With validation the runtime
// hands over a table of the structures that are bound and not destroyed: a base is looked up there before anything is
// read, and a header must fit the object. In a heap, every read also stays inside it.
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

bool rtc_below(uvec2 a, uvec2 b) { return a.y < b.y || (a.y == b.y && a.x < b.x); }

// Quads of the structure at a base, by the table; without one as many as there can be. 0: there is none, reported.
uint rtc_check_base(RtcBase base) {
#ifdef RTC_ADDRESS_MODE
    uvec2 wanted = base;
#else
    uvec2 wanted = uvec2(base, rtc_param(RTC_PARAM_HEAP_ID));
#endif
    uint table = rtc_param(RTC_PARAM_LIVE_TABLE);
    uint quads = 0xffffffffu;
    if (table != 0u) {
        uint first = 0u;
        uint count = rtc_param(RTC_PARAM_LIVE_COUNT); // entries from first on that may be it
        quads = 0u;
        while (count != 0u) {
            uint half_count = count / 2u;
            uint at = table + 4u * (first + half_count);
            uvec2 here = uvec2(rtc_control.w[at], rtc_control.w[at + 1u]);
            if (here == wanted) {
                quads = rtc_control.w[at + 2u];
            }
            bool behind = rtc_below(here, wanted);
            first += behind ? half_count + 1u : 0u;
            count = quads != 0u ? 0u : (behind ? count - half_count - 1u : half_count);
            rtc_turns++;
        }
    }
    if (quads == 0u) {
        rtc_bad_memory(RTC_BAD_BASE, wanted.x);
    }
    return quads;
}

// Whether a structure's header can be one; then its counts are this level's.
bool rtc_check_header(RtcBase base, uint kind) {
    uint quads = rtc_check_base(base);
    bool good = quads != 0u;
    uvec4 places = uvec4(0u);
    if (good) {
        uvec4 ids = rtc_quad(base, 0u);
        places = rtc_quad(base, RTC_HDR_NODES / 4u); // nodes, slots, node count, slot count
        bool aabbs = (rtc_quad(base, RTC_HDR_FACTS / 4u)[RTC_HDR_FACTS & 3u] & RTC_FACT_AABBS) != 0u;
        uint slot_quads = kind == RTC_AS_KIND_TOP ? RTC_INSTANCE_QUADS : (aabbs ? RTC_AABB_QUADS : RTC_TRIANGLE_QUADS);
        good = rtc_bad == 0u && rtc_base(ids.x, ids.y) == base && ids.z == RTC_AS_MAGIC && ids.w == kind &&
               places.x == RTC_AS_HEADER_QUADS && places.y >= RTC_AS_HEADER_QUADS && places.y < 0x80000000u &&
               places.y <= quads && places.z <= (places.y - RTC_AS_HEADER_QUADS) / RTC_NODE_QUADS &&
               places.w <= RTC_REF_INDEX_MASK && places.w <= (quads - places.y) / slot_quads;
    }
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
    return there ? node : 0u - RTC_AS_HEADER_QUADS / RTC_NODE_QUADS; // the header can always be read
}

uint rtc_checked_slot(uint slot) {
    bool there = slot < rtc_slot_count;
    if (!there) {
        rtc_bad_memory(RTC_BAD_SLOT, slot);
        rtc_trav_slots = 0u; // the header, too
    }
    return there ? slot : 0u;
}

// Of the top level, whose header may not have been looked at.
bool rtc_check_instance(uint instance) {
    rtc_entries += rtc_trav_cur == RTC_REF_ENTER ? 1u : 0u; // not where its data are made again
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
