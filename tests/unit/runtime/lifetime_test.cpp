// Host allocations go where the application sends them; recorders of several threads do
// not disturb each other; misuse of objects is named.
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <mutex>
#include <thread>

#include "module_util.h"
#include "scene_util.h"
#include "spv/module_resume.h"

namespace {

// Counts what is allocated and fails on a foreign or double free.
class Counter {
  public:
    Counter() {
        callbacks.pUserData = this;
        callbacks.pfnAllocation = [](void* user, size_t size, size_t alignment,
                                     VkSystemAllocationScope) -> void* {
            auto* self = static_cast<Counter*>(user);
            std::lock_guard lock(self->mutex_);
            void* p = std::aligned_alloc(std::max<size_t>(alignment, 16), (size + 63) / 64 * 64);
            self->live_[p] = size;
            self->total++;
            return p;
        };
        callbacks.pfnFree = [](void* user, void* p) {
            if (!p) return;
            auto* self = static_cast<Counter*>(user);
            std::lock_guard lock(self->mutex_);
            EXPECT_EQ(self->live_.erase(p), 1u) << "freed but not allocated here";
            std::free(p);
        };
        callbacks.pfnReallocation = [](void* user, void* old, size_t size, size_t alignment,
                                       VkSystemAllocationScope scope) -> void* {
            auto* self = static_cast<Counter*>(user);
            void* p = self->callbacks.pfnAllocation(user, size, alignment, scope);
            size_t had = 0;
            {
                std::lock_guard lock(self->mutex_);
                if (old) had = self->live_[old];
            }
            if (old) memcpy(p, old, std::min(had, size));
            self->callbacks.pfnFree(user, old);
            return p;
        };
    }
    size_t live() const { return live_.size(); }
    VkAllocationCallbacks callbacks{};
    int total = 0;

