// The executor on VK_NV_ray_tracing.
#include <algorithm>
#include <cstring>

#include "executor.h"

namespace rtc::native {
namespace {

using tools::check;
using tools::MemoryKind;

struct Functions {
    PFN_vkCreateAccelerationStructureNV create_as;
    PFN_vkDestroyAccelerationStructureNV destroy_as;
    PFN_vkGetAccelerationStructureMemoryRequirementsNV requirements;
    PFN_vkBindAccelerationStructureMemoryNV bind_memory;
    PFN_vkGetAccelerationStructureHandleNV as_handle;
    PFN_vkCmdBuildAccelerationStructureNV cmd_build;
    PFN_vkCreateRayTracingPipelinesNV create_pipelines;
    PFN_vkGetRayTracingShaderGroupHandlesNV group_handles;
    PFN_vkCmdTraceRaysNV cmd_trace;
};

class NvExecutor final : public Executor {
  public:
    explicit NvExecutor(const Context& context) : context_(context) {
#define FIND(member, name) f_.member = context.device_function<PFN_##name>(#name)
        FIND(create_as, vkCreateAccelerationStructureNV);
        FIND(destroy_as, vkDestroyAccelerationStructureNV);
        FIND(requirements, vkGetAccelerationStructureMemoryRequirementsNV);
        FIND(bind_memory, vkBindAccelerationStructureMemoryNV);
        FIND(as_handle, vkGetAccelerationStructureHandleNV);
        FIND(cmd_build, vkCmdBuildAccelerationStructureNV);
        FIND(create_pipelines, vkCreateRayTracingPipelinesNV);
        FIND(group_handles, vkGetRayTracingShaderGroupHandlesNV);
        FIND(cmd_trace, vkCmdTraceRaysNV);
#undef FIND
        if (!f_.cmd_trace) throw Error("the device was created without VK_NV_ray_tracing");
        properties_.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_TRACING_PROPERTIES_NV;
        VkPhysicalDeviceProperties2 properties{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2};
        properties.pNext = &properties_;
        vkGetPhysicalDeviceProperties2(context.physical, &properties);
    }

    ~NvExecutor() override {
        VkDevice device = context_.device;
        for (Built& built : bottoms_) destroy(built);
        for (Built& built : tops_) destroy(built);
        vkDestroyPipeline(device, pipeline_, nullptr);
        vkDestroyPipelineLayout(device, layout_, nullptr);
    }

    const char* name() const override { return "native NV"; }
    VkShaderStageFlags stages() const override {
        return VK_SHADER_STAGE_RAYGEN_BIT_NV | VK_SHADER_STAGE_ANY_HIT_BIT_NV |
               VK_SHADER_STAGE_CLOSEST_HIT_BIT_NV | VK_SHADER_STAGE_MISS_BIT_NV |
               VK_SHADER_STAGE_INTERSECTION_BIT_NV | VK_SHADER_STAGE_CALLABLE_BIT_NV;
    }
    VkDescriptorType top_descriptor() const override { return VK_DESCRIPTOR_TYPE_ACCELERATION_STRUCTURE_NV; }

    void build(const World& world) override {
        for (const Bottom& bottom : world.bottoms) bottoms_.push_back(build_bottom(bottom));
        for (const Top& top : world.tops) tops_.push_back(build_top(top));
    }

    void create_pipeline(const tools::JobPipeline& pipeline,
                         const std::vector<VkDescriptorSetLayout>& set_layouts,
                         uint32_t push_bytes) override {
        VkPushConstantRange range{stages(), 0, push_bytes};
        VkPipelineLayoutCreateInfo layout{VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO};
        layout.setLayoutCount = uint32_t(set_layouts.size());
        layout.pSetLayouts = set_layouts.data();
        layout.pushConstantRangeCount = push_bytes ? 1 : 0;
        layout.pPushConstantRanges = &range;
        check(vkCreatePipelineLayout(context_.device, &layout, nullptr, &layout_), "vkCreatePipelineLayout");
        StageList stages(context_.device, pipeline);
        std::vector<VkRayTracingShaderGroupCreateInfoNV> groups;
        for (const tools::JobGroup& group : pipeline.groups) {
            VkRayTracingShaderGroupCreateInfoNV info{
                VK_STRUCTURE_TYPE_RAY_TRACING_SHADER_GROUP_CREATE_INFO_NV};
            info.type = group.general >= 0   ? VK_RAY_TRACING_SHADER_GROUP_TYPE_GENERAL_NV
                        : group.procedural() ? VK_RAY_TRACING_SHADER_GROUP_TYPE_PROCEDURAL_HIT_GROUP_NV
                                             : VK_RAY_TRACING_SHADER_GROUP_TYPE_TRIANGLES_HIT_GROUP_NV;
            info.generalShader = uint32_t(group.general);  // -1 is VK_SHADER_UNUSED_NV
            info.closestHitShader = uint32_t(group.closest_hit);
            info.anyHitShader = uint32_t(group.any_hit);
            info.intersectionShader = uint32_t(group.intersection);
            groups.push_back(info);
        }
        group_count_ = uint32_t(groups.size());
        VkRayTracingPipelineCreateInfoNV info{VK_STRUCTURE_TYPE_RAY_TRACING_PIPELINE_CREATE_INFO_NV};
        info.stageCount = uint32_t(stages.infos().size());
        info.pStages = stages.infos().data();
        info.groupCount = group_count_;
        info.pGroups = groups.data();
        info.maxRecursionDepth = std::min(pipeline.max_recursion, properties_.maxRecursionDepth);
        info.layout = layout_;
        check(f_.create_pipelines(context_.device, VK_NULL_HANDLE, 1, &info, nullptr, &pipeline_),
              "vkCreateRayTracingPipelinesNV");
    }

