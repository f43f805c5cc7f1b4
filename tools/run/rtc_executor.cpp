#include "rtc_executor.h"

#ifdef RTC_RUN_HAS_RTC
#include <rtc/compiler.h>
#include <rtc/runtime.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <map>
#include <fstream>

#include "pipeline_statistics.h"

namespace rtc::run {
namespace {

using native::Buffer;
using native::Context;
using native::Error;
using native::Executor;
using tools::MemoryKind;

const char* launch_error_name(uint32_t code) {
    switch (code) {
        case RTC_LAUNCH_ERROR_RECURSION_DEPTH:
            return "recursion-depth";
        case RTC_LAUNCH_ERROR_CALLABLE_DEPTH:
            return "callable-depth";
        case RTC_LAUNCH_ERROR_BAD_HANDLE:
            return "bad-handle";
        case RTC_LAUNCH_ERROR_ABI:
            return "abi";
        case RTC_LAUNCH_ERROR_ASSUMPTION:
            return "assumption";
        case RTC_LAUNCH_ERROR_UNFINISHED:
            return "unfinished";
        case RTC_LAUNCH_ERROR_STACK:
            return "stack";
        case RTC_LAUNCH_ERROR_BAD_INSTANCE:
            return "bad-instance";
        case RTC_LAUNCH_ERROR_HEAP:
            return "heap";
        default:
            return "unknown";
    }
}

rtcc_stage stage_of(tools::JobStage stage) {
    switch (stage) {
        case tools::JobStage::RayGen:
            return RTCC_STAGE_RAYGEN;
        case tools::JobStage::Intersection:
            return RTCC_STAGE_INTERSECTION;
        case tools::JobStage::AnyHit:
            return RTCC_STAGE_ANY_HIT;
        case tools::JobStage::ClosestHit:
            return RTCC_STAGE_CLOSEST_HIT;
        case tools::JobStage::Miss:
            return RTCC_STAGE_MISS;
        case tools::JobStage::Callable:
            return RTCC_STAGE_CALLABLE;
    }
    return RTCC_STAGE_AUTO;
}

// The C library's objects, released on any way out.
template <typename T, void (*release)(T)>
struct Owned {
    T value;
    explicit Owned(T v) : value(v) {}
    ~Owned() { release(value); }
    Owned(const Owned&) = delete;
    Owned& operator=(const Owned&) = delete;
    operator T() const { return value; }
};

class RtcExecutor final : public Executor {
  public:
    RtcExecutor(RtcDevice& device, const RtcOptions& options)
        : context_(device.context), options_(options), said_(device.said), device_(device.handle) {
        said_.clear();
        addresses_ = tools::by_address(context_, options.addressing, rtrGetDeviceSupport(device_)->recommendAddresses);
    }

    ~RtcExecutor() override {
        if (recorder_) rtrDestroyRecorder(device_, recorder_, nullptr);
        if (pipeline_) rtrDestroyPipeline(device_, pipeline_, nullptr);
        for (auto as : tops_) rtrDestroyAccelerationStructure(device_, as, nullptr);
        for (auto as : bottoms_) rtrDestroyAccelerationStructure(device_, as, nullptr);
        if (heap_) rtrDestroyHeap(device_, heap_, nullptr);
    }

    const char* name() const override { return "rtc"; }
    VkShaderStageFlags stages() const override { return VK_SHADER_STAGE_COMPUTE_BIT; }
    VkDescriptorType top_descriptor() const override { return VK_DESCRIPTOR_TYPE_STORAGE_BUFFER; }

