#include "module_reader.h"

#include <spirv/unified1/spirv.hpp>

#include <algorithm>
#include <functional>

#include "../common/error.h"

namespace rtc::run {
namespace {

using tools::Error;
using tools::JobStage;

struct Instruction {
    spv::Op op;
    std::vector<uint32_t> words;  // operands
};

struct Decorations {
    std::map<uint32_t, std::vector<uint32_t>> own;
    std::map<uint32_t, std::map<uint32_t, std::vector<uint32_t>>> members;
};

std::string literal_string(const std::vector<uint32_t>& words, size_t from, size_t* next = nullptr) {
    std::string text;
    size_t at = from;
    for (bool more = true; more && at < words.size(); ++at)
        for (int byte = 0; byte < 4; ++byte) {
            char c = char(words[at] >> (8 * byte));
            if (!c) {
                more = false;
                break;
            }
            text += c;
        }
    if (next) *next = at;
    return text;
}

bool stage_of(uint32_t model, JobStage& stage) {
    switch (model) {
        case spv::ExecutionModelRayGenerationKHR:
            stage = JobStage::RayGen;
            return true;
        case spv::ExecutionModelIntersectionKHR:
            stage = JobStage::Intersection;
            return true;
        case spv::ExecutionModelAnyHitKHR:
            stage = JobStage::AnyHit;
            return true;
        case spv::ExecutionModelClosestHitKHR:
            stage = JobStage::ClosestHit;
            return true;
        case spv::ExecutionModelMissKHR:
            stage = JobStage::Miss;
            return true;
        case spv::ExecutionModelCallableKHR:
            stage = JobStage::Callable;
            return true;
        default:
            return false;
    }
}

class Reader {
  public:
    Reader(const std::vector<uint32_t>& words, const std::string& file) : file_(file) {
        if (words.size() < 5 || words[0] != spv::MagicNumber) throw Error(file + ": not a SPIR-V module");
        for (size_t at = 5; at < words.size();) {
            uint32_t length = words[at] >> 16;
            if (!length || at + length > words.size()) throw Error(file + ": truncated SPIR-V instruction");
            instructions_.push_back({spv::Op(words[at] & 0xffff), {&words[at] + 1, &words[at] + length}});
            at += length;
        }
        index();
    }

    Module read(const std::string& entry) {
        Module module;
        uint32_t function = 0;
        std::string seen;
        for (const Instruction& i : instructions_) {
            if (i.op != spv::OpEntryPoint || i.words.size() < 3) continue;
            std::string name = literal_string(i.words, 2);
            JobStage stage;
            if (!stage_of(i.words[0], stage)) continue;
            seen += " " + name;
            if (function || (!entry.empty() && name != entry)) continue;
            function = i.words[1];
            module.stage = stage;
            module.entry = name;
        }
        if (!function)
            throw Error(file_ + ": no ray tracing entry point" + (entry.empty() ? "" : " '" + entry + "'") +
                        (seen.empty() ? "" : "; there are:" + seen));
        used_.clear();
        reach(function);
        for (const Instruction& i : instructions_) {
            if (i.op == spv::OpVariable) variable(i, module);
            if (i.op == spv::OpSpecConstant || i.op == spv::OpSpecConstantTrue ||
                i.op == spv::OpSpecConstantFalse)
                constant(i, module);
        }
        module.traces = traces_;
        module.calls = calls_;
        return module;
    }

