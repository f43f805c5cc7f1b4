#include "executor.h"

#include <algorithm>
#include <cstring>

#include "../common/scene.h"

namespace rtc::native {

World world_of(const tools::Scene& scene) {
    World world;
    for (const tools::Mesh& mesh : scene.meshes) {
        Bottom bottom;
        bottom.name = mesh.name;
        Geometry geometry;
        geometry.boxes = mesh.procedural();
        geometry.flags =
            (mesh.opaque ? uint32_t(VK_GEOMETRY_OPAQUE_BIT_KHR) : 0u) |
            (mesh.no_duplicate_any_hit ? uint32_t(VK_GEOMETRY_NO_DUPLICATE_ANY_HIT_INVOCATION_BIT_KHR) : 0u);
        for (const glm::vec3& p : mesh.positions)
            geometry.positions.insert(geometry.positions.end(), {p.x, p.y, p.z});
        geometry.indices = mesh.indices;
        for (const auto& box : mesh.boxes)
            geometry.bounds.insert(geometry.bounds.end(),
                                   {box.min.x, box.min.y, box.min.z, box.max.x, box.max.y, box.max.z});
        bottom.geometries.push_back(std::move(geometry));
        world.bottoms.push_back(std::move(bottom));
    }
    Top top;
    top.name = scene.name;
    for (const tools::Instance& instance : scene.instances) {
        Placement placement;
        placement.bottom = int(instance.mesh);
        for (int row = 0; row < 3; ++row)
            for (int column = 0; column < 4; ++column)
                placement.transform[row * 4 + column] = instance.transform[column][row];
        placement.custom_index = instance.custom_index;
        placement.mask = instance.mask;
        placement.sbt_offset = instance.sbt_offset;
        placement.flags = instance.flags;
        top.instances.push_back(placement);
    }
    world.tops.push_back(std::move(top));
    return world;
}

Tables tables_of(const tools::JobTable& table) {
    return {{table.raygen, 0}, {table.miss, 0}, {table.hit, 0}, {table.callable, 0}, table.raygen_index};
}

TableLayout lay_out(const Tables& tables, const std::vector<uint8_t>& handles, const TableLimits& limits) {
    auto align = [](VkDeviceSize value, VkDeviceSize to) { return (value + to - 1) / to * to; };
    TableLayout layout;
    size_t groups = handles.size() / limits.handle_bytes;
    auto place = [&](const Table& table, const char* what, bool raygen) {
        TableLayout::Region region;
        if (table.records.empty()) return region;
        size_t data = 0;
        for (const auto& record : table.records) data = std::max(data, record.data.size());
        // A raygen region is one record: its stride is its size, and each starts at a base.
        uint32_t smallest = uint32_t(
            align(limits.handle_bytes + data, raygen ? limits.base_alignment : limits.handle_alignment));
        region.stride = std::max(table.stride, smallest);
        if (table.stride && table.stride < smallest)
            throw Error(std::string(what) + " records need a stride of " + std::to_string(smallest) + ", " +
                        std::to_string(table.stride) + " was given");
        if (region.stride % limits.handle_alignment)
            throw Error(std::string(what) + " stride " + std::to_string(region.stride) +
                        " is not a multiple of the handle alignment " +
                        std::to_string(limits.handle_alignment));
        region.offset = align(layout.bytes.size(), limits.base_alignment);
        region.size = VkDeviceSize(region.stride) * table.records.size();
        layout.bytes.resize(region.offset + region.size);
        for (size_t i = 0; i < table.records.size(); ++i) {
            const auto& record = table.records[i];
            uint8_t* at = &layout.bytes[region.offset + i * region.stride];
            if (record.group != ~0u) {
                if (record.group >= groups)
                    throw Error(std::string(what) + " record " + std::to_string(i) + " names group " +
                                std::to_string(record.group) + "; there are " + std::to_string(groups));
                std::memcpy(at, &handles[record.group * limits.handle_bytes], limits.handle_bytes);
            }
            if (!record.data.empty())
                std::memcpy(at + limits.handle_bytes, record.data.data(), record.data.size());
        }
        return region;
    };
    layout.raygen = place(tables.raygen, "raygen", true);
    layout.miss = place(tables.miss, "miss", false);
    layout.hit = place(tables.hit, "hit", false);
    layout.callable = place(tables.callable, "callable", false);
    if (tables.raygen_index >= tables.raygen.records.size())
        throw Error("the launch starts raygen record " + std::to_string(tables.raygen_index) +
                    "; there are " + std::to_string(tables.raygen.records.size()));
    layout.raygen.offset += VkDeviceSize(tables.raygen_index) * layout.raygen.stride;
    layout.raygen.size = layout.raygen.stride;
    return layout;
}

Requirements::Requirements(Kind kind) : kind_(kind) {}

void Requirements::apply(tools::ContextOptions& options) {
    options.all_core_features = true;
    if (kind_ == Kind::Nv) {
        options.required_extensions.push_back(VK_NV_RAY_TRACING_EXTENSION_NAME);
        return;
    }
    options.required_extensions.push_back(VK_KHR_ACCELERATION_STRUCTURE_EXTENSION_NAME);
    options.required_extensions.push_back(VK_KHR_RAY_TRACING_PIPELINE_EXTENSION_NAME);
    options.required_extensions.push_back(VK_KHR_DEFERRED_HOST_OPERATIONS_EXTENSION_NAME);
    as_.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ACCELERATION_STRUCTURE_FEATURES_KHR;
    as_.accelerationStructure = VK_TRUE;
    pipeline_.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_TRACING_PIPELINE_FEATURES_KHR;
    pipeline_.rayTracingPipeline = VK_TRUE;
    pipeline_.rayTraversalPrimitiveCulling = VK_TRUE;
    as_.pNext = &pipeline_;
    pipeline_.pNext = options.features;
    options.features = &as_;
    options.optional_extensions.push_back("VK_KHR_ray_tracing_position_fetch");
    options.optional_features.push_back({"VK_KHR_ray_tracing_position_fetch", &position_fetch_});
}

namespace {
VkShaderStageFlagBits stage_bit(tools::JobStage stage) {
    switch (stage) {
        case tools::JobStage::RayGen:
            return VK_SHADER_STAGE_RAYGEN_BIT_KHR;
        case tools::JobStage::Intersection:
            return VK_SHADER_STAGE_INTERSECTION_BIT_KHR;
        case tools::JobStage::AnyHit:
            return VK_SHADER_STAGE_ANY_HIT_BIT_KHR;
        case tools::JobStage::ClosestHit:
            return VK_SHADER_STAGE_CLOSEST_HIT_BIT_KHR;
        case tools::JobStage::Miss:
            return VK_SHADER_STAGE_MISS_BIT_KHR;
        case tools::JobStage::Callable:
            return VK_SHADER_STAGE_CALLABLE_BIT_KHR;
    }
    return VK_SHADER_STAGE_RAYGEN_BIT_KHR;
}
}  // namespace

StageList::StageList(VkDevice device, const tools::JobPipeline& pipeline) : device_(device) {
    for (const tools::JobShader& shader : pipeline.shaders) {
        VkShaderModuleCreateInfo module{VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO};
        module.codeSize = shader.spirv.size() * 4;
        module.pCode = shader.spirv.data();
        VkShaderModule made;
        tools::check(vkCreateShaderModule(device, &module, nullptr, &made), "vkCreateShaderModule");
        modules_.push_back(made);
        auto constants = std::make_unique<Constants>();
        for (const auto& constant : shader.constants) {
            constants->entries.push_back({constant.id, uint32_t(constants->data.size()), constant.bytes});
            const uint8_t* bytes = reinterpret_cast<const uint8_t*>(&constant.value);  // little-endian hosts
            constants->data.insert(constants->data.end(), bytes, bytes + constant.bytes);
        }
        constants->info.mapEntryCount = uint32_t(constants->entries.size());
        constants->info.pMapEntries = constants->entries.data();
        constants->info.dataSize = constants->data.size();
        constants->info.pData = constants->data.data();
        VkPipelineShaderStageCreateInfo info{VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO};
        info.stage = stage_bit(shader.stage);
        info.module = made;
        info.pName = shader.entry.c_str();
        info.pSpecializationInfo = constants->entries.empty() ? nullptr : &constants->info;
        infos_.push_back(info);
        constants_.push_back(std::move(constants));
    }
}

StageList::~StageList() {
    for (VkShaderModule module : modules_) vkDestroyShaderModule(device_, module, nullptr);
}

VkBuffer NvGeometries::input(const Context& context, const void* data, size_t bytes,
                             VkBufferUsageFlags usage) {
    Buffer buffer(context, bytes, usage, tools::MemoryKind::Host);
    if (bytes) std::memcpy(buffer.mapped, data, bytes);
    buffers_.push_back(std::move(buffer));
    return buffers_.back().handle;
}

NvGeometries::NvGeometries(const Context& context, const Bottom& bottom, VkBufferUsageFlags usage) {
    for (const Geometry& geometry : bottom.geometries) {
        VkGeometryNV out{VK_STRUCTURE_TYPE_GEOMETRY_NV};
        out.flags = geometry.flags;
        out.geometryType = geometry.boxes ? VK_GEOMETRY_TYPE_AABBS_NV : VK_GEOMETRY_TYPE_TRIANGLES_NV;
        auto& triangles = out.geometry.triangles;
        triangles = {VK_STRUCTURE_TYPE_GEOMETRY_TRIANGLES_NV};
        triangles.vertexFormat = VK_FORMAT_R32G32B32_SFLOAT;
        triangles.vertexStride = 12;
        triangles.indexType = VK_INDEX_TYPE_NONE_NV;
        auto& aabbs = out.geometry.aabbs;
        aabbs = {VK_STRUCTURE_TYPE_GEOMETRY_AABB_NV};
        aabbs.stride = 24;
        auto upload = [&](const auto& data) {
            return input(context, data.data(), data.size() * sizeof(data[0]), usage);
        };
        if (geometry.boxes) {
            aabbs.aabbData = upload(geometry.bounds);
            aabbs.numAABBs = geometry.primitive_count();
        } else {
            triangles.vertexData = upload(geometry.positions);
            triangles.vertexCount = uint32_t(geometry.positions.size() / 3);
            if (!geometry.indices.empty()) {
                triangles.indexType = VK_INDEX_TYPE_UINT32;
                triangles.indexData = upload(geometry.indices);
                triangles.indexCount = uint32_t(geometry.indices.size());
            }
            if (!geometry.transform.empty()) triangles.transformData = upload(geometry.transform);
        }
        geometries.push_back(out);
    }
}

VkAccelerationStructureInstanceKHR instance_of(const Placement& placement, uint64_t reference) {
    VkAccelerationStructureInstanceKHR instance{};
    std::memcpy(&instance.transform, placement.transform, sizeof(placement.transform));
    instance.instanceCustomIndex = placement.custom_index & 0xffffff;
    instance.mask = placement.mask & 0xff;
    instance.instanceShaderBindingTableRecordOffset = placement.sbt_offset & 0xffffff;
    instance.flags = placement.flags & 0xff;
    instance.accelerationStructureReference = reference;
    return instance;
}

}  // namespace rtc::native
