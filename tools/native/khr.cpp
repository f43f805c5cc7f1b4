// The executor on VK_KHR_ray_tracing_pipeline.
#include <algorithm>
#include <cstring>

#include "executor.h"

namespace rtc::native {
namespace {

using tools::check;
using tools::MemoryKind;

struct Functions {
    PFN_vkCreateAccelerationStructureKHR create_as;
    PFN_vkDestroyAccelerationStructureKHR destroy_as;
    PFN_vkGetAccelerationStructureBuildSizesKHR build_sizes;
    PFN_vkGetAccelerationStructureDeviceAddressKHR as_address;
    PFN_vkCmdBuildAccelerationStructuresKHR cmd_build;
    PFN_vkCreateRayTracingPipelinesKHR create_pipelines;
    PFN_vkGetRayTracingShaderGroupHandlesKHR group_handles;
    PFN_vkCmdTraceRaysKHR cmd_trace;
};

constexpr VkBufferUsageFlags kAddress = VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT;
constexpr VkBufferUsageFlags kInput =
    VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_BIT_KHR | kAddress;

class KhrExecutor final : public Executor {
  public:
    explicit KhrExecutor(const Context& context) : context_(context) {
#define FIND(member, name) f_.member = context.device_function<PFN_##name>(#name)
        FIND(create_as, vkCreateAccelerationStructureKHR);
        FIND(destroy_as, vkDestroyAccelerationStructureKHR);
        FIND(build_sizes, vkGetAccelerationStructureBuildSizesKHR);
        FIND(as_address, vkGetAccelerationStructureDeviceAddressKHR);
        FIND(cmd_build, vkCmdBuildAccelerationStructuresKHR);
        FIND(create_pipelines, vkCreateRayTracingPipelinesKHR);
        FIND(group_handles, vkGetRayTracingShaderGroupHandlesKHR);
        FIND(cmd_trace, vkCmdTraceRaysKHR);
#undef FIND
        if (!f_.cmd_trace) throw Error("the device was created without VK_KHR_ray_tracing_pipeline");
        properties_.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_TRACING_PIPELINE_PROPERTIES_KHR;
        as_properties_.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ACCELERATION_STRUCTURE_PROPERTIES_KHR;
        properties_.pNext = &as_properties_;
        VkPhysicalDeviceProperties2 properties{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2};
        properties.pNext = &properties_;
        vkGetPhysicalDeviceProperties2(context.physical, &properties);
    }

    ~KhrExecutor() override {
        VkDevice device = context_.device;
        for (Built& built : bottoms_) f_.destroy_as(device, built.as, nullptr);
        for (Built& built : tops_) f_.destroy_as(device, built.as, nullptr);
        vkDestroyPipeline(device, pipeline_, nullptr);
        vkDestroyPipelineLayout(device, layout_, nullptr);
    }

