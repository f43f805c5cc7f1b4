// Indirect builds take what they are built of from the device (ranges.comp); otherwise the whole
// piece of the input is meant, as it is bound.
bool in_range_of_geometry(uint i) {
    return p.ranges == 0u || p.primitive_base + i < state[p.ranges + RTR_RANGE_COUNT];
}
uint range_offset() { return p.ranges == 0u ? 0u : state[p.ranges + RTR_RANGE_OFFSET]; }
uint range_first_vertex() { return p.ranges == 0u ? 0u : state[p.ranges + RTR_RANGE_FIRST_VERTEX]; }
uint range_transform() { return p.ranges == 0u ? 0u : state[p.ranges + RTR_RANGE_TRANSFORM]; }
