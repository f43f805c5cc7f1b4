#include <algorithm>

#include "build_subject.h"
#include "error.h"

namespace rtc::bench {
namespace {

using tools::Buffer;
using tools::MemoryKind;

constexpr VkDeviceSize kAlign = 256;

VkDeviceSize required(RtrDevice device, RtrAccelerationStructure structure,
                      VkAccelerationStructureMemoryRequirementsTypeNV type) {
    VkMemoryRequirements2 needed{VK_STRUCTURE_TYPE_MEMORY_REQUIREMENTS_2, nullptr, {}};
    rtrGetAccelerationStructureMemoryRequirements(device, type, structure, &needed);
    return (needed.memoryRequirements.size + kAlign - 1) / kAlign * kAlign;
}

class RtcSubject final : public BuildSubject {
  public:
    RtcSubject(const tools::RtcDevice& device, const BuildInput& input) : BuildSubject("rtc"), device_(device) {
        const tools::Context& context = device.context;
        positions_ = upload_vector(context, input.mesh.positions, RTR_INPUT_BUFFER_USAGE);
        indices_ = upload_vector(context, input.mesh.indices, RTR_INPUT_BUFFER_USAGE);
        geometry_ = mesh_geometry(input.mesh, positions_.handle, indices_.handle);

        info_.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV;
        info_.flags = input.fast_build ? VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_BUILD_BIT_NV
                                       : VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_NV;
        if (input.low_memory) info_.flags |= VK_BUILD_ACCELERATION_STRUCTURE_LOW_MEMORY_BIT_NV;
        if (input.allow_update) info_.flags |= VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV;
        info_.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
        info_.geometryCount = 1;
        info_.pGeometries = &geometry_;
        for (uint32_t i = 0; i < input.copies; ++i) structures_.push_back(create());
        together_ = input.together;
        copies_ = input.copies;
        if (!input.instances.empty()) {
            bottom_info_ = info_;
            info_.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
            info_.geometryCount = 0;
            info_.pGeometries = nullptr;
            info_.instanceCount = uint32_t(input.instances.size());
            structures_.push_back(create());
        }
        bind();
        RtrRecorderCreateInfo recorder_info{};
        device.check(rtrCreateRecorder(device.handle, &recorder_info, nullptr, &recorder_), "rtrCreateRecorder");
        context.run([&](VkCommandBuffer commands) {
            device.check(rtrBeginRecorder(recorder_, commands), "rtrBeginRecorder");
            device.check(rtrCmdInitializeHeap(recorder_, heap_), "rtrCmdInitializeHeap");
            if (info_.type == VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV)
                device.check(rtrCmdBuildAccelerationStructure(recorder_, &bottom_info_, VK_NULL_HANDLE, 0, VK_FALSE,
                                                              structures_[0], nullptr, scratch_.handle, 0),
                             "rtrCmdBuildAccelerationStructure");
        });
        if (!input.instances.empty()) upload_instances(input);
    }

    ~RtcSubject() override {
        rtrDestroyRecorder(device_.handle, recorder_, nullptr);
        for (RtrAccelerationStructure structure : structures_)
            rtrDestroyAccelerationStructure(device_.handle, structure, nullptr);
        rtrDestroyHeap(device_.handle, heap_, nullptr);
    }

    void record_build(VkCommandBuffer commands) override { record(commands, VK_FALSE); }
    void record_update(VkCommandBuffer commands) override { record(commands, VK_TRUE); }

    VkDeviceSize compacted_bytes() override {
        Buffer result(device_.context, 256, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, MemoryKind::Readback);
        const RtrAccelerationStructure measured = structures_.back();
        device_.context.run([&](VkCommandBuffer commands) {
            device_.check(rtrBeginRecorder(recorder_, commands), "rtrBeginRecorder");
            device_.check(rtrCmdWriteAccelerationStructuresProperties(
                              recorder_, 1, &measured, VK_QUERY_TYPE_ACCELERATION_STRUCTURE_COMPACTED_SIZE_NV,
                              result.handle, 0),
                          "rtrCmdWriteAccelerationStructuresProperties");
            tools::full_barrier(commands);
        });
        retire();
        return *static_cast<const uint64_t*>(result.mapped);
    }

  private:
    RtrAccelerationStructure create() {
        VkAccelerationStructureCreateInfoNV create_info{};
        create_info.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_NV;
        create_info.info = info_;
        RtrAccelerationStructure structure = nullptr;
        device_.check(rtrCreateAccelerationStructure(device_.handle, &create_info, nullptr, &structure),
                      "rtrCreateAccelerationStructure");
        return structure;
    }

