// What must survive a call: backward data flow over the scalars of variables. A store to a part kills that part,
// a load of a part keeps it alive; parts that only an index known at run time can name count as wholes.
#include <set>

#include "continuation/machine.h"

namespace rtc::continuation {
namespace {

class Bits {
  public:
    explicit Bits(size_t count) : words_((count + 63) / 64, 0) {}
    void set(size_t first, size_t count, bool value) {
        for (size_t i = first; i < first + count; ++i) {
            if (value)
                words_[i / 64] |= uint64_t{1} << (i % 64);
            else
                words_[i / 64] &= ~(uint64_t{1} << (i % 64));
        }
    }
    bool test(size_t i) const { return words_[i / 64] >> (i % 64) & 1; }
    // True when a bit was added.
    bool join(const Bits& other) {
        uint64_t added = 0;
        for (size_t i = 0; i < words_.size(); ++i) {
            added |= other.words_[i] & ~words_[i];
            words_[i] |= other.words_[i];
        }
        return added != 0;
    }
    bool operator==(const Bits&) const = default;

  private:
    std::vector<uint64_t> words_;
};

// Scalars of all candidates, numbered one after the other.
struct Part {
    uint32_t first = 0, count = 0;
    Id type = 0;  // what the part is; 0: below an index that is not constant
};

struct Event {
    Part part;
    bool use = false;  // else: overwritten
};

class Scalars {
  public:
    explicit Scalars(const Program& program) : p_(program) {}

    uint32_t count(Id type) {
        const auto known = counts_.find(type);
        if (known != counts_.end()) return known->second;
        uint64_t total = 0;
        switch (p_.type_op(type)) {
            case Op::OpTypeVector:
            case Op::OpTypeMatrix:
            case Op::OpTypeArray:
                total = static_cast<uint64_t>(p_.element_count(type)) * count(p_.element_type(type, 0));
                break;
            case Op::OpTypeStruct:
                for (uint32_t i = 0; i < p_.element_count(type); ++i) total += count(p_.element_type(type, i));
                break;
            default: total = 1; break;
        }
        // Anything larger cannot be saved anyway (Program::flatten), nor can what has no known size.
        return counts_[type] = static_cast<uint32_t>(std::min<uint64_t>(std::max<uint64_t>(total, 1), 65536));
    }

    // The part of `from` that an access chain's index names.
    Part step(const Part& from, Id index) {
        uint64_t at = 0;
        if (!from.type || !p_.constant_value(index, at) || at >= p_.element_count(from.type) || from.count >= 65536)
            return {from.first, from.count, 0};
        Part to{from.first, 0, p_.element_type(from.type, static_cast<uint32_t>(at))};
        to.count = count(to.type);
        if (p_.type_op(from.type) == Op::OpTypeStruct)
            for (uint32_t i = 0; i < at; ++i) to.first += count(p_.element_type(from.type, i));
        else
            to.first += static_cast<uint32_t>(at) * to.count;
        return to;
    }

