#include <algorithm>
#include <cstring>

#include "build_subject.h"
#include "error.h"

namespace rtc::bench {
namespace {

using tools::Buffer;
using tools::check;
using tools::Context;
using tools::MemoryKind;

std::vector<VkAccelerationStructureInstanceKHR> instances_of(const BuildInput& input, uint64_t reference) {
    std::vector<VkAccelerationStructureInstanceKHR> instances;
    for (const glm::mat4& transform : input.instances) {
        native::Placement placement;
        for (int row = 0; row < 3; ++row)
            for (int column = 0; column < 4; ++column) placement.transform[4 * row + column] = transform[column][row];
        instances.push_back(native::instance_of(placement, reference));
    }
    return instances;
}

VkDeviceSize queried_size(const Context& context, VkQueryType type,
                          const std::function<void(VkCommandBuffer, VkQueryPool)>& write) {
    VkQueryPoolCreateInfo info{VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO};
    info.queryType = type;
    info.queryCount = 1;
    VkQueryPool pool = VK_NULL_HANDLE;
    check(vkCreateQueryPool(context.device, &info, nullptr, &pool), "vkCreateQueryPool");
    context.run([&](VkCommandBuffer commands) {
        vkCmdResetQueryPool(commands, pool, 0, 1);
        write(commands, pool);
    });
    uint64_t size = 0;
    const VkResult result = vkGetQueryPoolResults(context.device, pool, 0, 1, sizeof size, &size, sizeof size,
                                                  VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT);
    vkDestroyQueryPool(context.device, pool, nullptr);
    check(result, "vkGetQueryPoolResults");
    return size;
}

// ---- VK_KHR_acceleration_structure ---------------------------------------------------

class KhrSubject final : public BuildSubject {
  public:
    KhrSubject(const Context& context, const BuildInput& input) : BuildSubject("native KHR"), context_(context) {
#define FIND(member, name) member = context.device_function<PFN_##name>(#name)
        FIND(create_, vkCreateAccelerationStructureKHR);
        FIND(destroy_, vkDestroyAccelerationStructureKHR);
        FIND(sizes_, vkGetAccelerationStructureBuildSizesKHR);
        FIND(address_, vkGetAccelerationStructureDeviceAddressKHR);
        FIND(build_, vkCmdBuildAccelerationStructuresKHR);
        FIND(properties_, vkCmdWriteAccelerationStructuresPropertiesKHR);
#undef FIND
        constexpr VkBufferUsageFlags kInput = VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_BIT_KHR |
                                              VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT;
        positions_ = upload_vector(context, input.mesh.positions, kInput);
        indices_ = upload_vector(context, input.mesh.indices, kInput);
        bottom_.geometry.geometryType = VK_GEOMETRY_TYPE_TRIANGLES_KHR;
        bottom_.geometry.flags = VK_GEOMETRY_OPAQUE_BIT_KHR;
        auto& triangles = bottom_.geometry.geometry.triangles;
        triangles = {VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_TRIANGLES_DATA_KHR};
        triangles.vertexFormat = VK_FORMAT_R32G32B32_SFLOAT;
        triangles.vertexData.deviceAddress = positions_.address;
        triangles.vertexStride = sizeof(glm::vec3);
        triangles.maxVertex = uint32_t(input.mesh.positions.size()) - 1;
        triangles.indexType = VK_INDEX_TYPE_UINT32;
        triangles.indexData.deviceAddress = indices_.address;
        bottom_.range.primitiveCount = uint32_t(input.mesh.triangle_count());
        make(bottom_, VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_KHR, input);
        measured_ = &bottom_;
        together_ = input.together;
        for (uint32_t i = 1; i < input.copies; ++i) {
            Level& level = *more_.emplace_back(std::make_unique<Level>());
            level.geometry = bottom_.geometry;
            level.range = bottom_.range;
            make(level, VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_KHR, input);
        }
        if (input.instances.empty()) return;
        context.run([&](VkCommandBuffer commands) { record(commands, bottom_, false); });
        VkAccelerationStructureDeviceAddressInfoKHR info{
            VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_DEVICE_ADDRESS_INFO_KHR};
        info.accelerationStructure = bottom_.structure;
        instances_ = upload_vector(context, instances_of(input, address_(context.device, &info)), kInput);
        top_.geometry.geometryType = VK_GEOMETRY_TYPE_INSTANCES_KHR;
        top_.geometry.geometry.instances = {VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_INSTANCES_DATA_KHR};
        top_.geometry.geometry.instances.data.deviceAddress = instances_.address;
        top_.range.primitiveCount = uint32_t(input.instances.size());
        make(top_, VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_KHR, input);
        measured_ = &top_;
    }