  private:
    std::mutex mutex_;
    std::map<void*, size_t> live_;
};

class LifetimeTest : public RuntimeTest {};

// Every kernel goes through the application's pipeline cache, and a device is made from a cache
// that was kept in a file.
PFN_vkGetDeviceProcAddr real_device_proc;
PFN_vkGetInstanceProcAddr real_instance_proc;
PFN_vkCreateComputePipelines real_create;
VkPipelineCache expected_cache;
int created, cached;
VKAPI_ATTR VkResult VKAPI_CALL watch_create(VkDevice device, VkPipelineCache cache, uint32_t count,
                                            const VkComputePipelineCreateInfo* infos, const VkAllocationCallbacks* a,
                                            VkPipeline* out) {
    created++;
    cached += cache == expected_cache;
    return real_create(device, cache, count, infos, a, out);
}
VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL watched_device_proc(VkDevice device, const char* name) {
    auto f = real_device_proc(device, name);
    if (strcmp(name, "vkCreateComputePipelines") != 0) return f;
    real_create = reinterpret_cast<PFN_vkCreateComputePipelines>(f);
    return reinterpret_cast<PFN_vkVoidFunction>(watch_create);
}
VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL watched_instance_proc(VkInstance instance, const char* name) {
    auto f = real_instance_proc(instance, name);
    if (strcmp(name, "vkGetDeviceProcAddr") != 0) return f;
    real_device_proc = reinterpret_cast<PFN_vkGetDeviceProcAddr>(f);
    return reinterpret_cast<PFN_vkVoidFunction>(watched_device_proc);
}

TEST_F(LifetimeTest, KernelsComeBackFromACacheOnDisk) {
    auto find = [&](const char* name) { return vk->get_instance_proc_addr(vk->instance, name); };
    auto create = reinterpret_cast<PFN_vkCreatePipelineCache>(find("vkCreatePipelineCache"));
    auto destroy = reinterpret_cast<PFN_vkDestroyPipelineCache>(find("vkDestroyPipelineCache"));
    auto get = reinterpret_cast<PFN_vkGetPipelineCacheData>(find("vkGetPipelineCacheData"));
    real_instance_proc = vk->get_instance_proc_addr;
    const std::string file = testing::TempDir() + "rtr_kernels.cache";
    std::vector<char> data;
    for (bool again : {false, true}) {
        VkPipelineCacheCreateInfo cache_info{VK_STRUCTURE_TYPE_PIPELINE_CACHE_CREATE_INFO};
        if (again) {
            std::ifstream in(file, std::ios::binary);
            data.assign(std::istreambuf_iterator<char>(in), {});
            cache_info.initialDataSize = data.size();
            cache_info.pInitialData = data.data();
        }
        ASSERT_EQ(create(vk->device, &cache_info, nullptr, &expected_cache), VK_SUCCESS);
        RtrDeviceCreateInfo info{};
        info.instance = vk->instance;
        info.physicalDevice = vk->physical_device;
        info.device = vk->device;
        info.pfnGetInstanceProcAddr = watched_instance_proc;
        info.pipelineCache = expected_cache;
        created = cached = 0;
        RtrDevice device = nullptr;
        ASSERT_EQ(rtrCreateDevice(&info, nullptr, &device), VK_SUCCESS);
        EXPECT_GT(created, 20);
        EXPECT_EQ(cached, created);
        {
            Scene scene(*vk, device, 1 << 20);
            auto bottom = scene.build_bottom({scene.triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 0, 0}, {3, 0, 0}, {2, 1, 0}})});
            auto top = scene.build_top({scene.instance(bottom)});
            TreeFacts facts, top_facts;
            check_structure(scene, bottom, facts);
            check_structure(scene, top, top_facts);
            EXPECT_EQ(facts.slots.size(), 2u);
        }
        rtrDestroyDevice(device, nullptr);
        size_t size = 0;
        ASSERT_EQ(get(vk->device, expected_cache, &size, nullptr), VK_SUCCESS);
        data.resize(size);
        ASSERT_EQ(get(vk->device, expected_cache, &size, data.data()), VK_SUCCESS);
        EXPECT_GE(size, 32u);
        std::ofstream(file, std::ios::binary).write(data.data(), static_cast<std::streamsize>(size));
        destroy(vk->device, expected_cache, nullptr);
    }
    std::remove(file.c_str());
}

