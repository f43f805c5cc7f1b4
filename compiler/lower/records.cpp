// Reads of the shader record become word loads from the SBT region the record lies
// in, whatever the block's layout: offsets and strides come from its decorations.
// So do reads of push constants when stages declare different blocks: one compute
// shader has one push-constant block, and words can be read as any of them.
#include <unordered_map>

#include "continuation/machine.h"
#include "lower/stage.h"
#include "rtc/abi.h"

namespace rtc::lower {
namespace {

class Records {
  public:
    Records(Program& program, Stage& stage, continuation::Machine& machine, spv::StorageClass storage)
        : p_(program), stage_(stage), m_(machine), storage_(storage) {
        switch (stage.kind) {
            case StageKind::RayGen: word_function_ = "rtc_sbt_raygen_word"; break;
            case StageKind::Miss: word_function_ = "rtc_sbt_miss_word"; break;
            case StageKind::Callable: word_function_ = "rtc_sbt_callable_word"; break;
            default: word_function_ = "rtc_sbt_hit_word"; break;
        }
    }

    void run() {
        for (Id id : stage_.variables)
            if (static_cast<spv::StorageClass>(p_.def(id)->ops[0]) == storage_) {
                if (record_)
                    stage_.fail("several-records", {}, "a stage may use only one " + what() + " block", p_);
                record_ = id;
            }
        if (!record_) return;
        if (is_record()) stage_.record_bytes = extent(p_.pointee(p_.def(record_)->type));
        run_function(stage_.body);
        for (Function& function : stage_.functions) run_function(function);
        std::erase(stage_.variables, record_);
    }

  private:
    bool is_record() const { return storage_ == spv::StorageClass::ShaderRecordBufferKHR; }
    std::string what() const { return is_record() ? "shader record" : "push-constant"; }

    // Where a pointer into the record points: constant bytes plus an optional run-time part.
    struct Place {
        Id dynamic = 0;  // uint bytes, 0: none
        uint32_t bytes = 0;
        Id type = 0;
        uint32_t matrix_stride = 0;
        bool row_major = false;
    };

    uint32_t scalar_bytes(Id type) const {
        const Inst* inst = p_.def(type);
        if (inst->op == Op::OpTypePointer) return 8;
        return inst->ops[0] / 8;
    }

    uint32_t extent(Id type) const {
        const Inst* inst = p_.def(type);
        switch (inst->op) {
            case Op::OpTypeVector: return inst->ops[1] * scalar_bytes(inst->ops[0]);
            case Op::OpTypeArray: {
                uint32_t stride = 0;
                p_.decoration(type, spv::Decoration::ArrayStride, &stride);
                return stride * p_.element_count(type);
            }
            case Op::OpTypeRuntimeArray: return 0;
            case Op::OpTypeStruct: {
                uint32_t end = 0;
                for (uint32_t i = 0; i < inst->ops.size(); ++i) {
                    uint32_t offset = 0, stride = 0;
                    p_.member_decoration(type, i, spv::Decoration::Offset, &offset);
                    uint32_t size = 0;
                    if (p_.member_decoration(type, i, spv::Decoration::MatrixStride, &stride) &&
                        p_.type_op(inst->ops[i]) == Op::OpTypeMatrix) {
                        const bool row = p_.member_decoration(type, i, spv::Decoration::RowMajor);
                        const Inst* matrix = p_.def(inst->ops[i]);
                        size = stride * (row ? p_.element_count(matrix->ops[0]) : matrix->ops[1]);
                    } else {
                        size = extent(inst->ops[i]);
                    }
                    end = std::max(end, offset + size);
                }
                return end;
            }
            default: return scalar_bytes(type);
        }
    }

    Place step(ir::Emitter& e, const Place& from, Id index, const Inst& inst) {
        Place to = from;
        const Inst type = *p_.def(from.type);
        uint64_t constant = 0;
        const bool known = p_.constant_value(index, constant);
        uint32_t stride = 0;
        switch (type.op) {
            case Op::OpTypeStruct: {
                uint32_t offset = 0;
                p_.member_decoration(from.type, static_cast<uint32_t>(constant), spv::Decoration::Offset, &offset);
                to.bytes += offset;
                to.type = type.ops[constant];
                to.matrix_stride = 0;
                p_.member_decoration(from.type, static_cast<uint32_t>(constant), spv::Decoration::MatrixStride,
                                     &to.matrix_stride);
                to.row_major =
                    p_.member_decoration(from.type, static_cast<uint32_t>(constant), spv::Decoration::RowMajor);
                return to;
            }
            case Op::OpTypeArray:
            case Op::OpTypeRuntimeArray:
                p_.decoration(from.type, spv::Decoration::ArrayStride, &stride);
                to.type = type.ops[0];
                break;
            case Op::OpTypeMatrix:
                to.type = type.ops[0];
                stride = from.row_major ? scalar_bytes(p_.def(type.ops[0])->ops[0]) : from.matrix_stride;
                break;
            case Op::OpTypeVector:
                to.type = type.ops[0];
                stride = from.row_major && from.matrix_stride ? from.matrix_stride : scalar_bytes(type.ops[0]);
                break;
            default: stage_.fail("record-access", inst.source, "unsupported access into the " + what() + " block", p_);
        }
        if (known) {
            to.bytes += stride * static_cast<uint32_t>(constant);
            return to;
        }
        Id u = index;
        const Id index_type = type_of(index);
        if (index_type != p_.uint_type()) u = e.value(Op::OpBitcast, p_.uint_type(), {index});
        const Id scaled = e.value(Op::OpIMul, p_.uint_type(), {u, p_.constant_u32(stride)});
        to.dynamic = from.dynamic ? e.add(from.dynamic, scaled) : scaled;
        return to;
    }

