// Known bits: what is certain about integers and booleans whatever the inputs
// are. The facts about trace sites come from here, and the folding that follows.
#pragma once

#include <map>
#include <span>

#include "ir/program.h"

namespace rtc::link {

// Bits that are certainly 0, and bits that are certainly 1, of a 32-bit integer; a bool is one bit.
// Larger integers, floats and composites have none.
struct Bits {
    uint32_t zeros = 0;
    uint32_t ones = 0;
    bool constant(uint32_t width_mask) const { return (zeros | ones) == width_mask; }
    bool operator==(const Bits&) const = default;
};
Bits exactly(uint32_t value);
Bits both(Bits a, Bits b);  // what holds for either value

// Known bits of the values of some functions. Variables that only whole loads and stores touch are looked
// through, and so are calls; both also where a value depends on itself (flags |= x).
class BitAnalysis {
  public:
    // Tables by id. Analyses of one program that come one after the other share them: what one leaves behind,
    // the next does not see, and none has to clear them.
    class Tables {
      public:
        void reserve(ir::Id bound) {
            masks.reserve(bound);
            entries.reserve(bound);
        }

      private:
        friend class BitAnalysis;
        struct Entry {
            const ir::Inst* inst = nullptr;  // of the functions that makes it
            Bits bits;
            uint32_t epoch = 0;     // `bits` are of this one
            uint32_t analysis = 0;  // the entry is of this one
            uint32_t cell = 0;      // of a variable or function: in cells_, plus one
            ir::Id block = 0;       // of a phi: where it stands
        };
        ir::IdMap<uint8_t> masks;  // 0: not looked at, 1: none, 2: of a bool, 3: of a 32-bit integer
        ir::IdMap<Entry> entries;
        uint32_t epoch = 1, analysis = 0;
    };

    // `given`: what loads of these variables give, whatever is stored. `module_variables`: nothing but these
    // functions stores to module-scope variables. Neither the functions nor their instructions may change
    // while the analysis is asked.
    BitAnalysis(const ir::Program& program, const std::vector<const ir::Function*>& functions,
                const std::map<ir::Id, Bits>& given, bool module_variables, Tables& tables);
    Bits of(ir::Id id) {
        const Tables::Entry& known = t_.entries.get(id);
        return known.epoch == t_.epoch ? known.bits : find(id);
    }
    // All bits of the type: 1 for bool, ~0 for 32-bit integers, else 0.
    uint32_t mask(ir::Id type) const {
        constexpr uint32_t kMasks[] = {0, 0, 1, ~0u};
        const uint8_t known = t_.masks.get(type);
        return kMasks[known ? known : look_at(type)];
    }
    // The instructions of a function (by its place among `functions`) whose value may have known bits, or be that
    // of an operand, in order.
    struct Candidate {
        const ir::Inst* inst;
        ir::Id block;
    };
    std::span<const Candidate> candidates(size_t function) const {
        const size_t begin = function ? candidate_ends_[function - 1] : 0;
        return {candidates_.data() + begin, candidate_ends_[function] - begin};
    }
    // The instruction that makes a value of the functions or a global one; null for parameters.
    const ir::Inst* def(ir::Id id) const {
        const ir::Inst* here = local(id);
        return here ? here : p_.def(id);
    }

    // ---- code that turns out not to run ----
    // `block` always goes to `target`, whatever else its terminator names.
    void take(ir::Id block, ir::Id target) { taken_[block] = target; }
    ir::Id taken(ir::Id block) const { return taken_.get(block); }
    // Nothing gets to `block`.
    void bury(ir::Id block) { dead_.insert(block); }
    bool dead(ir::Id block) const { return dead_.contains(block); }
    // Whether `from`, which names `to`, may go there.
    bool arrives(ir::Id from, ir::Id to) const {
        const ir::Id only = taken_.get(from);
        return !dead_.contains(from) && (!only || only == to);
    }
    // The block of a phi of the functions.
    ir::Id block_of(const ir::Inst& phi) const { return t_.entries.get(phi.result).block; }
    // Once more, with what has been said since: what is stored in dead blocks counts for nothing.
    void settle();

  private:
    // A variable or a function's result: one of several values.
    struct Cell {
        ir::Id id = 0;
        uint32_t first = 0, count = 0;  // of values_
        Bits bits;
        bool given = false;
        bool fixed = false;  // settle leaves its bits alone
    };
    struct Stored {
        uint32_t cell;
        ir::Id value, block;
    };
    struct Opening {
        uint32_t cell;
        ir::Id block;
    };
    const ir::Inst* local(ir::Id id) const {  // null for what is not of the functions
        const Tables::Entry& known = t_.entries.get(id);
        return known.analysis == t_.analysis ? known.inst : nullptr;
    }
    Tables::Entry& entry(ir::Id id) {
        Tables::Entry& known = t_.entries[id];
        if (known.analysis != t_.analysis) {
            known = {};
            known.analysis = t_.analysis;
        }
        return known;
    }
    uint8_t look_at(ir::Id type) const;
    uint32_t make_cell(ir::Id id);
    bool find_cell(ir::Id id, uint32_t& cell) const;
    void collect(const ir::Function& function);
    size_t count_live() const;
    void place_values();
    Bits find(ir::Id id);
    Bits compute(const ir::Inst& inst);
    Bits operation(ir::Op op, ir::Id type, const uint32_t* ops, size_t count);
    Bits content(ir::Id id) const;

    const ir::Program& p_;
    Tables& t_;
    std::vector<Candidate> candidates_;  // function by function
    std::vector<size_t> candidate_ends_;
    std::vector<Cell> cells_;
    std::vector<Stored> stored_;
    std::vector<Opening> openings_;  // where a variable is touched by more than whole loads and stores
    std::vector<const ir::Inst*> phis_;
    size_t live_ = 0;             // count_live() plus one when bits were settled
    std::vector<ir::Id> values_;  // what live code stores, cell by cell
    ir::IdSet dead_;
    ir::IdMap<ir::Id> taken_;
    int depth_ = 0;
};

}  // namespace rtc::link