    void build(const native::World& world) override {
        std::vector<std::unique_ptr<native::NvGeometries>> inputs;
        std::vector<VkAccelerationStructureInfoNV> infos;
        VkDeviceSize memory_size = 4096, scratch_size = 256;
        auto create = [&](const VkAccelerationStructureInfoNV& info,
                          std::vector<RtrAccelerationStructure>& out) {
            VkAccelerationStructureCreateInfoNV create_info{};
            create_info.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_NV;
            create_info.info = info;
            RtrAccelerationStructure as = nullptr;
            need(rtrCreateAccelerationStructure(device_, &create_info, nullptr, &as),
                 "rtrCreateAccelerationStructure");
            out.push_back(as);
            memory_size += size_of(as, VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_OBJECT_NV) + 256;
            scratch_size =
                std::max({scratch_size,
                          size_of(as, VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_BUILD_SCRATCH_NV),
                          size_of(as, VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_UPDATE_SCRATCH_NV)});
        };
        std::vector<std::unique_ptr<native::NvGeometries>> earlier;  // of structures that are updated
        for (const native::Bottom& bottom : world.bottoms) {
            native::Bottom before = bottom;
            before.geometries = bottom.built_from;
            earlier.push_back(
                bottom.built_from.empty()
                    ? nullptr
                    : std::make_unique<native::NvGeometries>(context_, before, RTR_INPUT_BUFFER_USAGE));
            inputs.push_back(
                std::make_unique<native::NvGeometries>(context_, bottom, RTR_INPUT_BUFFER_USAGE));
            VkAccelerationStructureInfoNV info{};
            info.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV;
            info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
            info.flags = bottom.flags;
            info.geometryCount = uint32_t(inputs.back()->geometries.size());
            info.pGeometries = inputs.back()->geometries.data();
            infos.push_back(info);
            create(info, bottoms_);
        }
        for (const native::Top& top : world.tops) {
            VkAccelerationStructureInfoNV info{};
            info.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV;
            info.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
            info.flags = VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_NV;
            info.instanceCount = uint32_t(top.instances.size());
            infos.push_back(info);
            create(info, tops_);
        }
        bind_memory(memory_size);
        Buffer scratch(context_, scratch_size, RTR_SCRATCH_BUFFER_USAGE, MemoryKind::Device);
        RtrRecorder recorder = nullptr;
        RtrRecorderCreateInfo recorder_info{};
        need(rtrCreateRecorder(device_, &recorder_info, nullptr, &recorder), "rtrCreateRecorder");
        auto one = [&](const VkAccelerationStructureInfoNV& info, RtrAccelerationStructure as,
                       VkBuffer instances, bool first, bool update = false) {
            context_.run([&](VkCommandBuffer commands) {
                need(rtrBeginRecorder(recorder, commands), "rtrBeginRecorder");
                if (first && heap_) need(rtrCmdInitializeHeap(recorder, heap_), "rtrCmdInitializeHeap");
                need(rtrCmdBuildAccelerationStructure(recorder, &info, instances, 0, update, as,
                                                      update ? as : nullptr, scratch.handle, 0),
                     "rtrCmdBuildAccelerationStructure");
                tools::full_barrier(commands);
            });
            need(rtrRetireRecorder(recorder), "rtrRetireRecorder");
        };
        try {
            for (size_t i = 0; i < bottoms_.size(); ++i) {
                if (earlier[i]) {
                    VkAccelerationStructureInfoNV info = infos[i];
                    info.pGeometries = earlier[i]->geometries.data();
                    one(info, bottoms_[i], VK_NULL_HANDLE, i == 0);
                }
                one(infos[i], bottoms_[i], VK_NULL_HANDLE, i == 0 && !earlier[i], earlier[i] != nullptr);
            }
            for (size_t t = 0; t < tops_.size(); ++t) {
                std::vector<VkAccelerationStructureInstanceKHR> instances;
                for (const native::Placement& placement : world.tops[t].instances) {
                    uint64_t handle = 0;
                    if (placement.bottom >= 0)
                        need(rtrGetAccelerationStructureHandle(device_, bottoms_.at(size_t(placement.bottom)),
                                                               sizeof(handle), &handle),
                             "rtrGetAccelerationStructureHandle");
                    instances.push_back(native::instance_of(placement, handle));
                }
                Buffer buffer(context_, instances.size() * sizeof(instances[0]), RTR_INPUT_BUFFER_USAGE,
                              MemoryKind::Host);
                if (!instances.empty())
                    std::memcpy(buffer.mapped, instances.data(), instances.size() * sizeof(instances[0]));
                one(infos[bottoms_.size() + t], tops_[t], buffer.handle, bottoms_.empty() && t == 0);
            }
        } catch (...) {
            rtrDestroyRecorder(device_, recorder, nullptr);
            throw;
        }
        rtrDestroyRecorder(device_, recorder, nullptr);
    }

