// Host memory that runs out: whichever allocation fails, the call says VK_ERROR_OUT_OF_HOST_MEMORY and leaves
// nothing behind.
#include <algorithm>
#include <cstdlib>
#include <functional>
#include <set>

#include "module_util.h"
#include "scene_util.h"
#include "spv/module_resume.h"

namespace {

// Fails the allocation of this number, from 0 on; frees what it gave out only.
class Failing {
  public:
    explicit Failing(int number) : left_(number) {
        callbacks.pUserData = this;
        callbacks.pfnAllocation = [](void* user, size_t size, size_t alignment, VkSystemAllocationScope) -> void* {
            auto* self = static_cast<Failing*>(user);
            if (self->left_-- == 0) {
                self->failed = true;
                return nullptr;
            }
            void* p = std::aligned_alloc(std::max<size_t>(alignment, 16), (size + 63) / 64 * 64);
            self->live.insert(p);
            return p;
        };
        callbacks.pfnReallocation = [](void*, void*, size_t, size_t, VkSystemAllocationScope) -> void* { return nullptr; };
        callbacks.pfnFree = [](void* user, void* p) {
            if (!p) return;
            EXPECT_EQ(static_cast<Failing*>(user)->live.erase(p), 1u) << "freed but not allocated here";
            std::free(p);
        };
    }
    VkAllocationCallbacks callbacks{};
    std::set<void*> live;
    bool failed = false;

  private:
    int left_;
};

class AllocationTest : public RuntimeTest {
  protected:
    // `call` with every allocation failing in turn, until none did; it undoes what succeeded.
    void every_failure(const char* what, int least, const std::function<VkResult(const VkAllocationCallbacks*)>& call) {
        SCOPED_TRACE(what);
        int n = 0;
        for (;; n++) {
            SCOPED_TRACE(n);
            ASSERT_LT(n, 1000);
            Failing memory(n);
            const VkResult r = call(&memory.callbacks);
            vk->runtime_messages.clear();  // of Vulkan functions that failed
            EXPECT_EQ(memory.live.size(), 0u) << "left behind";
            if (!memory.failed) {
                EXPECT_EQ(r, VK_SUCCESS);
                break;
            }
            EXPECT_EQ(r, VK_ERROR_OUT_OF_HOST_MEMORY);
        }
        EXPECT_GE(n, least) << "allocations seen";
    }
};

TEST_F(AllocationTest, EveryAllocationMayFail) {
    Scene scene(*vk, rtr, 1 << 16);
    const std::vector<Vec3> vertices{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 0, 0}, {3, 0, 0}, {2, 1, 0}};
    const std::vector<VkGeometryNV> geometry{scene.triangles(vertices)};
    VkAccelerationStructureCreateInfoNV create{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_NV};
    create.info.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV;
    create.info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
    create.info.geometryCount = 1;
    create.info.pGeometries = geometry.data();
    every_failure("structure", 2, [&](const VkAllocationCallbacks* a) {
        RtrAccelerationStructure as = nullptr;
        const VkResult r = rtrCreateAccelerationStructure(rtr, &create, a, &as);
        EXPECT_EQ(as == nullptr, r != VK_SUCCESS);
        rtrDestroyAccelerationStructure(rtr, as, a);
        return r;
    });
    Buffer buffer = vk->buffer(4096, RTR_HEAP_BUFFER_USAGE);
    every_failure("heap and its ranges", 2, [&](const VkAllocationCallbacks* a) {
        RtrHeapCreateInfo info{nullptr, buffer.handle, 0, buffer.size};
        RtrHeap heap = nullptr;
        VkDeviceSize at = 0;
        VkResult r = rtrCreateHeap(rtr, &info, a, &heap);
        EXPECT_EQ(heap == nullptr, r != VK_SUCCESS);
        if (r == VK_SUCCESS) r = rtrAllocateHeapRange(heap, 256, 0, &at);
        rtrDestroyHeap(rtr, heap, a);
        return r;
    });
    const auto dst = scene.create(create.info);
    Buffer scratch = vk->buffer(scene.scratch_size(dst), RTR_SCRATCH_BUFFER_USAGE);
    every_failure("recorder and what it records", 2, [&](const VkAllocationCallbacks* a) {
        RtrRecorderCreateInfo info{};
        RtrRecorder recorder = nullptr;
        VkResult r = rtrCreateRecorder(rtr, &info, a, &recorder);
        if (r != VK_SUCCESS) return r;
        vk->begin();
        EXPECT_EQ(rtrBeginRecorder(recorder, vk->cmd), VK_SUCCESS);
        r = rtrCmdBuildAccelerationStructure(recorder, &create.info, VK_NULL_HANDLE, 0, VK_FALSE, dst, nullptr,
                                             scratch.handle, 0);
        vk->submit();
        rtrDestroyRecorder(rtr, recorder, a);
        return r;
    });
    every_failure("host build", 1, [&](const VkAllocationCallbacks* a) {
        RtrHostGeometry host{vertices.data(), nullptr, nullptr, nullptr};
        std::vector<char> memory(65536);
        return rtrBuildAccelerationStructureOnHost(rtr, &create.info, &host, dst, memory.data(), a);
    });
    RtcModuleHeader header = module_header(1u << RTC_BINDING_PARAMS | 1u << RTC_BINDING_CONTROL |
                                               1u << RTC_BINDING_SCRATCH, 1);
    header.flags |= RTC_MODULE_RESUMABLE;
    header.reserved_set = 0;
    const auto code = with_reflection(module_resume_spv, sizeof module_resume_spv, header, "{}");
    uint32_t value = 3;
    VkSpecializationMapEntry entry{7, 0, 4};
    VkSpecializationInfo constants{1, &entry, 4, &value};
    every_failure("deferred pipeline", 6, [&](const VkAllocationCallbacks* a) {
        RtrRayTracingPipelineCreateInfo info{};
        info.flags = VK_PIPELINE_CREATE_DEFER_COMPILE_BIT_NV;
        info.pCode = code.data();
        info.codeSize = code.size() * 4;
        info.pSpecializationInfo = &constants;
        RtrPipeline pipeline = nullptr;
        const VkResult r = rtrCreateRayTracingPipeline(rtr, VK_NULL_HANDLE, &info, a, &pipeline);
        EXPECT_EQ(pipeline == nullptr, r != VK_SUCCESS);
        rtrDestroyPipeline(rtr, pipeline, a);
        return r;
    });
    vk->destroy(buffer);
    vk->destroy(scratch);
}

}  // namespace