  private:
    void index() {
        uint32_t function = 0;
        for (size_t n = 0; n < instructions_.size(); ++n) {
            const auto& [op, w] = instructions_[n];
            auto need = [&](size_t count) {
                if (w.size() < count) throw Error(file_ + ": malformed SPIR-V instruction");
            };
            switch (op) {
                case spv::OpName:
                    need(2);
                    names_[w[0]] = literal_string(w, 1);
                    break;
                case spv::OpMemberName:
                    need(3);
                    member_names_[w[0]][w[1]] = literal_string(w, 2);
                    break;
                case spv::OpDecorate:
                    need(2);
                    decorations_[w[0]].own[w[1]] = {w.begin() + 2, w.end()};
                    break;
                case spv::OpMemberDecorate:
                    need(3);
                    decorations_[w[0]].members[w[1]][w[2]] = {w.begin() + 3, w.end()};
                    break;
                case spv::OpTypeForwardPointer:
                    break;
                case spv::OpTypeVoid:
                case spv::OpTypeBool:
                case spv::OpTypeInt:
                case spv::OpTypeFloat:
                case spv::OpTypeVector:
                case spv::OpTypeMatrix:
                case spv::OpTypeImage:
                case spv::OpTypeSampler:
                case spv::OpTypeSampledImage:
                case spv::OpTypeArray:
                case spv::OpTypeRuntimeArray:
                case spv::OpTypeStruct:
                case spv::OpTypePointer:
                case spv::OpTypeFunction:
                case spv::OpTypeAccelerationStructureKHR:
                case spv::OpTypeRayQueryKHR:
                    need(1);
                    definitions_[w[0]] = n;
                    break;
                case spv::OpConstant:
                case spv::OpSpecConstant:
                    need(3);
                    definitions_[w[1]] = n;
                    break;
                case spv::OpFunction:
                    need(2);
                    function = w[1];
                    bodies_[function] = {n, n};
                    break;
                case spv::OpFunctionEnd:
                    bodies_[function].second = n;
                    break;
                default:
                    break;
            }
        }
    }

    // Every word of the bodies an entry point reaches may be an id it uses. Literals that
    // happen to equal an id only make a resource seem used, which costs one descriptor.
    void reach(uint32_t function) {
        auto body = bodies_.find(function);
        if (body == bodies_.end() || !reached_.insert({function, true}).second) return;
        for (size_t n = body->second.first; n <= body->second.second; ++n) {
            const auto& [op, w] = instructions_[n];
            traces_ |= op == spv::OpTraceNV || op == spv::OpTraceRayKHR;
            calls_ |= op == spv::OpExecuteCallableNV || op == spv::OpExecuteCallableKHR;
            for (uint32_t word : w) used_[word] = true;
            if (op == spv::OpFunctionCall && w.size() > 2) reach(w[2]);
        }
    }

    const Instruction& define(uint32_t id) const {
        auto found = definitions_.find(id);
        if (found == definitions_.end())
            throw Error(file_ + ": SPIR-V id " + std::to_string(id) + " is no type");
        return instructions_[found->second];
    }

    uint32_t decoration(uint32_t id, uint32_t what, uint32_t otherwise) const {
        auto found = decorations_.find(id);
        if (found == decorations_.end()) return otherwise;
        auto own = found->second.own.find(what);
        return own == found->second.own.end() || own->second.empty() ? otherwise : own->second[0];
    }
    bool decorated(uint32_t id, uint32_t what) const {
        auto found = decorations_.find(id);
        return found != decorations_.end() && found->second.own.count(what);
    }

    uint32_t constant_value(uint32_t id) const {
        const Instruction& i = define(id);
        return (i.op == spv::OpConstant || i.op == spv::OpSpecConstant) ? i.words[2] : 1;
    }

