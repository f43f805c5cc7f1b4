// Interning, lookups and import of modules into one id space.
#include "ir/program.h"

#include <algorithm>

namespace rtc::ir {
namespace {

// Global instructions that mean the same wherever they stand, so that one copy serves all.
bool is_internable(Op op) {
    switch (op) {
        case Op::OpTypeVoid:
        case Op::OpTypeBool:
        case Op::OpTypeInt:
        case Op::OpTypeFloat:
        case Op::OpTypeVector:
        case Op::OpTypeMatrix:
        case Op::OpTypeImage:
        case Op::OpTypeSampler:
        case Op::OpTypeSampledImage:
        case Op::OpTypeArray:
        case Op::OpTypeRuntimeArray:
        case Op::OpTypeStruct:
        case Op::OpTypePointer:
        case Op::OpTypeFunction:
        case Op::OpTypeAccelerationStructureKHR:
        case Op::OpTypeRayQueryKHR:
        case Op::OpConstantTrue:
        case Op::OpConstantFalse:
        case Op::OpConstant:
        case Op::OpConstantComposite:
        case Op::OpConstantNull:
        case Op::OpUndef: return true;
        default: return false;
    }
}

void append_word(std::string& key, uint32_t word) { key.append(reinterpret_cast<const char*>(&word), 4); }

}  // namespace

const std::string& Program::key_of(const Inst& inst, const std::string& extra) {
    key_.clear();
    append_word(key_, static_cast<uint32_t>(inst.op));
    append_word(key_, inst.type);
    key_.append(reinterpret_cast<const char*>(inst.ops.data()), 4 * inst.ops.size());
    key_ += '|';
    key_ += extra;
    return key_;
}

Id Program::intern(Inst inst) {
    const std::string& key = key_of(inst, {});
    const auto [known, fresh] = interned_.try_emplace(key, 0);
    if (fresh) known->second = add_global(std::move(inst));
    return known->second;
}

Id Program::add_global(Inst inst) {
    if (!inst.result) inst.result = module.new_id();
    global_index_[inst.result] = static_cast<uint32_t>(module.globals.size() + 1);
    module.globals.push_back(std::move(inst));
    return module.globals.back().result;
}

Id Program::void_type() { return intern(Inst(Op::OpTypeVoid, 0, 0, {})); }
Id Program::bool_type() { return intern(Inst(Op::OpTypeBool, 0, 0, {})); }
Id Program::int_type(uint32_t width, bool is_signed) {
    return intern(Inst(Op::OpTypeInt, 0, 0, {width, is_signed ? 1u : 0u}));
}
Id Program::float_type(uint32_t width) { return intern(Inst(Op::OpTypeFloat, 0, 0, {width})); }
Id Program::vector_type(Id element, uint32_t count) { return intern(Inst(Op::OpTypeVector, 0, 0, {element, count})); }
Id Program::pointer_type(spv::StorageClass storage, Id pointee) {
    return intern(Inst(Op::OpTypePointer, 0, 0, {static_cast<uint32_t>(storage), pointee}));
}
Id Program::function_type(Id result, const std::vector<Id>& params) {
    Inst inst(Op::OpTypeFunction, 0, 0, {result});
    inst.ops.insert(inst.ops.end(), params.begin(), params.end());
    return intern(std::move(inst));
}
Id Program::array_type(Id element, uint32_t count) {
    return intern(Inst(Op::OpTypeArray, 0, 0, {element, constant_u32(count)}));
}
Id Program::constant_u32(uint32_t value) { return intern(Inst(Op::OpConstant, uint_type(), 0, {value})); }
Id Program::constant_scalar(Id type, uint64_t bits) {
    const Inst* t = def(type);
    Inst inst(Op::OpConstant, type, 0, {static_cast<uint32_t>(bits)});
    if (t->ops[0] == 64) inst.ops.push_back(static_cast<uint32_t>(bits >> 32));
    return intern(std::move(inst));
}
Id Program::constant_bool(bool value) {
    return intern(Inst(value ? Op::OpConstantTrue : Op::OpConstantFalse, bool_type(), 0, {}));
}
Id Program::constant_null(Id type) { return intern(Inst(Op::OpConstantNull, type, 0, {})); }
Id Program::undef(Id type) { return intern(Inst(Op::OpUndef, type, 0, {})); }

Id Program::pointee(Id pointer_type) const { return def(pointer_type)->ops[1]; }

spv::StorageClass Program::storage(Id pointer_type) const {
    return static_cast<spv::StorageClass>(def(pointer_type)->ops[0]);
}

bool Program::constant_value(Id id, uint64_t& value) const {
    const Inst* inst = def(id);
    if (!inst) return false;
    if (inst->op == Op::OpConstantNull) {
        value = 0;
        return type_op(inst->type) == Op::OpTypeInt;
    }
    if (inst->op != Op::OpConstant || type_op(inst->type) != Op::OpTypeInt) return false;
    value = inst->ops[0];
    if (inst->ops.size() > 1) value |= static_cast<uint64_t>(inst->ops[1]) << 32;
    return true;
}

Id Program::element_type(Id type, uint32_t index) const {
    const Inst* inst = def(type);
    switch (inst->op) {
        case Op::OpTypeVector:
        case Op::OpTypeMatrix:
        case Op::OpTypeArray:
        case Op::OpTypeRuntimeArray: return inst->ops[0];
        case Op::OpTypeStruct: return index < inst->ops.size() ? inst->ops[index] : 0;
        default: return 0;
    }
}

uint32_t Program::element_count(Id type) const {
    const Inst* inst = def(type);
    switch (inst->op) {
        case Op::OpTypeVector:
        case Op::OpTypeMatrix: return inst->ops[1];
        case Op::OpTypeArray: {
            uint64_t value = 0;
            return constant_value(inst->ops[1], value) ? static_cast<uint32_t>(value) : 0;
        }
        case Op::OpTypeStruct: return static_cast<uint32_t>(inst->ops.size());
        default: return 0;
    }
}

bool Program::is_opaque(Id type) const {
    switch (type_op(type)) {
        case Op::OpTypeImage:
        case Op::OpTypeSampler:
        case Op::OpTypeSampledImage:
        case Op::OpTypeAccelerationStructureKHR:
        case Op::OpTypeRayQueryKHR: return true;
        case Op::OpTypeArray:
        case Op::OpTypeRuntimeArray: return is_opaque(element_type(type, 0));
        case Op::OpTypeStruct: {
            for (Id member : def(type)->ops)
                if (is_opaque(member)) return true;
            return false;
        }
        default: return false;
    }
}

void Program::flatten(Id type, std::vector<Leaf>& leaves, const std::string& what) const {
    const Inst* inst = def(type);
    const Op op = inst ? inst->op : Op::OpNop;
    switch (op) {
        case Op::OpTypeBool: leaves.push_back({{}, type, 1}); return;
        case Op::OpTypeInt:
        case Op::OpTypeFloat: leaves.push_back({{}, type, inst->ops[0] == 64 ? 2u : 1u}); return;
        case Op::OpTypePointer:
            if (storage(type) == spv::StorageClass::PhysicalStorageBuffer) {
                leaves.push_back({{}, type, 2});
                return;
            }
            break;
        case Op::OpTypeVector:
        case Op::OpTypeMatrix:
        case Op::OpTypeArray:
        case Op::OpTypeStruct: {
            const uint32_t count = element_count(type);
            if (count > 65535) fail("value-too-large", "", 0, what + " is too large to keep across a call");
            if (op == Op::OpTypeArray && count == 0)
                fail("spec-sized-array", "", 0, what + " holds an array sized by a specialisation constant");
            for (uint32_t i = 0; i < count; ++i) {
                std::vector<Leaf> inner;
                flatten(element_type(type, i), inner, what);
                for (Leaf& leaf : inner) {
                    leaf.path.insert(leaf.path.begin(), i);
                    leaves.push_back(std::move(leaf));
                }
                if (leaves.size() > 65535) fail("value-too-large", "", 0, what + " is too large to keep across a call");
            }
            return;
        }
        default: break;
    }
    fail("value-not-storable", "", 0, what + " has a type that cannot be kept in memory across a call");
}

uint32_t Program::word_count(Id type, const std::string& what) const {
    std::vector<Leaf> leaves;
    flatten(type, leaves, what);
    uint32_t words = 0;
    for (const Leaf& leaf : leaves) words += leaf.words;
    return words;
}

Id Program::add_variable(spv::StorageClass storage, Id pointee, const std::string& name) {
    const Id id = add_global(
        Inst(Op::OpVariable, pointer_type(storage, pointee), 0, {static_cast<uint32_t>(storage)}));
    if (!name.empty()) module.set_name(id, name);
    return id;
}

void Program::decorate(Id target, spv::Decoration decoration, std::vector<uint32_t> operands) {
    Inst inst(Op::OpDecorate, 0, 0, {target, static_cast<uint32_t>(decoration)});
    inst.ops.insert(inst.ops.end(), operands.begin(), operands.end());
    module.decorations.push_back(std::move(inst));
    chain_decoration(target);
}

void Program::member_decorate(Id target, uint32_t member, spv::Decoration decoration, std::vector<uint32_t> operands) {
    Inst inst(Op::OpMemberDecorate, 0, 0, {target, member, static_cast<uint32_t>(decoration)});
    inst.ops.insert(inst.ops.end(), operands.begin(), operands.end());
    module.decorations.push_back(std::move(inst));
    chain_decoration(target);
}

void Program::chain_decoration(Id target) {
    const auto place = static_cast<uint32_t>(module.decorations.size());
    decoration_next_.resize(place, 0);
    Chain& chain = decoration_chains_[target];
    if (chain.last)
        decoration_next_[chain.last - 1] = place;
    else
        chain.first = place;
    chain.last = place;
}

std::vector<const Inst*> Program::decorations_of(Id id) const {
    std::vector<const Inst*> out;
    for_each_decoration(id, [&](const Inst& inst) { out.push_back(&inst); });
    return out;
}

bool Program::is_decorated(Id id) const {
    bool any = false;
    for_each_decoration(id, [&](const Inst&) { any = true; });
    return any;
}

bool Program::decoration(Id id, spv::Decoration decoration, uint32_t* operand) const {
    for (uint32_t at = decoration_chains_.get(id).first; at; at = decoration_next_[at - 1]) {
        const Inst& inst = module.decorations[at - 1];
        if (inst.op != Op::OpDecorate || inst.ops[1] != static_cast<uint32_t>(decoration)) continue;
        if (operand && inst.ops.size() > 2) *operand = inst.ops[2];
        return true;
    }
    return false;
}

bool Program::member_decoration(Id id, uint32_t member, spv::Decoration decoration, uint32_t* operand) const {
    for (const Inst* inst : decorations_of(id)) {
        if (inst->op != Op::OpMemberDecorate || inst->ops[1] != member ||
            inst->ops[2] != static_cast<uint32_t>(decoration))
            continue;
        if (operand && inst->ops.size() > 3) *operand = inst->ops[3];
        return true;
    }
    return false;
}

void Program::copy_decorations(Id from, Id to) {
    std::vector<Inst> copies;  // decorate() moves what decorations_of points at
    for (const Inst* inst : decorations_of(from)) copies.push_back(*inst);
    for (const Inst& inst : copies)
        if (inst.op == Op::OpDecorate)
            decorate(to, static_cast<spv::Decoration>(inst.ops[1]), {inst.ops.begin() + 2, inst.ops.end()});
}

void Program::remove_decorations(Id id, spv::Decoration decoration) {
    for (uint32_t at = decoration_chains_.get(id).first; at; at = decoration_next_[at - 1]) {
        Inst& inst = module.decorations[at - 1];
        if (inst.op == Op::OpDecorate && inst.ops[1] == static_cast<uint32_t>(decoration)) inst.op = Op::OpNop;
    }
}

void Program::see_names() {
    for (; names_seen_ < module.names.size(); ++names_seen_) {
        const Inst& inst = module.names[names_seen_];
        named_.insert(inst.ops[0]);
        if (inst.op != Op::OpName) continue;
        uint32_t& first = name_index_[inst.ops[0]];
        if (!first) first = static_cast<uint32_t>(names_seen_ + 1);
    }
}

std::string Program::name_of(Id id) {
    see_names();
    const uint32_t at = name_index_.get(id);
    if (!at) return {};
    const Inst& inst = module.names[at - 1];
    return words_string(inst.ops.data() + 1, inst.ops.size() - 1);
}

uint32_t Program::file_index(const std::string& name) {
    if (name.empty()) return 0;
    const auto found = file_index_.find(name);
    if (found != file_index_.end()) return found->second;
    module.files.push_back(name);
    return file_index_[name] = static_cast<uint32_t>(module.files.size() - 1);
}

void Program::reindex() {
    global_index_.clear();
    for (size_t i = 0; i < module.globals.size(); ++i)
        if (module.globals[i].result) global_index_[module.globals[i].result] = static_cast<uint32_t>(i + 1);
    std::erase_if(module.decorations, [](const Inst& inst) { return inst.op == Op::OpNop; });
    named_ = {};
    name_index_.clear();
    names_seen_ = 0;
    decoration_chains_.clear();
    decoration_next_.assign(module.decorations.size(), 0);
    for (size_t i = 0; i < module.decorations.size(); ++i) {
        Chain& chain = decoration_chains_[module.decorations[i].ops[0]];
        const auto place = static_cast<uint32_t>(i + 1);
        (chain.last ? decoration_next_[chain.last - 1] : chain.first) = place;
        chain.last = place;
    }
}

std::vector<Function> Program::import(const Module& source, IdMap<Id>& map) {
    // (A damaged bound may be far beyond the ids there are.)
    map.reserve(std::min<Id>(source.bound, 1u << 16));
    auto mapped = [&](Id id) {
        Id& known = map[id];
        if (!known) known = module.new_id();
        return known;
    };
    // Of each id in `source`: its first and its last decoration, and from each the next; places plus one.
    IdMap<Chain> decorations;
    std::vector<uint32_t> next(source.decorations.size(), 0);
    for (size_t i = 0; i < source.decorations.size(); ++i) {
        Chain& chain = decorations[source.decorations[i].ops[0]];
        const auto place = static_cast<uint32_t>(i + 1);
        (chain.last ? next[chain.last - 1] : chain.first) = place;
        chain.last = place;
    }

    for (spv::Capability capability : source.capabilities) module.add_capability(capability);
    for (const std::string& extension : source.extensions) module.add_extension(extension);
    std::vector<uint32_t> files(source.files.size(), 0);
    for (size_t i = 1; i < source.files.size(); ++i) files[i] = file_index(source.files[i]);
    for (const Inst& set : source.ext_imports) {
        const std::string name = words_string(set.ops.data(), set.ops.size());
        auto [it, fresh] = ext_sets_.emplace(name, 0);
        if (fresh) {
            it->second = module.new_id();
            module.ext_imports.push_back(Inst(Op::OpExtInstImport, 0, it->second, set.ops));
        }
        map[set.result] = it->second;
    }

    auto add_decorations = [&](Id from, Id to) {
        for (uint32_t at = decorations.get(from).first; at; at = next[at - 1]) {
            Inst copy = source.decorations[at - 1];
            copy.ops[0] = to;
            if (copy.op == Op::OpDecorateId)
                for (size_t i = 2; i < copy.ops.size(); ++i) copy.ops[i] = mapped(copy.ops[i]);
            module.decorations.push_back(std::move(copy));
            chain_decoration(to);
        }
    };

    std::set<Id> forward_pointers;
    for (const Inst& inst : source.globals) {
        Inst copy = inst;
        copy.source.file = files[copy.source.file];
        if (copy.type) copy.type = mapped(copy.type);
        copy.for_each_id([&](Id& id) { id = mapped(id); });
        if (inst.op == Op::OpTypeForwardPointer) {
            forward_pointers.insert(inst.ops[0]);
            module.globals.push_back(std::move(copy));
            continue;
        }
        if (!inst.result) {
            module.globals.push_back(std::move(copy));
            continue;
        }
        if (is_internable(inst.op) && !forward_pointers.count(inst.result)) {
            // Decorations are part of a type's meaning (Block, Offset, ArrayStride, ...).
            std::string extra;
            if (uint32_t at = decorations.get(inst.result).first) {
                std::vector<std::string> parts;
                for (; at; at = next[at - 1]) {
                    const Inst& d = source.decorations[at - 1];
                    std::string part;
                    append_word(part, static_cast<uint32_t>(d.op));
                    for (size_t i = 1; i < d.ops.size(); ++i) append_word(part, d.ops[i]);
                    parts.push_back(std::move(part));
                }
                std::sort(parts.begin(), parts.end());
                for (const std::string& part : parts) extra += part + ";";
            }
            copy.result = 0;
            const auto [known, fresh] = interned_.try_emplace(key_of(copy, extra), 0);
            if (!fresh) {
                map[inst.result] = known->second;
                continue;
            }
            copy.result = known->second = mapped(inst.result);
            add_decorations(inst.result, copy.result);
            add_global(std::move(copy));
            continue;
        }
        copy.result = mapped(inst.result);
        add_decorations(inst.result, copy.result);
        add_global(std::move(copy));
    }

    std::vector<Function> functions;
    functions.reserve(source.functions.size());
    for (const Function& function : source.functions) {
        Function copy = function;
        auto map_inst = [&](Inst& inst) {
            inst.source.file = files[inst.source.file];
            if (inst.type) inst.type = mapped(inst.type);
            if (inst.result) {
                const Id from = inst.result;
                inst.result = mapped(from);
                add_decorations(from, inst.result);
            }
            inst.for_each_id([&](Id& id) { id = mapped(id); });
        };
        map_inst(copy.def);
        for (Inst& inst : copy.params) map_inst(inst);
        for (Block& block : copy.blocks) {
            block.label = mapped(block.label);
            for (Inst& inst : block.insts) map_inst(inst);
        }
        functions.push_back(std::move(copy));
    }

    see_names();
    for (const Inst& inst : source.names) {
        const Id to = map.get(inst.ops[0]);
        if (!to || named_.contains(to)) continue;
        Inst copy = inst;
        copy.ops[0] = to;
        module.names.push_back(std::move(copy));
    }
    return functions;
}

}  // namespace rtc::ir
