#include <algorithm>
#include <chrono>
#include <cstring>
#include <string_view>

#include "error.h"
#include "pipeline_statistics.h"
#include "rtc_device.h"

namespace rtc::tools {
namespace {

// Suspended lanes of this many bytes at most; larger launches go in tiles.
constexpr VkDeviceSize kScratchLimit = 96u << 20;
constexpr uint32_t kRounds = 64;  // the runtime's default
// Exact decisions take long: a lane may need one round for every few of them.
constexpr uint32_t kExactRounds = 2048;

std::vector<RtrSbtRecord> convert(const std::vector<JobRecord>& records) {
    std::vector<RtrSbtRecord> converted;
    for (const JobRecord& record : records)
        converted.push_back({record.group == ~0u ? RTR_NULL_GROUP : record.group,
                             uint32_t(record.data.size()), record.data.data()});
    return converted;
}

// The module's own bindings when they are in one of the job's sets (rtc --reserved=SET.BINDING).
ExtraBindings bindings_inside(const RtcDevice& device, const RayTracingJob& job,
                                              const std::vector<uint32_t>& module) {
    ExtraBindings extra;
    const size_t bytes = module.size() * sizeof(uint32_t);
    uint32_t count = 0;
    device.check(rtrGetReservedBindings(device.handle, module.data(), bytes, &extra.set, &count, nullptr),
                 "rtrGetReservedBindings");
    bool inside = false;
    for (const JobBinding& binding : job.bindings) inside = inside || binding.set >= extra.set;
    if (!inside) return extra;
    extra.bindings.resize(count);
    device.check(rtrGetReservedBindings(device.handle, module.data(), bytes, &extra.set, &count,
                                        extra.bindings.data()),
                 "rtrGetReservedBindings");
    return extra;
}

}  // namespace

RtcLauncher::RtcLauncher(const RtcDevice& device, const RtcScene& scene, const RayTracingJob& job,
                         const std::vector<uint32_t>& module, const RtrTraceOptions* options)
    : device_(device), extent_{job.width, job.height, job.depth} {
    descriptors_ = std::make_unique<JobDescriptors>(
        device.context, job.bindings, VK_SHADER_STAGE_COMPUTE_BIT, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER,
        [&](VkDescriptorSet set, uint32_t binding, uint32_t element) {
            structures_.push_back({set, binding, element});
            write_structure(scene, set, binding, element);
        },
        bindings_inside(device, job, module));
    const auto start = std::chrono::steady_clock::now();
    VkPushConstantRange range{VK_SHADER_STAGE_COMPUTE_BIT, 0, uint32_t(job.push_constants.size())};
    RtrRayTracingPipelineCreateInfo info{};
    info.pCode = module.data();
    info.codeSize = module.size() * sizeof(uint32_t);
    info.setLayoutCount = uint32_t(descriptors_->layouts.size());
    info.pSetLayouts = descriptors_->layouts.data();
    info.pushConstantRangeCount = range.size ? 1 : 0;
    info.pPushConstantRanges = &range;
    info.pOptions = options;
    info.flags = statistics_flag(device.context);
    device.check(rtrCreateRayTracingPipeline(device.handle, VK_NULL_HANDLE, &info, nullptr, &pipeline_),
                 "rtrCreateRayTracingPipeline");
    create_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    make_table(job.table);
    heap_ = scene.heap;
    make_recorder();
}

RtcLauncher::~RtcLauncher() {
    rtrDestroyRecorder(device_.handle, recorder_, nullptr);
    rtrDestroyPipeline(device_.handle, pipeline_, nullptr);
}

void RtcLauncher::make_table(const JobTable& table) {
    const std::vector<RtrSbtRecord> raygen = convert(table.raygen), miss = convert(table.miss),
                                    hit = convert(table.hit), callable = convert(table.callable);
    const RtrSbtInfo info{uint32_t(raygen.size()), raygen.data(), uint32_t(miss.size()),     miss.data(),
                          uint32_t(hit.size()),    hit.data(),    uint32_t(callable.size()), callable.data()};
    device_.check(rtrGetSbtLayout(device_.handle, &info, &table_layout_), "rtrGetSbtLayout");
    std::vector<uint8_t> bytes(table_layout_.size);
    device_.check(rtrWriteSbt(device_.handle, pipeline_, &info, &table_layout_, bytes.data()), "rtrWriteSbt");
    table_ = upload_vector(device_.context, bytes, RTR_INPUT_BUFFER_USAGE);
    raygen_offset_ = table_layout_.raygen.offset + table.raygen_index * table_layout_.raygen.stride;
}

void RtcLauncher::make_recorder() {
    VkDeviceSize minimum = 0;
    const VkDeviceSize full = rtrGetLaunchScratchSize(device_.handle, pipeline_, extent_.width,
                                                      extent_.height, extent_.depth, &minimum);
    uint32_t tiles = 1;
    if (full) {
        const VkDeviceSize size = std::max(minimum, std::min(full, kScratchLimit));
        scratch_ = Buffer(device_.context, size, RTR_LAUNCH_SCRATCH_BUFFER_USAGE, MemoryKind::Device);
        tiles = std::max(1u, rtrGetLaunchTileCount(device_.handle, pipeline_, extent_.width, extent_.height,
                                                   extent_.depth, size, 0));
    }
    const RtrPipelineInfo pipeline = info();
    const std::string_view reflection(pipeline.pReflectionJson ? pipeline.pReflectionJson : "",
                                      pipeline.reflectionJsonSize);
    const bool exact = reflection.find("\"accuracy\":\"exact") != std::string_view::npos;
    rounds_ = !(pipeline.moduleFlags & RTC_MODULE_RESUMABLE) ? 1 : (exact ? kExactRounds : kRounds);
    const VkDeviceSize control_size = rtrGetRecorderControlSize(device_.handle, kLaunches, tiles, rounds_);
    control_ = Buffer(device_.context, control_size, RTR_CONTROL_BUFFER_USAGE, MemoryKind::Shared);
    RtrRecorderCreateInfo recorderInfo{};
    recorderInfo.controlBuffer = control_.handle;
    recorderInfo.controlSize = control_size;
    device_.check(rtrCreateRecorder(device_.handle, &recorderInfo, nullptr, &recorder_), "rtrCreateRecorder");
    write_reserved();
}

void RtcLauncher::write_structure(const RtcScene& scene, VkDescriptorSet set, uint32_t binding,
                                  uint32_t element) const {
    const VkDescriptorBufferInfo structure = scene.descriptor();
    VkWriteDescriptorSet write{};
    write.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
    write.dstSet = set;
    write.dstBinding = binding;
    write.dstArrayElement = element;
    write.descriptorCount = 1;
    write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    write.pBufferInfo = &structure;
    vkUpdateDescriptorSets(device_.context.device, 1, &write, 0, nullptr);
}

void RtcLauncher::write_reserved() const {
    if (!info().reservedInAppSet) return;
    RtrReservedDescriptors reserved{};
    reserved.heap = heap_;
    reserved.recorder = recorder_;
    reserved.raygenBuffer = reserved.missBuffer = reserved.hitBuffer = reserved.callableBuffer = table_.handle;
    reserved.launchScratch = scratch_.handle;
    reserved.launchScratchSize = scratch_.size;
    device_.check(rtrWriteReservedDescriptors(device_.handle, pipeline_, descriptors_->sets.at(info().reservedSet),
                                              &reserved),
                  "rtrWriteReservedDescriptors");
}

void RtcLauncher::use_scene(const RtcScene& scene) {
    heap_ = scene.heap;
    for (const StructurePlace& place : structures_)
        write_structure(scene, place.set, place.binding, place.element);
    write_reserved();
}

void RtcLauncher::record(VkCommandBuffer commands, const std::vector<uint8_t>& push_constants) {
    if (commands != recording_) {
        device_.check(rtrBeginRecorder(recorder_, commands), "rtrBeginRecorder");
        if (heap_) device_.check(rtrCmdSetHeap(recorder_, heap_), "rtrCmdSetHeap");
        if (scratch_.handle)
            device_.check(rtrCmdSetLaunchScratch(recorder_, scratch_.handle, 0, scratch_.size),
                          "rtrCmdSetLaunchScratch");
        device_.check(rtrCmdSetLaunchLimits(recorder_, 0, rounds_), "rtrCmdSetLaunchLimits");
        device_.check(rtrCmdBindPipeline(recorder_, pipeline_), "rtrCmdBindPipeline");
        // A set that holds the module's own bindings is the last of its bind call.
        const uint32_t count = uint32_t(descriptors_->sets.size());
        const uint32_t split = info().reservedInAppSet ? info().reservedSet + 1 : count;
        for (const auto& [first, end] : {std::pair(0u, split), std::pair(split, count)})
            if (end > first)
                device_.check(rtrCmdBindDescriptorSets(recorder_, first, end - first,
                                                       &descriptors_->sets[first], 0, nullptr),
                              "rtrCmdBindDescriptorSets");
        recording_ = commands;
    }
    if (!push_constants.empty())
        device_.check(
            rtrCmdPushConstants(recorder_, 0, uint32_t(push_constants.size()), push_constants.data()),
            "rtrCmdPushConstants");
    auto region = [&](const RtrSbtRegion& part) {
        return RtrStridedBufferRegion{part.size ? table_.handle : VK_NULL_HANDLE, part.offset, part.stride,
                                      part.size};
    };
    RtrStridedBufferRegion raygen = region(table_layout_.raygen);
    raygen.offset = raygen_offset_;
    raygen.size = raygen.stride;
    const RtrStridedBufferRegion miss = region(table_layout_.miss), hit = region(table_layout_.hit),
                                 callable = region(table_layout_.callable);
    device_.check(rtrCmdTraceRaysRegions(recorder_, &raygen, &miss, &hit, &callable, extent_.width,
                                         extent_.height, extent_.depth),
                  "rtrCmdTraceRaysRegions");
    full_barrier(commands);
}

void RtcLauncher::finish() {
    for (uint32_t launch = 0; launch < rtrGetLaunchCount(recorder_); ++launch) {
        RtrLaunchError problem{};
        if (rtrGetLaunchError(recorder_, launch, control_.mapped, &problem) == VK_SUCCESS) continue;
        char text[256];
        rtrFormatLaunchError(&problem, text, sizeof text);
        throw Error(std::string("launch ") + std::to_string(launch) + ": " + text);
    }
    device_.check(rtrRetireRecorder(recorder_), "rtrRetireRecorder");
    recording_ = VK_NULL_HANDLE;
}

RtrPipelineInfo RtcLauncher::info() const {
    RtrPipelineInfo info{};
    rtrGetPipelineInfo(pipeline_, &info);
    return info;
}

}  // namespace rtc::tools