    void create_pipeline(const tools::JobPipeline& pipeline,
                         const std::vector<VkDescriptorSetLayout>& set_layouts,
                         uint32_t push_bytes) override {
        compile(pipeline);
        VkPushConstantRange range{VK_SHADER_STAGE_COMPUTE_BIT, 0, push_bytes};
        RtrTraceOptions trace_options = RTR_TRACE_OPTIONS_DEFAULT;
        if (options_.step_budget) trace_options.stepBudget = options_.step_budget;
        if (options_.fetch >= 0) trace_options.fetch = RtrFetch(options_.fetch);
        RtrRayTracingPipelineCreateInfo info{};
        info.pCode = module_.data();
        info.codeSize = module_.size() * 4;
        info.setLayoutCount = uint32_t(set_layouts.size());
        info.pSetLayouts = set_layouts.data();
        info.pushConstantRangeCount = push_bytes ? 1 : 0;
        info.pPushConstantRanges = &range;
        info.pOptions = &trace_options;
        if (options_.statistics) info.flags = tools::statistics_flag(context_);
        VkResult made = rtrCreateRayTracingPipeline(device_, VK_NULL_HANDLE, &info, nullptr, &pipeline_);
        // Not a limit that the module exceeds, but something the shaders ask for by name.
        if (made == VK_ERROR_FEATURE_NOT_PRESENT && said_.find("the module needs the ") != std::string::npos)
            throw tools::MissingFeature("the device cannot run the module:" + said_);
        need(made, "rtrCreateRayTracingPipeline");
        group_count_ = uint32_t(pipeline.groups.size());
        if (options_.statistics) print_statistics();
    }

    void set_tables(const native::Tables& tables) override {
        std::vector<uint8_t> handles(size_t(group_count_) * RTC_HANDLE_BYTES);
        need(rtrGetRayTracingShaderGroupHandles(device_, pipeline_, 0, group_count_, handles.size(),
                                                handles.data()),
             "rtrGetRayTracingShaderGroupHandles");
        table_ = native::lay_out(tables, handles,
                                 {RTC_HANDLE_BYTES, RTC_SBT_HANDLE_ALIGNMENT, RTC_SBT_BASE_ALIGNMENT});
        table_buffer_ = Buffer(context_, table_.bytes.size(), RTR_INPUT_BUFFER_USAGE, MemoryKind::Host);
        std::memcpy(table_buffer_.mapped, table_.bytes.data(), table_.bytes.size());
    }

    // A module of heap mode could do nothing with it.
    VkDeviceAddress top_address(uint32_t top) const override {
        uint64_t handle = 0;
        if (addresses_ && rtrGetAccelerationStructureHandle(device_, tops_.at(top), sizeof handle, &handle) != VK_SUCCESS)
            throw Error("rtrGetAccelerationStructureHandle failed: " + said_);
        return handle;
    }

    void write_top(VkDescriptorSet set, uint32_t binding, uint32_t element, uint32_t top) override {
        VkDescriptorBufferInfo info{};
        if (top == ~0u && addresses_)
            info = {null_top().handle, 0, RTC_AS_HEADER_QUADS * RTC_QUAD_BYTES};
        else if (top == ~0u)
            need(rtrGetNullAccelerationStructureDescriptor(device_, heap_, &info),
                 "rtrGetNullAccelerationStructureDescriptor");
        else
            need(rtrGetAccelerationStructureDescriptor(device_, tops_.at(top), &info),
                 "rtrGetAccelerationStructureDescriptor");
        VkWriteDescriptorSet write{};
        write.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
        write.dstSet = set;
        write.dstBinding = binding;
        write.dstArrayElement = element;
        write.descriptorCount = 1;
        write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
        write.pBufferInfo = &info;
        vkUpdateDescriptorSets(context_.device, 1, &write, 0, nullptr);
    }

