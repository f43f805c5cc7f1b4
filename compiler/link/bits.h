// Known bits: what is certain about integers and booleans whatever the inputs
// are. The facts about trace sites come from here, and the folding that follows.
#pragma once

#include <map>
#include <unordered_map>

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

// Known bits of values of one function and of the globals, computed on demand.
class BitAnalysis {
  public:
    // `contents`: what loads of these variables and calls of these functions give. Local variables that only
    // loads and stores touch are looked through. `settle`: also where they are stored in terms of themselves
    // (flags |= x); takes several rounds over the function.
    BitAnalysis(const ir::Program& program, const ir::Function& function, const std::map<ir::Id, Bits>& contents,
                bool settle);
    Bits of(ir::Id id);
    uint32_t mask(ir::Id type) const;  // all bits of the type: 1 for bool, ~0 for 32-bit integers, else 0

  private:
    Bits compute(const ir::Inst& inst);
    Bits operation(ir::Op op, ir::Id type, const uint32_t* ops, size_t count);
    Bits stored(ir::Id variable);
    void settle();

    const ir::Program& p_;
    const std::map<ir::Id, Bits>& contents_;
    std::unordered_map<ir::Id, const ir::Inst*> defs_;
    std::unordered_map<ir::Id, std::vector<ir::Id>> stores_;  // local variable -> values; absent: touched otherwise
    std::map<ir::Id, Bits> settled_;  // contents of local variables
    std::unordered_map<ir::Id, Bits> known_;
    std::unordered_map<ir::Id, bool> open_;  // being computed: nothing is known yet
    int depth_ = 0;
};

// What module-scope variables hold wherever they are stored, and what functions return: from the stores and
// returns of `functions`, of which nothing else writes them. `given` stands as it is. (fold.cpp)
std::map<ir::Id, Bits> contents_of(const ir::Program& program, const std::vector<const ir::Function*>& functions,
                                   const std::map<ir::Id, Bits>& given, bool variables);

}  // namespace rtc::link