    const char* name() const override { return "native KHR"; }
    VkShaderStageFlags stages() const override {
        return VK_SHADER_STAGE_RAYGEN_BIT_KHR | VK_SHADER_STAGE_ANY_HIT_BIT_KHR |
               VK_SHADER_STAGE_CLOSEST_HIT_BIT_KHR | VK_SHADER_STAGE_MISS_BIT_KHR |
               VK_SHADER_STAGE_INTERSECTION_BIT_KHR | VK_SHADER_STAGE_CALLABLE_BIT_KHR;
    }
    VkDescriptorType top_descriptor() const override { return VK_DESCRIPTOR_TYPE_ACCELERATION_STRUCTURE_KHR; }

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
        std::vector<VkRayTracingShaderGroupCreateInfoKHR> groups;
        for (const tools::JobGroup& group : pipeline.groups) {
            VkRayTracingShaderGroupCreateInfoKHR info{
                VK_STRUCTURE_TYPE_RAY_TRACING_SHADER_GROUP_CREATE_INFO_KHR};
            info.type = group.general >= 0   ? VK_RAY_TRACING_SHADER_GROUP_TYPE_GENERAL_KHR
                        : group.procedural() ? VK_RAY_TRACING_SHADER_GROUP_TYPE_PROCEDURAL_HIT_GROUP_KHR
                                             : VK_RAY_TRACING_SHADER_GROUP_TYPE_TRIANGLES_HIT_GROUP_KHR;
            info.generalShader = uint32_t(group.general);  // -1 is VK_SHADER_UNUSED_KHR
            info.closestHitShader = uint32_t(group.closest_hit);
            info.anyHitShader = uint32_t(group.any_hit);
            info.intersectionShader = uint32_t(group.intersection);
            groups.push_back(info);
        }
        group_count_ = uint32_t(groups.size());
        VkRayTracingPipelineCreateInfoKHR info{VK_STRUCTURE_TYPE_RAY_TRACING_PIPELINE_CREATE_INFO_KHR};
        info.stageCount = uint32_t(stages.infos().size());
        info.pStages = stages.infos().data();
        info.groupCount = group_count_;
        info.pGroups = groups.data();
        info.maxPipelineRayRecursionDepth =
            std::min(pipeline.max_recursion, properties_.maxRayRecursionDepth);
        info.layout = layout_;
        check(f_.create_pipelines(context_.device, VK_NULL_HANDLE, VK_NULL_HANDLE, 1, &info, nullptr,
                                  &pipeline_),
              "vkCreateRayTracingPipelinesKHR");
    }

    void set_tables(const Tables& tables) override {
        TableLimits limits{properties_.shaderGroupHandleSize, properties_.shaderGroupHandleAlignment,
                           properties_.shaderGroupBaseAlignment};
        std::vector<uint8_t> handles(size_t(group_count_) * limits.handle_bytes);
        check(f_.group_handles(context_.device, pipeline_, 0, group_count_, handles.size(), handles.data()),
              "vkGetRayTracingShaderGroupHandlesKHR");
        table_ = lay_out(tables, handles, limits);
        table_buffer_ = Buffer(context_, table_.bytes.size() + limits.base_alignment,
                               VK_BUFFER_USAGE_SHADER_BINDING_TABLE_BIT_KHR | kAddress, MemoryKind::Host);
        VkDeviceAddress base = table_buffer_.address;
        table_address_ = (base + limits.base_alignment - 1) / limits.base_alignment * limits.base_alignment;
        std::memcpy(static_cast<uint8_t*>(table_buffer_.mapped) + (table_address_ - base),
                    table_.bytes.data(), table_.bytes.size());
    }

    void write_top(VkDescriptorSet set, uint32_t binding, uint32_t element, uint32_t top) override {
        VkWriteDescriptorSetAccelerationStructureKHR as{
            VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET_ACCELERATION_STRUCTURE_KHR};
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

    VkDeviceSize structure_bytes() const override {
        VkDeviceSize bytes = 0;
        for (const Built& built : bottoms_) bytes += built.memory.size;
        for (const Built& built : tops_) bytes += built.memory.size;
        return bytes;
    }

    VkDeviceAddress top_address(uint32_t top) const override { return tops_.at(top).address; }

    void trace(VkCommandBuffer commands, const Launch& launch) override {
        vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_RAY_TRACING_KHR, pipeline_);
        if (!launch.sets.empty())
            vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_RAY_TRACING_KHR, layout_, 0,
                                    uint32_t(launch.sets.size()), launch.sets.data(), 0, nullptr);
        if (!launch.push_constants.empty())
            vkCmdPushConstants(commands, layout_, stages(), 0, uint32_t(launch.push_constants.size()),
                               launch.push_constants.data());
        auto region = [&](const TableLayout::Region& r) {
            VkStridedDeviceAddressRegionKHR out{};
            if (r.size) out = {table_address_ + r.offset, r.stride, r.size};
            return out;
        };
        auto raygen = region(table_.raygen), miss = region(table_.miss), hit = region(table_.hit),
             callable = region(table_.callable);
        f_.cmd_trace(commands, &raygen, &miss, &hit, &callable, launch.width, launch.height, launch.depth);
    }

