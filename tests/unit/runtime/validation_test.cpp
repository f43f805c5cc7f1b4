// RtrDeviceCreateInfo::validation: shader binding tables are looked at before a launch.
#include "launch_fixture.h"
#include "module_util.h"
#include "scene_util.h"
#include "spv/module_trace.h"

namespace {

class ValidationTest : public ValidatedLaunchTest {
  protected:
    // One ray that misses everything: hits[0].t becomes ~0 where the launch ran.
    RtrLaunchError launch(bool sized, VkDeviceSize miss_size, uint32_t foreign_record) {
        Scene scene(*vk, rtr, 1 << 16);
        const float ray[8] = {0, 0, 0, 0, 0, 0, 1, 1e30f};
        Buffer rays = scene.upload(ray, sizeof ray), hits = scene.upload(nullptr, 256),
               sbt = scene.upload(nullptr, 1024);
        memset(hits.data, 0, 256);
        memset(sbt.data, 0, 1024);
        if (!layout) make_set(3);
        VkDescriptorBufferInfo header;
        EXPECT_EQ(rtrGetNullAccelerationStructureDescriptor(rtr, scene.heap, &header), VK_SUCCESS);
        write(0, header);
        write(1, {rays.handle, 0, VK_WHOLE_SIZE});
        write(2, {hits.handle, 0, VK_WHOLE_SIZE});
        RtcModuleHeader h = module_header(1u << RTC_BINDING_PARAMS | 1u << RTC_BINDING_HEAP_TEXELS |
                                              1u << RTC_BINDING_HEAP | 1u << RTC_BINDING_CONTROL,
                                          2);
        if (!pipeline) {
            EXPECT_EQ(
                make_pipeline(with_reflection(module_trace_spv, sizeof module_trace_spv, h, "{}"), 4),
                VK_SUCCESS);
            if (rtrGetDeviceSupport(rtr)->needsResumableModules) expect_runtime_error("not-resumable");
        }
        // Raygen at 0, four miss records of 32 bytes at 512; the third stays null.
        uint32_t handle[8];
        EXPECT_EQ(rtrGetRayTracingShaderGroupHandles(rtr, pipeline, 0, 1, 32, handle), VK_SUCCESS);
        memcpy(sbt.data, handle, 32);
        for (int i : {0, 1, 3}) memcpy(sbt.as<char>(512 + 32 * static_cast<VkDeviceSize>(i)), handle, 32);
        if (foreign_record != ~0u) {
            VkDeviceSize at = foreign_record == 9 ? 0 : 512 + 32 * foreign_record;
            sbt.as<uint32_t>(at)[0] = 100;
            sbt.as<uint32_t>(at)[7] ^= 1;
        }
        uint32_t first = 0;
        scene.run([&] {
            auto rec = scene.recorder;
            rtrCmdBindPipeline(rec, pipeline);
            rtrCmdBindDescriptorSets(rec, 0, 1, &set, 0, nullptr);
            rtrCmdPushConstants(rec, 0, 4, &first);
            rtrCmdSetHeap(rec, scene.heap);
            RtrStridedBufferRegion raygen{sbt.handle, 0, 0, 32}, miss{sbt.handle, 512, 32, miss_size};
            if (sized)
                EXPECT_EQ(rtrCmdTraceRaysRegions(rec, &raygen, &miss, nullptr, nullptr, 1, 1, 1), VK_SUCCESS);
            else
                EXPECT_EQ(rtrCmdTraceRays(rec, sbt.handle, 0, sbt.handle, 512, 32, VK_NULL_HANDLE, 0, 0,
                                          VK_NULL_HANDLE, 0, 0, 1, 1, 1),
                          VK_SUCCESS);
            VkDescriptorBufferInfo place;
            EXPECT_EQ(rtrGetLaunchErrorLocation(rec, 0, &place), VK_SUCCESS);
            at_ = place.offset;
        });
        ran = hits.as<uint32_t>()[0] == 0xffffffffu;
        RtrLaunchError error;
        rtrDecodeLaunchError(scene.control.as<uint32_t>(at_), &error);
        return error;
    }

    bool ran = false;

  private:
    VkDeviceSize at_ = 0;
};

TEST_F(ValidationTest, GoodTablesRun) {
    for (bool sized : {true, false}) {
        EXPECT_EQ(launch(sized, 128, ~0u).code, RTC_LAUNCH_ERROR_NONE);
        EXPECT_TRUE(ran);
    }
    EXPECT_EQ(launch(true, 512, ~0u).code, RTC_LAUNCH_ERROR_NONE);  // to the last byte
    EXPECT_TRUE(ran);
    // Without a size it is not known what belongs to the table.
    EXPECT_EQ(launch(false, 0, 1).code, RTC_LAUNCH_ERROR_NONE);
    EXPECT_TRUE(ran);
}

TEST_F(ValidationTest, BadTablesDoNot) {
    char text[256];
    RtrLaunchError e = launch(true, 128, 3);
    EXPECT_FALSE(ran);
    EXPECT_EQ(e.code, RTC_LAUNCH_ERROR_BAD_HANDLE);
    EXPECT_EQ(e.count, 1u);
    EXPECT_EQ(e.detail[0], 100u);
    rtrFormatLaunchError(&e, text, sizeof text);
    EXPECT_NE(std::string(text).find("record 3 of the miss region"), std::string::npos) << text;
    for (bool sized : {true, false}) {
        e = launch(sized, 128, 9);
        EXPECT_FALSE(ran);
        EXPECT_EQ(e.code, RTC_LAUNCH_ERROR_BAD_HANDLE);
        rtrFormatLaunchError(&e, text, sizeof text);
        EXPECT_NE(std::string(text).find("record 0 of the raygen region"), std::string::npos) << text;
    }
    e = launch(true, 544, ~0u);  // one record more than the buffer has
    EXPECT_FALSE(ran);
    EXPECT_EQ(e.code, RTC_LAUNCH_ERROR_SBT_RANGE);
    EXPECT_EQ(e.detail[0], 512u);
    rtrFormatLaunchError(&e, text, sizeof text);
    EXPECT_NE(std::string(text).find("the miss region"), std::string::npos) << text;
}

TEST_F(ValidationTest, ModulesThatDoNotCheckAreNamed) {
    make_set(3);
    RtcModuleHeader h = module_header(1u << RTC_BINDING_PARAMS | 1u << RTC_BINDING_HEAP_TEXELS |
                                          1u << RTC_BINDING_HEAP | 1u << RTC_BINDING_CONTROL,
                                      2);
    for (const bool checked : {false, true}) {
        h.flags = checked ? RTC_MODULE_CHECKED : 0;
        unchecked = 0;
        ASSERT_EQ(make_pipeline(with_reflection(module_trace_spv, sizeof module_trace_spv, h, "{}"), 4), VK_SUCCESS);
        if (rtrGetDeviceSupport(rtr)->needsResumableModules) expect_runtime_error("not-resumable");
        EXPECT_EQ(unchecked, checked ? 0u : 1u);
        rtrDestroyPipeline(rtr, pipeline, nullptr);
        pipeline = nullptr;
    }
}

}  // namespace
