// Stages name their resources independently; the linked shader has each once.
#include "link/link.h"

namespace rtc::link {
namespace {

using spv::StorageClass;

Id element_of(const Program& p, Id type, uint32_t& count) {
    count = 1;
    while (p.type_op(type) == Op::OpTypeArray || p.type_op(type) == Op::OpTypeRuntimeArray) {
        count = p.type_op(type) == Op::OpTypeArray ? count * p.element_count(type) : 0;
        type = p.element_type(type, 0);
    }
    return type;
}

std::string kind_of(const Program& p, const Inst& variable, Id element) {
    const auto storage = static_cast<StorageClass>(variable.ops[0]);
    const Inst* type = p.def(element);
    if (storage == StorageClass::StorageBuffer)
        return element == p.header_struct ? "acceleration-structure" : "storage-buffer";
    if (storage == StorageClass::Uniform)
        return p.decoration(element, spv::Decoration::BufferBlock) ? "storage-buffer" : "uniform-buffer";
    switch (type->op) {
        case Op::OpTypeSampler: return "sampler";
        case Op::OpTypeSampledImage: {
            const Inst* image = p.def(type->ops[0]);
            return static_cast<spv::Dim>(image->ops[1]) == spv::Dim::Buffer ? "uniform-texel-buffer"
                                                                             : "combined-image-sampler";
        }
        case Op::OpTypeImage: {
            const bool buffer = static_cast<spv::Dim>(type->ops[1]) == spv::Dim::Buffer;
            if (static_cast<spv::Dim>(type->ops[1]) == spv::Dim::SubpassData) return "input-attachment";
            if (type->ops[5] == 2) return buffer ? "storage-texel-buffer" : "storage-image";
            return buffer ? "uniform-texel-buffer" : "sampled-image";
        }
        default: return "unknown";
    }
}

}  // namespace

void unify_resources(Program& p, lower::Stage& stage, ResourceTable& table, Reflection& reflection) {
    std::map<Id, Id> replaced;
    for (Id id : stage.variables) {
        const Inst variable = *p.def(id);
        const auto storage = static_cast<StorageClass>(variable.ops[0]);
        if (storage == StorageClass::PushConstant) {
            // The stages' blocks agree (prepare_push_constants), so they are one type.
            if (!table.push_constants)
                table.push_constants = id;
            else
                replaced[id] = table.push_constants;
            continue;
        }
        if (storage == StorageClass::Input) {
            uint32_t builtin = 0;
            if (p.decoration(id, spv::Decoration::BuiltIn, &builtin)) {
                Id& known = table.variables[{0xffffffffu, builtin, variable.type}];
                if (known)
                    replaced[id] = known;
                else
                    known = id;
            }
            continue;
        }
        if (storage != StorageClass::UniformConstant && storage != StorageClass::Uniform &&
            storage != StorageClass::StorageBuffer)
            continue;
        uint32_t set = 0, binding = 0;
        if (!p.decoration(id, spv::Decoration::DescriptorSet, &set) ||
            !p.decoration(id, spv::Decoration::Binding, &binding))
            stage.fail("resource-without-binding", {},
                       "resource '" + p.module.name_of(id) + "' has no descriptor set and binding", p);
        uint32_t count = 1;
        const Id element = element_of(p, p.pointee(variable.type), count);
        std::string kind = kind_of(p, variable, element);
        const auto [place, fresh] = table.kinds.emplace(std::make_pair(set, binding), std::make_pair(kind, stage.name));
        // A combined descriptor holds an image and a sampler, and may be read as either (Vulkan, "Combined Image
        // Sampler").
        auto combines = [](const std::string& k) {
            return k == "combined-image-sampler" || k == "sampled-image" || k == "sampler";
        };
        if (!fresh && place->second.first != kind && combines(kind) && combines(place->second.first)) {
            place->second.first = kind = "combined-image-sampler";
            for (ResourceReport& other : reflection.resources)
                if (other.set == set && other.binding == binding) other.type = kind;
        }
        if (!fresh && place->second.first != kind)
            stage.fail("resource-conflict", {},
                       "set " + std::to_string(set) + " binding " + std::to_string(binding) + " ('" +
                           p.module.name_of(id) + "') is declared as " + kind + " here and as " + place->second.first +
                           " in stage '" + place->second.second + "'",
                       p);
        std::vector<uint32_t> key{set, binding, variable.type, variable.ops[0]};
        // Access qualifiers are part of what makes two declarations the same.
        for (const Inst* inst : p.decorations_of(id)) key.push_back(inst->ops[1]);
        Id& known = table.variables[key];
        if (known) {
            replaced[id] = known;
        } else {
            known = id;
            // Several variables onto one resource: writes through one are seen through the other.
            const auto [first, alone] = table.first.emplace(std::make_pair(set, binding), id);
            if (!alone)
                for (Id variable : {first->second, id})
                    if (!p.decoration(variable, spv::Decoration::Aliased))
                        p.decorate(variable, spv::Decoration::Aliased);
            ResourceReport report;
            report.name = p.name_of(id);
            report.stage = stage.name;
            report.set = set;
            report.binding = binding;
            report.type = kind;
            report.array_size = count;
            reflection.resources.push_back(std::move(report));
        }
    }
    if (replaced.empty()) return;
    auto rewrite = [&](Id& id) {
        const auto found = replaced.find(id);
        if (found != replaced.end()) id = found->second;
    };
    auto rewrite_function = [&](ir::Function& function) {
        for (ir::Block& block : function.blocks)
            for (Inst& inst : block.insts) inst.for_each_id(rewrite);
    };
    rewrite_function(stage.body);
    for (ir::Function& function : stage.functions) rewrite_function(function);
    for (Inst& inst : stage.prologue) inst.for_each_id(rewrite);
    for (Id& id : stage.variables) rewrite(id);
}

}  // namespace rtc::link
