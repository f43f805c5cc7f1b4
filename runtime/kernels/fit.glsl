// Boxes and costs of a node whose children are finished; with p.step 1 the tree is improved too.
//
// By rotations (Kensler 2008): where it makes
// the two children cheaper, a child changes places with a grandchild of the other side,
// or two grandchildren with each other. The lane that finishes a node owns everything
// below it, so the result does not depend on who comes first. Large primitives beside
// small ones need a deep tree (floor and bunny: 0.65 of the SAH cost that trees as low as
// the Morton tree reach), so nodes may grow to RTR_HEIGHT_FREE; above that only rotations
// that do not make a node higher are taken. Should the whole become deeper than
// RTC_MAX_DEPTH all the same, the Morton tree comes back: p.step 2 (lbvh_topology.comp too).
// docs/benchmarks.md compares the trees with others.
#include "tree.glsl"

void rotate(uint node, inout uint l, inout uint r, inout Subtree a, inout Subtree b) {
    bool may = (p.flags & RTR_BUILD_TOP) == 0u;
    bool l_inner = (l & RTR_CHILD_LEAF) == 0u, r_inner = (r & RTR_CHILD_LEAF) == 0u;
    uint limit = max(max(a.height, b.height), RTR_HEIGHT_FREE - 1u);
    // Only a gain that rounding cannot explain, else passes could swap to and fro.
    float least = (a.cost + b.cost) * 0.99999;
    uint choice = 0u;
    Subtree new_a = a, new_b = b;
    uint l0 = 0u, l1 = 0u, r0 = 0u, r1 = 0u;
    Subtree a0 = a, a1 = a, b0 = b, b1 = b, x, y;
    if (l_inner) {
        l0 = info[l].x;
        l1 = info[l].y;
        a0 = load_subtree(l0);
        a1 = load_subtree(l1);
        x = join(b, a1, may); // r <-> l0
        if (max(x.height, a0.height) <= limit && x.cost + a0.cost < least) {
            least = x.cost + a0.cost;
            choice = 1u;
            new_a = x;
            new_b = a0;
        }
        x = join(a0, b, may); // r <-> l1
        if (max(x.height, a1.height) <= limit && x.cost + a1.cost < least) {
            least = x.cost + a1.cost;
            choice = 2u;
            new_a = x;
            new_b = a1;
        }
    }
    if (r_inner) {
        r0 = info[r].x;
        r1 = info[r].y;
        b0 = load_subtree(r0);
        b1 = load_subtree(r1);
        x = join(a, b1, may); // l <-> r0
        if (max(x.height, b0.height) <= limit && x.cost + b0.cost < least) {
            least = x.cost + b0.cost;
            choice = 3u;
            new_a = b0;
            new_b = x;
        }
        x = join(b0, a, may); // l <-> r1
        if (max(x.height, b1.height) <= limit && x.cost + b1.cost < least) {
            least = x.cost + b1.cost;
            choice = 4u;
            new_a = b1;
            new_b = x;
        }
    }
    if (l_inner && r_inner) {
        x = join(a0, b0, may); // l1 <-> r0
        y = join(a1, b1, may);
        if (max(x.height, y.height) <= limit && x.cost + y.cost < least) {
            least = x.cost + y.cost;
            choice = 5u;
            new_a = x;
            new_b = y;
        }
        x = join(a0, b1, may); // l1 <-> r1
        y = join(b0, a1, may);
        if (max(x.height, y.height) <= limit && x.cost + y.cost < least) {
            choice = 6u;
            new_a = x;
            new_b = y;
        }
    }
    if (choice == 0u) return;
    uint old_l = l, old_r = r;
    if (choice == 1u) {
        store_subtree(old_l, old_r, l1, new_a);
        set_parent(old_r, old_l);
        set_parent(l0, node);
        r = l0;
    } else if (choice == 2u) {
        store_subtree(old_l, l0, old_r, new_a);
        set_parent(old_r, old_l);
        set_parent(l1, node);
        r = l1;
    } else if (choice == 3u) {
        store_subtree(old_r, old_l, r1, new_b);
        set_parent(old_l, old_r);
        set_parent(r0, node);
        l = r0;
    } else if (choice == 4u) {
        store_subtree(old_r, r0, old_l, new_b);
        set_parent(old_l, old_r);
        set_parent(r1, node);
        l = r1;
    } else if (choice == 5u) {
        store_subtree(old_l, l0, r0, new_a);
        store_subtree(old_r, l1, r1, new_b);
        set_parent(r0, old_l);
        set_parent(l1, old_r);
    } else {
        store_subtree(old_l, l0, r1, new_a);
        store_subtree(old_r, r0, l1, new_b);
        set_parent(r1, old_l);
        set_parent(l1, old_r);
    }
    a = new_a;
    b = new_b;
}

// Returns the node's parent, ~0 for the root's.
uint finish_node(uint node) {
    uint l = info[node].x, r = info[node].y;
    Subtree a = load_subtree(l), b = load_subtree(r);
    if (p.step == 1u) rotate(node, l, r, a, b);
    Subtree whole = join(a, b, node != 0u && (p.flags & RTR_BUILD_TOP) == 0u);
    store_subtree(node, l, r, whole);
    uint parent = links[node];
    if (parent == 0xffffffffu && p.step == 1u) state[RTR_ST_DEEP] = whole.encoded > RTC_MAX_DEPTH ? 1u : 0u;
    return parent;
}
