// Acceleration structures of a Scene: one bottom level a mesh, one top level.
#include <algorithm>
#include <chrono>
#include <cstring>

#include "error.h"
#include "rtc_device.h"

namespace rtc::tools {
namespace {

constexpr VkDeviceSize kAlign = 256;
VkDeviceSize align_up(VkDeviceSize size) { return (size + kAlign - 1) / kAlign * kAlign; }

// The buffers of one mesh and the geometry that names them.
struct BottomInput {
    Buffer positions, indices;
    VkGeometryNV geometry{};
};

VkGeometryNV empty_geometry(const Mesh& mesh) {
    VkGeometryNV geometry{};
    geometry.sType = VK_STRUCTURE_TYPE_GEOMETRY_NV;
    geometry.geometry.triangles.sType = VK_STRUCTURE_TYPE_GEOMETRY_TRIANGLES_NV;
    geometry.geometry.aabbs.sType = VK_STRUCTURE_TYPE_GEOMETRY_AABB_NV;
    if (mesh.opaque) geometry.flags |= VK_GEOMETRY_OPAQUE_BIT_NV;
    if (mesh.no_duplicate_any_hit) geometry.flags |= VK_GEOMETRY_NO_DUPLICATE_ANY_HIT_INVOCATION_BIT_NV;
    return geometry;
}

BottomInput upload_mesh(const Context& context, const Mesh& mesh) {
    BottomInput input;
    input.geometry = empty_geometry(mesh);
    if (mesh.procedural()) {
        input.positions = upload_vector(context, mesh.boxes, RTR_INPUT_BUFFER_USAGE);
        input.geometry.geometryType = VK_GEOMETRY_TYPE_AABBS_NV;
        VkGeometryAABBNV& boxes = input.geometry.geometry.aabbs;
        boxes.aabbData = input.positions.handle;
        boxes.numAABBs = uint32_t(mesh.boxes.size());
        boxes.stride = sizeof(Mesh::Box);
        return input;
    }
    input.positions = upload_vector(context, mesh.positions, RTR_INPUT_BUFFER_USAGE);
    input.indices = upload_vector(context, mesh.indices, RTR_INPUT_BUFFER_USAGE);
    input.geometry.geometryType = VK_GEOMETRY_TYPE_TRIANGLES_NV;
    VkGeometryTrianglesNV& triangles = input.geometry.geometry.triangles;
    triangles.vertexData = input.positions.handle;
    triangles.vertexCount = uint32_t(mesh.positions.size());
    triangles.vertexStride = sizeof(glm::vec3);
    triangles.vertexFormat = VK_FORMAT_R32G32B32_SFLOAT;
    triangles.indexData = input.indices.handle;
    triangles.indexCount = uint32_t(mesh.indices.size());
    triangles.indexType = VK_INDEX_TYPE_UINT32;
    return input;
}

VkDeviceSize requirement(RtrDevice device, RtrAccelerationStructure structure,
                         VkAccelerationStructureMemoryRequirementsTypeNV type) {
    VkMemoryRequirements2 needed{};
    needed.sType = VK_STRUCTURE_TYPE_MEMORY_REQUIREMENTS_2;
    rtrGetAccelerationStructureMemoryRequirements(device, type, structure, &needed);
    return align_up(needed.memoryRequirements.size);
}

VkAccelerationStructureInstanceNV convert(const Instance& instance, uint64_t reference) {
    VkAccelerationStructureInstanceNV converted{};
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 4; ++column)
            converted.transform.matrix[row][column] = instance.transform[column][row];
    converted.instanceCustomIndex = instance.custom_index & 0xffffffu;
    converted.mask = instance.mask & 0xffu;
    converted.instanceShaderBindingTableRecordOffset = instance.sbt_offset & 0xffffffu;
    converted.flags = instance.flags & 0xffu;
    converted.accelerationStructureReference = reference;
    return converted;
}

VkAccelerationStructureInfoNV info_of(const RtcSceneOptions& options, VkAccelerationStructureTypeNV type) {
    VkAccelerationStructureInfoNV info{};
    info.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV;
    info.type = type;
    info.flags = options.fast_build ? VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_BUILD_BIT_NV
                                    : VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_NV;
    if (options.allow_update) info.flags |= VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV;
    return info;
}

// What all levels are built from. Infos point into the other members.
struct Inputs {
    Inputs(const Context& context, const RtcScene::Bottoms& bottoms, size_t instances, const RtcSceneOptions& options) {
        for (const auto& bottom : bottoms) {
            std::vector<VkGeometryNV>& list = geometries.emplace_back();
            for (const Mesh* mesh : bottom) {
                buffers.push_back(upload_mesh(context, *mesh));
                list.push_back(buffers.back().geometry);
            }
        }
        for (const auto& list : geometries) {
            VkAccelerationStructureInfoNV info = info_of(options, VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV);
            info.geometryCount = uint32_t(list.size());
            info.pGeometries = list.data();
            infos.push_back(info);
        }
        infos.push_back(info_of(options, VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV));
        infos.back().instanceCount = uint32_t(instances);
    }

