#include "driver_compile.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <cstring>

#include "error.h"
#include "resources.h"
#include "rtc/runtime.h"
#include "vulkan_context.h"

namespace rtc::bench {
namespace {

using tools::Buffer;
using tools::check;
using tools::Context;
using tools::ContextOptions;
using tools::MemoryKind;

double process_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

ContextOptions context_options(const std::string& device) {
    // A shader that the driver finds on disk costs nothing and measures nothing.
    setenv("MESA_SHADER_CACHE_DISABLE", "true", 1);
    ContextOptions options;
    options.device = device;
    options.all_core_features = true;
    return options;
}

VkBool32 VKAPI_PTR print_message(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                                 const VkDebugUtilsMessengerCallbackDataEXT* data, void*) {
    std::fprintf(stderr, "rtc-bench: %s\n", data->pMessage);
    return VK_FALSE;
}

constexpr uint32_t kWidth = 32;
constexpr uint32_t kRounds = 4;

}  // namespace

struct DriverCompiler::State {
    explicit State(const std::string& device_name) : context(context_options(device_name)) {
        VkDebugUtilsMessengerCreateInfoEXT messenger{VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT};
        messenger.messageSeverity =
            VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
        messenger.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_TYPE_GENERAL_BIT_EXT;
        messenger.pfnUserCallback = print_message;
        RtrDeviceCreateInfo info{};
        info.instance = context.instance;
        info.physicalDevice = context.physical;
        info.device = context.device;
        info.pfnGetInstanceProcAddr = vkGetInstanceProcAddr;
        info.pMessenger = &messenger;
        check(rtrCreateDevice(&info, nullptr, &device), "rtrCreateDevice");

        heap_buffer = Buffer(context, 4096, RTR_HEAP_BUFFER_USAGE, MemoryKind::Device);
        RtrHeapCreateInfo heap_info{};
        heap_info.buffer = heap_buffer.handle;
        heap_info.size = 4096;
        check(rtrCreateHeap(device, &heap_info, nullptr, &heap), "rtrCreateHeap");

        const VkDeviceSize control_size = rtrGetRecorderControlSize(device, 4, 1, kRounds);
        control = Buffer(context, control_size, RTR_CONTROL_BUFFER_USAGE, MemoryKind::Host);
        RtrRecorderCreateInfo recorder_info{};
        recorder_info.controlBuffer = control.handle;
        recorder_info.controlSize = control_size;
        check(rtrCreateRecorder(device, &recorder_info, nullptr, &recorder), "rtrCreateRecorder");

        result = Buffer(context, kWidth * 16, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, MemoryKind::Host);
        make_set();
    }

    ~State() {
        vkDestroyDescriptorPool(context.device, pool, nullptr);
        vkDestroyDescriptorSetLayout(context.device, layout, nullptr);
        rtrDestroyRecorder(device, recorder, nullptr);
        rtrDestroyHeap(device, heap, nullptr);
        rtrDestroyDevice(device, nullptr);
    }

    void make_set() {
        VkDescriptorSetLayoutBinding bindings[2]{};
        for (uint32_t i = 0; i < 2; ++i)
            bindings[i] = {i, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr};
        VkDescriptorSetLayoutCreateInfo layout_info{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO};
        layout_info.bindingCount = 2;
        layout_info.pBindings = bindings;
        check(vkCreateDescriptorSetLayout(context.device, &layout_info, nullptr, &layout), "vkCreateDescriptorSetLayout");
        VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 2};
        VkDescriptorPoolCreateInfo pool_info{VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO};
        pool_info.maxSets = 1;
        pool_info.poolSizeCount = 1;
        pool_info.pPoolSizes = &size;
        check(vkCreateDescriptorPool(context.device, &pool_info, nullptr, &pool), "vkCreateDescriptorPool");
        VkDescriptorSetAllocateInfo allocate{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO};
        allocate.descriptorPool = pool;
        allocate.descriptorSetCount = 1;
        allocate.pSetLayouts = &layout;
        check(vkAllocateDescriptorSets(context.device, &allocate, &set), "vkAllocateDescriptorSets");

