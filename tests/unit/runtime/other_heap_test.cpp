// Structures of another heap, or of the other addressing mode: an instance of one is inactive and named in
// the header, and a launch cannot be recorded into one that is declared.
#include "launch_fixture.h"
#include "module_util.h"
#include "scene_util.h"
#include "spv/module_trace.h"
#include "spv/module_trace_address.h"

namespace {

class OtherHeapTest : public LaunchTest {
  protected:
    static VkGeometryNV triangle(Scene& scene, float x) {
        return scene.triangles({{x, 0, 0}, {x + 1, 0, 0}, {x, 1, 0}});
    }
    static uint64_t referred(const Scene& scene, RtrAccelerationStructure top, uint32_t instance) {
        const uint32_t* w = scene.words(top);
        const uint32_t* q = w + 4 * (w[RTC_HDR_SLOTS] + RTC_INSTANCE_QUADS * instance + 6);
        return q[0] | uint64_t(q[1]) << 32;
    }
    void expect_second_only(const Scene& scene, RtrAccelerationStructure top, RtrAccelerationStructure second) {
        EXPECT_EQ(scene.words(top)[RTC_HDR_ACTIVE_COUNT], 1u);
        EXPECT_EQ(scene.words(top)[RTC_HDR_BAD_INSTANCE], 1u);
        EXPECT_EQ(referred(scene, top, 0), 0u);
        EXPECT_EQ(referred(scene, top, 1), scene.handle(second));
    }
    VkResult record(Scene& scene, RtrHeap heap, const std::vector<RtrAccelerationStructure>& declared) {
        Buffer sbt = scene.upload(nullptr, 256);
        VkResult result = VK_SUCCESS;
        vk->begin();
        EXPECT_EQ(rtrBeginRecorder(scene.recorder, vk->cmd), VK_SUCCESS);
        EXPECT_EQ(rtrCmdDeclareScene(scene.recorder, uint32_t(declared.size()), declared.data()), VK_SUCCESS);
        rtrCmdBindPipeline(scene.recorder, pipeline);
        rtrCmdBindDescriptorSets(scene.recorder, 0, 1, &set, 0, nullptr);
        rtrCmdSetHeap(scene.recorder, heap);
        result = rtrCmdTraceRays(scene.recorder, sbt.handle, 0, VK_NULL_HANDLE, 0, 0, VK_NULL_HANDLE, 0, 0,
                                 VK_NULL_HANDLE, 0, 0, 1, 1, 1);
        vk->EndCommandBuffer(vk->cmd);
        EXPECT_EQ(rtrRetireRecorder(scene.recorder), VK_SUCCESS);
        return result;
    }
};

TEST_F(OtherHeapTest, HandlesOfTwoHeapsDiffer) {
    Scene a(*vk, rtr, 1 << 20), b(*vk, rtr, 1 << 20);
    auto in_a = a.build_bottom({triangle(a, 0)}), in_b = b.build_bottom({triangle(b, 9)});
    EXPECT_NE(a.handle(in_a), b.handle(in_b));
    EXPECT_EQ(uint32_t(a.handle(in_a)), uint32_t(b.handle(in_b))) << "at the same place";
    EXPECT_EQ(a.handle(in_a) >> 63, 1u) << "no device address looks like it";
}

TEST_F(OtherHeapTest, InstancesOfAnotherHeapAreInactive) {
    Scene a(*vk, rtr, 1 << 20), b(*vk, rtr, 1 << 20);
    auto in_a = a.build_bottom({triangle(a, 0)}), in_b = b.build_bottom({triangle(b, 9)});
    expect_second_only(a, a.build_top({b.instance(in_b), a.instance(in_a)}), in_a);
    expect_second_only(b, b.build_top({a.instance(in_a), b.instance(in_b)}), in_b);
    auto halved = a.instance(in_a);  // as if handles had 32 bits
    halved.accelerationStructureReference &= 0xffffffffu;
    expect_second_only(a, a.build_top({halved, a.instance(in_a)}), in_a);
    // The null handle is no mistake.
    auto with_null = a.build_top({a.instance(nullptr), a.instance(in_a)});
    EXPECT_EQ(a.words(with_null)[RTC_HDR_BAD_INSTANCE], 0u);
    if (!vk->GetBufferDeviceAddress) return;
    Scene c(*vk, rtr, 1 << 20, true);
    auto in_c = c.build_bottom({triangle(c, 0)});
    expect_second_only(a, a.build_top({c.instance(in_c), a.instance(in_a)}), in_a);
    expect_second_only(c, c.build_top({a.instance(in_a), c.instance(in_c)}), in_c);
}

TEST_F(OtherHeapTest, CopiesAndHostBuildsSayTheirOwnHeap) {
    Scene a(*vk, rtr, 1 << 20), b(*vk, rtr, 1 << 20);
    auto in_a = a.build_bottom({triangle(a, 0)}), in_b = b.build_bottom({triangle(b, 9)});
    auto self = [](const Scene& scene, RtrAccelerationStructure as) {
        return scene.words(as)[RTC_HDR_SELF_LO] | uint64_t(scene.words(as)[RTC_HDR_SELF_HI]) << 32;
    };
    VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
    info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
    auto copied = b.create(info, 4096), read = b.create(info, 4096), hosted = b.create(info, 4096);
    // From one heap to the other by way of a blob.
    Buffer blob = b.upload(nullptr, 4096);
    memset(blob.data, 0, 4096);
    b.run([&] {
        EXPECT_EQ(rtrCmdCopyAccelerationStructure(b.recorder, copied, in_b, VK_COPY_ACCELERATION_STRUCTURE_MODE_COMPACT_NV),
                  VK_SUCCESS);
        EXPECT_EQ(rtrCmdCopyAccelerationStructureToMemory(b.recorder, in_a, blob.handle, 0, 4096), VK_SUCCESS);
        vk->compute_barrier();
        EXPECT_EQ(rtrCmdCopyMemoryToAccelerationStructure(b.recorder, read, blob.handle, 0, 4096), VK_SUCCESS);
    });
    EXPECT_EQ(rtrCopyAccelerationStructureOnHost(rtr, hosted, const_cast<uint32_t*>(b.words(hosted)), in_b, b.words(in_b),
                                                 VK_COPY_ACCELERATION_STRUCTURE_MODE_COMPACT_NV),
              VK_SUCCESS);
    for (auto as : {copied, read, hosted}) EXPECT_EQ(self(b, as), b.handle(as));
    auto top = b.build_top({b.instance(copied), b.instance(read), b.instance(hosted)});
    EXPECT_EQ(b.words(top)[RTC_HDR_ACTIVE_COUNT], 3u);
    EXPECT_EQ(b.words(top)[RTC_HDR_BAD_INSTANCE], 0u);
    // A blob of a top level whose handles are still those of its old heap.
    auto top_a = a.build_top({a.instance(in_a)});
    VkAccelerationStructureInfoNV top_info = info;
    top_info.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
    auto moved = b.create(top_info, 4096);
    for (bool patched : {false, true}) {
        b.run([&] {
            EXPECT_EQ(rtrCmdCopyAccelerationStructureToMemory(b.recorder, top_a, blob.handle, 0, 4096), VK_SUCCESS);
            vk->compute_barrier();
            vk->host_barrier();
        });
        const uint64_t handle = b.handle(in_b);
        if (patched) memcpy(blob.as<char>(RTR_SERIALIZED_HANDLES_OFFSET), &handle, 8);
        b.run([&] {
            EXPECT_EQ(rtrCmdCopyMemoryToAccelerationStructure(b.recorder, moved, blob.handle, 0, 4096), VK_SUCCESS);
        });
        EXPECT_EQ(self(b, moved), b.handle(moved));
        EXPECT_EQ(referred(b, moved, 0), patched ? handle : 0);
    }
}

TEST_F(OtherHeapTest, LaunchesIntoDeclaredScenesElsewhereAreRefused) {
    Scene a(*vk, rtr, 1 << 20), b(*vk, rtr, 1 << 20);
    auto in_a = a.build_bottom({triangle(a, 0)}), in_b = b.build_bottom({triangle(b, 9)});
    auto top = a.build_top({a.instance(in_a)});
    make_set(3);
    Buffer rest = a.upload(nullptr, 256);
    VkDescriptorBufferInfo header;
    ASSERT_EQ(rtrGetAccelerationStructureDescriptor(rtr, top, &header), VK_SUCCESS);
    write(0, header);
    for (uint32_t i = 1; i < 3; i++) write(i, {rest.handle, 0, VK_WHOLE_SIZE});
    RtcModuleHeader h = module_header(1u << RTC_BINDING_PARAMS | 1u << RTC_BINDING_CONTROL, 1);
    const RtcModuleHeader of_addresses = [&] {
        auto copy = h;
        copy.flags = RTC_MODULE_ADDRESS_MODE;
        return copy;
    }();
    h.used_bindings |= 1u << RTC_BINDING_HEAP_TEXELS | 1u << RTC_BINDING_HEAP;
    ASSERT_EQ(make_pipeline(with_reflection(module_trace_spv, sizeof module_trace_spv, h, "{}"), 4), VK_SUCCESS);
    if (rtrGetDeviceSupport(rtr)->needsResumableModules) expect_runtime_error("not-resumable");
    EXPECT_EQ(record(a, a.heap, {top, in_a}), VK_SUCCESS);
    EXPECT_EQ(record(a, b.heap, {}), VK_SUCCESS) << "nothing is declared";
    EXPECT_EQ(record(a, b.heap, {top, in_a}), VK_ERROR_VALIDATION_FAILED_EXT);
    EXPECT_NE(vk->runtime_messages.back().find("structure 0 of rtrCmdDeclareScene does not lie in the heap"), std::string::npos);
    expect_runtime_error("other-heap");
    EXPECT_EQ(record(a, a.heap, {top, in_a, in_b}), VK_ERROR_VALIDATION_FAILED_EXT);
    EXPECT_NE(vk->runtime_messages.back().find("structure 2 of"), std::string::npos);
    expect_runtime_error("other-heap");
    if (!vk->GetBufferDeviceAddress) return;
    Scene c(*vk, rtr, 1 << 20, true);
    auto in_c = c.build_bottom({triangle(c, 0)});
    EXPECT_EQ(record(a, a.heap, {in_c}), VK_ERROR_VALIDATION_FAILED_EXT);
    expect_runtime_error("other-heap");
    rtrDestroyPipeline(rtr, pipeline, nullptr);
    ASSERT_EQ(make_pipeline(with_reflection(module_trace_address_spv, sizeof module_trace_address_spv, of_addresses, "{}"), 4),
              VK_SUCCESS);
    if (rtrGetDeviceSupport(rtr)->needsResumableModules) expect_runtime_error("not-resumable");
    EXPECT_EQ(record(a, nullptr, {in_c}), VK_SUCCESS);
    EXPECT_EQ(record(a, a.heap, {in_a}), VK_ERROR_VALIDATION_FAILED_EXT);
    EXPECT_NE(vk->runtime_messages.back().find("at a device address"), std::string::npos);
    expect_runtime_error("other-heap");
}

}  // namespace