    ~KhrSubject() override {
        for (const Level* level : {&top_, &bottom_}) destroy_(context_.device, level->structure, nullptr);
        for (const auto& level : more_) destroy_(context_.device, level->structure, nullptr);
    }

    void record_build(VkCommandBuffer commands) override {
        if (!together_) {
            record(commands, *measured_, false);
            for (const auto& level : more_) record(commands, *level, false);
            return;
        }
        std::vector<VkAccelerationStructureBuildGeometryInfoKHR> infos{measured_->info};
        std::vector<const VkAccelerationStructureBuildRangeInfoKHR*> ranges{&measured_->range};
        for (const auto& level : more_) {
            infos.push_back(level->info);
            ranges.push_back(&level->range);
        }
        build_(commands, uint32_t(infos.size()), infos.data(), ranges.data());
        tools::full_barrier(commands);
    }
    void record_update(VkCommandBuffer commands) override { record(commands, *measured_, true); }

    VkDeviceSize compacted_bytes() override {
        return queried_size(context_, VK_QUERY_TYPE_ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR,
                            [&](VkCommandBuffer commands, VkQueryPool pool) {
                                properties_(commands, 1, &measured_->structure,
                                            VK_QUERY_TYPE_ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR, pool, 0);
                            });
    }

  private:
    struct Level {
        VkAccelerationStructureGeometryKHR geometry{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_KHR};
        VkAccelerationStructureBuildRangeInfoKHR range{};
        VkAccelerationStructureBuildGeometryInfoKHR info{
            VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_GEOMETRY_INFO_KHR};
        VkAccelerationStructureKHR structure = VK_NULL_HANDLE;
        Buffer memory, scratch;
    };

    void make(Level& level, VkAccelerationStructureTypeKHR type, const BuildInput& input) {
        level.info.type = type;
        level.info.flags = input.fast_build ? VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_BUILD_BIT_KHR
                                            : VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_KHR;
        level.info.flags |= VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_COMPACTION_BIT_KHR;
        if (input.low_memory) level.info.flags |= VK_BUILD_ACCELERATION_STRUCTURE_LOW_MEMORY_BIT_KHR;
        if (input.allow_update) level.info.flags |= VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_KHR;
        level.info.geometryCount = 1;
        level.info.pGeometries = &level.geometry;
        VkAccelerationStructureBuildSizesInfoKHR sizes{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_SIZES_INFO_KHR};
        sizes_(context_.device, VK_ACCELERATION_STRUCTURE_BUILD_TYPE_DEVICE_KHR, &level.info,
               &level.range.primitiveCount, &sizes);
        bytes = sizes.accelerationStructureSize;
        scratch_bytes = sizes.buildScratchSize;
        update_scratch_bytes = sizes.updateScratchSize;
        level.memory = Buffer(context_, bytes,
                              VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_STORAGE_BIT_KHR |
                                  VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT,
                              MemoryKind::Device);
        VkAccelerationStructureCreateInfoKHR create_info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_KHR};
        create_info.buffer = level.memory.handle;
        create_info.size = bytes;
        create_info.type = type;
        check(create_(context_.device, &create_info, nullptr, &level.structure), "vkCreateAccelerationStructureKHR");
        VkPhysicalDeviceAccelerationStructurePropertiesKHR limits{
            VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ACCELERATION_STRUCTURE_PROPERTIES_KHR};
        VkPhysicalDeviceProperties2 properties{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &limits, {}};
        vkGetPhysicalDeviceProperties2(context_.physical, &properties);
        const VkDeviceSize alignment = std::max(1u, limits.minAccelerationStructureScratchOffsetAlignment);
        level.scratch = Buffer(context_, std::max(scratch_bytes, update_scratch_bytes) + alignment,
                               VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT,
                               MemoryKind::Device);
        level.info.scratchData.deviceAddress = (level.scratch.address + alignment - 1) / alignment * alignment;
        level.info.dstAccelerationStructure = level.structure;
    }