  private:
    struct Built {
        VkAccelerationStructureKHR as = VK_NULL_HANDLE;
        VkDeviceAddress address = 0;
        Buffer memory;
    };

    // `before`: the geometries to build of first; the structure is then updated to those of `info`.
    Built build_one(VkAccelerationStructureBuildGeometryInfoKHR& info, const std::vector<uint32_t>& counts,
                    const std::vector<VkAccelerationStructureBuildRangeInfoKHR>& ranges,
                    const VkAccelerationStructureGeometryKHR* before = nullptr) {
        VkAccelerationStructureBuildSizesInfoKHR sizes{
            VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_SIZES_INFO_KHR};
        f_.build_sizes(context_.device, VK_ACCELERATION_STRUCTURE_BUILD_TYPE_DEVICE_KHR, &info, counts.data(),
                       &sizes);
        Built built;
        built.memory =
            Buffer(context_, sizes.accelerationStructureSize,
                   VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_STORAGE_BIT_KHR | kAddress, MemoryKind::Device);
        VkAccelerationStructureCreateInfoKHR create{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_KHR};
        create.buffer = built.memory.handle;
        create.size = sizes.accelerationStructureSize;
        create.type = info.type;
        check(f_.create_as(context_.device, &create, nullptr, &built.as), "vkCreateAccelerationStructureKHR");
        VkDeviceSize alignment = std::max(1u, as_properties_.minAccelerationStructureScratchOffsetAlignment);
        Buffer scratch(context_, std::max(sizes.buildScratchSize, sizes.updateScratchSize) + alignment,
                       VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | kAddress, MemoryKind::Device);
        info.dstAccelerationStructure = built.as;
        info.scratchData.deviceAddress = (scratch.address + alignment - 1) / alignment * alignment;
        const VkAccelerationStructureBuildRangeInfoKHR* range = ranges.data();
        auto build = [&](const VkAccelerationStructureGeometryKHR* geometries, bool update) {
            info.pGeometries = geometries;
            info.mode = update ? VK_BUILD_ACCELERATION_STRUCTURE_MODE_UPDATE_KHR
                               : VK_BUILD_ACCELERATION_STRUCTURE_MODE_BUILD_KHR;
            info.srcAccelerationStructure = update ? built.as : VK_NULL_HANDLE;
            context_.run([&](VkCommandBuffer commands) {
                f_.cmd_build(commands, 1, &info, &range);
                tools::full_barrier(commands);
            });
        };
        const VkAccelerationStructureGeometryKHR* const geometries = info.pGeometries;
        if (before) build(before, false);
        build(geometries, before != nullptr);
        VkAccelerationStructureDeviceAddressInfoKHR address{
            VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_DEVICE_ADDRESS_INFO_KHR};
        address.accelerationStructure = built.as;
        built.address = f_.as_address(context_.device, &address);
        return built;
    }

    template <typename T>
    Buffer input(const std::vector<T>& data) {
        Buffer buffer(context_, data.size() * sizeof(T), kInput, MemoryKind::Host);
        if (!data.empty()) std::memcpy(buffer.mapped, data.data(), data.size() * sizeof(T));
        return buffer;
    }