    Id type_of(Id id) const {
        if (const Inst* global = p_.def(id)) return global->type;
        const auto found = value_types_.find(id);
        return found == value_types_.end() ? p_.uint_type() : found->second;
    }

    Id word(ir::Emitter& e, const Place& place) {
        if (!is_record()) {
            Id at = p_.constant_u32(place.bytes / 4);
            if (place.dynamic) {
                const Id words = e.value(Op::OpShiftRightLogical, p_.uint_type(), {place.dynamic, p_.constant_u32(2)});
                at = place.bytes / 4 ? e.add(words, at) : words;
            }
            return e.load(p_.uint_type(), e.chain(spv::StorageClass::PushConstant, p_.uint_type(), p_.push_words,
                                                  {p_.constant_u32(0), at}));
        }
        Id at = e.load(p_.uint_type(), stage_.record_base);
        if (place.dynamic)
            at = e.add(at, e.value(Op::OpShiftRightLogical, p_.uint_type(), {place.dynamic, p_.constant_u32(2)}));
        at = e.add(at, p_.constant_u32(RTC_HANDLE_WORDS + place.bytes / 4));
        return m_.call(e, word_function_, {at});
    }

    Id load(ir::Emitter& e, const Place& place, const Inst& inst) {
        const Inst type = *p_.def(place.type);
        const Id u32 = p_.uint_type();
        switch (type.op) {
            case Op::OpTypeStruct:
            case Op::OpTypeArray:
            case Op::OpTypeMatrix:
            case Op::OpTypeVector: {
                std::vector<Id> parts;
                const uint32_t count = p_.element_count(place.type);
                for (uint32_t i = 0; i < count; ++i)
                    parts.push_back(load(e, step(e, place, p_.constant_u32(i), inst), inst));
                return e.construct(place.type, parts);
            }
            default: break;
        }
        if (type.op == Op::OpTypePointer || type.ops[0] == 64) {
            Place high = place;
            high.bytes += 4;
            const Id low_word = word(e, place);
            return e.value(Op::OpBitcast, place.type,
                           {e.construct(p_.vector_type(u32, 2), {low_word, word(e, high)})});
        }
        if (type.ops[0] == 32) return e.from_uint(word(e, place), place.type);
        // 8 and 16 bits: the word, shifted down.
        Id shift = p_.constant_u32(place.bytes % 4 * 8);
        if (place.dynamic) {
            const Id sum = e.add(place.dynamic, p_.constant_u32(place.bytes));
            shift = e.value(Op::OpShiftLeftLogical, u32,
                            {e.value(Op::OpBitwiseAnd, u32, {sum, p_.constant_u32(3)}), p_.constant_u32(3)});
            Place whole = place;
            whole.dynamic = sum;
            whole.bytes = 0;
            return narrow(e, e.value(Op::OpShiftRightLogical, u32, {word(e, whole), shift}), place.type);
        }
        return narrow(e, e.value(Op::OpShiftRightLogical, u32, {word(e, place), shift}), place.type);
    }

    Id narrow(ir::Emitter& e, Id bits, Id type_id) {
        const Inst type = *p_.def(type_id);
        const Id unsigned_type = p_.int_type(type.ops[0], false);
        const Id v = e.value(Op::OpUConvert, unsigned_type, {bits});
        return unsigned_type == type_id ? v : e.value(Op::OpBitcast, type_id, {v});
    }

    void run_function(Function& function) {
        value_types_.clear();
        for (const Inst& param : function.params) value_types_[param.result] = param.type;
        for (const Block& block : function.blocks)
            for (const Inst& inst : block.insts)
                if (inst.result) value_types_[inst.result] = inst.type;
        std::unordered_map<Id, Place> places;
        places[record_] = Place{0, 0, p_.pointee(p_.def(record_)->type), 0, false};
        for (Block& block : function.blocks) {
            std::vector<Inst> out;
            for (Inst& inst : block.insts) {
                ir::Emitter e(p_, out, inst.source);
                if ((inst.op == Op::OpAccessChain || inst.op == Op::OpInBoundsAccessChain) &&
                    places.count(inst.ops[0])) {
                    Place place = places[inst.ops[0]];
                    for (size_t i = 1; i < inst.ops.size(); ++i) place = step(e, place, inst.ops[i], inst);
                    places[inst.result] = place;
                    continue;
                }
                if (inst.op == Op::OpLoad && places.count(inst.ops[0])) {
                    const Id value = load(e, places[inst.ops[0]], inst);
                    Inst copy(Op::OpCopyObject, inst.type, inst.result, {value});
                    out.push_back(std::move(copy));
                    continue;
                }
                bool touches = false;
                inst.for_each_id([&](Id id) { touches |= places.count(id) != 0; });
                if (touches)
                    stage_.fail("record-access", inst.source,
                                "the " + what() + " block can only be read, member by member or whole", p_);
                out.push_back(std::move(inst));
            }
            block.insts = std::move(out);
        }
    }

    Program& p_;
    Stage& stage_;
    continuation::Machine& m_;
    spv::StorageClass storage_;
    std::string word_function_;
    Id record_ = 0;
    std::unordered_map<Id, Id> value_types_;
};

}  // namespace

void lower_records(Program& program, Stage& stage, continuation::Machine& machine) {
    Records(program, stage, machine, spv::StorageClass::ShaderRecordBufferKHR).run();
    if (program.push_words) Records(program, stage, machine, spv::StorageClass::PushConstant).run();
}

}  // namespace rtc::lower