    void record(VkCommandBuffer commands, Level& level, bool update) {
        level.info.mode = update ? VK_BUILD_ACCELERATION_STRUCTURE_MODE_UPDATE_KHR
                                 : VK_BUILD_ACCELERATION_STRUCTURE_MODE_BUILD_KHR;
        level.info.srcAccelerationStructure = update ? level.structure : VK_NULL_HANDLE;
        const VkAccelerationStructureBuildRangeInfoKHR* range = &level.range;
        build_(commands, 1, &level.info, &range);
        tools::full_barrier(commands);
    }

    const Context& context_;
    PFN_vkCreateAccelerationStructureKHR create_;
    PFN_vkDestroyAccelerationStructureKHR destroy_;
    PFN_vkGetAccelerationStructureBuildSizesKHR sizes_;
    PFN_vkGetAccelerationStructureDeviceAddressKHR address_;
    PFN_vkCmdBuildAccelerationStructuresKHR build_;
    PFN_vkCmdWriteAccelerationStructuresPropertiesKHR properties_;
    Buffer positions_, indices_, instances_;
    Level bottom_, top_;
    std::vector<std::unique_ptr<Level>> more_;  // the other copies
    bool together_ = false;
    Level* measured_ = nullptr;
};

// ---- VK_NV_ray_tracing ---------------------------------------------------------------

class NvSubject final : public BuildSubject {
  public:
    NvSubject(const Context& context, const BuildInput& input) : BuildSubject("native NV"), context_(context) {
#define FIND(member, name) member = context.device_function<PFN_##name>(#name)
        FIND(create_, vkCreateAccelerationStructureNV);
        FIND(destroy_, vkDestroyAccelerationStructureNV);
        FIND(requirements_, vkGetAccelerationStructureMemoryRequirementsNV);
        FIND(bind_, vkBindAccelerationStructureMemoryNV);
        FIND(handle_, vkGetAccelerationStructureHandleNV);
        FIND(build_, vkCmdBuildAccelerationStructureNV);
        FIND(properties_, vkCmdWriteAccelerationStructuresPropertiesNV);
#undef FIND
        constexpr VkBufferUsageFlags kInput = VK_BUFFER_USAGE_RAY_TRACING_BIT_NV;
        positions_ = upload_vector(context, input.mesh.positions, kInput);
        indices_ = upload_vector(context, input.mesh.indices, kInput);
        geometry_ = mesh_geometry(input.mesh, positions_.handle, indices_.handle);
        bottom_.info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
        bottom_.info.geometryCount = 1;
        bottom_.info.pGeometries = &geometry_;
        make(bottom_, input);
        measured_ = &bottom_;
        if (input.instances.empty()) return;
        context.run([&](VkCommandBuffer commands) { record(commands, bottom_, false); });
        uint64_t reference = 0;
        check(handle_(context.device, bottom_.structure, sizeof reference, &reference),
              "vkGetAccelerationStructureHandleNV");
        instances_ = upload_vector(context, instances_of(input, reference), kInput);
        top_.info.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
        top_.info.instanceCount = uint32_t(input.instances.size());
        make(top_, input);
        measured_ = &top_;
    }

    ~NvSubject() override {
        for (const Level* level : {&top_, &bottom_}) {
            destroy_(context_.device, level->structure, nullptr);
            vkFreeMemory(context_.device, level->memory, nullptr);
        }
    }

    void record_build(VkCommandBuffer commands) override { record(commands, *measured_, false); }
    void record_update(VkCommandBuffer commands) override { record(commands, *measured_, true); }

    VkDeviceSize compacted_bytes() override {
        return queried_size(context_, VK_QUERY_TYPE_ACCELERATION_STRUCTURE_COMPACTED_SIZE_NV,
                            [&](VkCommandBuffer commands, VkQueryPool pool) {
                                properties_(commands, 1, &measured_->structure,
                                            VK_QUERY_TYPE_ACCELERATION_STRUCTURE_COMPACTED_SIZE_NV, pool, 0);
                            });
    }