    TypeRef type(uint32_t id, uint32_t matrix_stride = 0, bool row_major = false, int depth = 0) const {
        if (depth > 64) throw Error(file_ + ": SPIR-V types nest too deeply");
        auto made = std::make_shared<Type>();
        const auto& [op, w] = define(id);
        auto nested = [&](uint32_t inner) { return type(inner, matrix_stride, row_major, depth + 1); };
        switch (op) {
            case spv::OpTypeBool:
                made->kind = Type::Kind::Bool;
                break;
            case spv::OpTypeInt:
                made->kind = w[2] ? Type::Kind::Int : Type::Kind::Uint;
                made->width = w[1];
                break;
            case spv::OpTypeFloat:
                made->kind = Type::Kind::Float;
                made->width = w[1];
                break;
            case spv::OpTypeVector:
                made->kind = Type::Kind::Vector;
                made->element = nested(w[1]);
                made->count = w[2];
                made->stride = made->element->width / 8;
                break;
            case spv::OpTypeMatrix:
                made->kind = Type::Kind::Matrix;
                made->element = nested(w[1]);
                made->count = w[2];
                made->stride = matrix_stride ? matrix_stride : 16;
                made->row_major = row_major;
                break;
            case spv::OpTypeArray:
            case spv::OpTypeRuntimeArray:
                made->kind = Type::Kind::Array;
                made->element = nested(w[1]);
                made->count = op == spv::OpTypeArray ? constant_value(w[2]) : 0;
                made->stride = decoration(id, spv::DecorationArrayStride, made->element->size());
                break;
            case spv::OpTypeStruct: {
                made->kind = Type::Kind::Struct;
                uint32_t running = 0;
                auto found = decorations_.find(id);
                for (uint32_t m = 0; m + 1 < w.size(); ++m) {
                    uint32_t offset = running, stride = 0;
                    bool rows = false;
                    if (found != decorations_.end()) {
                        auto member = found->second.members.find(m);
                        if (member != found->second.members.end()) {
                            const auto& d = member->second;
                            if (auto o = d.find(spv::DecorationOffset); o != d.end() && !o->second.empty())
                                offset = o->second[0];
                            if (auto s = d.find(spv::DecorationMatrixStride);
                                s != d.end() && !s->second.empty())
                                stride = s->second[0];
                            rows = d.count(spv::DecorationRowMajor) > 0;
                        }
                    }
                    Type::Member out;
                    auto names = member_names_.find(id);
                    if (names != member_names_.end() && names->second.count(m))
                        out.name = names->second.at(m);
                    out.type = type(w[m + 1], stride, rows, depth + 1);
                    out.offset = offset;
                    running = offset + out.type->size();
                    made->members.push_back(std::move(out));
                }
                break;
            }
            case spv::OpTypePointer:
                made->kind = Type::Kind::Address;
                made->width = 64;
                break;
            default:
                made->kind = Type::Kind::Opaque;
                break;
        }
        return made;
    }

    bool member_decorated(uint32_t structure, uint32_t what) const {
        auto found = decorations_.find(structure);
        if (found == decorations_.end() || found->second.members.empty()) return false;
        return std::all_of(found->second.members.begin(), found->second.members.end(),
                           [&](const auto& member) { return member.second.count(what); });
    }

    void image(uint32_t id, Resource& out) const {
        const auto& w = define(id).words;
        if (w.size() < 8) throw Error(file_ + ": malformed OpTypeImage");
        const Instruction& component = define(w[1]);
        out.image.component = component.op == spv::OpTypeFloat                   ? Type::Kind::Float
                              : component.words.size() > 2 && component.words[2] ? Type::Kind::Int
                                                                                 : Type::Kind::Uint;
        out.image.dim = w[2];
        out.image.arrayed = w[4];
        out.image.multisampled = w[5];
        out.image.format = w[7];
        bool storage = w[6] == 2;
        if (w[2] == spv::DimBuffer)
            out.type =
                storage ? VK_DESCRIPTOR_TYPE_STORAGE_TEXEL_BUFFER : VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
        else
            out.type = storage ? VK_DESCRIPTOR_TYPE_STORAGE_IMAGE : VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE;
    }

