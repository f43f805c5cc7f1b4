// Known bits: what is certain about integers and booleans whatever the inputs
// are. The facts about trace sites come from here, and the folding that follows.
#pragma once

#include <map>

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
    // `given`: what loads of these variables give, whatever is stored. `module_variables`: nothing but these
    // functions stores to module-scope variables. Neither the functions nor their instructions may change
    // while the analysis is asked.
    BitAnalysis(const ir::Program& program, const std::vector<const ir::Function*>& functions,
                const std::map<ir::Id, Bits>& given, bool module_variables);
    Bits of(ir::Id id);
    uint32_t mask(ir::Id type) const;  // all bits of the type: 1 for bool, ~0 for 32-bit integers, else 0
    // The instruction that makes a value of the functions or a global one; null for parameters.
    const ir::Inst* def(ir::Id id) const {
        const ir::Inst* local = defs_.get(id);
        return local ? local : p_.def(id);
    }

  private:
    // A variable or a function's result: one of several values.
    struct Cell {
        ir::Id id = 0;
        std::vector<ir::Id> values;
        Bits bits;
        bool fixed = false;
    };
    struct Known {
        Bits bits;
        uint32_t epoch = 0;
    };
    Cell& cell(ir::Id id);
    void collect(const std::vector<const ir::Function*>& functions, bool module_variables);
    void settle();
    Bits compute(const ir::Inst& inst);
    Bits operation(ir::Op op, ir::Id type, const uint32_t* ops, size_t count);
    Bits content(ir::Id id) const;

    const ir::Program& p_;
    ir::IdMap<const ir::Inst*> defs_;
    std::vector<Cell> cells_;
    ir::IdMap<uint32_t> cell_index_;  // plus one
    ir::IdMap<Known> known_;
    uint32_t epoch_ = 1;
    int depth_ = 0;
};

}  // namespace rtc::link
