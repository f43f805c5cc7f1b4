// From a pile of functions and globals to a module: reserved bindings, dead code,
// order, ids, declarations.
#include <algorithm>
#include <set>

#include "ir/id_set.h"
#include "link/link.h"
#include "rtc/abi.h"

namespace rtc::link {
namespace {

bool is_ray_tracing(spv::Capability capability) {
    switch (static_cast<uint32_t>(capability)) {
        case 5340:  // RayTracingNV
        case 4479:  // RayTracingKHR
        case 5353:  // RayTracingProvisionalKHR
        case 4478:  // RayTraversalPrimitiveCullingKHR
        case 4472:  // RayQueryKHR
        case 6020:  // RayCullMaskKHR
        case 5341:  // RayTracingMotionBlurNV
        case 5336:  // RayTracingPositionFetchKHR
            return true;
        default: return false;
    }
}

bool is_ray_tracing(const std::string& extension) {
    return extension == "SPV_NV_ray_tracing" || extension == "SPV_KHR_ray_tracing" ||
           extension == "SPV_KHR_ray_query" || extension == "SPV_KHR_ray_cull_mask" ||
           extension == "SPV_KHR_ray_tracing_position_fetch" || extension == "SPV_NV_ray_tracing_motion_blur";
}

}  // namespace

void place_reserved(Program& p, continuation::Machine& machine, const LinkOptions& options, Reflection& reflection) {
    std::set<Id> ours;
    for (const auto& [binding, id] : machine.reserved) ours.insert(id);
    uint64_t next = 0;  // the set above the highest one used
    std::set<std::pair<uint32_t, uint32_t>> taken;
    for (const Inst& inst : p.module.globals) {
        if (inst.op != Op::OpVariable || ours.count(inst.result)) continue;
        uint32_t set = 0, binding = 0;
        if (!p.decoration(inst.result, spv::Decoration::DescriptorSet, &set)) continue;
        p.decoration(inst.result, spv::Decoration::Binding, &binding);
        next = std::max(next, uint64_t{set} + 1);
        taken.insert({set, binding});
    }
    if (options.reserved_set < 0 && next > UINT32_MAX)
        ir::fail("reserved-conflict", "", 0, "the shaders use the highest set there is; choose one with --reserved=SET.BINDING");
    const uint32_t set = options.reserved_set >= 0 ? static_cast<uint32_t>(options.reserved_set) : static_cast<uint32_t>(next);
    for (const auto& [binding, id] : machine.reserved) {
        if (taken.count({set, options.reserved_binding + binding}))
            ir::fail("reserved-conflict", "", 0,
                     "set " + std::to_string(set) + " binding " + std::to_string(options.reserved_binding + binding) +
                         " is one of the " + std::to_string(RTC_BINDING_COUNT) +
                         " reserved bindings and used by a shader; choose others with --reserved=SET.BINDING");
        p.decorate(id, spv::Decoration::DescriptorSet, {set});
        p.decorate(id, spv::Decoration::Binding, {options.reserved_binding + binding});
    }
    reflection.reserved_set = set;
    reflection.reserved_binding = options.reserved_binding;
}

void tidy(Program& p, const std::vector<Id>& roots) {
    ir::Module& m = p.module;
    ir::IdSet live;
    live.reserve(m.bound);
    std::vector<Id> work(roots);
    ir::IdMap<uint32_t> functions;  // index plus one
    for (size_t i = 0; i < m.functions.size(); ++i) functions[m.functions[i].id()] = static_cast<uint32_t>(i + 1);
    auto need = [&](Id id) {
        if (id && live.insert(id)) work.push_back(id);
    };
    for (Id id : roots) live.insert(id);
    for (const Inst& inst : m.execution_modes) inst.for_each_id([&](Id id) { need(id); });
    while (!work.empty()) {
        const Id id = work.back();
        work.pop_back();
        if (const uint32_t index = functions.get(id)) {
            const ir::Function& function = m.functions[index - 1];
            auto visit = [&](const Inst& inst) {
                need(inst.type);
                if (inst.result) live.insert(inst.result);
                inst.for_each_id(need);
            };
            visit(function.def);
            for (const Inst& inst : function.params) visit(inst);
            for (const ir::Block& block : function.blocks) {
                live.insert(block.label);
                for (const Inst& inst : block.insts) visit(inst);
            }
        } else if (const Inst* global = p.def(id)) {
            need(global->type);
            global->for_each_id(need);
        }
        p.for_each_decoration(id, [&](const Inst& inst) {
            if (inst.op == Op::OpDecorateId)
                for (size_t i = 2; i < inst.ops.size(); ++i) need(inst.ops[i]);
        });
    }
    // The WorkgroupSize constant is used by its decoration alone.
    for (const Inst& inst : m.decorations)
        if (inst.op == Op::OpDecorate && inst.ops[1] == static_cast<uint32_t>(spv::Decoration::BuiltIn) &&
            inst.ops[2] == static_cast<uint32_t>(spv::BuiltIn::WorkgroupSize)) {
            std::vector<Id> more{inst.ops[0]};
            while (!more.empty()) {
                const Id id = more.back();
                more.pop_back();
                live.insert(id);
                const Inst* global = p.def(id);
                if (!global) continue;
                if (global->type) more.push_back(global->type);
                global->for_each_id([&](Id operand) { more.push_back(operand); });
            }
        }
    std::erase_if(m.functions, [&](const ir::Function& f) { return !live.count(f.id()); });

    // Globals, each after what it names. Only a forward-declared pointer may come before its pointee.
    std::set<Id> forward;
    std::vector<Inst> ordered;
    for (const Inst& inst : m.globals)
        if (inst.op == Op::OpTypeForwardPointer && live.count(inst.ops[0])) {
            forward.insert(inst.ops[0]);
            ordered.push_back(inst);
        }
    ir::IdSet placed;
    ordered.reserve(m.globals.size());
    auto place = [&](auto& self, Id id) -> void {
        const Inst* inst = p.def(id);
        if (!inst || !placed.insert(id)) return;
        if (inst->type) self(self, inst->type);
        inst->for_each_id([&](Id operand) {
            if (inst->op == Op::OpTypeStruct && forward.count(operand)) return;
            self(self, operand);
        });
        ordered.push_back(*inst);
    };
    for (const Inst& inst : m.globals)
        if (inst.result && live.count(inst.result)) place(place, inst.result);
    for (Id id : forward) place(place, id);
    m.globals = std::move(ordered);

    // Ids by first appearance: the same module whatever the passes allocated on the way.
    ir::IdMap<Id> numbers;
    numbers.reserve(m.bound);
    Id next = 1;
    auto number = [&](Id& id) {
        if (!id) return;
        Id& known = numbers[id];
        if (!known) known = next++;
        id = known;
    };
    auto renumber = [&](Inst& inst) {
        number(inst.type);
        number(inst.result);
        inst.for_each_id(number);
    };
    auto is_live_target = [&](const Inst& inst) { return live.count(inst.ops[0]) || placed.count(inst.ops[0]); };
    std::erase_if(m.decorations, [&](const Inst& inst) { return inst.op == Op::OpNop || !is_live_target(inst); });
    std::erase_if(m.names, [&](const Inst& inst) { return !is_live_target(inst); });
    for (Inst& inst : m.ext_imports) renumber(inst);
    for (Inst& inst : m.globals) renumber(inst);
    for (ir::Function& function : m.functions) {
        renumber(function.def);
        for (Inst& inst : function.params) renumber(inst);
        for (ir::Block& block : function.blocks) {
            number(block.label);
            for (Inst& inst : block.insts) renumber(inst);
        }
    }
    for (ir::EntryPoint& entry : m.entry_points) {
        number(entry.function);
        for (Id& id : entry.interface) number(id);
    }
    for (Inst& inst : m.execution_modes) inst.for_each_id(number);
    for (Inst& inst : m.decorations) {
        number(inst.ops[0]);
        if (inst.op == Op::OpDecorateId)
            for (size_t i = 2; i < inst.ops.size(); ++i) number(inst.ops[i]);
    }
    for (Inst& inst : m.names) number(inst.ops[0]);
    auto by_target = [](const Inst& a, const Inst& b) { return a.ops[0] < b.ops[0]; };
    std::stable_sort(m.decorations.begin(), m.decorations.end(), by_target);
    std::stable_sort(m.names.begin(), m.names.end(), by_target);
    m.bound = next;
    p.reindex();
}

void declare_entry(Program& p, Id main, const LinkOptions& options, Reflection& reflection) {
    ir::Module& m = p.module;
    std::erase_if(m.capabilities, [](spv::Capability c) { return is_ray_tracing(c); });
    std::erase_if(m.extensions, [](const std::string& e) { return is_ray_tracing(e); });
    m.add_capability(spv::Capability::Shader);
    // Version 1.3 has these classes and 1.5 these capabilities without their extensions.
    uint32_t version = std::max(m.version, 0x00010300u);
    switch (options.target) {
        case TargetEnv::Auto: version = version <= 0x00010300u ? 0x00010300u : std::max(version, 0x00010500u); break;
        case TargetEnv::Vulkan11: version = 0x00010300u; break;
        case TargetEnv::Vulkan12: version = 0x00010500u; break;
        case TargetEnv::Vulkan13: version = 0x00010600u; break;
    }
    m.version = version;
    reflection.spirv_version = version;
    auto drop = [&](const char* name) { std::erase(m.extensions, std::string(name)); };
    drop("SPV_KHR_storage_buffer_storage_class");
    drop("SPV_KHR_variable_pointers");
    drop("SPV_KHR_16bit_storage");
    drop("SPV_KHR_device_group");
    drop("SPV_KHR_multiview");
    drop("SPV_KHR_shader_draw_parameters");
    if (version >= 0x00010500u) {
        drop("SPV_KHR_8bit_storage");
        drop("SPV_EXT_descriptor_indexing");
        drop("SPV_KHR_physical_storage_buffer");
        drop("SPV_EXT_physical_storage_buffer");
        drop("SPV_KHR_vulkan_memory_model");
    } else {
        if (m.has_capability(spv::Capability::PhysicalStorageBufferAddresses))
            m.add_extension("SPV_KHR_physical_storage_buffer");
        for (spv::Capability capability : m.capabilities) {
            const uint32_t value = static_cast<uint32_t>(capability);
            if (value >= 5301 && value <= 5312) m.add_extension("SPV_EXT_descriptor_indexing");
            if (value >= 4448 && value <= 4450) m.add_extension("SPV_KHR_8bit_storage");
        }
    }

    ir::EntryPoint entry;
    entry.model = spv::ExecutionModel::GLCompute;
    entry.function = main;
    entry.name = "main";
    m.entry_points = {entry};
    m.execution_modes.push_back(Inst(Op::OpExecutionMode, 0, 0,
                                     {main, static_cast<uint32_t>(spv::ExecutionMode::LocalSize), 64, 1, 1}));
}

void declare_interface(ir::Module& m) {
    std::vector<Id>& interface = m.entry_points.front().interface;
    interface.clear();
    for (const Inst& inst : m.globals) {
        if (inst.op != Op::OpVariable) continue;
        const auto storage = static_cast<spv::StorageClass>(inst.ops[0]);
        if (m.version >= 0x00010400u || storage == spv::StorageClass::Input) interface.push_back(inst.result);
    }
}

std::vector<std::string> required_features(const ir::Module& module) {
    static const std::pair<spv::Capability, const char*> kFeatures[] = {
        {spv::Capability::Float64, "shaderFloat64"},
        {spv::Capability::Int64, "shaderInt64"},
        {spv::Capability::Int16, "shaderInt16"},
        {spv::Capability::Int8, "shaderInt8"},
        {spv::Capability::Float16, "shaderFloat16"},
        {spv::Capability::Int64Atomics, "shaderBufferInt64Atomics"},
        {spv::Capability::StorageBuffer16BitAccess, "storageBuffer16BitAccess"},
        {spv::Capability::UniformAndStorageBuffer16BitAccess, "uniformAndStorageBuffer16BitAccess"},
        {spv::Capability::StoragePushConstant16, "storagePushConstant16"},
        {spv::Capability::StorageBuffer8BitAccess, "storageBuffer8BitAccess"},
        {spv::Capability::UniformAndStorageBuffer8BitAccess, "uniformAndStorageBuffer8BitAccess"},
        {spv::Capability::StoragePushConstant8, "storagePushConstant8"},
        {spv::Capability::StorageImageReadWithoutFormat, "shaderStorageImageReadWithoutFormat"},
        {spv::Capability::StorageImageWriteWithoutFormat, "shaderStorageImageWriteWithoutFormat"},
        {spv::Capability::StorageImageMultisample, "shaderStorageImageMultisample"},
        {spv::Capability::UniformBufferArrayDynamicIndexing, "shaderUniformBufferArrayDynamicIndexing"},
        {spv::Capability::SampledImageArrayDynamicIndexing, "shaderSampledImageArrayDynamicIndexing"},
        {spv::Capability::StorageBufferArrayDynamicIndexing, "shaderStorageBufferArrayDynamicIndexing"},
        {spv::Capability::StorageImageArrayDynamicIndexing, "shaderStorageImageArrayDynamicIndexing"},
        {spv::Capability::UniformBufferArrayNonUniformIndexing, "shaderUniformBufferArrayNonUniformIndexing"},
        {spv::Capability::SampledImageArrayNonUniformIndexing, "shaderSampledImageArrayNonUniformIndexing"},
        {spv::Capability::StorageBufferArrayNonUniformIndexing, "shaderStorageBufferArrayNonUniformIndexing"},
        {spv::Capability::StorageImageArrayNonUniformIndexing, "shaderStorageImageArrayNonUniformIndexing"},
        {spv::Capability::UniformTexelBufferArrayNonUniformIndexing, "shaderUniformTexelBufferArrayNonUniformIndexing"},
        {spv::Capability::StorageTexelBufferArrayNonUniformIndexing, "shaderStorageTexelBufferArrayNonUniformIndexing"},
        {spv::Capability::RuntimeDescriptorArray, "runtimeDescriptorArray"},
        {spv::Capability::PhysicalStorageBufferAddresses, "bufferDeviceAddress"},
        {spv::Capability::VulkanMemoryModel, "vulkanMemoryModel"},
        {spv::Capability::VulkanMemoryModelDeviceScope, "vulkanMemoryModelDeviceScope"},
        {spv::Capability::VariablePointers, "variablePointers"},
        {spv::Capability::VariablePointersStorageBuffer, "variablePointersStorageBuffer"},
        {spv::Capability::ImageCubeArray, "imageCubeArray"},
        {spv::Capability::SampledCubeArray, "imageCubeArray"},
        {spv::Capability::ImageGatherExtended, "shaderImageGatherExtended"},
        {spv::Capability::MinLod, "shaderResourceMinLod"},
        {spv::Capability::SparseResidency, "shaderResourceResidency"},
        {spv::Capability::ShaderClockKHR, "shaderSubgroupClock"},
    };
    std::vector<std::string> out;
    for (spv::Capability capability : module.capabilities)
        for (const auto& [known, name] : kFeatures)
            if (known == capability && std::find(out.begin(), out.end(), name) == out.end()) out.push_back(name);
    return out;
}

}  // namespace rtc::link