  private:
    struct Level {
        VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
        VkAccelerationStructureNV structure = VK_NULL_HANDLE;
        VkDeviceMemory memory = VK_NULL_HANDLE;
        Buffer scratch;
    };

    VkMemoryRequirements required(const Level& level, VkAccelerationStructureMemoryRequirementsTypeNV type) {
        VkAccelerationStructureMemoryRequirementsInfoNV info{
            VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_INFO_NV};
        info.type = type;
        info.accelerationStructure = level.structure;
        VkMemoryRequirements2 needed{VK_STRUCTURE_TYPE_MEMORY_REQUIREMENTS_2, nullptr, {}};
        requirements_(context_.device, &info, &needed);
        return needed.memoryRequirements;
    }

    void make(Level& level, const BuildInput& input) {
        level.info.flags = input.fast_build ? VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_BUILD_BIT_NV
                                            : VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_NV;
        level.info.flags |= VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_COMPACTION_BIT_NV;
        if (input.low_memory) level.info.flags |= VK_BUILD_ACCELERATION_STRUCTURE_LOW_MEMORY_BIT_NV;
        if (input.allow_update) level.info.flags |= VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV;
        VkAccelerationStructureCreateInfoNV create_info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_NV};
        create_info.info = level.info;
        check(create_(context_.device, &create_info, nullptr, &level.structure), "vkCreateAccelerationStructureNV");
        const VkMemoryRequirements object =
            required(level, VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_OBJECT_NV);
        bytes = object.size;
        scratch_bytes = required(level, VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_BUILD_SCRATCH_NV).size;
        update_scratch_bytes =
            required(level, VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_UPDATE_SCRATCH_NV).size;
        uint32_t type = context_.memory_type(object.memoryTypeBits, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
        if (type == ~0u) type = context_.memory_type(object.memoryTypeBits, 0);
        VkMemoryAllocateInfo allocate{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO};
        allocate.allocationSize = object.size;
        allocate.memoryTypeIndex = type;
        check(vkAllocateMemory(context_.device, &allocate, nullptr, &level.memory), "vkAllocateMemory");
        VkBindAccelerationStructureMemoryInfoNV bind_info{
            VK_STRUCTURE_TYPE_BIND_ACCELERATION_STRUCTURE_MEMORY_INFO_NV};
        bind_info.accelerationStructure = level.structure;
        bind_info.memory = level.memory;
        check(bind_(context_.device, 1, &bind_info), "vkBindAccelerationStructureMemoryNV");
        level.scratch = Buffer(context_, std::max(scratch_bytes, update_scratch_bytes),
                               VK_BUFFER_USAGE_RAY_TRACING_BIT_NV, MemoryKind::Device);
    }

    void record(VkCommandBuffer commands, Level& level, bool update) {
        build_(commands, &level.info, level.info.instanceCount ? instances_.handle : VK_NULL_HANDLE, 0, update,
               level.structure, update ? level.structure : VK_NULL_HANDLE, level.scratch.handle, 0);
        tools::full_barrier(commands);
    }

    const Context& context_;
    PFN_vkCreateAccelerationStructureNV create_;
    PFN_vkDestroyAccelerationStructureNV destroy_;
    PFN_vkGetAccelerationStructureMemoryRequirementsNV requirements_;
    PFN_vkBindAccelerationStructureMemoryNV bind_;
    PFN_vkGetAccelerationStructureHandleNV handle_;
    PFN_vkCmdBuildAccelerationStructureNV build_;
    PFN_vkCmdWriteAccelerationStructuresPropertiesNV properties_;
    Buffer positions_, indices_, instances_;
    VkGeometryNV geometry_{VK_STRUCTURE_TYPE_GEOMETRY_NV};
    Level bottom_, top_;
    Level* measured_ = nullptr;
};

}  // namespace

std::unique_ptr<BuildSubject> make_khr_subject(const Context& context, const BuildInput& input) {
    return std::make_unique<KhrSubject>(context, input);
}

std::unique_ptr<BuildSubject> make_nv_subject(const Context& context, const BuildInput& input) {
    return std::make_unique<NvSubject>(context, input);
}

}  // namespace rtc::bench
