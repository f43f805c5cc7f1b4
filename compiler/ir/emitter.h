// Appends instructions to a list, with the value/word conversions that payloads,
// frames and records share.
#pragma once

#include "ir/program.h"

namespace rtc::ir {

class Emitter {
  public:
    Emitter(Program& program, std::vector<Inst>& out, SourceLine source = {})
        : p(program), out_(out), source_(source) {}

    Program& p;

    Id value(Op op, Id type, Words ops);
    void effect(Op op, Words ops);

    Id load(Id type, Id pointer) { return value(Op::OpLoad, type, {pointer}); }
    void store(Id pointer, Id object) { effect(Op::OpStore, {pointer, object}); }
    void store_u32(Id pointer, uint32_t constant) { store(pointer, p.constant_u32(constant)); }
    Id chain(spv::StorageClass storage, Id type, Id base, std::vector<Id> indices);
    Id extract(Id type, Id composite, const std::vector<uint32_t>& path);
    Id construct(Id type, const std::vector<Id>& parts);
    Id call(Id function, Id result_type, const std::vector<Id>& arguments = {});
    Id add(Id a, Id b) { return value(Op::OpIAdd, p.uint_type(), {a, b}); }
    Id select(Id type, Id condition, Id a, Id b) { return value(Op::OpSelect, type, {condition, a, b}); }
    // Any integer or float scalar of 32 bits to uint.
    Id as_uint(Id value, Id type);
    Id from_uint(Id value, Id type);

    // A value as 32-bit words, in the order of Program::flatten, and back.
    std::vector<Id> to_words(Id value, Id type);
    Id from_words(Id type, const std::vector<Id>& words, size_t& at);

    void set_source(SourceLine source) { source_ = source; }

  private:
    std::vector<Inst>& out_;
    SourceLine source_;
};

}  // namespace rtc::ir
