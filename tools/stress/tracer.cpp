#include "tracer.h"

#include <rtc/compiler.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>

#include "error.h"
#include "shaders.h"

namespace rtc::stress {

using tools::Buffer;
using tools::Error;
using tools::MemoryKind;

namespace {

VKAPI_ATTR VkBool32 VKAPI_CALL collect(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                       VkDebugUtilsMessageTypeFlagsEXT,
                                       const VkDebugUtilsMessengerCallbackDataEXT* data, void* user) {
    *static_cast<std::string*>(user) += std::string(data->pMessage) + "\n";
    return VK_FALSE;
}

std::vector<uint32_t> compile(bool addresses) {
    rtcc_compiler_t compiler = rtcc_compiler_create();
    rtcc_pipeline_t pipeline = rtcc_pipeline_create();
    rtcc_options_t options = rtcc_options_create();
    rtcc_options_set_optimization(options, RTCC_OPTIMIZATION_PERFORMANCE);
    rtcc_options_set_addressing(options, addresses ? RTCC_ADDRESSING_ADDRESS : RTCC_ADDRESSING_HEAP);
    auto add = [&](rtcc_stage stage, const char* name, const std::string& text) {
        return rtcc_pipeline_add_glsl(pipeline, stage, name, name, text.data(), text.size());
    };
    const std::string common = kCommon, hit = common + kHitCommon;
    const int32_t raygen = add(RTCC_STAGE_RAYGEN, "stress.rgen", common + kRaygen);
    const int32_t miss = add(RTCC_STAGE_MISS, "stress.rmiss", common + kMiss);
    const int32_t closest = add(RTCC_STAGE_CLOSEST_HIT, "stress.rchit", hit + kClosestHit);
    const int32_t any = add(RTCC_STAGE_ANY_HIT, "stress.rahit", hit + kAnyHit);
    const int32_t intersection = add(RTCC_STAGE_INTERSECTION, "stress.rint", hit + kIntersection);
    rtcc_pipeline_add_general_group(pipeline, "raygen", raygen);
    rtcc_pipeline_add_general_group(pipeline, "miss", miss);
    rtcc_pipeline_add_hit_group(pipeline, "triangles", closest, any, -1);
    rtcc_pipeline_add_hit_group(pipeline, "boxes", closest, any, intersection);
    rtcc_result_t result = rtcc_compile_pipeline(compiler, pipeline, options);
    const std::string messages = rtcc_result_messages(result);
    const uint32_t* first = rtcc_result_words(result);
    std::vector<uint32_t> words;
    if (first) words.assign(first, first + rtcc_result_word_count(result));
    rtcc_result_release(result);
    rtcc_options_release(options);
    rtcc_pipeline_release(pipeline);
    rtcc_compiler_release(compiler);
    if (words.empty()) throw Error("the pipeline does not compile:\n" + messages);
    return words;
}

// A ray may meet a hundred thousand instances that lie on each other: launches that run out of rounds begin anew with
// more.
constexpr uint32_t kRounds = 512, kMostRounds = 1u << 17;

}  // namespace

// Each block is preceded by its size and the pointer malloc gave.
void* VKAPI_CALL Device::allocate(void* user, size_t size, size_t alignment, VkSystemAllocationScope) {
    alignment = std::max(alignment, alignof(std::max_align_t));
    char* raw = static_cast<char*>(std::malloc(size + alignment + 2 * sizeof(size_t)));
    if (!raw) return nullptr;
    uintptr_t at =
        (reinterpret_cast<uintptr_t>(raw) + 2 * sizeof(size_t) + alignment - 1) / alignment * alignment;
    void* header[2] = {raw, reinterpret_cast<void*>(size)};
    std::memcpy(reinterpret_cast<char*>(at) - sizeof header, header, sizeof header);
    __atomic_add_fetch(static_cast<long long*>(user), 1, __ATOMIC_RELAXED);
    return reinterpret_cast<void*>(at);
}

void VKAPI_CALL Device::release(void* user, void* memory) {
    if (!memory) return;
    void* header[2];
    std::memcpy(header, static_cast<char*>(memory) - sizeof header, sizeof header);
    std::free(header[0]);
    __atomic_sub_fetch(static_cast<long long*>(user), 1, __ATOMIC_RELAXED);
}

void* VKAPI_CALL Device::reallocate(void* user, void* old, size_t size, size_t alignment,
                                    VkSystemAllocationScope scope) {
    if (size == 0) {
        release(user, old);
        return nullptr;
    }
    void* fresh = allocate(user, size, alignment, scope);
    if (fresh && old) {
        void* header[2];
        std::memcpy(header, static_cast<char*>(old) - sizeof header, sizeof header);
        std::memcpy(fresh, old, std::min(size, reinterpret_cast<size_t>(header[1])));
        release(user, old);
    }
    return fresh;
}

Device::Device(const tools::Context& c, bool use_addresses, uint32_t budget)
    : context(c), addresses(use_addresses), step_budget(budget) {
    tools::check(rtrGetPhysicalDeviceSupport(c.instance, c.physical, vkGetInstanceProcAddr, &support),
                 "rtrGetPhysicalDeviceSupport");
    if (step_budget == RTR_DEFAULT) {
        step_budget = support.recommended.stepBudget ? support.recommended.stepBudget : kStepBudget;
    }
    callbacks_ = {&live_, allocate, reallocate, release, nullptr, nullptr};
    VkDebugUtilsMessengerCreateInfoEXT messenger{VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT};
    messenger.messageSeverity =
        VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
    messenger.messageType =
        VK_DEBUG_UTILS_MESSAGE_TYPE_GENERAL_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT;
    messenger.pfnUserCallback = collect;
    messenger.pUserData = &messages;
    RtrDeviceCreateInfo info{};
    info.instance = c.instance;
    info.physicalDevice = c.physical;
    info.device = c.device;
    info.pfnGetInstanceProcAddr = vkGetInstanceProcAddr;
    info.pMessenger = &messenger;
    info.bufferDeviceAddress = addresses;
    check(rtrCreateDevice(&info, &callbacks_, &handle), "rtrCreateDevice");
}

Device::~Device() { close(); }

long long Device::close() {
    if (handle) rtrDestroyDevice(handle, &callbacks_);
    handle = nullptr;
    return live_;
}

void Device::check(VkResult result, const char* call) {
    if (result == VK_SUCCESS) return;
    throw Error(std::string(call) + ": " + tools::result_name(result) + "\n" + messages);
}

Tracer::Tracer(Device& device) : device_(device) {
    const tools::Context& context = device.context;
    VkDescriptorSetLayoutBinding bindings[4];
    for (uint32_t i = 0; i < 4; ++i)
        bindings[i] = {i, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr};
    VkDescriptorSetLayoutCreateInfo layout{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO};
    layout.bindingCount = 4;
    layout.pBindings = bindings;
    tools::check(vkCreateDescriptorSetLayout(context.device, &layout, nullptr, &layout_),
                 "vkCreateDescriptorSetLayout");
    const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 4};
    VkDescriptorPoolCreateInfo pool{VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO};
    pool.maxSets = pool.poolSizeCount = 1;
    pool.pPoolSizes = &size;
    tools::check(vkCreateDescriptorPool(context.device, &pool, nullptr, &pool_), "vkCreateDescriptorPool");
    VkDescriptorSetAllocateInfo allocation{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO};
    allocation.descriptorPool = pool_;
    allocation.descriptorSetCount = 1;
    allocation.pSetLayouts = &layout_;
    tools::check(vkAllocateDescriptorSets(context.device, &allocation, &set_), "vkAllocateDescriptorSets");