    void variable(const Instruction& i, Module& module) const {
        if (i.words.size() < 3) throw Error(file_ + ": malformed OpVariable");
        uint32_t pointer = i.words[0], id = i.words[1], storage = i.words[2];
        if (!used_.count(id)) return;
        const auto& p = define(pointer).words;
        if (p.size() < 3) throw Error(file_ + ": malformed OpTypePointer");
        uint32_t inner = p[2];
        if (storage == spv::StorageClassPushConstant) {
            module.push_constants = type(inner);
            return;
        }
        if (storage == spv::StorageClassShaderRecordBufferKHR) {
            module.record = type(inner);
            return;
        }
        if (storage != spv::StorageClassUniform && storage != spv::StorageClassStorageBuffer &&
            storage != spv::StorageClassUniformConstant)
            return;
        Resource out;
        out.set = decoration(id, spv::DecorationDescriptorSet, 0);
        out.binding = decoration(id, spv::DecorationBinding, 0);
        auto name = names_.find(id);
        if (name != names_.end()) out.name = name->second;
        while (define(inner).op == spv::OpTypeArray || define(inner).op == spv::OpTypeRuntimeArray) {
            const Instruction& array = define(inner);
            out.count = array.op == spv::OpTypeArray ? out.count * constant_value(array.words[2]) : 0;
            inner = array.words[1];
        }
        const Instruction& core = define(inner);
        switch (core.op) {
            case spv::OpTypeStruct: {
                bool buffer =
                    storage == spv::StorageClassStorageBuffer || decorated(inner, spv::DecorationBufferBlock);
                out.type = buffer ? VK_DESCRIPTOR_TYPE_STORAGE_BUFFER : VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER;
                out.writable = buffer && !decorated(id, spv::DecorationNonWritable) &&
                               !member_decorated(inner, spv::DecorationNonWritable);
                out.block = type(inner);
                if (out.name.empty() && names_.count(inner)) out.name = names_.at(inner);
                break;
            }
            case spv::OpTypeAccelerationStructureKHR:
                out.acceleration_structure = true;
                break;
            case spv::OpTypeSampler:
                out.type = VK_DESCRIPTOR_TYPE_SAMPLER;
                break;
            case spv::OpTypeSampledImage:
                image(core.words[1], out);
                if (out.image.dim != spv::DimBuffer) out.type = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER;
                break;
            case spv::OpTypeImage:
                image(inner, out);
                out.writable = (out.type == VK_DESCRIPTOR_TYPE_STORAGE_IMAGE ||
                                out.type == VK_DESCRIPTOR_TYPE_STORAGE_TEXEL_BUFFER) &&
                               !decorated(id, spv::DecorationNonWritable);
                break;
            default:
                return;
        }
        module.resources.push_back(std::move(out));
    }

    void constant(const Instruction& i, Module& module) const {
        uint32_t id = i.words.at(1);
        if (!decorated(id, spv::DecorationSpecId)) return;
        SpecConstant out;
        out.id = decoration(id, spv::DecorationSpecId, 0);
        if (names_.count(id)) out.name = names_.at(id);
        TypeRef t = type(i.words[0]);
        out.kind = t->kind;
        out.width = t->kind == Type::Kind::Bool ? 32 : t->width;
        module.constants.push_back(std::move(out));
    }

    std::string file_;
    std::vector<Instruction> instructions_;
    std::map<uint32_t, size_t> definitions_;
    std::map<uint32_t, std::string> names_;
    std::map<uint32_t, std::map<uint32_t, std::string>> member_names_;
    std::map<uint32_t, Decorations> decorations_;
    std::map<uint32_t, std::pair<size_t, size_t>> bodies_;
    std::map<uint32_t, bool> reached_, used_;
    bool traces_ = false, calls_ = false;
};

}  // namespace

uint32_t Type::size() const {
    switch (kind) {
        case Kind::Bool:
            return 4;
        case Kind::Int:
        case Kind::Uint:
        case Kind::Float:
            return width / 8;
        case Kind::Vector:
            return count * stride;
        case Kind::Matrix:
            return stride * (row_major ? element->count : count);
        case Kind::Array:
            return count * stride;
        case Kind::Address:
            return 8;
        case Kind::Struct: {
            uint32_t end = 0;
            for (const Member& member : members) end = std::max(end, member.offset + member.type->size());
            return end;
        }
        case Kind::Opaque:
            return 0;
    }
    return 0;
}

Module read_module(const std::vector<uint32_t>& words, const std::string& entry, const std::string& file) {
    return Reader(words, file).read(entry);
}

}  // namespace rtc::run
