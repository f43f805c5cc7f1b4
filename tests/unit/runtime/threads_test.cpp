// Threads with recorders, heaps and structures of their own use one device and one pipeline at the
// same time, validation included. Under ThreadSanitizer: threads_tsan.sh.
#include <thread>

#include "launch_fixture.h"
#include "module_util.h"
#include "spv/module_trace.h"

namespace {

class ThreadsTest : public ValidatedLaunchTest {
  protected:
    ThreadsTest() : ValidatedLaunchTest(false) {}
};

constexpr auto kUpdate = VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV;

// What one thread does with what is its own.
struct Worker {
    Vulkan* vk;
    RtrDevice rtr;
    RtrPipeline pipeline;
    VkDescriptorSet set;
    Buffer memory, scratch, control, vertices, instances, results, table;
    VkCommandPool pool = VK_NULL_HANDLE;
    VkCommandBuffer cmd = VK_NULL_HANDLE;
    VkGeometryNV geometry{VK_STRUCTURE_TYPE_GEOMETRY_NV};
    std::string problem;

    void check(VkResult r, const char* what) {
        if (r != VK_SUCCESS && problem.empty()) problem = what;
    }
    RtrAccelerationStructure create(RtrHeap heap, const VkAccelerationStructureInfoNV& info) {
        VkAccelerationStructureCreateInfoNV create{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_NV};
        create.info = info;
        RtrAccelerationStructure as = nullptr;
        check(rtrCreateAccelerationStructure(rtr, &create, nullptr, &as), "create");
        VkMemoryRequirements2 need{VK_STRUCTURE_TYPE_MEMORY_REQUIREMENTS_2};
        rtrGetAccelerationStructureMemoryRequirements(
            rtr, VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_OBJECT_NV, as, &need);
        RtrBindAccelerationStructureMemoryInfo bind{};
        bind.accelerationStructure = as;
        bind.heap = heap;
        check(rtrAllocateHeapRange(heap, need.memoryRequirements.size, 0, &bind.heapOffset), "allocate");
        check(rtrBindAccelerationStructureMemory(rtr, 1, &bind), "bind");
        return as;
    }

