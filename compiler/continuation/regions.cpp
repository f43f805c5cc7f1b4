// Dominators, and from them the constructs of a stage body.
#include "continuation/regions.h"

#include <algorithm>

namespace rtc::continuation {
namespace {

// Immediate dominators after Cooper, Harvey and Kennedy, "A Simple, Fast Dominance Algorithm" (2001).
std::map<Id, Id> dominators(Id entry, const std::map<Id, std::vector<Id>>& successors, std::vector<Id>& order) {
    std::map<Id, int> number;
    std::vector<std::pair<Id, size_t>> stack{{entry, 0}};
    std::set<Id> seen{entry};
    std::vector<Id> post;
    while (!stack.empty()) {
        auto& [label, next] = stack.back();
        const std::vector<Id>& out = successors.at(label);
        if (next < out.size()) {
            const Id target = out[next++];
            if (seen.insert(target).second) stack.push_back({target, 0});
        } else {
            number[label] = static_cast<int>(post.size());
            post.push_back(label);
            stack.pop_back();
        }
    }
    order.assign(post.rbegin(), post.rend());
    std::map<Id, std::vector<Id>> predecessors;
    for (Id label : order)
        for (Id target : successors.at(label)) predecessors[target].push_back(label);
    std::map<Id, Id> idom{{entry, entry}};
    for (bool changed = true; changed;) {
        changed = false;
        for (Id label : order) {
            if (label == entry) continue;
            Id best = 0;
            for (Id p : predecessors[label]) {
                if (!idom.count(p)) continue;
                if (!best) {
                    best = p;
                    continue;
                }
                Id a = p, b = best;
                while (a != b) {
                    while (number[a] < number[b]) a = idom[a];
                    while (number[b] < number[a]) b = idom[b];
                }
                best = a;
            }
            if (idom[label] != best) {
                idom[label] = best;
                changed = true;
            }
        }
    }
    return idom;
}

}  // namespace

Regions::Regions(const ir::Program& program, const lower::Stage& stage, const lower::CallKinds& kinds) {
    std::set<Id> labels;
    for (const Block& block : stage.body.blocks) {
        labels.insert(block.label);
        successors[block.label] = block.successors();
    }
    for (auto& [label, out] : successors)
        for (Id target : out)
            if (!labels.count(target))
                stage.fail("branch-target", {}, "a branch names a block of another function", program);
    std::vector<Id> order;
    const std::map<Id, Id> idom = dominators(stage.body.blocks.front().label, successors, order);
    reachable.insert(order.begin(), order.end());
    find_constructs(stage, idom);

    // A construct with a call inside is cut, and so is everything around an inlined function.
    for (const Block& block : stage.body.blocks) {
        if (!reachable.count(block.label)) continue;
        bool call = false;
        for (const ir::Inst& inst : block.insts) call |= lower::is_call(inst, kinds);
        if (!call) continue;
        const auto found = innermost_.find(block.label);
        for (int c = found == innermost_.end() ? -1 : found->second; c >= 0; c = constructs[c].parent)
            constructs[c].cut = true;
    }
    // So that a long loop can be re-entered, what is around it is cut too.
    if (kinds.loops_suspend)
        for (Construct& c : constructs) {
            if (!c.is_loop) continue;
            for (const Block& block : stage.body.blocks)
                if (block.label == c.header) c.can_suspend = !lower::is_short_loop(program, stage.body, block);
            if (!c.can_suspend) continue;
            for (int up = c.parent; up >= 0; up = constructs[up].parent) constructs[up].cut = true;
        }
    for (const Construct& region : constructs)
        if (region.is_inline)
            for (int c = region.parent; c >= 0; c = constructs[c].parent) constructs[c].cut = true;
}

void Regions::find_constructs(const lower::Stage& stage, const std::map<Id, Id>& idom) {
    // a dominates b iff b's interval in a walk of the dominator tree lies within a's.
    std::map<Id, std::vector<Id>> children;
    Id root = 0;
    for (const auto& [label, up] : idom) {
        if (label == up) root = label;
        else children[up].push_back(label);
    }
    std::map<Id, std::pair<int, int>> interval;
    int clock = 0;
    std::vector<std::pair<Id, size_t>> walk{{root, 0}};
    interval[root].first = clock++;
    while (!walk.empty()) {
        auto& [label, next] = walk.back();
        const std::vector<Id>& below = children[label];
        if (next < below.size()) {
            const Id child = below[next++];
            interval[child].first = clock++;
            walk.push_back({child, 0});
        } else {
            interval[label].second = clock;
            walk.pop_back();
        }
    }
    auto dominates = [&](Id a, Id b) {
        const auto ia = interval.find(a), ib = interval.find(b);
        if (ia == interval.end() || ib == interval.end()) return false;
        return ia->second.first <= ib->second.first && ib->second.second <= ia->second.second;
    };
    struct Head {
        Construct construct;
        int depth;
        size_t order;
    };
    std::map<Id, Id> inline_exit;
    for (const lower::InlineRegion& region : stage.inlined) inline_exit[region.entry] = region.exit;
    std::vector<Head> heads;
    for (size_t i = 0; i < stage.body.blocks.size(); ++i) {
        const Block& block = stage.body.blocks[i];
        if (!reachable.count(block.label)) continue;
        Construct construct;
        construct.header = block.label;
        if (const auto found = inline_exit.find(block.label); found != inline_exit.end()) {
            construct.merge = found->second;
            construct.is_inline = construct.cut = true;
        } else if (const ir::Inst* merge = block.merge()) {
            construct.merge = merge->ops[0];
            construct.is_loop = merge->op == ir::Op::OpLoopMerge;
            if (construct.is_loop) construct.continue_target = merge->ops[1];
        } else {
            continue;
        }
        int depth = 0;
        for (Id at = block.label; idom.at(at) != at; at = idom.at(at)) ++depth;
        heads.push_back({std::move(construct), depth, i});
    }
    // Dominating headers first, so that a construct's parent is known before it.
    std::stable_sort(heads.begin(), heads.end(), [](const Head& a, const Head& b) { return a.depth < b.depth; });
    for (Head& head : heads) {
        Construct& c = head.construct;
        const auto outer = innermost_.find(c.header);
        c.parent = outer == innermost_.end() ? -1 : outer->second;
        const std::set<Id>& within = c.parent >= 0 ? constructs[c.parent].blocks : reachable;
        // `if (x) continue;` dominates the continue construct of the loop around it without holding it.
        Id next_turn = 0;
        for (int up = c.parent; up >= 0 && !next_turn; up = constructs[up].parent)
            if (constructs[up].is_loop) next_turn = constructs[up].continue_target;
        if (next_turn && dominates(next_turn, c.header)) next_turn = 0;
        for (Id label : within)
            if (dominates(c.header, label) && !dominates(c.merge, label) &&
                !(next_turn && dominates(next_turn, label)))
                c.blocks.insert(label);
        const int index = static_cast<int>(constructs.size());
        headed_[c.header] = index;
        for (Id label : c.blocks) innermost_[label] = index;
        constructs.push_back(std::move(c));
    }
}

int Regions::headed(Id label) const {
    const auto found = headed_.find(label);
    return found == headed_.end() ? -1 : found->second;
}

int Regions::around(Id label) const {
    const auto found = innermost_.find(label);
    int c = found == innermost_.end() ? -1 : found->second;
    if (c >= 0 && constructs[c].header == label) c = constructs[c].parent;
    return c;
}

bool Regions::is_top(Id label) const {
    for (int c = around(label); c >= 0; c = constructs[c].parent)
        if (!constructs[c].cut) return false;
    return true;
}

int Regions::intact_root(Id label) const {
    int root = -1;
    const auto found = innermost_.find(label);
    for (int c = found == innermost_.end() ? -1 : found->second; c >= 0; c = constructs[c].parent)
        if (!constructs[c].cut) root = c;
    return root;
}

}  // namespace rtc::continuation
