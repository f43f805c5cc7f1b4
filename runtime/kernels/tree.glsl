// An inner node from its two children, with the choice between keeping the split and
// collapsing the subtree into one leaf, by the surface area heuristic.
struct Subtree {
    vec3 lo, hi;
    float cost;
    uint count;  // primitives
    uint inner;  // encoded nodes in it
    uint height; // of the encoded nodes
};

Subtree subtree_of(uint child) {
    Subtree t;
    if ((child & RTR_CHILD_LEAF) != 0u) {
        uint prim = child & ~RTR_CHILD_LEAF;
        t.lo = leaf_box[2u * prim].xyz;
        t.hi = leaf_box[2u * prim + 1u].xyz;
        t.cost = half_area(t.lo, t.hi) * RTR_COST_SLOT;
        t.count = 1u;
        t.inner = 0u;
        t.height = 0u;
    } else {
        vec4 a = node_box[2u * child];
        vec4 b = node_box[2u * child + 1u];
        uint misc = floatBitsToUint(b.w);
        t.lo = a.xyz;
        t.hi = b.xyz;
        t.cost = a.w;
        t.count = info[child].w & ~RTR_COLLAPSED;
        t.inner = misc & RTR_INNER_MASK;
        t.height = misc >> RTR_HEIGHT_SHIFT;
    }
    return t;
}

// Stores box, cost and counts of `node`; returns the word for info[node].w.
uint store_node(uint node, Subtree a, Subtree b, bool is_root) {
    vec3 lo = min(a.lo, b.lo), hi = max(a.hi, b.hi);
    float area = half_area(lo, hi);
    uint count = a.count + b.count;
    float split_cost = min(area * RTR_COST_NODE + (a.cost + b.cost), RTR_FLT_MAX);
    float leaf_cost = min(area * RTR_COST_SLOT * float(count), RTR_FLT_MAX);
    bool collapse = !is_root && (p.flags & RTR_BUILD_TOP) == 0u && count <= RTC_MAX_LEAF_SLOTS &&
                    leaf_cost <= split_cost;
    uint inner = collapse ? 0u : 1u + a.inner + b.inner;
    uint height = collapse ? 0u : 1u + max(a.height, b.height);
    node_box[2u * node] = vec4(lo, collapse ? leaf_cost : split_cost);
    node_box[2u * node + 1u] = vec4(hi, uintBitsToFloat(inner | (height << RTR_HEIGHT_SHIFT)));
    return count | (collapse ? RTR_COLLAPSED : 0u);
}