    void trace(VkCommandBuffer commands, const native::Launch& launch) override {
        if (!recorder_) {
            VkDeviceSize size = rtrGetRecorderControlSize(device_, 1, 4, options_.rounds ? options_.rounds : 64);
            control_ = Buffer(context_, size, RTR_CONTROL_BUFFER_USAGE, MemoryKind::Readback);
            RtrRecorderCreateInfo info{};
            info.controlBuffer = control_.handle;
            info.controlSize = size;
            need(rtrCreateRecorder(device_, &info, nullptr, &recorder_), "rtrCreateRecorder");
            VkDeviceSize scratch = rtrGetLaunchScratchSize(device_, pipeline_, launch.width, launch.height,
                                                           launch.depth, nullptr);
            if (scratch)
                scratch_ = Buffer(context_, scratch, RTR_LAUNCH_SCRATCH_BUFFER_USAGE, MemoryKind::Device);
        }
        need(rtrBeginRecorder(recorder_, commands), "rtrBeginRecorder");
        if (heap_) need(rtrCmdSetHeap(recorder_, heap_), "rtrCmdSetHeap");
        if (scratch_.handle)
            need(rtrCmdSetLaunchScratch(recorder_, scratch_.handle, 0, scratch_.size),
                 "rtrCmdSetLaunchScratch");
        if (options_.rounds)
            need(rtrCmdSetLaunchLimits(recorder_, 0, options_.rounds), "rtrCmdSetLaunchLimits");
        need(rtrCmdBindPipeline(recorder_, pipeline_), "rtrCmdBindPipeline");
        if (!launch.sets.empty())
            need(rtrCmdBindDescriptorSets(recorder_, 0, uint32_t(launch.sets.size()), launch.sets.data(), 0,
                                          nullptr),
                 "rtrCmdBindDescriptorSets");
        if (!launch.push_constants.empty())
            need(rtrCmdPushConstants(recorder_, 0, uint32_t(launch.push_constants.size()),
                                     launch.push_constants.data()),
                 "rtrCmdPushConstants");
        auto region = [&](const native::TableLayout::Region& r) {
            return RtrStridedBufferRegion{r.size ? table_buffer_.handle : VK_NULL_HANDLE, r.offset, r.stride,
                                          r.size};
        };
        RtrStridedBufferRegion raygen = region(table_.raygen), miss = region(table_.miss),
                               hit = region(table_.hit), callable = region(table_.callable);
        need(rtrCmdTraceRaysRegions(recorder_, &raygen, &miss, &hit, &callable, launch.width, launch.height,
                                    launch.depth),
             "rtrCmdTraceRaysRegions");
    }

    std::string finish() override {
        std::string text;
        if (rtrGetLaunchCount(recorder_)) {
            RtrLaunchError error{};
            said_.clear();
            if (rtrGetLaunchError(recorder_, 0, control_.mapped, &error) != VK_SUCCESS) {
                char line[512];
                rtrFormatLaunchError(&error, line, sizeof(line));
                text = std::string(launch_error_name(error.code)) + ": " + line;
                if (error.suspendedLanes) text += "; --rounds allows more";
            }
        }
        need(rtrRetireRecorder(recorder_), "rtrRetireRecorder");
        return text;
    }

  private:
    void print_statistics() {
        RtrPipelineInfo info{};
        rtrGetPipelineInfo(pipeline_, &info);
        const auto told = tools::pipeline_statistics(context_, info.pipeline);
        for (const auto& [what, value] : told) std::printf("rtc: %s %s\n", what.c_str(), value.c_str());
        if (told.empty()) std::printf("rtc: this driver tells no statistics of pipelines\n");
    }

    void need(VkResult result, const char* what) {
        if (result == VK_SUCCESS) return;
        throw Error(std::string(what) + ": " + tools::result_name(result) + said_);
    }

