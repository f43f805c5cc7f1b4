// The structured regions of a stage body: which constructs there are, which blocks
// each holds, and which must be taken apart because they contain a call.
#pragma once

#include <map>
#include <set>
#include <vector>

#include "lower/stage.h"

namespace rtc::continuation {

using ir::Block;
using ir::Id;

struct Construct {
    Id header = 0;
    Id merge = 0;
    Id continue_target = 0;  // loops only
    bool is_loop = false;
    bool is_inline = false;  // the code of an inlined function; always cut
    bool cut = false;        // contains a call: becomes states
    bool can_suspend = false;  // a loop that may be long, when lanes can suspend
    int parent = -1;         // index of the enclosing construct
    std::set<Id> blocks;     // labels, header included
};

class Regions {
  public:
    // Throws CompileError when a loop or selection is not structured.
    Regions(const ir::Program& program, const lower::Stage& stage, const lower::CallKinds& kinds);

    std::vector<Construct> constructs;       // outer before inner
    std::set<Id> reachable;
    std::map<Id, std::vector<Id>> successors;

    // Innermost construct holding the block; for a header, the construct around the one it heads. -1: none.
    int around(Id label) const;
    // The construct a block heads, or -1.
    int headed(Id label) const;
    // No intact construct holds the block, except one it heads.
    bool is_top(Id label) const;
    // The outermost intact construct that holds the block without being headed by a top block elsewhere; -1: none.
    int intact_root(Id label) const;

  private:
    void find_constructs(const lower::Stage& stage, const std::map<Id, Id>& idom);
    std::map<Id, int> headed_, innermost_;
};

}  // namespace rtc::continuation
