// Shared by the kernels of updates, which read from the header of the destination where its
// slots are: those of a compacted structure lie directly behind the nodes in use. The slots are
// seen through windows: dst_slots starts p.window_first quads behind the base, and a window
// has the slots that begin in its first p.window_count quads.

// The structure is one that this update may change; otherwise nothing is done.
bool fits() {
    return dst_header[RTC_HDR_MAGIC] == RTC_AS_MAGIC && dst_header[RTC_HDR_PRIMITIVE_COUNT] == p.total &&
           dst_header[RTC_HDR_GEOMETRY_COUNT] == p.geometry_count &&
           (dst_header[RTC_HDR_BUILD_FLAGS] & 1u) != 0u; // ALLOW_UPDATE
}

// Slot number i of the window; false when there is none. `at`: its first quad in dst_slots.
bool window_slot(uint i, uint quads, out uint slot, out uint at) {
    uint slots = dst_header[RTC_HDR_SLOTS];
    slot = i + (p.window_first > slots ? (p.window_first - slots + quads - 1u) / quads : 0u);
    at = slots + slot * quads - p.window_first;
    return fits() && slot < dst_header[RTC_HDR_SLOT_COUNT] && at < p.window_count;
}

// A primitive became inactive, or active, since the build.
void changed_activity(uint primitive) { atomicMin(state[RTR_ST_BAD_UPDATE], primitive); }