    // Memory for all structures: a heap, or a buffer with an address.
    void bind_memory(VkDeviceSize size) {
        memory_ = Buffer(context_, size, addresses_ ? RTR_ADDRESS_BUFFER_USAGE : RTR_HEAP_BUFFER_USAGE,
                         MemoryKind::Device);
        if (!addresses_) {
            RtrHeapCreateInfo info{};
            info.buffer = memory_.handle;
            info.size = size / 256 * 256;
            need(rtrCreateHeap(device_, &info, nullptr, &heap_), "rtrCreateHeap");
        }
        VkDeviceSize used = 0;
        for (auto* list : {&bottoms_, &tops_})
            for (RtrAccelerationStructure as : *list) {
                const VkDeviceSize bytes = size_of(as, VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_OBJECT_NV);
                RtrBindAccelerationStructureMemoryInfo bind{};
                bind.accelerationStructure = as;
                if (addresses_) {
                    bind.buffer = memory_.handle;
                    bind.bufferOffset = used;
                    used += (bytes + 255) / 256 * 256;
                } else {
                    bind.heap = heap_;
                    need(rtrAllocateHeapRange(heap_, bytes, 0, &bind.heapOffset), "rtrAllocateHeapRange");
                }
                need(rtrBindAccelerationStructureMemory(device_, 1, &bind), "rtrBindAccelerationStructureMemory");
            }
    }

    // A header of zeros: every ray misses it.
    const Buffer& null_top() {
        if (!null_top_.handle) {
            null_top_ = Buffer(context_, RTC_AS_HEADER_QUADS * RTC_QUAD_BYTES, RTR_INPUT_BUFFER_USAGE, MemoryKind::Host);
            std::memset(null_top_.mapped, 0, RTC_AS_HEADER_QUADS * RTC_QUAD_BYTES);
        }
        return null_top_;
    }

    VkDeviceSize size_of(RtrAccelerationStructure as, VkAccelerationStructureMemoryRequirementsTypeNV type) {
        VkMemoryRequirements2 out{};
        out.sType = VK_STRUCTURE_TYPE_MEMORY_REQUIREMENTS_2;
        rtrGetAccelerationStructureMemoryRequirements(device_, type, as, &out);
        return out.memoryRequirements.size;
    }

    void compile(const tools::JobPipeline& job) {
        Owned<rtcc_compiler_t, rtcc_compiler_release> compiler(rtcc_compiler_create());
        Owned<rtcc_options_t, rtcc_options_release> options(rtcc_options_create());
        Owned<rtcc_pipeline_t, rtcc_pipeline_release> pipeline(rtcc_pipeline_create());
        rtcc_options_set_max_recursion_depth(options, job.max_recursion);
        rtcc_options_set_max_callable_depth(options, job.max_callable_depth);
        rtcc_options_set_optimization(
            options, options_.optimize ? RTCC_OPTIMIZATION_PERFORMANCE : RTCC_OPTIMIZATION_NONE);
        bool needed = rtrGetDeviceSupport(device_)->needsResumableModules;
        rtcc_options_set_addressing(options, addresses_ ? RTCC_ADDRESSING_ADDRESS : RTCC_ADDRESSING_HEAP);
        static const std::map<std::string, rtcc_accuracy> kTiers{{"fast", RTCC_ACCURACY_FAST},
                                                                 {"watertight", RTCC_ACCURACY_WATERTIGHT},
                                                                 {"exact", RTCC_ACCURACY_EXACT},
                                                                 {"exact64", RTCC_ACCURACY_EXACT_FLOAT64}};
        rtcc_options_set_accuracy(options, kTiers.at(options_.accuracy));
        if (rtcc_options_assume(options, options_.assume.c_str()) != RTCC_STATUS_SUCCESS)
            throw Error("no such assumption: " + options_.assume);
        rtcc_options_set_specialize(options, options_.specialize);
        rtcc_options_set_resumable(options, options_.resumable < 0 ? needed : options_.resumable);
        for (const tools::JobShader& shader : job.shaders) {
            int32_t stage = rtcc_pipeline_add_spirv(pipeline, stage_of(shader.stage), shader.name.c_str(),
                                                    shader.file.c_str(), shader.spirv.data(),
                                                    shader.spirv.size(), shader.entry.c_str());
            if (stage < 0) throw Error("stage " + shader.name + " was refused (is its name unique?)");
            for (const auto& constant : shader.constants)
                rtcc_pipeline_specialize(pipeline, stage, constant.id, constant.value);
        }
        for (const tools::JobGroup& group : job.groups) {
            int32_t made = group.general >= 0
                               ? rtcc_pipeline_add_general_group(pipeline, group.name.c_str(), group.general)
                               : rtcc_pipeline_add_hit_group(pipeline, group.name.c_str(), group.closest_hit,
                                                             group.any_hit, group.intersection);
            if (made < 0) throw Error("group " + group.name + " was refused");
        }
        Owned<rtcc_result_t, rtcc_result_release> result(rtcc_compile_pipeline(compiler, pipeline, options));
        std::string messages = rtcc_result_messages(result);
        if (rtcc_result_status(result) != RTCC_STATUS_SUCCESS) throw Error("rtc: " + messages);
        if (options_.print_warnings && !messages.empty()) std::fprintf(stderr, "%s", messages.c_str());
        module_.assign(rtcc_result_words(result), rtcc_result_words(result) + rtcc_result_word_count(result));
        if (!options_.save_module.empty()) {
            std::ofstream out(options_.save_module, std::ios::binary);
            out.write(reinterpret_cast<const char*>(module_.data()), std::streamsize(module_.size() * 4));
        }
    }

