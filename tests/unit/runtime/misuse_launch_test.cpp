// Every diagnostic about recorders, shader binding tables and launches: what provokes it, its id,
// VkResult and advice.
#include "expect_refused.h"
#include "faulty_vulkan.h"
#include "launch_fixture.h"
#include "module_util.h"
#include "scene_util.h"
#include "spv/module_resume.h"

namespace {

constexpr VkResult kInvalid = VK_ERROR_VALIDATION_FAILED_EXT, kAbsent = VK_ERROR_FEATURE_NOT_PRESENT;
constexpr uint32_t kHeapUsed = 1u << RTC_BINDING_PARAMS | 1u << RTC_BINDING_HEAP_TEXELS | 1u << RTC_BINDING_HEAP |
                               1u << RTC_BINDING_SBT_RAYGEN | 1u << RTC_BINDING_SBT_HIT |
                               1u << RTC_BINDING_CONTROL | 1u << RTC_BINDING_SCRATCH;

class MisuseLaunchTest : public LaunchTest {
  protected:
    void make(RtcModuleHeader header, RtrDevice device = nullptr, const RtrTraceOptions* options = nullptr) {
        if (!layout) make_set(1);
        rtrDestroyPipeline(device ? device : rtr, pipeline, nullptr);
        ASSERT_EQ(make_pipeline(with_reflection(module_resume_spv, sizeof module_resume_spv, header, ""), 8, options,
                                nullptr, device),
                  VK_SUCCESS);
        vk->runtime_messages.clear();  // "not-resumable" on lavapipe 22.3
    }
};

TEST_F(MisuseLaunchTest, Recorders) {
    Buffer control = vk->buffer(4096, RTR_CONTROL_BUFFER_USAGE);
    RtrRecorder recorder = nullptr;
    expect_refused(*vk, {{"control-offset", kInvalid, "multiple of 256", [&] {
                              RtrRecorderCreateInfo info{nullptr, control.handle, 128, 1024};
                              return rtrCreateRecorder(rtr, &info, nullptr, &recorder);
                          }}});
    RtrRecorderCreateInfo info{nullptr, control.handle, 0, control.size};
    ASSERT_EQ(rtrCreateRecorder(rtr, &info, nullptr, &recorder), VK_SUCCESS);
    const std::vector<VkDescriptorSet> sets(64);
    const std::vector<uint32_t> offsets(64);
    VkDescriptorBufferInfo place;
    RtrLaunchError error;
    Buffer out = vk->buffer(512, RTR_INPUT_BUFFER_USAGE);
    const uint32_t word = 0;
    // Before it has a command buffer.
    expect_refused(*vk, {
        {"command-buffer", kInvalid, "one in the recording state is needed",
         [&] { return rtrBeginRecorder(recorder, VK_NULL_HANDLE); }},
        {"recorder-not-begun", kInvalid, "rtrBeginRecorder first", [&] { return rtrCmdBindPipeline(recorder, nullptr); }},
        {"recorder-not-begun", kInvalid, "rtrBeginRecorder first",
         [&] { return rtrCmdPushConstants(recorder, 0, 4, &word); }},
        {"recorder-not-begun", kInvalid, "rtrBeginRecorder first",
         [&] { return rtrCmdBindDescriptorSets(recorder, 0, 1, sets.data(), 0, nullptr); }},
        {"recorder-not-begun", kInvalid, "rtrBeginRecorder first",
         [&] { return rtrCmdSetRayTracingPipelineStackSize(recorder, 0); }},
        {"recorder-not-begun", kInvalid, "rtrBeginRecorder first",
         [&] { return rtrCmdDeclareScene(recorder, 0, nullptr); }},
        {"recorder-not-begun", kInvalid, "rtrBeginRecorder first",
         [&] { return rtrCmdTraceRaysRegions(recorder, nullptr, nullptr, nullptr, nullptr, 1, 1, 1); }},
        {"probe", kInvalid, "begin the recorder", [&] { return rtrCmdProbeFloat(recorder, out.handle, 0); }},
    });
    vk->begin();
    ASSERT_EQ(rtrBeginRecorder(recorder, vk->cmd), VK_SUCCESS);
    expect_refused(*vk, {
        {"probe", kInvalid, "multiple of 256", [&] { return rtrCmdProbeFloat(recorder, out.handle, 8); }},
        {"bind-sets", kInvalid, "at most 32",
         [&] { return rtrCmdBindDescriptorSets(recorder, 0, 33, sets.data(), 0, nullptr); }},
        {"bind-sets", kInvalid, "63",
         [&] { return rtrCmdBindDescriptorSets(recorder, 0, 1, sets.data(), 64, offsets.data()); }},
        {"push-constants", kInvalid, "multiples of 4", [&] { return rtrCmdPushConstants(recorder, 2, 4, &word); }},
        {"push-constants", kInvalid, "below 4096", [&] { return rtrCmdPushConstants(recorder, 4096, 4, &word); }},
        {"scratch", kInvalid, "not a multiple of 256",
         [&] { return rtrCmdSetLaunchScratch(recorder, out.handle, 64, 256); }},
        {"rounds", kInvalid, "at most 16384", [&] { return rtrCmdSetLaunchLimits(recorder, 0, 16385); }},
        {"no-pipeline", kInvalid, "rtrCmdBindPipeline first",
         [&] { return rtrCmdTraceRaysRegions(recorder, nullptr, nullptr, nullptr, nullptr, 1, 1, 1); }},
        {"launch-index", kInvalid, "launch 0 of the 0 that were recorded",
         [&] { return rtrGetLaunchErrorLocation(recorder, 0, &place); }},
        {"launch-index", kInvalid, "launch 3 of the 0", [&] { return rtrGetLaunchError(recorder, 3, out.data, &error); }},
    });
    // Calls that overlap in part are kept; there is an end to that.
    for (uint32_t i = 0; i < 32; i++)
        ASSERT_EQ(rtrCmdBindDescriptorSets(recorder, i, 2, sets.data(), 0, nullptr), VK_SUCCESS);
    expect_refused(*vk, {{"bind-sets", kInvalid, "bind such sets in one call",
                          [&] { return rtrCmdBindDescriptorSets(recorder, 32, 2, sets.data(), 0, nullptr); }}});
    vk->submit();
    rtrDestroyRecorder(rtr, recorder, nullptr);
    vk->destroy(control);
    vk->destroy(out);
}

TEST_F(MisuseLaunchTest, Launches) {
    RtcModuleHeader header = module_header(kHeapUsed, 2);
    header.flags |= RTC_MODULE_RESUMABLE;
    header.scratch_words = 1;
    header.stack_words = 4;
    make(header);
    Scene scene(*vk, rtr, 1 << 16);
    Buffer sbt = scene.upload(nullptr, 1024);
    Buffer scratch = vk->buffer(1 << 16, RTR_LAUNCH_SCRATCH_BUFFER_USAGE);
    const RtrStridedBufferRegion good{sbt.handle, 0, 64, 256}, odd{sbt.handle, 32, 64, 256},
        narrow{sbt.handle, 0, 40, 256}, wide{sbt.handle, 0, 8192, 8192}, none{};
    auto trace = [&](const RtrStridedBufferRegion& raygen, const RtrStridedBufferRegion& hit, uint32_t w = 1,
                     uint32_t h = 1, uint32_t d = 1) {
        return [&, w, h, d] { return rtrCmdTraceRaysRegions(scene.recorder, &raygen, nullptr, &hit, nullptr, w, h, d); };
    };
    scene.run([&] {
        ASSERT_EQ(rtrCmdBindPipeline(scene.recorder, pipeline), VK_SUCCESS);
        expect_refused(*vk, {
            {"sbt-raygen", kInvalid, "the raygen region has no buffer", trace(none, good)},
            {"sbt-offset", kInvalid, "raygen region: offset 32 is not a multiple of 64", trace(odd, good)},
            {"sbt-offset", kInvalid, "hit region: offset 32", trace(good, odd)},
            {"sbt-stride", kInvalid, "hit region: stride 40 must be a multiple of 32", trace(good, narrow)},
            {"sbt-stride", kInvalid, "at most 4096", trace(good, wide)},
            {"no-heap", kInvalid, "rtrCmdSetHeap first", trace(good, good)},
        });
        rtrCmdSetHeap(scene.recorder, scene.heap);
        expect_refused(*vk, {
            {"launch-scratch", kInvalid, "(rtrGetLaunchScratchSize), 0 are set", trace(good, good)},
            {"launch-size", kInvalid, "below 2^32", trace(good, good, 1u << 16, 1u << 16, 1)},
            {"launch-size", kInvalid, "below 2^32", trace(good, good, 1u << 11, 1u << 11, 1u << 11)},
            {"indirect-buffer", kInvalid, "indirectBuffer missing",
             [&] {
                 return rtrCmdTraceRaysIndirect(scene.recorder, &good, nullptr, nullptr, nullptr, VK_NULL_HANDLE, 0, 1,
                                                1, 1);
             }},
            {"indirect-buffer", kInvalid, "not a multiple of 4",
             [&] {
                 return rtrCmdTraceRaysIndirect(scene.recorder, &good, nullptr, nullptr, nullptr, sbt.handle, 2, 1, 1,
                                                1);
             }},
        });
        rtrCmdSetLaunchScratch(scene.recorder, scratch.handle, 0, scratch.size);
        rtrCmdSetLaunchLimits(scene.recorder, 64, 16384);
        expect_refused(*vk, {{"control-region", VK_ERROR_OUT_OF_POOL_MEMORY, "rtrGetRecorderControlSize",
                              trace(good, good, 4096, 4096, 1)}});
        ASSERT_EQ(rtrCmdSetRayTracingPipelineStackSize(scene.recorder, 8), VK_SUCCESS);
        expect_refused(*vk, {{"stack-size", kInvalid, "the pipeline's stack has 16", trace(good, good)}});
        EXPECT_EQ(rtrGetLaunchCount(scene.recorder), 0u);
    });
    // A recorder for builds only.
    RtrRecorderCreateInfo info{};
    RtrRecorder bare = nullptr;
    ASSERT_EQ(rtrCreateRecorder(rtr, &info, nullptr, &bare), VK_SUCCESS);
    vk->begin();
    rtrBeginRecorder(bare, vk->cmd);
    rtrCmdBindPipeline(bare, pipeline);
    expect_refused(*vk, {{"control-buffer", kInvalid, "launches need one", [&] {
                              return rtrCmdTraceRaysRegions(bare, &good, nullptr, nullptr, nullptr, 1, 1, 1);
                          }}});
    vk->submit();
    rtrDestroyRecorder(rtr, bare, nullptr);
    vk->destroy(scratch);
}

TEST_F(MisuseLaunchTest, ShaderBindingTables) {
    make(module_header(kHeapUsed, 2));
    const RtrSbtRecord large{0, 4096 - 31, nullptr}, stranger{2, 0, nullptr};
    RtrSbtInfo info{};
    RtrSbtLayout where;
    std::vector<unsigned char> table(256);
    const auto lay_out = [&] { return rtrGetSbtLayout(rtr, &info, &where); };
    info.missCount = 1;
    info.pMiss = &large;
    expect_refused(*vk, {{"sbt-record", kInvalid, "maxShaderGroupStride is 4096", lay_out}});
    info.pMiss = &stranger;
    ASSERT_EQ(lay_out(), VK_SUCCESS);
    expect_refused(*vk, {
        {"sbt-group", kInvalid, "names group 2; the pipeline has 2",
         [&] { return rtrWriteSbt(rtr, pipeline, &info, &where, table.data()); }},
        {"group-handles", kInvalid, "out of range",
         [&] { return rtrGetRayTracingShaderGroupHandles(rtr, pipeline, 1, 2, 256, table.data()); }},
        {"group-handles", kInvalid, "too few bytes",
         [&] { return rtrGetRayTracingShaderGroupHandles(rtr, pipeline, 0, 2, 63, table.data()); }},
    });
}

// A heap that one storage buffer does not reach is read through texels only.
TEST_F(MisuseLaunchTest, HeapBeyondAStorageBuffer) {
    FaultyVulkan faulty(*vk);
    faulty.remembered = [](VkPhysicalDeviceLimits& l) { l.maxStorageBufferRange = 1 << 15; };
    RtrDevice d = faulty.create();
    ASSERT_NE(d, nullptr);
    RtrTraceOptions options = RTR_TRACE_OPTIONS_DEFAULT;
    options.fetch = RTR_FETCH_STORAGE;
    make(module_header(kHeapUsed, 1), d, &options);
    {
        Scene scene(*vk, d, 1 << 16);
        const RtrStridedBufferRegion raygen{scene.upload(nullptr, 256).handle, 0, 64, 64};
        scene.run([&] {
            rtrCmdBindPipeline(scene.recorder, pipeline);
            rtrCmdSetHeap(scene.recorder, scene.heap);
            expect_refused(*vk, {{"maxStorageBufferRange", kAbsent, "use RTR_FETCH_TEXEL", [&] {
                                      return rtrCmdTraceRaysRegions(scene.recorder, &raygen, nullptr, nullptr, nullptr,
                                                                    1, 1, 1);
                                  }}});
        });
    }
    rtrDestroyPipeline(d, pipeline, nullptr);
    pipeline = nullptr;
    rtrDestroyDevice(d, nullptr);
}

}  // namespace
