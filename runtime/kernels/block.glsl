// Reading another acceleration structure: by the heap's texels, or in address mode
// (RTR_ADDRESS) by its device address.

// Whether the reference leads to a structure that was built, beside the destination: in its heap, or
// like it at a device address. A device address can only be followed on trust.
bool is_structure(uint base_lo, uint base_hi) {
#ifdef RTR_ADDRESS
    if ((base_hi & RTC_HEAP_TAG) != 0u) return false;
    uvec4 h1 = block_quad(base_lo, base_hi, RTC_HDR_FACTS / 4u);
    if ((h1.x & RTC_FACT_ADDRESSES) == 0u) return false;
#else
    if (base_hi != p.self_hi || base_lo > p.heap_quads - RTC_AS_HEADER_QUADS) return false;
#endif
    return block_quad(base_lo, base_hi, RTC_HDR_MAGIC / 4u).z == RTC_AS_MAGIC;
}

// Serialising: the version of blobs stands in eight words of the push constants that copies
// do not use.
uint blob_version(uint w) {
    uint words[8] = uint[8](p.count, p.first, p.primitive_base, p.geometry, p.data_stride, p.vertex_count,
                            p.index_offset, p.index_type);
    return words[w];
}

// The source of a copy as it looks with its slots directly behind the nodes in use.
struct Compacted {
    uint src_slots;  // quads from the source's base to its slots
    uint dst_slots;  // the same in the copy
    uint slot_quads; // quads of a slot
    uint end;        // quads in all
    bool top;
};

uvec4 source(uint quad) { return block_quad(p.src_lo, p.src_hi, quad); }

Compacted read_source(bool compact) {
    Compacted c;
    uvec4 nodes = source(RTC_HDR_NODES / 4u); // NODES, SLOTS, NODE_COUNT, SLOT_COUNT
    uvec4 h0 = source(0u), h1 = source(1u);
    c.top = h0.w == RTC_AS_KIND_TOP;
    if (c.top) c.slot_quads = RTC_INSTANCE_QUADS;
    else c.slot_quads = (h1.x & RTC_FACT_AABBS) != 0u ? RTC_AABB_QUADS : RTC_TRIANGLE_QUADS;
    c.src_slots = nodes.y;
    c.dst_slots = compact ? RTC_AS_HEADER_QUADS + ((nodes.z + 3u) & ~3u) * RTC_NODE_QUADS : nodes.y;
    c.end = c.dst_slots + nodes.w * c.slot_quads;
    return c;
}

// Quad `at` of the copy, whose own base is not yet in it.
uvec4 compacted_quad(Compacted c, uint at) {
    uvec4 v = at >= c.dst_slots ? source(c.src_slots + (at - c.dst_slots)) : source(at);
    if (at == RTC_HDR_NODES / 4u) v.y = c.dst_slots;
    return v;
}
