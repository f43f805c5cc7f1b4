// Acceleration structures in descriptors that are written after the set was bound, where the device has that:
// storage buffers for Vulkan, so its rules for those hold.
#include "launch_fixture.h"
#include "module_util.h"
#include "scene_util.h"
#include "spv/module_trace.h"

namespace {

class UpdateAfterBindTest : public LaunchTest {};

TEST_F(UpdateAfterBindTest, TheStructureWrittenLastIsTraced) {
    if (!vk->update_after_bind) GTEST_SKIP() << "storage buffers cannot be updated after they are bound here";
    Scene scene(*vk, rtr, 1 << 20);
    // Two scenes: a triangle at z = 0, and one at z = -5.
    RtrAccelerationStructure tops[2];
    for (int i = 0; i < 2; i++) {
        const float z = -5.0f * float(i);
        auto bottom = scene.build_bottom({scene.triangles({{-1, -1, z}, {3, -1, z}, {-1, 3, z}})});
        tops[i] = scene.build_top({scene.instance(bottom)});
    }
    const float ray[8] = {0, 0, 1, 0, 0, 0, -1, 1e30f};
    Buffer rays = scene.upload(ray, sizeof ray), hits = scene.upload(nullptr, 64), sbt = scene.upload(nullptr, 256);

    VkDescriptorSetLayoutBinding bindings[3];
    for (uint32_t i = 0; i < 3; i++)
        bindings[i] = {i, VK_DESCRIPTOR_TYPE_ACCELERATION_STRUCTURE_NV, 1, VK_SHADER_STAGE_RAYGEN_BIT_NV, nullptr};
    rtrTranslateLayoutBindings(3, bindings, bindings);
    const VkDescriptorBindingFlags flags[3] = {VK_DESCRIPTOR_BINDING_UPDATE_AFTER_BIND_BIT, 0, 0};
    VkDescriptorSetLayoutBindingFlagsCreateInfo flags_info{
        VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_BINDING_FLAGS_CREATE_INFO, nullptr, 3, flags};
    VkDescriptorSetLayoutCreateInfo layout_info{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO, &flags_info};
    layout_info.flags = VK_DESCRIPTOR_SET_LAYOUT_CREATE_UPDATE_AFTER_BIND_POOL_BIT;
    layout_info.bindingCount = 3;
    layout_info.pBindings = bindings;
    ASSERT_EQ(vk->CreateDescriptorSetLayout(vk->device, &layout_info, nullptr, &layout), VK_SUCCESS);
    VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 3};
    VkDescriptorPoolCreateInfo pool_info{VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO};
    pool_info.flags = VK_DESCRIPTOR_POOL_CREATE_UPDATE_AFTER_BIND_BIT;
    pool_info.maxSets = 1;
    pool_info.poolSizeCount = 1;
    pool_info.pPoolSizes = &size;
    ASSERT_EQ(vk->CreateDescriptorPool(vk->device, &pool_info, nullptr, &pool), VK_SUCCESS);
    VkDescriptorSetAllocateInfo allocate{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO, nullptr, pool, 1, &layout};
    ASSERT_EQ(vk->AllocateDescriptorSets(vk->device, &allocate, &set), VK_SUCCESS);

    write(1, {rays.handle, 0, VK_WHOLE_SIZE});
    write(2, {hits.handle, 0, VK_WHOLE_SIZE});
    ASSERT_EQ(rtrUpdateAccelerationStructureDescriptors(rtr, set, 0, 0, 1, &tops[0], nullptr), VK_SUCCESS);
    const RtcModuleHeader header =
        module_header(1u << RTC_BINDING_PARAMS | 1u << RTC_BINDING_HEAP_TEXELS | 1u << RTC_BINDING_HEAP |
                          1u << RTC_BINDING_CONTROL, 1);
    ASSERT_EQ(make_pipeline(with_reflection(module_trace_spv, sizeof module_trace_spv, header, ""), 4), VK_SUCCESS);
    vk->runtime_messages.clear();  // "not-resumable" on lavapipe 22.3
    scene.run([&] {
        const uint32_t first = 0;
        rtrCmdBindPipeline(scene.recorder, pipeline);
        rtrCmdBindDescriptorSets(scene.recorder, 0, 1, &set, 0, nullptr);
        rtrCmdPushConstants(scene.recorder, 0, 4, &first);
        rtrCmdSetHeap(scene.recorder, scene.heap);
        EXPECT_EQ(rtrCmdTraceRays(scene.recorder, sbt.handle, 0, VK_NULL_HANDLE, 0, 0, VK_NULL_HANDLE, 0, 0,
                                  VK_NULL_HANDLE, 0, 0, 1, 1, 1),
                  VK_SUCCESS);
        // Bound and recorded; not yet submitted.
        EXPECT_EQ(rtrUpdateAccelerationStructureDescriptors(rtr, set, 0, 0, 1, &tops[1], nullptr), VK_SUCCESS);
    });
    EXPECT_FLOAT_EQ(hits.as<float>()[0], 6.0f);
}

}  // namespace