    void set_tables(const Tables& tables) override {
        TableLimits limits{properties_.shaderGroupHandleSize, properties_.shaderGroupHandleSize,
                           properties_.shaderGroupBaseAlignment};
        std::vector<uint8_t> handles(size_t(group_count_) * limits.handle_bytes);
        check(f_.group_handles(context_.device, pipeline_, 0, group_count_, handles.size(), handles.data()),
              "vkGetRayTracingShaderGroupHandlesNV");
        table_ = lay_out(tables, handles, limits);
        table_buffer_ =
            Buffer(context_, table_.bytes.size(), VK_BUFFER_USAGE_RAY_TRACING_BIT_NV, MemoryKind::Host);
        std::memcpy(table_buffer_.mapped, table_.bytes.data(), table_.bytes.size());
    }

    void write_top(VkDescriptorSet set, uint32_t binding, uint32_t element, uint32_t top) override {
        VkWriteDescriptorSetAccelerationStructureNV as{
            VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET_ACCELERATION_STRUCTURE_NV};
        as.accelerationStructureCount = 1;
        as.pAccelerationStructures = &tops_.at(top).as;
        VkWriteDescriptorSet write{VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET, &as};
        write.dstSet = set;
        write.dstBinding = binding;
        write.dstArrayElement = element;
        write.descriptorCount = 1;
        write.descriptorType = top_descriptor();
        vkUpdateDescriptorSets(context_.device, 1, &write, 0, nullptr);
    }

    void trace(VkCommandBuffer commands, const Launch& launch) override {
        vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_RAY_TRACING_NV, pipeline_);
        if (!launch.sets.empty())
            vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_RAY_TRACING_NV, layout_, 0,
                                    uint32_t(launch.sets.size()), launch.sets.data(), 0, nullptr);
        if (!launch.push_constants.empty())
            vkCmdPushConstants(commands, layout_, stages(), 0, uint32_t(launch.push_constants.size()),
                               launch.push_constants.data());
        auto buffer = [&](const TableLayout::Region& r) {
            return r.size ? table_buffer_.handle : VK_NULL_HANDLE;
        };
        f_.cmd_trace(commands, table_buffer_.handle, table_.raygen.offset, buffer(table_.miss),
                     table_.miss.offset, table_.miss.stride, buffer(table_.hit), table_.hit.offset,
                     table_.hit.stride, buffer(table_.callable), table_.callable.offset,
                     table_.callable.stride, launch.width, launch.height, launch.depth);
    }

  private:
    struct Built {
        VkAccelerationStructureNV as = VK_NULL_HANDLE;
        VkDeviceMemory memory = VK_NULL_HANDLE;
        uint64_t handle = 0;
    };

    void destroy(Built& built) {
        f_.destroy_as(context_.device, built.as, nullptr);
        vkFreeMemory(context_.device, built.memory, nullptr);
    }

    VkMemoryRequirements requirements(VkAccelerationStructureNV as,
                                      VkAccelerationStructureMemoryRequirementsTypeNV type) {
        VkAccelerationStructureMemoryRequirementsInfoNV info{
            VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_INFO_NV};
        info.type = type;
        info.accelerationStructure = as;
        VkMemoryRequirements2 out{VK_STRUCTURE_TYPE_MEMORY_REQUIREMENTS_2};
        f_.requirements(context_.device, &info, &out);
        return out.memoryRequirements;
    }