    const std::vector<uint32_t> words = compile(device.addresses);
    RtrTraceOptions options = RTR_TRACE_OPTIONS_DEFAULT;
    options.stepBudget = device.step_budget;
    RtrRayTracingPipelineCreateInfo info{};
    info.pOptions = &options;
    info.pCode = words.data();
    info.codeSize = words.size() * 4;
    info.setLayoutCount = 1;
    info.pSetLayouts = &layout_;
    device.check(rtrCreateRayTracingPipeline(device.handle, VK_NULL_HANDLE, &info, nullptr, &pipeline_),
                 "rtrCreateRayTracingPipeline");

    const VkDeviceSize scratch = rtrGetLaunchScratchSize(device.handle, pipeline_, kMostRays, 1, 1, nullptr);
    if (scratch) scratch_ = Buffer(context, scratch, RTR_LAUNCH_SCRATCH_BUFFER_USAGE, MemoryKind::Device);
    make_recorder(kRounds);
}

void Tracer::make_recorder(uint32_t rounds) {
    if (recorder_) rtrDestroyRecorder(device_.handle, recorder_, nullptr);
    recorder_ = nullptr;
    rounds_ = rounds;
    const uint32_t tiles = rtrGetLaunchTileCount(device_.handle, pipeline_, kMostRays, 1, 1, scratch_.size, 0);
    const VkDeviceSize control = rtrGetRecorderControlSize(device_.handle, 1, tiles, rounds);
    control_ = Buffer(device_.context, control, RTR_CONTROL_BUFFER_USAGE, MemoryKind::Host);
    RtrRecorderCreateInfo info{};
    info.controlBuffer = control_.handle;
    info.controlSize = control;
    device_.check(rtrCreateRecorder(device_.handle, &info, nullptr, &recorder_), "rtrCreateRecorder");
}

Tracer::~Tracer() {
    rtrDestroyRecorder(device_.handle, recorder_, nullptr);
    rtrDestroyPipeline(device_.handle, pipeline_, nullptr);
    vkDestroyDescriptorPool(device_.context.device, pool_, nullptr);
    vkDestroyDescriptorSetLayout(device_.context.device, layout_, nullptr);
}

