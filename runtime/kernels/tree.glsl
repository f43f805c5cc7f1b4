// Inner nodes from their children, by the surface area heuristic (SAH).
struct Subtree {
    vec3 lo, hi;
    float cost;     // SAH cost, not divided by the root's area
    uint count;     // primitives; 255: or more
    uint encoded;   // height in encoded nodes: a collapsed subtree has 0
    uint height;    // height in inner nodes
    bool collapsed; // one leaf is cheaper than its nodes
};

Subtree load_leaf(uint child) {
    Subtree t;
    uint prim = child & ~RTR_CHILD_LEAF;
    t.lo = leaf_box[2u * prim].xyz;
    t.hi = leaf_box[2u * prim + 1u].xyz;
    t.cost = half_area(t.lo, t.hi) * RTR_COST_SLOT;
    t.count = 1u;
    t.encoded = 0u;
    t.height = 0u;
    t.collapsed = false;
    return t;
}

Subtree load_subtree(uint child) {
    Subtree t;
    if ((child & RTR_CHILD_LEAF) != 0u) {
        t = load_leaf(child);
    } else {
        t.collapsed = false;
        vec4 a = node_box[2u * child];
        vec4 b = node_box[2u * child + 1u];
        uint misc = floatBitsToUint(b.w);
        t.lo = a.xyz;
        t.hi = b.xyz;
        t.cost = a.w;
        t.count = misc >> RTR_COUNT_SHIFT;
        t.encoded = (misc >> RTR_ENCODED_SHIFT) & RTR_HEIGHT_MASK;
        t.height = misc & RTR_HEIGHT_MASK;
    }
    return t;
}

Subtree join(Subtree a, Subtree b, bool may_collapse) {
    Subtree t;
    t.lo = min(a.lo, b.lo);
    t.hi = max(a.hi, b.hi);
    t.count = min(a.count + b.count, 255u);
    float area = half_area(t.lo, t.hi);
    precise float split_cost = min(area * RTR_COST_NODE + (a.cost + b.cost), RTR_FLT_MAX);
    precise float leaf_cost = min(area * RTR_COST_SLOT * float(t.count), RTR_FLT_MAX);
    bool collapse = leaf_cost <= split_cost || (p.flags & RTR_BUILD_LOW_MEMORY) != 0u;
    t.collapsed = may_collapse && t.count <= RTC_MAX_LEAF_SLOTS && collapse;
    t.cost = t.collapsed ? leaf_cost : split_cost;
    t.encoded = t.collapsed ? 0u : 1u + max(a.encoded, b.encoded);
    t.height = 1u + max(a.height, b.height);
    return t;
}

void store_subtree(uint node, uint left, uint right, Subtree t) {
    node_box[2u * node] = vec4(t.lo, t.cost);
    uint misc = t.height | (t.encoded << RTR_ENCODED_SHIFT) | (t.count << RTR_COUNT_SHIFT);
    node_box[2u * node + 1u] = vec4(t.hi, uintBitsToFloat(misc));
    info[node] = uvec4(left, right, 0u, t.count | (t.collapsed ? RTR_COLLAPSED : 0u));
}

void set_parent(uint child, uint parent) {
    // Leaves are known by their sorted position, which slot_of still holds here.
    if ((child & RTR_CHILD_LEAF) != 0u) links[p.total + slot_of[child & ~RTR_CHILD_LEAF]] = parent;
    else links[child] = parent;
}
