// The module under construction: interned types and constants, and the import
// of other modules (stages, traversal) into its id space.
#pragma once

#include <map>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "ir/id_set.h"
#include "ir/module.h"

namespace rtc::ir {

// A 32-bit-word view of one scalar inside a value.
struct Leaf {
    std::vector<uint32_t> path;  // composite indices
    Id type = 0;                 // scalar type
    uint32_t words = 1;          // 1, or 2 for 64-bit scalars
};

class Program {
  public:
    Module module;

    // ---- types and constants; equal requests give equal ids ----
    Id void_type();
    Id bool_type();
    Id int_type(uint32_t width, bool is_signed);
    Id float_type(uint32_t width);
    Id uint_type() { return int_type(32, false); }
    Id vector_type(Id element, uint32_t count);
    Id pointer_type(spv::StorageClass storage, Id pointee);
    Id function_type(Id result, const std::vector<Id>& params);
    Id array_type(Id element, uint32_t count);
    Id constant_u32(uint32_t value);
    Id constant_scalar(Id type, uint64_t bits);  // int or float of any width
    Id constant_bool(bool value);
    Id constant_null(Id type);
    Id undef(Id type);

    // ---- looking things up ----
    const Inst* def(Id id) const {  // global instruction defining id, or nullptr
        const uint32_t index = global_index_.get(id);
        return index ? &module.globals[index - 1] : nullptr;
    }
    Op type_op(Id type) const {  // OpNop when unknown
        const Inst* inst = def(type);
        return inst ? inst->op : Op::OpNop;
    }
    Id pointee(Id pointer_type) const;
    spv::StorageClass storage(Id pointer_type) const;
    // Value of an integer constant (not specialisable); false otherwise.
    bool constant_value(Id id, uint64_t& value) const;
    // Type of member/element `index` of a composite type.
    Id element_type(Id type, uint32_t index) const;
    uint32_t element_count(Id type) const;  // vector, matrix, array of constant length, struct
    bool is_pointer(Id type) const { return type_op(type) == Op::OpTypePointer; }
    bool is_opaque(Id type) const;  // image, sampler, sampled image, AS, or an aggregate of them

    // Scalars of a type in order; throws with `what` in the message for types without a word form.
    void flatten(Id type, std::vector<Leaf>& leaves, const std::string& what) const;
    uint32_t word_count(Id type, const std::string& what) const;

    // ---- globals ----
    Id add_global(Inst inst);  // gives inst.result a fresh id when it is 0
    Id add_variable(spv::StorageClass storage, Id pointee, const std::string& name);
    void decorate(Id target, spv::Decoration decoration, std::vector<uint32_t> operands = {});
    void member_decorate(Id target, uint32_t member, spv::Decoration decoration, std::vector<uint32_t> operands = {});
    // In the order they were made.
    template <typename Fn>
    void for_each_decoration(Id id, Fn&& fn) const {
        for (uint32_t at = decoration_chains_.get(id).first; at; at = decoration_next_[at - 1])
            if (const Inst& inst = module.decorations[at - 1]; inst.op != Op::OpNop) fn(inst);
    }
    bool is_decorated(Id id) const;
    std::vector<const Inst*> decorations_of(Id id) const;
    bool decoration(Id id, spv::Decoration decoration, uint32_t* operand = nullptr) const;
    bool member_decoration(Id id, uint32_t member, spv::Decoration decoration, uint32_t* operand = nullptr) const;
    void copy_decorations(Id from, Id to);  // for a clone of a value; member decorations stay behind
    void remove_decorations(Id id, spv::Decoration decoration);

    std::string name_of(Id id);  // OpName or "", without a search

    // Source file index in module.files for `name`.
    uint32_t file_index(const std::string& name);

    // ---- import ----
    // Adds `source`'s types, constants, globals, decorations and names, and returns its functions
    // with every id mapped. `map` receives source id -> program id.
    std::vector<Function> import(const Module& source, IdMap<Id>& map);

    // Types of lowered acceleration structures: the header block, and arrays of it by original array type.
    Id header_struct = 0;
    // Push constants as words, when the stages' blocks differ; 0: they agree.
    Id push_words = 0;
    std::map<Id, Id> header_arrays;

    // Rebuilds lookup tables after passes edited module.globals, module.names or module.decorations directly.
    void reindex();

  private:
    Id intern(Inst inst);
    // Good until the next call.
    const std::string& key_of(const Inst& inst, const std::string& extra);

    std::unordered_map<std::string, Id> interned_;
    std::string key_;
    IdMap<uint32_t> global_index_;  // index plus one
    // Decorations of one target are chained: places in module.decorations plus one, 0 for none.
    struct Chain {
        uint32_t first = 0, last = 0;
    };
    void chain_decoration(Id target);  // the one just pushed to module.decorations
    IdMap<Chain> decoration_chains_;
    std::vector<uint32_t> decoration_next_;
    std::map<std::string, uint32_t> file_index_;
    std::map<std::string, Id> ext_sets_;
    void see_names();
    IdSet named_;                // targets of the first names_seen_ names
    IdMap<uint32_t> name_index_;  // the first OpName among them, index plus one
    size_t names_seen_ = 0;
};

}  // namespace rtc::ir