std::vector<Hit> Tracer::trace(RtrHeap heap, RtrAccelerationStructure top,
                               const std::vector<HitRecord>& records, const std::vector<float>& boxes,
                               const std::vector<Ray>& rays) {
    const tools::Context& context = device_.context;
    const RtrSbtRecord raygen{0, 0, nullptr}, miss{1, 0, nullptr};
    std::vector<RtrSbtRecord> hit;
    for (const HitRecord& r : records) hit.push_back({r.boxes ? 3u : 2u, 8, &r.id});
    RtrSbtInfo sbt{};
    sbt.raygenCount = sbt.missCount = 1;
    sbt.pRaygen = &raygen;
    sbt.pMiss = &miss;
    sbt.hitCount = uint32_t(hit.size());
    sbt.pHit = hit.data();
    RtrSbtLayout at{};
    device_.check(rtrGetSbtLayout(device_.handle, &sbt, &at), "rtrGetSbtLayout");
    Buffer table(context, at.size, RTR_INPUT_BUFFER_USAGE, MemoryKind::Host);
    device_.check(rtrWriteSbt(device_.handle, pipeline_, &sbt, &at, table.mapped), "rtrWriteSbt");

    const VkBufferUsageFlags storage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
    Buffer ray_buffer(context, rays.size() * sizeof(Ray), storage, MemoryKind::Host);
    Buffer hit_buffer(context, rays.size() * sizeof(Hit), storage, MemoryKind::Readback);
    Buffer box_buffer(context, boxes.size() * 4 + 32, storage, MemoryKind::Host);
    std::memcpy(ray_buffer.mapped, rays.data(), rays.size() * sizeof(Ray));
    std::memset(hit_buffer.mapped, 0xee, rays.size() * sizeof(Hit));
    std::memcpy(box_buffer.mapped, boxes.data(), boxes.size() * 4);
    VkDescriptorBufferInfo infos[4] = {{},
                                       {ray_buffer.handle, 0, VK_WHOLE_SIZE},
                                       {hit_buffer.handle, 0, VK_WHOLE_SIZE},
                                       {box_buffer.handle, 0, VK_WHOLE_SIZE}};
    device_.check(rtrGetAccelerationStructureDescriptor(device_.handle, top, &infos[0]),
                  "rtrGetAccelerationStructureDescriptor");
    VkWriteDescriptorSet write{VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
    write.dstSet = set_;
    write.descriptorCount = 4;  // consecutive bindings of one kind
    write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    write.pBufferInfo = infos;
    vkUpdateDescriptorSets(context.device, 1, &write, 0, nullptr);

    for (bool finished = false; !finished;) {
        context.run([&](VkCommandBuffer commands) {
            device_.check(rtrBeginRecorder(recorder_, commands), "rtrBeginRecorder");
            if (heap) device_.check(rtrCmdSetHeap(recorder_, heap), "rtrCmdSetHeap");
            device_.check(rtrCmdSetLaunchLimits(recorder_, 0, rounds_), "rtrCmdSetLaunchLimits");
            if (scratch_.handle)
                device_.check(rtrCmdSetLaunchScratch(recorder_, scratch_.handle, 0, scratch_.size),
                              "rtrCmdSetLaunchScratch");
            device_.check(rtrCmdBindPipeline(recorder_, pipeline_), "rtrCmdBindPipeline");
            device_.check(rtrCmdBindDescriptorSets(recorder_, 0, 1, &set_, 0, nullptr),
                          "rtrCmdBindDescriptorSets");
            device_.check(
                rtrCmdTraceRays(recorder_, table.handle, at.raygen.offset, table.handle, at.miss.offset,
                                at.miss.stride, hit.empty() ? VK_NULL_HANDLE : table.handle, at.hit.offset,
                                at.hit.stride, VK_NULL_HANDLE, 0, 0, uint32_t(rays.size()), 1, 1),
                "rtrCmdTraceRays");
            tools::full_barrier(commands);
        });
        RtrLaunchError problem{};
        finished = rtrGetLaunchError(recorder_, 0, control_.mapped, &problem) == VK_SUCCESS;
        if (!finished && (problem.code != RTC_LAUNCH_ERROR_UNFINISHED || rounds_ >= kMostRounds)) {
            char text[256];
            rtrFormatLaunchError(&problem, text, sizeof text);
            throw Error(std::string("launch error: ") + text);
        }
        if (!finished) {
            device_.messages.clear();
            device_.check(rtrRetireRecorder(recorder_), "rtrRetireRecorder");
            make_recorder(rounds_ * 8);
        }
    }
    device_.check(rtrRetireRecorder(recorder_), "rtrRetireRecorder");
    std::vector<Hit> hits(rays.size());
    std::memcpy(hits.data(), hit_buffer.mapped, hits.size() * sizeof(Hit));
    return hits;
}

}  // namespace rtc::stress