    // What the device builds of; `buffers` keeps it alive.
    std::vector<VkAccelerationStructureGeometryKHR> geometries_of(const std::vector<Geometry>& list,
                                                                  std::vector<Buffer>& buffers) {
        std::vector<VkAccelerationStructureGeometryKHR> geometries;
        auto keep = [&](Buffer buffer) {
            buffers.push_back(std::move(buffer));
            return buffers.back().address;
        };
        for (const Geometry& geometry : list) {
            VkAccelerationStructureGeometryKHR out{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_KHR};
            out.flags = geometry.flags;
            if (geometry.boxes) {
                out.geometryType = VK_GEOMETRY_TYPE_AABBS_KHR;
                auto& aabbs = out.geometry.aabbs;
                aabbs = {VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_AABBS_DATA_KHR};
                aabbs.data.deviceAddress = keep(input(geometry.bounds));
                aabbs.stride = 24;
            } else {
                out.geometryType = VK_GEOMETRY_TYPE_TRIANGLES_KHR;
                auto& triangles = out.geometry.triangles;
                triangles = {VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_TRIANGLES_DATA_KHR};
                triangles.vertexFormat = VK_FORMAT_R32G32B32_SFLOAT;
                triangles.vertexData.deviceAddress = keep(input(geometry.positions));
                triangles.vertexStride = 12;
                uint32_t vertices = uint32_t(geometry.positions.size() / 3);
                triangles.maxVertex = vertices ? vertices - 1 : 0;
                triangles.indexType =
                    geometry.indices.empty() ? VK_INDEX_TYPE_NONE_KHR : VK_INDEX_TYPE_UINT32;
                if (!geometry.indices.empty())
                    triangles.indexData.deviceAddress = keep(input(geometry.indices));
                if (!geometry.transform.empty())
                    triangles.transformData.deviceAddress = keep(input(geometry.transform));
            }
            geometries.push_back(out);
        }
        return geometries;
    }

    Built build_bottom(const Bottom& bottom) {
        std::vector<Buffer> buffers;
        const auto geometries = geometries_of(bottom.geometries, buffers);
        const auto before = geometries_of(bottom.built_from, buffers);
        std::vector<uint32_t> counts;
        std::vector<VkAccelerationStructureBuildRangeInfoKHR> ranges;
        for (const Geometry& geometry : bottom.geometries) {
            counts.push_back(geometry.primitive_count());
            ranges.push_back({geometry.primitive_count(), 0, 0, 0});
        }
        VkAccelerationStructureBuildGeometryInfoKHR info{
            VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_GEOMETRY_INFO_KHR};
        info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_KHR;
        info.flags = bottom.flags;
        info.geometryCount = uint32_t(geometries.size());
        info.pGeometries = geometries.data();
        return build_one(info, counts, ranges, before.empty() ? nullptr : before.data());
    }

    Built build_top(const Top& top) {
        std::vector<VkAccelerationStructureInstanceKHR> instances;
        for (const Placement& placement : top.instances)
            instances.push_back(instance_of(
                placement, placement.bottom < 0 ? 0 : bottoms_.at(size_t(placement.bottom)).address));
        Buffer buffer = input(instances);
        VkAccelerationStructureGeometryKHR geometry{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_KHR};
        geometry.geometryType = VK_GEOMETRY_TYPE_INSTANCES_KHR;
        geometry.geometry.instances = {VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_INSTANCES_DATA_KHR};
        geometry.geometry.instances.data.deviceAddress = buffer.address;
        VkAccelerationStructureBuildGeometryInfoKHR info{
            VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_GEOMETRY_INFO_KHR};
        info.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_KHR;
        info.flags = VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_KHR;
        info.geometryCount = 1;
        info.pGeometries = &geometry;
        return build_one(info, {uint32_t(instances.size())}, {{uint32_t(instances.size()), 0, 0, 0}});
    }

    const Context& context_;
    Functions f_{};
    VkPhysicalDeviceRayTracingPipelinePropertiesKHR properties_{};
    VkPhysicalDeviceAccelerationStructurePropertiesKHR as_properties_{};
    std::vector<Built> bottoms_, tops_;
    VkPipelineLayout layout_ = VK_NULL_HANDLE;
    VkPipeline pipeline_ = VK_NULL_HANDLE;
    uint32_t group_count_ = 0;
    TableLayout table_;
    Buffer table_buffer_;
    VkDeviceAddress table_address_ = 0;
};

}  // namespace

std::unique_ptr<Executor> make_khr(const Context& context) { return std::make_unique<KhrExecutor>(context); }

}  // namespace rtc::native
