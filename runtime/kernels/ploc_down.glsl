// Hands a node's place down to its children: slots in depth-first order, encoded nodes in
// depth-first order (preorder). Inside a collapsed subtree only slots are handed down.
void hand_down(uint node) {
    uvec4 v = info[node];
    uint at = out_index[node];
    bool alive = at != 0xffffffffu;
    uint first = v.z;
    uint left_slots = 1u, left_nodes = 0u;
    if ((v.x & RTR_CHILD_LEAF) != 0u) {
        slot_of[v.x & ~RTR_CHILD_LEAF] = first;
    } else {
        uint w = info[v.x].w;
        left_slots = w & ~RTR_COLLAPSED;
        left_nodes = floatBitsToUint(node_box[2u * v.x + 1u].w) & RTR_INNER_MASK;
        info[v.x].z = first;
        out_index[v.x] = alive && (w & RTR_COLLAPSED) == 0u ? at + 1u : 0xffffffffu;
    }
    if ((v.y & RTR_CHILD_LEAF) != 0u) {
        slot_of[v.y & ~RTR_CHILD_LEAF] = first + left_slots;
    } else {
        uint w = info[v.y].w;
        info[v.y].z = first + left_slots;
        out_index[v.y] = alive && (w & RTR_COLLAPSED) == 0u ? at + 1u + left_nodes : 0xffffffffu;
    }
}