    const Context& context_;
    RtcOptions options_;
    std::string& said_;
    RtrDevice device_ = nullptr;
    RtrHeap heap_ = nullptr;
    RtrPipeline pipeline_ = nullptr;
    RtrRecorder recorder_ = nullptr;
    std::vector<RtrAccelerationStructure> bottoms_, tops_;
    bool addresses_ = false;
    Buffer memory_, null_top_, table_buffer_, control_, scratch_;
    native::TableLayout table_;
    std::vector<uint32_t> module_;
    uint32_t group_count_ = 0;
};

}  // namespace

RtcDevice::RtcDevice(const native::Context& c) : context(c) {
    VkDebugUtilsMessengerCreateInfoEXT messenger{};
    messenger.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT;
    messenger.messageSeverity =
        VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT;
    messenger.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_GENERAL_BIT_EXT |
                            VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT |
                            VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT;
    messenger.pfnUserCallback = [](VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                                   const VkDebugUtilsMessengerCallbackDataEXT* data, void* user) -> VkBool32 {
        static_cast<RtcDevice*>(user)->said += std::string("\n  ") + data->pMessage;
        return VK_FALSE;
    };
    messenger.pUserData = this;
    RtrDeviceCreateInfo info{};
    info.instance = context.instance;
    info.physicalDevice = context.physical;
    info.device = context.device;
    info.pfnGetInstanceProcAddr = vkGetInstanceProcAddr;
    info.pMessenger = &messenger;
    info.bufferDeviceAddress = context.device_addresses;
    VkResult result = rtrCreateDevice(&info, nullptr, &handle);
    if (result != VK_SUCCESS)
        throw Error(std::string("rtrCreateDevice: ") + tools::result_name(result) + said);
}

RtcDevice::~RtcDevice() { rtrDestroyDevice(handle, nullptr); }

bool has_rtc() { return true; }

std::unique_ptr<Executor> make_rtc(RtcDevice& device, const RtcOptions& options) {
    return std::make_unique<RtcExecutor>(device, options);
}

}  // namespace rtc::run

#else

namespace rtc::run {
bool has_rtc() { return false; }
RtcDevice::RtcDevice(const native::Context& c) : context(c) {
    throw native::Error("this rtc-run was built without rtc's compiler and runtime; only --native works");
}
RtcDevice::~RtcDevice() = default;
std::unique_ptr<native::Executor> make_rtc(RtcDevice&, const RtcOptions&) { return nullptr; }
}  // namespace rtc::run

#endif