    void bind() {
        VkDeviceSize heap_size = kAlign, scratch_size = 0;
        std::vector<VkDeviceSize> offsets;
        for (RtrAccelerationStructure structure : structures_) {
            offsets.push_back(heap_size);
            bytes = required(device_.handle, structure, VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_OBJECT_NV);
            heap_size += bytes;
            scratch_bytes = required(device_.handle, structure,
                                     VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_BUILD_SCRATCH_NV);
            update_scratch_bytes = required(device_.handle, structure,
                                            VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_UPDATE_SCRATCH_NV);
            scratch_size = std::max({scratch_size, scratch_bytes, update_scratch_bytes});
        }
        scratch_stride_ = scratch_size;
        scratch_ = Buffer(device_.context, scratch_size * copies_, RTR_SCRATCH_BUFFER_USAGE, MemoryKind::Device);
        heap_buffer_ = Buffer(device_.context, heap_size + kAlign, RTR_HEAP_BUFFER_USAGE, MemoryKind::Device);
        RtrHeapCreateInfo heap_info{};
        heap_info.buffer = heap_buffer_.handle;
        heap_info.size = heap_size;
        device_.check(rtrCreateHeap(device_.handle, &heap_info, nullptr, &heap_), "rtrCreateHeap");
        for (size_t i = 0; i < structures_.size(); ++i) {
            RtrBindAccelerationStructureMemoryInfo bind_info{};
            bind_info.accelerationStructure = structures_[i];
            bind_info.heap = heap_;
            bind_info.heapOffset = offsets[i];
            device_.check(rtrBindAccelerationStructureMemory(device_.handle, 1, &bind_info),
                          "rtrBindAccelerationStructureMemory");
        }
    }

    void upload_instances(const BuildInput& input) {
        retire();
        uint64_t reference = 0;
        device_.check(
            rtrGetAccelerationStructureHandle(device_.handle, structures_[0], sizeof reference, &reference),
            "rtrGetAccelerationStructureHandle");
        std::vector<VkAccelerationStructureInstanceNV> instances;
        for (const glm::mat4& transform : input.instances) {
            VkAccelerationStructureInstanceNV instance{};
            for (int row = 0; row < 3; ++row)
                for (int column = 0; column < 4; ++column)
                    instance.transform.matrix[row][column] = transform[column][row];
            instance.mask = 0xff;
            instance.accelerationStructureReference = reference;
            instances.push_back(instance);
        }
        instances_ = upload_vector(device_.context, instances, RTR_INPUT_BUFFER_USAGE);
    }

    void record(VkCommandBuffer commands, VkBool32 update) {
        retire();
        device_.check(rtrBeginRecorder(recorder_, commands), "rtrBeginRecorder");
        std::vector<RtrAccelerationStructureBuildInfo> builds;
        for (uint32_t i = 0; i < copies_; ++i) {
            RtrAccelerationStructureBuildInfo build{};
            build.pInfo = &info_;
            build.instanceData = instances_.handle;
            build.update = update;
            build.dst = copies_ > 1 ? structures_[i] : structures_.back();
            build.scratch = scratch_.handle;
            build.scratchOffset = i * scratch_stride_;
            builds.push_back(build);
        }
        const uint32_t each = together_ ? copies_ : 1;
        for (uint32_t i = 0; i < copies_; i += each)
            device_.check(rtrCmdBuildAccelerationStructures(recorder_, each, &builds[i]),
                          "rtrCmdBuildAccelerationStructures");
    }

    // Everything recorded before has been waited for.
    void retire() { device_.check(rtrRetireRecorder(recorder_), "rtrRetireRecorder"); }

    const tools::RtcDevice& device_;
    Buffer positions_, indices_, instances_, scratch_, heap_buffer_;
    VkGeometryNV geometry_{};
    VkAccelerationStructureInfoNV info_{}, bottom_info_{};
    std::vector<RtrAccelerationStructure> structures_;
    VkDeviceSize scratch_stride_ = 0;
    uint32_t copies_ = 1;
    bool together_ = false;
    RtrHeap heap_ = nullptr;
    RtrRecorder recorder_ = nullptr;
};

}  // namespace

std::unique_ptr<BuildSubject> make_rtc_subject(const tools::RtcDevice& device, const BuildInput& input) {
    return std::make_unique<RtcSubject>(device, input);
}

}  // namespace rtc::bench
