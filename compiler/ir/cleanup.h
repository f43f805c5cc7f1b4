// Small clean-ups of one function, for code that was made for many purposes and is
// linked for one. All leave valid structured code, and no float operation changes.
#pragma once

#include "ir/program.h"

namespace rtc::ir {

// Branches on constants go one way; blocks that are no longer reached disappear (merge and continue
// blocks of what is left stay, empty). Switches are left alone.
void fold_constant_branches(const Program& program, Function& function);

// Within each block, a load of a local variable whose value is known there becomes that value.
void forward_local_loads(const Program& program, Function& function);

// Instructions whose result nothing uses and that have no effect; local variables that are only stored to.
void remove_dead_code(Function& function);

// A block that ends in a plain branch to a block nothing else branches to or names takes it in.
void merge_blocks(Function& function);

// An insertion deep into a composite becomes one for each level.
void split_nested_inserts(Program& program, Function& function);

// Whether something is stored two levels deep or deeper into a local variable.
bool stores_deep(const Function& function);

// All of the above that remove something.
void clean_up(const Program& program, Function& function);

}  // namespace rtc::ir