        VkDescriptorBufferInfo buffers[2]{{}, {result.handle, 0, VK_WHOLE_SIZE}};
        check(rtrGetNullAccelerationStructureDescriptor(device, heap, &buffers[0]),
              "rtrGetNullAccelerationStructureDescriptor");
        VkWriteDescriptorSet write{VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
        write.dstSet = set;
        write.descriptorCount = 2;  // runs on into binding 1
        write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
        write.pBufferInfo = buffers;
        vkUpdateDescriptorSets(context.device, 1, &write, 0, nullptr);
    }

    void launch(RtrPipeline pipeline, const Buffer& table, const RtrSbtLayout& sbt, const Buffer& scratch) {
        context.run([&](VkCommandBuffer commands) {
            check(rtrBeginRecorder(recorder, commands), "rtrBeginRecorder");
            check(rtrCmdInitializeHeap(recorder, heap), "rtrCmdInitializeHeap");
            check(rtrCmdBindPipeline(recorder, pipeline), "rtrCmdBindPipeline");
            check(rtrCmdBindDescriptorSets(recorder, 0, 1, &set, 0, nullptr), "rtrCmdBindDescriptorSets");
            check(rtrCmdSetHeap(recorder, heap), "rtrCmdSetHeap");
            check(rtrCmdSetLaunchScratch(recorder, scratch.handle, 0, scratch.size), "rtrCmdSetLaunchScratch");
            check(rtrCmdSetLaunchLimits(recorder, 0, kRounds), "rtrCmdSetLaunchLimits");
            check(rtrCmdTraceRays(recorder, table.handle, sbt.raygen.offset, table.handle, sbt.miss.offset,
                                  sbt.miss.stride, table.handle, sbt.hit.offset, sbt.hit.stride, VK_NULL_HANDLE, 0, 0,
                                  kWidth, 1, 1),
                  "rtrCmdTraceRays");
        });
        check(rtrResetRecorder(recorder), "rtrResetRecorder");
    }

    Context context;
    RtrDevice device = nullptr;
    RtrHeap heap = nullptr;
    RtrRecorder recorder = nullptr;
    Buffer heap_buffer, control, result;
    VkDescriptorSetLayout layout = VK_NULL_HANDLE;
    VkDescriptorPool pool = VK_NULL_HANDLE;
    VkDescriptorSet set = VK_NULL_HANDLE;
};

DriverCompiler::DriverCompiler(const std::string& device) : state_(std::make_unique<State>(device)) {}
DriverCompiler::~DriverCompiler() = default;

std::string DriverCompiler::name() const {
    return std::string(state_->context.driver.driverName) + " " + state_->context.driver.driverInfo;
}

double DriverCompiler::cpu_seconds(const std::vector<uint32_t>& module) {
    State& s = *state_;
    RtrRayTracingPipelineCreateInfo info{};
    info.pCode = module.data();
    info.codeSize = module.size() * 4;
    info.setLayoutCount = 1;
    info.pSetLayouts = &s.layout;

    const double begin = process_seconds();
    RtrPipeline pipeline = nullptr;
    check(rtrCreateRayTracingPipeline(s.device, VK_NULL_HANDLE, &info, nullptr, &pipeline), "rtrCreateRayTracingPipeline");

    const RtrSbtRecord raygen{0, 0, nullptr}, miss{1, 0, nullptr}, hit{2, 0, nullptr};
    RtrSbtInfo sbt{};
    sbt.raygenCount = sbt.missCount = sbt.hitCount = 1;
    sbt.pRaygen = &raygen;
    sbt.pMiss = &miss;
    sbt.pHit = &hit;
    RtrSbtLayout layout{};
    check(rtrGetSbtLayout(s.device, &sbt, &layout), "rtrGetSbtLayout");
    Buffer table(s.context, layout.size, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, MemoryKind::Host);
    check(rtrWriteSbt(s.device, pipeline, &sbt, &layout, table.mapped), "rtrWriteSbt");
    Buffer scratch(s.context, rtrGetLaunchScratchSize(s.device, pipeline, kWidth, 1, 1, nullptr),
                   RTR_LAUNCH_SCRATCH_BUFFER_USAGE, MemoryKind::Device);

    s.launch(pipeline, table, layout, scratch);
    const double compiled = process_seconds();
    s.launch(pipeline, table, layout, scratch);
    const double again = process_seconds();
    rtrDestroyPipeline(s.device, pipeline, nullptr);
    return std::max(0.0, (compiled - begin) - (again - compiled));
}

}  // namespace rtc::bench