  private:
    const Program& p_;
    std::map<Id, uint32_t> counts_;
};

}  // namespace

std::map<Id, std::vector<LiveVariable>> live_across_calls(const Program& program, const lower::Stage& stage,
                                                          const lower::CallKinds& kinds,
                                                          const std::vector<std::pair<Id, Id>>& candidates) {
    Scalars scalars(program);
    std::map<Id, Part> whole;
    uint32_t total = 0;
    std::set<Id> candidate_set;
    for (const auto& [id, type] : candidates) {
        whole[id] = {total, scalars.count(type), type};
        total += whole[id].count;
        candidate_set.insert(id);
    }

    // Module-scope variables a function may touch, callees included.
    std::map<Id, std::set<Id>> touched;
    for (bool changed = true; changed;) {
        changed = false;
        for (const Function& function : stage.functions) {
            std::set<Id>& set = touched[function.id()];
            const size_t before = set.size();
            for (const Block& block : function.blocks)
                for (const Inst& inst : block.insts) {
                    inst.for_each_id([&](Id id) {
                        if (candidate_set.count(id)) set.insert(id);
                    });
                    if (inst.op == Op::OpFunctionCall) {
                        const std::set<Id> callee = touched[inst.ops[0]];
                        set.insert(callee.begin(), callee.end());
                    }
                }
            changed |= set.size() != before;
        }
    }

    std::map<Id, std::vector<Event>> effects;     // whole block, in order
    std::map<Id, std::vector<Event>> after_call;  // what follows the call inside its block
    std::map<Id, bool> has_call;
    for (const Block& block : stage.body.blocks) {
        std::vector<Event>& all = effects[block.label];
        std::vector<Event>& rest = after_call[block.label];
        // Pointers into variables, within this block (memory form keeps them there).
        std::map<Id, Part> parts;
        auto part_of = [&](Id id) -> const Part* {
            if (const auto found = whole.find(id); found != whole.end()) return &found->second;
            const auto found = parts.find(id);
            return found == parts.end() ? nullptr : &found->second;
        };
        bool called = false;
        for (const Inst& inst : block.insts) {
            std::vector<Event> events;
            if (inst.op == Op::OpAccessChain || inst.op == Op::OpInBoundsAccessChain || inst.op == Op::OpCopyObject) {
                if (const Part* base = part_of(inst.ops[0])) {
                    Part part = *base;
                    for (size_t i = 1; i < inst.ops.size(); ++i) part = scalars.step(part, inst.ops[i]);
                    parts[inst.result] = part;
                }
            } else if (inst.op == Op::OpStore) {
                if (const Part* value = part_of(inst.ops[1])) events.push_back({*value, true});
                if (const Part* target = part_of(inst.ops[0]); target && target->type) events.push_back({*target, false});
            } else {
                // The outgoing payload travels in the shared words and comes back from them.
                const bool call = lower::is_call(inst, kinds);
                const size_t payload = lower::is_trace(inst.op) ? 10 : lower::is_callable(inst.op) ? 1 : ~size_t{0};
                for (size_t i = 0; i < inst.ops.size(); ++i) {
                    const Part* part = part_of(inst.ops[i]);
                    if (!part) continue;
                    events.push_back({*part, true});
                    if (call && i == payload && part->type) rest.push_back({*part, false});
                }
                if (inst.op == Op::OpFunctionCall)
                    for (Id variable : touched[inst.ops[0]]) events.push_back({whole.at(variable), true});
                if (call) {
                    called = true;
                    all.insert(all.end(), events.begin(), events.end());
                    // What the call itself overwrites belongs to the time after it.
                    all.insert(all.end(), rest.begin(), rest.end());
                    continue;
                }
                // The epilogue reads the incoming data.
                if ((inst.op == Op::OpReturn || inst.op == Op::OpIgnoreIntersectionKHR ||
                     inst.op == Op::OpTerminateRayKHR) &&
                    stage.incoming)
                    events.push_back({whole.at(stage.incoming), true});
            }
            all.insert(all.end(), events.begin(), events.end());
            if (called) rest.insert(rest.end(), events.begin(), events.end());
        }
        has_call[block.label] = called;
    }

    auto before = [](Bits live, const std::vector<Event>& events) {
        for (auto it = events.rbegin(); it != events.rend(); ++it) live.set(it->part.first, it->part.count, it->use);
        return live;
    };
    std::map<Id, Bits> live_in;
    for (const Block& block : stage.body.blocks) live_in.emplace(block.label, Bits(total));
    auto live_out = [&](const Block& block) {
        Bits live(total);
        for (Id successor : block.successors())
            if (const auto found = live_in.find(successor); found != live_in.end()) live.join(found->second);
        return live;
    };
    for (bool changed = true; changed;) {
        changed = false;
        for (auto block = stage.body.blocks.rbegin(); block != stage.body.blocks.rend(); ++block)
            changed |= live_in.at(block->label).join(before(live_out(*block), effects[block->label]));
    }

    std::map<Id, std::vector<LiveVariable>> out;
    for (const Block& block : stage.body.blocks) {
        if (!has_call[block.label]) continue;
        const Bits live = before(live_out(block), after_call[block.label]);
        std::vector<LiveVariable>& list = out[block.label];
        for (const auto& [id, type] : candidates) {
            const Part& part = whole.at(id);
            LiveVariable entry;
            entry.variable = id;
            for (uint32_t i = 0; i < part.count; ++i)
                if (live.test(part.first + i)) entry.scalars.push_back(i);
            if (entry.scalars.empty()) continue;
            if (entry.scalars.size() == part.count) entry.scalars.clear();
            list.push_back(std::move(entry));
        }
    }
    return out;
}

}  // namespace rtc::continuation
