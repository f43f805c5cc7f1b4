// Address mode: structures bound to buffers, named by their device addresses, traced
// without a heap; what it refuses.
#include <cmath>
#include <random>

#include "launch_fixture.h"
#include "module_util.h"
#include "scene_util.h"
#include "spv/module_trace_address.h"

namespace {

class AddressTest : public LaunchTest {
  protected:
    void SetUp() override {
        RuntimeTest::SetUp();
        if (vk && !vk->GetBufferDeviceAddress) GTEST_SKIP() << "the device has no bufferDeviceAddress";
    }

    static std::vector<uint32_t> module() {
        RtcModuleHeader h = module_header(1u << RTC_BINDING_PARAMS | 1u << RTC_BINDING_CONTROL, 1);
        h.flags = RTC_MODULE_ADDRESS_MODE;
        return with_reflection(module_trace_address_spv, sizeof module_trace_address_spv, h, "{}");
    }
};

struct Ray {
    float o[3], tmin, d[3], tmax;
};
struct Hit {
    uint32_t t, instance, geometry, primitive;
};

TEST_F(AddressTest, HandlesAreDeviceAddresses) {
    Scene scene(*vk, rtr, 1 << 20, true);
    auto bottom = scene.build_bottom({scene.triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}})});
    auto top = scene.build_top({scene.instance(bottom)});
    VkBufferDeviceAddressInfo info{VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO};
    info.buffer = scene.heap_buffer.handle;
    VkDeviceAddress start = vk->GetBufferDeviceAddress(vk->device, &info);
    for (auto as : {bottom, top}) {
        uint64_t handle = scene.handle(as);
        VkDescriptorBufferInfo header;
        ASSERT_EQ(rtrGetAccelerationStructureDescriptor(rtr, as, &header), VK_SUCCESS);
        EXPECT_EQ(header.buffer, scene.heap_buffer.handle);
        EXPECT_EQ(handle, start + header.offset);
        const uint32_t* w = scene.words(as);
        EXPECT_EQ(w[RTC_HDR_SELF_LO] | uint64_t(w[RTC_HDR_SELF_HI]) << 32, handle);
        EXPECT_TRUE(w[RTC_HDR_FACTS] & RTC_FACT_ADDRESSES);
    }
    const uint32_t* record = scene.words(top) + 4 * scene.words(top)[RTC_HDR_SLOTS];
    EXPECT_EQ(record[24] | uint64_t(record[25]) << 32, scene.handle(bottom));
    TreeFacts facts;
    check_structure(scene, top, facts);
}

// Bottom levels in two buffers and a top level in a third, which no heap could do. Rays
// along z at known instances.
TEST_F(AddressTest, TracesAcrossBuffers) {
    Scene one(*vk, rtr, 1 << 20, true), two(*vk, rtr, 1 << 20, true), scene(*vk, rtr, 1 << 20, true);
    std::mt19937 rng(7);
    std::uniform_real_distribution<float> u(0.05f, 0.3f);
    std::vector<Vec3> vertices[2];
    for (auto& v : vertices) {
        for (int i = 0; i < 100; i++) {  // a grid of triangles at z = 0, 1 apart
            float x = float(i % 10), y = float(i / 10);
            v.insert(v.end(), {{x, y, 0}, {x + 0.9f, y, 0}, {x, y + 0.9f, u(rng)}});
        }
    }
    RtrAccelerationStructure bottoms[2] = {one.build_bottom({one.triangles(vertices[0])}),
                                           two.build_bottom({two.triangles(vertices[1])})};
    std::vector<VkAccelerationStructureInstanceNV> instances;
    for (int i = 0; i < 20; i++) {
        auto instance = scene.instance(bottoms[i % 2]);
        instance.transform.matrix[2][3] = -2.0f * float(i / 2);
        instance.transform.matrix[0][3] = 20.0f * float(i % 2);
        instances.push_back(instance);
    }
    auto top = scene.build_top(instances);
    std::vector<Ray> rays;
    for (int i = 0; i < 200; i++) {  // starts between two layers
        int layer = i % 10, cell = i / 2;
        rays.push_back({{20.0f * (i % 2) + float(cell % 10) + 0.1f, float(cell / 10) + 0.1f,
                         -2.0f * float(layer) + 1},
                        0,
                        {0, 0, -1},
                        1e30f});
    }
    Buffer ray_buffer = scene.upload(rays.data(), rays.size() * sizeof(Ray));
    Buffer hits = scene.upload(nullptr, rays.size() * sizeof(Hit));
    VkDescriptorBufferInfo header;
    ASSERT_EQ(rtrGetAccelerationStructureDescriptor(rtr, top, &header), VK_SUCCESS);
    make_set(3);
    write(0, header);
    write(1, {ray_buffer.handle, 0, VK_WHOLE_SIZE});
    write(2, {hits.handle, 0, VK_WHOLE_SIZE});
    ASSERT_EQ(make_pipeline(module(), 4), VK_SUCCESS);
    if (rtrGetDeviceSupport(rtr)->needsResumableModules) expect_runtime_error("not-resumable");
    Buffer sbt = scene.upload(nullptr, 256);
    uint32_t first = 0;
    auto launch = [&] {
        scene.run([&] {
            rtrCmdBindPipeline(scene.recorder, pipeline);
            rtrCmdBindDescriptorSets(scene.recorder, 0, 1, &set, 0, nullptr);
            rtrCmdPushConstants(scene.recorder, 0, 4, &first);
            EXPECT_EQ(rtrCmdTraceRays(scene.recorder, sbt.handle, 0, VK_NULL_HANDLE, 0, 0, VK_NULL_HANDLE, 0,
                                      0, VK_NULL_HANDLE, 0, 0, static_cast<uint32_t>(rays.size()), 1, 1),
                      VK_SUCCESS);
        });
    };
    launch();
    for (uint32_t i = 0; i < rays.size(); i++) {
        const Hit& hit = hits.as<Hit>()[i];
        EXPECT_EQ(hit.instance, 2 * (i % 10) + i % 2) << i;
        EXPECT_EQ(hit.primitive, i / 2) << i;
    }
    // 256 zero bytes are a null structure.
    Buffer zero = scene.upload(nullptr, 256);
    memset(zero.data, 0, 256);
    write(0, {zero.handle, 0, 256});
    launch();
    for (uint32_t i = 0; i < rays.size(); i++) EXPECT_EQ(hits.as<Hit>()[i].t, 0xffffffffu);
}