    std::vector<BottomInput> buffers;
    std::vector<std::vector<VkGeometryNV>> geometries;
    std::vector<VkAccelerationStructureInfoNV> infos;  // the top level's is the last
};

RtcScene::Bottoms bottoms_of(const Scene& scene) {
    RtcScene::Bottoms bottoms;
    for (const Mesh& mesh : scene.meshes) bottoms.push_back({&mesh});
    return bottoms;
}

}  // namespace

RtcScene::RtcScene(const RtcDevice& device, const Scene& scene, bool fast_build, bool addresses)
    : RtcScene(device, bottoms_of(scene), scene.instances, {fast_build, addresses, false}) {}

RtcScene::RtcScene(const RtcDevice& device, const Bottoms& bottoms, const std::vector<Instance>& instances,
                   const RtcSceneOptions& options)
    : device_(device), options_(options) {
    build(bottoms, instances, false);
}

void RtcScene::update(const Bottoms& bottoms, const std::vector<Instance>& instances) { build(bottoms, instances, true); }

void RtcScene::build(const Bottoms& bottoms, const std::vector<Instance>& instances, bool update) {
    const auto start = std::chrono::steady_clock::now();
    const RtcDevice& device = device_;
    const Context& context = device.context;
    const Inputs inputs(context, bottoms, instances.size(), options_);
    std::vector<RtrAccelerationStructure> all;
    if (update) {
        all = bottoms_;
        all.push_back(top);
    }
    for (const VkAccelerationStructureInfoNV& info : inputs.infos) {
        if (update) break;
        VkAccelerationStructureCreateInfoNV createInfo{};
        createInfo.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_NV;
        createInfo.info = info;
        RtrAccelerationStructure structure = nullptr;
        device.check(rtrCreateAccelerationStructure(device.handle, &createInfo, nullptr, &structure),
                     "rtrCreateAccelerationStructure");
        all.push_back(structure);
        if (info.type == VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV) {
            top = structure;
        } else {
            bottoms_.push_back(structure);
        }
    }
    VkDeviceSize scratch_size = 0;
    std::vector<VkDeviceSize> sizes;
    for (RtrAccelerationStructure structure : all) {
        const auto scratch = update ? VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_UPDATE_SCRATCH_NV
                                    : VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_BUILD_SCRATCH_NV;
        sizes.push_back(requirement(device.handle, structure,
                                    VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_OBJECT_NV));
        scratch_size = std::max({scratch_size, kAlign, requirement(device.handle, structure, scratch)});
        if (!update) bytes += sizes.back();
    }
    if (!update) {
        const VkDeviceSize size = bytes + 2 * kAlign;
        memory_ = Buffer(context, size, options_.addresses ? RTR_ADDRESS_BUFFER_USAGE : RTR_HEAP_BUFFER_USAGE,
                         MemoryKind::Device);
        if (!options_.addresses) {
            RtrHeapCreateInfo heapInfo{};
            heapInfo.buffer = memory_.handle;
            heapInfo.size = size;
            device.check(rtrCreateHeap(device.handle, &heapInfo, nullptr, &heap), "rtrCreateHeap");
        }
    }
    VkDeviceSize used = 0;
    for (size_t i = 0; i < all.size() && !update; ++i) {
        RtrBindAccelerationStructureMemoryInfo bind{};
        bind.accelerationStructure = all[i];
        if (options_.addresses) {
            bind.buffer = memory_.handle;
            bind.bufferOffset = used;
            used += sizes[i];
        } else {
            bind.heap = heap;
            device.check(rtrAllocateHeapRange(heap, sizes[i], 0, &bind.heapOffset), "rtrAllocateHeapRange");
        }
        device.check(rtrBindAccelerationStructureMemory(device.handle, 1, &bind),
                     "rtrBindAccelerationStructureMemory");
        top_offset_ = options_.addresses ? bind.bufferOffset : bind.heapOffset;
        top_size_ = sizes[i];
    }

    std::vector<VkAccelerationStructureInstanceNV> converted;
    for (const Instance& instance : instances) {
        uint64_t reference = 0;
        device.check(rtrGetAccelerationStructureHandle(device.handle, bottoms_[instance.mesh],
                                                       sizeof reference, &reference),
                     "rtrGetAccelerationStructureHandle");
        converted.push_back(convert(instance, reference));
    }
    Buffer instance_buffer = upload_vector(context, converted, RTR_INPUT_BUFFER_USAGE);
    Buffer scratch(context, scratch_size, RTR_SCRATCH_BUFFER_USAGE, MemoryKind::Device);

    RtrRecorderCreateInfo recorderInfo{};
    RtrRecorder recorder = nullptr;
    device.check(rtrCreateRecorder(device.handle, &recorderInfo, nullptr, &recorder), "rtrCreateRecorder");
    context.run([&](VkCommandBuffer commands) {
        device.check(rtrBeginRecorder(recorder, commands), "rtrBeginRecorder");
        if (heap && !update) device.check(rtrCmdInitializeHeap(recorder, heap), "rtrCmdInitializeHeap");
        for (size_t i = 0; i < all.size(); ++i) {
            const bool is_top = i + 1 == all.size();
            device.check(rtrCmdBuildAccelerationStructure(recorder, &inputs.infos[i],
                                                          is_top ? instance_buffer.handle : VK_NULL_HANDLE, 0, update,
                                                          all[i], update ? all[i] : nullptr, scratch.handle, 0),
                         "rtrCmdBuildAccelerationStructure");
            full_barrier(commands);  // the scratch is shared, and the top level reads the others
        }
    });
    rtrDestroyRecorder(device.handle, recorder, nullptr);
    build_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

RtcScene::~RtcScene() {
    for (RtrAccelerationStructure structure : bottoms_)
        rtrDestroyAccelerationStructure(device_.handle, structure, nullptr);
    rtrDestroyAccelerationStructure(device_.handle, top, nullptr);
    if (heap) rtrDestroyHeap(device_.handle, heap, nullptr);
}

VkDescriptorBufferInfo RtcScene::descriptor() const {
    VkDescriptorBufferInfo info{};
    device_.check(rtrGetAccelerationStructureDescriptor(device_.handle, top, &info),
                  "rtrGetAccelerationStructureDescriptor");
    return info;
}

std::vector<uint32_t> RtcScene::top_words() const {
    const Buffer read(device_.context, top_size_, VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryKind::Readback);
    device_.context.run([&](VkCommandBuffer commands) {
        const VkBufferCopy copy{top_offset_, 0, top_size_};
        vkCmdCopyBuffer(commands, memory_.handle, read.handle, 1, &copy);
        full_barrier(commands);
    });
    std::vector<uint32_t> words(top_size_ / sizeof(uint32_t));
    std::memcpy(words.data(), read.mapped, words.size() * sizeof(uint32_t));
    return words;
}

}  // namespace rtc::tools