TEST_F(LifetimeTest, AllocationsGoThroughTheCallbacks) {
    Counter device_counter, object_counter;
    RtrDeviceCreateInfo info{};
    info.instance = vk->instance;
    info.physicalDevice = vk->physical_device;
    info.device = vk->device;
    info.pfnGetInstanceProcAddr = vk->get_instance_proc_addr;
    RtrDevice device = nullptr;
    ASSERT_EQ(rtrCreateDevice(&info, &device_counter.callbacks, &device), VK_SUCCESS);
    EXPECT_GT(device_counter.total, 0);
    Buffer buffer = vk->buffer(1 << 20, RTR_HEAP_BUFFER_USAGE),
           control = vk->buffer(1 << 16, RTR_CONTROL_BUFFER_USAGE);
    for (auto* a : {static_cast<const VkAllocationCallbacks*>(nullptr),
                    static_cast<const VkAllocationCallbacks*>(&object_counter.callbacks)}) {
        int before = device_counter.total;
        RtrHeapCreateInfo heap_info{nullptr, buffer.handle, 0, buffer.size};
        RtrHeap heap = nullptr;
        ASSERT_EQ(rtrCreateHeap(device, &heap_info, a, &heap), VK_SUCCESS);
        VkDeviceSize at = 0;
        for (int i = 0; i < 100; i++) EXPECT_EQ(rtrAllocateHeapRange(heap, 256, 0, &at), VK_SUCCESS);
        RtrRecorderCreateInfo recorder_info{nullptr, control.handle, 0, control.size};
        RtrRecorder recorder = nullptr;
        ASSERT_EQ(rtrCreateRecorder(device, &recorder_info, a, &recorder), VK_SUCCESS);
        VkAccelerationStructureCreateInfoNV create{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_NV};
        create.info.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV;
        create.info.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
        RtrAccelerationStructure as = nullptr;
        ASSERT_EQ(rtrCreateAccelerationStructure(device, &create, a, &as), VK_SUCCESS);
        RtrBindAccelerationStructureMemoryInfo bind{nullptr, as, heap, at, VK_NULL_HANDLE, 0};
        ASSERT_EQ(rtrBindAccelerationStructureMemory(device, 1, &bind), VK_SUCCESS);
        // Many builds: the recorder's pools grow.
        Buffer scratch = vk->buffer(1 << 16, RTR_SCRATCH_BUFFER_USAGE);
        vk->begin();
        rtrBeginRecorder(recorder, vk->cmd);
        for (int i = 0; i < 100; i++) {
            EXPECT_EQ(rtrCmdBuildAccelerationStructure(recorder, &create.info, VK_NULL_HANDLE, 0, VK_FALSE,
                                                       as, nullptr, scratch.handle, 0),
                      VK_SUCCESS);
            vk->compute_barrier();
        }
        vk->submit();
        rtrDestroyRecorder(device, recorder, a);
        rtrDestroyAccelerationStructure(device, as, a);
        rtrDestroyHeap(device, heap, a);
        vk->destroy(scratch);
        EXPECT_EQ(object_counter.live(), 0u);
        if (a)
            EXPECT_GT(object_counter.total, 0);
        else
            EXPECT_GT(device_counter.total, before);
    }
    rtrDestroyDevice(device, &device_counter.callbacks);
    EXPECT_EQ(device_counter.live(), 0u);
    vk->destroy(buffer);
    vk->destroy(control);
}

TEST_F(LifetimeTest, FailedCreationLeavesNothing) {
    Counter counter;
    RtcModuleHeader h = module_header(1u << RTC_BINDING_PARAMS, 1);
    auto good = with_reflection(module_resume_spv, sizeof module_resume_spv, h, "{}");
    RtrRayTracingPipelineCreateInfo info{};
    info.pCode = good.data();
    info.codeSize = good.size() * 4;
    uint32_t value = 0;
    VkSpecializationMapEntry entry{RTC_SPEC_FETCH, 0, 4};
    VkSpecializationInfo specialization{1, &entry, 4, &value};
    info.pSpecializationInfo = &specialization;
    RtrPipeline pipeline = nullptr;
    RtrTraceOptions options = RTR_TRACE_OPTIONS_DEFAULT;
    options.workgroupSize = 33;
    info.pOptions = &options;
    EXPECT_EQ(rtrCreateRayTracingPipeline(rtr, VK_NULL_HANDLE, &info, &counter.callbacks, &pipeline),
              VK_ERROR_VALIDATION_FAILED_EXT);
    expect_runtime_error("trace-options");
    info.codeSize = 20;
    EXPECT_EQ(rtrCreateRayTracingPipeline(rtr, VK_NULL_HANDLE, &info, &counter.callbacks, &pipeline),
              VK_ERROR_VALIDATION_FAILED_EXT);
    expect_runtime_error("module");
    EXPECT_EQ(pipeline, nullptr);
    EXPECT_EQ(counter.live(), 0u);
}