TEST_F(AddressTest, WhatIsRefused) {
    Scene scene(*vk, rtr, 1 << 20, true), heap_scene(*vk, rtr, 1 << 20);
    auto a = scene.build_bottom({scene.triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}})});
    auto h = heap_scene.build_bottom({heap_scene.triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}})});
    // Copies and updates between the modes.
    scene.run([&] {
        for (auto [dst, src] : {std::pair{a, h}, std::pair{h, a}}) {
            EXPECT_EQ(rtrCmdCopyAccelerationStructure(scene.recorder, dst, src,
                                                      VK_COPY_ACCELERATION_STRUCTURE_MODE_CLONE_NV),
                      VK_ERROR_VALIDATION_FAILED_EXT);
            expect_runtime_error("copy");
        }
    });
    // A top level of the heap with an address in an instance: inactive, and told.
    auto top = heap_scene.build_top({heap_scene.instance(h), scene.instance(a)});
    EXPECT_EQ(heap_scene.words(top)[RTC_HDR_ACTIVE_COUNT], 1u);
    EXPECT_EQ(heap_scene.words(top)[RTC_HDR_FIRST_OFFENDER], 0u);  // not opaque comes first
    // Binding.
    VkAccelerationStructureCreateInfoNV create{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_NV};
    create.info.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV;
    create.info.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
    RtrAccelerationStructure as = nullptr;
    ASSERT_EQ(rtrCreateAccelerationStructure(rtr, &create, nullptr, &as), VK_SUCCESS);
    RtrBindAccelerationStructureMemoryInfo bind{};
    auto refused = [&](const char* id) {
        EXPECT_EQ(rtrBindAccelerationStructureMemory(rtr, 1, &bind), VK_ERROR_VALIDATION_FAILED_EXT);
        expect_runtime_error(id);
    };
    refused("bind");
    bind.accelerationStructure = as;
    refused("bind");
    bind.buffer = scene.heap_buffer.handle;
    bind.heap = heap_scene.heap;
    refused("bind");
    bind.heap = nullptr;
    bind.bufferOffset = 128;
    refused("bind-offset");
    bind.bufferOffset = 0;
    ASSERT_EQ(rtrBindAccelerationStructureMemory(rtr, 1, &bind), VK_SUCCESS);
    refused("bind");  // twice
    rtrDestroyAccelerationStructure(rtr, as, nullptr);
}

// A device without the feature refuses address mode wherever it appears, by name.
TEST_F(AddressTest, NeedsTheFeature) {
    RtrDeviceCreateInfo info{};
    info.instance = vk->instance;
    info.physicalDevice = vk->physical_device;
    info.device = vk->device;
    info.pfnGetInstanceProcAddr = vk->get_instance_proc_addr;
    auto messenger = vk->messenger_info(true);
    info.pMessenger = &messenger;
    RtrDevice plain = nullptr;
    ASSERT_EQ(rtrCreateDevice(&info, nullptr, &plain), VK_SUCCESS);
    EXPECT_EQ(make_pipeline(module(), 4, nullptr, nullptr, plain), VK_ERROR_FEATURE_NOT_PRESENT);
    expect_runtime_error("address-mode");
    VkAccelerationStructureCreateInfoNV create{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_NV};
    create.info.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV;
    create.info.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
    RtrAccelerationStructure as = nullptr;
    ASSERT_EQ(rtrCreateAccelerationStructure(plain, &create, nullptr, &as), VK_SUCCESS);
    Buffer buffer = vk->buffer(1 << 16, RTR_ADDRESS_BUFFER_USAGE);
    RtrBindAccelerationStructureMemoryInfo bind{};
    bind.accelerationStructure = as;
    bind.buffer = buffer.handle;
    EXPECT_EQ(rtrBindAccelerationStructureMemory(plain, 1, &bind), VK_ERROR_FEATURE_NOT_PRESENT);
    expect_runtime_error("address-mode");
    rtrDestroyAccelerationStructure(plain, as, nullptr);
    rtrDestroyDevice(plain, nullptr);
    vk->destroy(buffer);
}

}  // namespace