    // `before`: what to build of first; the structure is then updated to `info`.
    Built build_one(const VkAccelerationStructureInfoNV& info, VkBuffer instances,
                    const VkAccelerationStructureInfoNV* before = nullptr) {
        VkDevice device = context_.device;
        Built built;
        VkAccelerationStructureCreateInfoNV create{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_NV};
        create.info = info;
        check(f_.create_as(device, &create, nullptr, &built.as), "vkCreateAccelerationStructureNV");
        VkMemoryRequirements object =
            requirements(built.as, VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_OBJECT_NV);
        uint32_t type = context_.memory_type(object.memoryTypeBits, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
        if (type == ~0u) type = context_.memory_type(object.memoryTypeBits, 0);
        VkMemoryAllocateInfo allocate{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO};
        allocate.allocationSize = object.size;
        allocate.memoryTypeIndex = type;
        check(vkAllocateMemory(device, &allocate, nullptr, &built.memory), "vkAllocateMemory");
        VkBindAccelerationStructureMemoryInfoNV bind{
            VK_STRUCTURE_TYPE_BIND_ACCELERATION_STRUCTURE_MEMORY_INFO_NV};
        bind.accelerationStructure = built.as;
        bind.memory = built.memory;
        check(f_.bind_memory(device, 1, &bind), "vkBindAccelerationStructureMemoryNV");
        auto scratch_size = [&](VkAccelerationStructureMemoryRequirementsTypeNV type) {
            return requirements(built.as, type).size;
        };
        Buffer scratch(
            context_,
            std::max(scratch_size(VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_BUILD_SCRATCH_NV),
                     scratch_size(VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_UPDATE_SCRATCH_NV)),
            VK_BUFFER_USAGE_RAY_TRACING_BIT_NV, MemoryKind::Device);
        auto build = [&](const VkAccelerationStructureInfoNV& from, bool update) {
            context_.run([&](VkCommandBuffer commands) {
                f_.cmd_build(commands, &from, instances, 0, update, built.as,
                             update ? built.as : VK_NULL_HANDLE, scratch.handle, 0);
                tools::full_barrier(commands);
            });
        };
        if (before) build(*before, false);
        build(info, before != nullptr);
        check(f_.as_handle(device, built.as, sizeof(built.handle), &built.handle),
              "vkGetAccelerationStructureHandleNV");
        return built;
    }

    template <typename T>
    Buffer input(const std::vector<T>& data) {
        Buffer buffer(context_, data.size() * sizeof(T), VK_BUFFER_USAGE_RAY_TRACING_BIT_NV,
                      MemoryKind::Host);
        if (!data.empty()) std::memcpy(buffer.mapped, data.data(), data.size() * sizeof(T));
        return buffer;
    }

    Built build_bottom(const Bottom& bottom) {
        NvGeometries input(context_, bottom, VK_BUFFER_USAGE_RAY_TRACING_BIT_NV);
        VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
        info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
        info.flags = bottom.flags;
        info.geometryCount = uint32_t(input.geometries.size());
        info.pGeometries = input.geometries.data();
        if (bottom.built_from.empty()) return build_one(info, VK_NULL_HANDLE);
        Bottom earlier = bottom;
        earlier.geometries = bottom.built_from;
        NvGeometries first(context_, earlier, VK_BUFFER_USAGE_RAY_TRACING_BIT_NV);
        VkAccelerationStructureInfoNV before = info;
        before.pGeometries = first.geometries.data();
        return build_one(info, VK_NULL_HANDLE, &before);
    }

    Built build_top(const Top& top) {
        std::vector<VkAccelerationStructureInstanceKHR> instances;
        for (const Placement& placement : top.instances)
            instances.push_back(instance_of(
                placement, placement.bottom < 0 ? 0 : bottoms_.at(size_t(placement.bottom)).handle));
        Buffer buffer = input(instances);
        VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
        info.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
        info.flags = VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_NV;
        info.instanceCount = uint32_t(instances.size());
        return build_one(info, buffer.handle);
    }

    const Context& context_;
    Functions f_{};
    VkPhysicalDeviceRayTracingPropertiesNV properties_{};
    std::vector<Built> bottoms_, tops_;
    VkPipelineLayout layout_ = VK_NULL_HANDLE;
    VkPipeline pipeline_ = VK_NULL_HANDLE;
    uint32_t group_count_ = 0;
    TableLayout table_;
    Buffer table_buffer_;
};

}  // namespace

std::unique_ptr<Executor> make_nv(const Context& context) { return std::make_unique<NvExecutor>(context); }

}  // namespace rtc::native