TEST_F(LifetimeTest, ThreadsRecordAtTheSameTime) {
    Scene scene(*vk, rtr, 4 << 20);
    std::vector<Vec3> vertices;
    for (int i = 0; i < 900; i++) vertices.push_back({float(i % 31), float(i % 17), float(i)});
    std::vector<VkGeometryNV> geometry{scene.triangles(vertices)};
    VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
    info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
    info.geometryCount = 1;
    info.pGeometries = geometry.data();
    struct Worker {
        VkCommandPool pool;
        VkCommandBuffer cmd;
        RtrRecorder recorder;
        RtrAccelerationStructure as;
        Buffer scratch;
    };
    std::vector<Worker> workers(4);
    for (auto& w : workers) {
        VkCommandPoolCreateInfo pool{VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO};
        pool.queueFamilyIndex = vk->queue_family;
        vk->CreateCommandPool(vk->device, &pool, nullptr, &w.pool);
        VkCommandBufferAllocateInfo allocate{VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO};
        allocate.commandPool = w.pool;
        allocate.commandBufferCount = 1;
        vk->AllocateCommandBuffers(vk->device, &allocate, &w.cmd);
        RtrRecorderCreateInfo recorder_info{};
        ASSERT_EQ(rtrCreateRecorder(rtr, &recorder_info, nullptr, &w.recorder), VK_SUCCESS);
        w.as = scene.create(info);
        w.scratch = vk->buffer(scene.scratch_size(w.as), RTR_SCRATCH_BUFFER_USAGE);
    }
    std::vector<std::thread> threads;
    for (auto& w : workers) {
        threads.emplace_back([&, this] {
            VkCommandBufferBeginInfo begin{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
            vk->BeginCommandBuffer(w.cmd, &begin);
            EXPECT_EQ(rtrBeginRecorder(w.recorder, w.cmd), VK_SUCCESS);
            EXPECT_EQ(rtrCmdBuildAccelerationStructure(w.recorder, &info, VK_NULL_HANDLE, 0, VK_FALSE, w.as,
                                                       nullptr, w.scratch.handle, 0),
                      VK_SUCCESS);
            VkMemoryBarrier b{VK_STRUCTURE_TYPE_MEMORY_BARRIER, nullptr, VK_ACCESS_MEMORY_WRITE_BIT,
                              VK_ACCESS_HOST_READ_BIT};
            vk->CmdPipelineBarrier(w.cmd, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0,
                                   1, &b, 0, nullptr, 0, nullptr);
            vk->EndCommandBuffer(w.cmd);
        });
    }
    for (auto& t : threads) t.join();
    for (auto& w : workers) {
        VkSubmitInfo submit{VK_STRUCTURE_TYPE_SUBMIT_INFO};
        submit.commandBufferCount = 1;
        submit.pCommandBuffers = &w.cmd;
        vk->QueueSubmit(vk->queue, 1, &submit, VK_NULL_HANDLE);
    }
    vk->QueueWaitIdle(vk->queue);
    for (auto& w : workers) {
        TreeFacts facts;
        check_structure(scene, w.as, facts);
        EXPECT_EQ(facts.slots.size(), 300u);
        rtrDestroyRecorder(rtr, w.recorder, nullptr);
        vk->DestroyCommandPool(vk->device, w.pool, nullptr);
        vk->destroy(w.scratch);
    }
}

TEST_F(LifetimeTest, SupportNamesItsRequirements) {
    RtrPhysicalDeviceSupport support;
    ASSERT_EQ(
        rtrGetPhysicalDeviceSupport(vk->instance, vk->physical_device, vk->get_instance_proc_addr, &support),
        VK_SUCCESS);
    EXPECT_TRUE(support.supported);
    ASSERT_GT(support.requirementCount, 5u);
    for (uint32_t i = 0; i < support.requirementCount; i++) {
        EXPECT_NE(support.requirements[i].name[0], 0);
        EXPECT_TRUE(support.requirements[i].met) << support.requirements[i].name;
    }
    EXPECT_EQ(support.recommended.workgroupSize % 32, 0u);
    VkPhysicalDeviceRayTracingPropertiesNV p{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_TRACING_PROPERTIES_NV};
    rtrGetRayTracingProperties(rtr, &p);
    EXPECT_EQ(p.shaderGroupHandleSize, 32u);
    EXPECT_EQ(p.maxRecursionDepth, 31u);
    EXPECT_EQ(p.shaderGroupBaseAlignment, 64u);
}

TEST_F(LifetimeTest, EnumsBecomeValidOnes) {
    EXPECT_EQ(
        rtrTranslateBufferUsage(VK_BUFFER_USAGE_RAY_TRACING_BIT_NV | VK_BUFFER_USAGE_VERTEX_BUFFER_BIT) &
            VK_BUFFER_USAGE_RAY_TRACING_BIT_NV,
        0u);
    EXPECT_TRUE(rtrTranslateBufferUsage(VK_BUFFER_USAGE_RAY_TRACING_BIT_NV) &
                VK_BUFFER_USAGE_STORAGE_BUFFER_BIT);
    EXPECT_EQ(rtrTranslateBufferUsage(VK_BUFFER_USAGE_VERTEX_BUFFER_BIT),
              VkBufferUsageFlags(VK_BUFFER_USAGE_VERTEX_BUFFER_BIT));
    EXPECT_EQ(rtrTranslateBufferUsage(VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_BIT_KHR |
                                      VK_BUFFER_USAGE_VERTEX_BUFFER_BIT),
              VkBufferUsageFlags(VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_VERTEX_BUFFER_BIT));
    EXPECT_EQ(rtrTranslateBufferUsage(VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_STORAGE_BIT_KHR |
                                      VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT),
              VkBufferUsageFlags(RTR_ADDRESS_BUFFER_USAGE));
    EXPECT_EQ(rtrTranslatePipelineStages(VK_PIPELINE_STAGE_RAY_TRACING_SHADER_BIT_NV),
              VkPipelineStageFlags(VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT));
    EXPECT_EQ(rtrTranslateShaderStages(VK_SHADER_STAGE_RAYGEN_BIT_NV | VK_SHADER_STAGE_VERTEX_BIT),
              VkShaderStageFlags(VK_SHADER_STAGE_COMPUTE_BIT | VK_SHADER_STAGE_VERTEX_BIT));
    EXPECT_EQ(rtrTranslateShaderStages(VK_SHADER_STAGE_ALL), VkShaderStageFlags(VK_SHADER_STAGE_ALL));
    EXPECT_EQ(rtrTranslateAccess(VK_ACCESS_ACCELERATION_STRUCTURE_READ_BIT_NV),
              VkAccessFlags(VK_ACCESS_SHADER_READ_BIT));
    EXPECT_EQ(rtrTranslateDescriptorType(VK_DESCRIPTOR_TYPE_ACCELERATION_STRUCTURE_NV),
              VK_DESCRIPTOR_TYPE_STORAGE_BUFFER);
    EXPECT_EQ(rtrTranslateDescriptorType(VK_DESCRIPTOR_TYPE_SAMPLER), VK_DESCRIPTOR_TYPE_SAMPLER);
    EXPECT_EQ(rtrTranslateBindPoint(VK_PIPELINE_BIND_POINT_RAY_TRACING_NV), VK_PIPELINE_BIND_POINT_COMPUTE);
    EXPECT_EQ(rtrTranslateBindPoint(VK_PIPELINE_BIND_POINT_GRAPHICS), VK_PIPELINE_BIND_POINT_GRAPHICS);
    EXPECT_EQ(rtrTranslatePipelineStages2(VK_PIPELINE_STAGE_2_RAY_TRACING_SHADER_BIT_KHR |
                                          VK_PIPELINE_STAGE_2_HOST_BIT),
              VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_2_HOST_BIT);
    EXPECT_EQ(rtrTranslatePipelineStages2(VK_PIPELINE_STAGE_2_ACCELERATION_STRUCTURE_COPY_BIT_KHR),
              VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT);
    EXPECT_EQ(rtrTranslateAccess2(VK_ACCESS_2_SHADER_BINDING_TABLE_READ_BIT_KHR | VK_ACCESS_2_HOST_READ_BIT),
              VK_ACCESS_2_SHADER_READ_BIT | VK_ACCESS_2_HOST_READ_BIT);
    EXPECT_EQ(rtrTranslateAccess2(VK_ACCESS_2_ACCELERATION_STRUCTURE_WRITE_BIT_KHR),
              VK_ACCESS_2_SHADER_READ_BIT | VK_ACCESS_2_SHADER_WRITE_BIT);
}

// Structures are no objects of Vulkan's; in tools their buffer carries the name (VK_OBJECT_TYPE_ACCELERATION_STRUCTURE_NV).
TEST_F(LifetimeTest, NamesOfStructuresAreThoseOfBuffers) {
    auto set_name = reinterpret_cast<PFN_vkSetDebugUtilsObjectNameEXT>(
        vk->get_instance_proc_addr(vk->instance, "vkSetDebugUtilsObjectNameEXT"));
    if (!set_name) GTEST_SKIP() << "no VK_EXT_debug_utils";
    Buffer heap = vk->buffer(4096, RTR_HEAP_BUFFER_USAGE);
    VkDebugUtilsObjectNameInfoEXT name{VK_STRUCTURE_TYPE_DEBUG_UTILS_OBJECT_NAME_INFO_EXT};
    name.objectType = VK_OBJECT_TYPE_BUFFER;
    name.objectHandle = uint64_t(heap.handle);
    name.pObjectName = "the scene's structures";
    EXPECT_EQ(set_name(vk->device, &name), VK_SUCCESS);
    vk->destroy(heap);
}

TEST_F(LifetimeTest, MemoryRequirementsAnswerEverything) {
    VkAccelerationStructureCreateInfoNV create{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_NV};
    create.info.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV;
    create.info.instanceCount = 100;
    RtrAccelerationStructure as = nullptr;
    ASSERT_EQ(rtrCreateAccelerationStructure(rtr, &create, nullptr, &as), VK_SUCCESS);
    VkMemoryDedicatedRequirements dedicated{VK_STRUCTURE_TYPE_MEMORY_DEDICATED_REQUIREMENTS};
    dedicated.prefersDedicatedAllocation = dedicated.requiresDedicatedAllocation = VK_TRUE;
    VkMemoryRequirements2 need{VK_STRUCTURE_TYPE_MEMORY_REQUIREMENTS_2, &dedicated, {}};
    rtrGetAccelerationStructureMemoryRequirements(rtr, VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_OBJECT_NV, as,
                                                  &need);
    EXPECT_GT(need.memoryRequirements.size, 100u * RTC_INSTANCE_QUADS * RTC_QUAD_BYTES);
    EXPECT_EQ(need.memoryRequirements.alignment, 256u);
    EXPECT_FALSE(dedicated.prefersDedicatedAllocation || dedicated.requiresDedicatedAllocation);
    rtrGetAccelerationStructureMemoryRequirements(rtr, VkAccelerationStructureMemoryRequirementsTypeNV(77), as, &need);
    EXPECT_EQ(need.memoryRequirements.size, 0u);
    expect_runtime_error("requirements-type");
    rtrDestroyAccelerationStructure(rtr, as, nullptr);
}

TEST_F(LifetimeTest, AbiVersionIsTheHeaders) { EXPECT_EQ(rtrGetAbiVersion(), RTC_ABI_VERSION); }

TEST_F(LifetimeTest, ArraysOfStructuresBecomeValidOnes) {
    VkDescriptorPoolSize sizes[2] = {{VK_DESCRIPTOR_TYPE_ACCELERATION_STRUCTURE_NV, 3},
                                     {VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, 4}};
    rtrTranslatePoolSizes(2, sizes, sizes);
    EXPECT_EQ(sizes[0].type, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER);
    EXPECT_EQ(sizes[0].descriptorCount, 3u);
    EXPECT_EQ(sizes[1].type, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE);
    VkDescriptorSetLayoutBinding bindings[2] = {
        {7, VK_DESCRIPTOR_TYPE_ACCELERATION_STRUCTURE_KHR, 2,
         VK_SHADER_STAGE_RAYGEN_BIT_NV | VK_SHADER_STAGE_FRAGMENT_BIT, nullptr},
        {8, VK_DESCRIPTOR_TYPE_SAMPLER, 1, VK_SHADER_STAGE_MISS_BIT_NV, nullptr}};
    rtrTranslateLayoutBindings(2, bindings, bindings);
    EXPECT_EQ(bindings[0].binding, 7u);
    EXPECT_EQ(bindings[0].descriptorCount, 2u);
    EXPECT_EQ(bindings[0].descriptorType, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER);
    EXPECT_EQ(bindings[0].stageFlags,
              VkShaderStageFlags(VK_SHADER_STAGE_COMPUTE_BIT | VK_SHADER_STAGE_FRAGMENT_BIT));
    EXPECT_EQ(bindings[1].stageFlags, VkShaderStageFlags(VK_SHADER_STAGE_COMPUTE_BIT));
    const VkPushConstantRange in[3] = {{VK_SHADER_STAGE_CLOSEST_HIT_BIT_NV, 16, 8},
                                       {VK_SHADER_STAGE_RAYGEN_BIT_NV | VK_SHADER_STAGE_VERTEX_BIT, 4, 4},
                                       {VK_SHADER_STAGE_FRAGMENT_BIT, 0, 64}};
    VkPushConstantRange out[4];
    ASSERT_EQ(rtrTranslatePushConstantRanges(3, in, out), 3u);
    EXPECT_EQ(out[0].stageFlags, VkShaderStageFlags(VK_SHADER_STAGE_VERTEX_BIT));
    EXPECT_EQ(out[0].offset, 4u);
    EXPECT_EQ(out[1].stageFlags, VkShaderStageFlags(VK_SHADER_STAGE_FRAGMENT_BIT));
    EXPECT_EQ(out[2].stageFlags, VkShaderStageFlags(VK_SHADER_STAGE_COMPUTE_BIT));
    EXPECT_EQ(out[2].offset, 4u);
    EXPECT_EQ(out[2].size, 20u);
    EXPECT_EQ(rtrTranslatePushConstantRanges(0, nullptr, out), 0u);
}

TEST_F(LifetimeTest, KhrPropertiesAgree) {
    VkPhysicalDeviceRayTracingPropertiesNV nv{
        VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_TRACING_PROPERTIES_NV};
    VkPhysicalDeviceRayTracingPipelinePropertiesKHR p{
        VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_TRACING_PIPELINE_PROPERTIES_KHR};
    VkPhysicalDeviceAccelerationStructurePropertiesKHR a{
        VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ACCELERATION_STRUCTURE_PROPERTIES_KHR};
    p.pNext = &a;
    rtrGetRayTracingProperties(rtr, &nv);
    rtrGetRayTracingPipelineProperties(rtr, &p);
    rtrGetAccelerationStructureProperties(rtr, &a);
    EXPECT_EQ(p.pNext, &a);
    EXPECT_EQ(p.shaderGroupHandleSize, nv.shaderGroupHandleSize);
    EXPECT_EQ(p.maxRayRecursionDepth, nv.maxRecursionDepth);
    EXPECT_EQ(p.maxShaderGroupStride, nv.maxShaderGroupStride);
    EXPECT_EQ(p.shaderGroupBaseAlignment, nv.shaderGroupBaseAlignment);
    EXPECT_EQ(p.shaderGroupHandleAlignment, 32u);
    EXPECT_EQ(a.maxGeometryCount, nv.maxGeometryCount);
    EXPECT_EQ(a.maxInstanceCount, nv.maxInstanceCount);
    EXPECT_EQ(a.maxPrimitiveCount, nv.maxTriangleCount);
    EXPECT_GT(a.maxPerStageDescriptorAccelerationStructures, 0u);
    EXPECT_EQ(a.minAccelerationStructureScratchOffsetAlignment, 256u);
}

// Extending structures are never skipped in silence: the message names their type.
TEST_F(LifetimeTest, UnknownChainsAreNamed) {
    VkMemoryAllocateInfo stranger{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO};
    auto expect = [&](VkResult result, const char* owner) {
        EXPECT_EQ(result, VK_ERROR_VALIDATION_FAILED_EXT);
        ASSERT_EQ(vk->runtime_messages.size(), 1u);
        EXPECT_NE(vk->runtime_messages[0].find(owner), std::string::npos) << vk->runtime_messages[0];
        EXPECT_NE(vk->runtime_messages[0].find(std::to_string(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO)),
                  std::string::npos)
            << vk->runtime_messages[0];
        expect_runtime_error("pNext");
    };
    RtrHeapCreateInfo heap_info{};
    heap_info.pNext = &stranger;
    RtrHeap heap = nullptr;
    expect(rtrCreateHeap(rtr, &heap_info, nullptr, &heap), "RtrHeapCreateInfo");
    RtrRecorderCreateInfo recorder_info{};
    recorder_info.pNext = &stranger;
    RtrRecorder recorder = nullptr;
    expect(rtrCreateRecorder(rtr, &recorder_info, nullptr, &recorder), "RtrRecorderCreateInfo");
    RtrRayTracingPipelineCreateInfo pipeline_info{};
    pipeline_info.pNext = &stranger;
    RtrPipeline pipeline = nullptr;
    expect(rtrCreateRayTracingPipeline(rtr, VK_NULL_HANDLE, &pipeline_info, nullptr, &pipeline),
           "RtrRayTracingPipelineCreateInfo");
    VkAccelerationStructureCreateInfoNV create{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_NV};
    create.info.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV;
    create.info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
    RtrAccelerationStructure as = nullptr;
    create.pNext = &stranger;
    expect(rtrCreateAccelerationStructure(rtr, &create, nullptr, &as), "VkAccelerationStructureCreateInfoNV");
    create.pNext = nullptr;
    create.info.pNext = &stranger;
    expect(rtrCreateAccelerationStructure(rtr, &create, nullptr, &as), "VkAccelerationStructureInfoNV");
    create.info.pNext = nullptr;
    VkGeometryNV geometry{VK_STRUCTURE_TYPE_GEOMETRY_NV};
    create.info.geometryCount = 1;
    create.info.pGeometries = &geometry;
    geometry.geometryType = VK_GEOMETRY_TYPE_TRIANGLES_NV;
    geometry.geometry.triangles.sType = VK_STRUCTURE_TYPE_GEOMETRY_TRIANGLES_NV;
    geometry.geometry.aabbs.sType = VK_STRUCTURE_TYPE_GEOMETRY_AABB_NV;
    geometry.geometry.triangles.pNext = &stranger;
    expect(rtrCreateAccelerationStructure(rtr, &create, nullptr, &as), "VkGeometryTrianglesNV");
    geometry.geometryType = VK_GEOMETRY_TYPE_AABBS_NV;
    geometry.geometry.aabbs.pNext = &stranger;
    expect(rtrCreateAccelerationStructure(rtr, &create, nullptr, &as), "VkGeometryAABBNV");
    geometry.pNext = &stranger;
    expect(rtrCreateAccelerationStructure(rtr, &create, nullptr, &as), "VkGeometryNV");
    RtrBindAccelerationStructureMemoryInfo bind{};
    bind.pNext = &stranger;
    expect(rtrBindAccelerationStructureMemory(rtr, 1, &bind), "RtrBindAccelerationStructureMemoryInfo");
    rtrReportMessage(rtr, VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT, "mine", "100 %s");
    EXPECT_EQ(vk->runtime_messages[0], "mine: 100 %s");
    vk->runtime_messages.clear();
}

}  // namespace