    void run(int rounds) {
        VkAccelerationStructureInfoNV bottom{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV}, top = bottom;
        bottom.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
        bottom.flags = kUpdate;
        bottom.geometryCount = 1;
        bottom.pGeometries = &geometry;
        top.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
        top.instanceCount = 2;
        for (int round = 0; round < rounds; round++) {
            RtrHeapCreateInfo heap_info{nullptr, memory.handle, 0, memory.size};
            RtrHeap heap = nullptr;
            RtrRecorder recorder = nullptr;
            check(rtrCreateHeap(rtr, &heap_info, nullptr, &heap), "heap");
            RtrRecorderCreateInfo recorder_info{nullptr, control.handle, 0, control.size};
            check(rtrCreateRecorder(rtr, &recorder_info, nullptr, &recorder), "recorder");
            RtrAccelerationStructure as[4] = {create(heap, bottom), create(heap, bottom), create(heap, bottom),
                                              create(heap, top)};
            VkCommandBufferBeginInfo begin{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
            vk->BeginCommandBuffer(cmd, &begin);
            check(rtrBeginRecorder(recorder, cmd), "begin");
            check(rtrCmdInitializeHeap(recorder, heap), "initialise");
            RtrAccelerationStructureBuildInfo builds[3] = {};
            for (int i = 0; i < 3; i++) {
                builds[i].pInfo = i < 2 ? &bottom : &top;
                builds[i].dst = as[i < 2 ? i : 3];
                builds[i].instanceData = instances.handle;
                builds[i].scratch = scratch.handle;
                builds[i].scratchOffset = (1u << 16) * static_cast<VkDeviceSize>(i);
            }
            check(rtrCmdBuildAccelerationStructures(recorder, 3, builds), "build");
            check(rtrCmdBuildAccelerationStructure(recorder, &bottom, VK_NULL_HANDLE, 0, VK_TRUE, as[2], as[0],
                                                   scratch.handle, 0),
                  "update");
            check(rtrCmdCopyAccelerationStructure(recorder, as[1], as[0], VK_COPY_ACCELERATION_STRUCTURE_MODE_CLONE_NV),
                  "copy");
            check(rtrCmdWriteAccelerationStructuresProperties(
                      recorder, 2, as, VK_QUERY_TYPE_ACCELERATION_STRUCTURE_COMPACTED_SIZE_NV, results.handle, 0),
                  "query");
            check(rtrCmdDeclareScene(recorder, 4, as), "declare");
            check(rtrCmdBindPipeline(recorder, pipeline), "pipeline");
            check(rtrCmdBindDescriptorSets(recorder, 0, 1, &set, 0, nullptr), "sets");
            check(rtrCmdSetHeap(recorder, heap), "heap");
            RtrStridedBufferRegion raygen{table.handle, 0, 0, 32};
            check(rtrCmdTraceRaysRegions(recorder, &raygen, nullptr, nullptr, nullptr, 8, 8, 1), "trace");
            VkMemoryBarrier b{VK_STRUCTURE_TYPE_MEMORY_BARRIER, nullptr, VK_ACCESS_MEMORY_WRITE_BIT,
                              VK_ACCESS_HOST_READ_BIT};
            vk->CmdPipelineBarrier(cmd, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &b, 0,
                                   nullptr, 0, nullptr);
            vk->EndCommandBuffer(cmd);
            vk->ResetCommandPool(vk->device, pool, 0);  // recording is the point; nothing is submitted
            rtrDestroyRecorder(rtr, recorder, nullptr);
            for (auto a : as) rtrDestroyAccelerationStructure(rtr, a, nullptr);
            rtrDestroyHeap(rtr, heap, nullptr);
        }
    }
};

TEST_F(ThreadsTest, RecordEverythingAtTheSameTime) {
    make_set(3);
    Buffer some = vk->buffer(4096, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT);
    for (uint32_t i = 0; i < 3; i++) write(i, {some.handle, 0, 256});
    RtcModuleHeader h = module_header(1u << RTC_BINDING_PARAMS | 1u << RTC_BINDING_HEAP_TEXELS |
                                          1u << RTC_BINDING_HEAP | 1u << RTC_BINDING_CONTROL,
                                      1);
    ASSERT_EQ(make_pipeline(with_reflection(module_trace_spv, sizeof module_trace_spv, h, "{}"), 4), VK_SUCCESS);
    std::vector<Worker> workers(4);
    for (auto& w : workers) {
        w.vk = vk;
        w.rtr = rtr;
        w.pipeline = pipeline;
        w.set = set;
        w.memory = vk->buffer(1 << 18, RTR_HEAP_BUFFER_USAGE);
        w.scratch = vk->buffer(1 << 18, RTR_SCRATCH_BUFFER_USAGE);
        w.control = vk->buffer(1 << 18, RTR_CONTROL_BUFFER_USAGE);
        w.vertices = vk->buffer(36 * 100, RTR_INPUT_BUFFER_USAGE);
        w.instances = vk->buffer(128, RTR_INPUT_BUFFER_USAGE);
        w.results = vk->buffer(256, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT);
        w.table = vk->buffer(256, RTR_INPUT_BUFFER_USAGE);
        VkCommandPoolCreateInfo pool_info{VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO};
        pool_info.queueFamilyIndex = vk->queue_family;
        vk->CreateCommandPool(vk->device, &pool_info, nullptr, &w.pool);
        VkCommandBufferAllocateInfo allocate{VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO};
        allocate.commandPool = w.pool;
        allocate.commandBufferCount = 1;
        vk->AllocateCommandBuffers(vk->device, &allocate, &w.cmd);
        w.geometry.geometryType = VK_GEOMETRY_TYPE_TRIANGLES_NV;
        auto& t = w.geometry.geometry.triangles;
        t.sType = VK_STRUCTURE_TYPE_GEOMETRY_TRIANGLES_NV;
        t.vertexData = w.vertices.handle;
        t.vertexCount = 300;
        t.vertexStride = 12;
        t.vertexFormat = VK_FORMAT_R32G32B32_SFLOAT;
        t.indexType = VK_INDEX_TYPE_NONE_NV;
        w.geometry.geometry.aabbs.sType = VK_STRUCTURE_TYPE_GEOMETRY_AABB_NV;
    }
    std::vector<std::thread> threads;
    for (auto& w : workers) threads.emplace_back([&w] { w.run(6); });
    for (auto& t : threads) t.join();
    for (auto& w : workers) {
        EXPECT_EQ(w.problem, "");
        vk->DestroyCommandPool(vk->device, w.pool, nullptr);
        for (Buffer* b : {&w.memory, &w.scratch, &w.control, &w.vertices, &w.instances, &w.results, &w.table})
            vk->destroy(*b);
    }
    vk->destroy(some);
}

}  // namespace
