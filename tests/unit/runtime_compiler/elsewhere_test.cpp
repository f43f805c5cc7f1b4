// Rays into an acceleration structure that does not lie where they look for it: they miss, and the launch error says
// where it lies, whatever lies in its place in the heap that is set.
#include "stages_fixture.h"

namespace {

class ElsewhereTest : public StagesTest {
  protected:
    static RtrAccelerationStructure top_of(Scene& scene, float x) {
        auto bottom = scene.build_bottom({scene.triangles({{x, 0, 0}, {x + 1, 0, 0}, {x, 1, 0}})});
        return scene.build_top({scene.instance(bottom)});
    }
    void expect_elsewhere(const RtrLaunchError& error, const std::string& text) {
        EXPECT_EQ(error.code, RTC_LAUNCH_ERROR_HEAP);
        EXPECT_EQ(error.count, 3u);
        char line[384];
        rtrFormatLaunchError(&error, line, sizeof line);
        EXPECT_NE(std::string(line).find(text), std::string::npos) << line;
        for (uint32_t word : said) EXPECT_EQ(word, base + 7);
    }
    VkResult create_for_addresses() {
        auto options = rtcc_options_create();
        EXPECT_EQ(rtcc_options_set_addressing(options, RTCC_ADDRESSING_ADDRESS), RTCC_STATUS_SUCCESS);
        const VkResult r = create(options);
        rtcc_options_release(options);
        return r;
    }
    static std::string number(const Scene& scene, RtrAccelerationStructure as) {
        return std::to_string(scene.handle(as) >> 32 & 0x7fffffffu);
    }
};

TEST_F(ElsewhereTest, AnotherHeapIsSet) {
    ASSERT_EQ(create(), VK_SUCCESS);
    // Both heaps have a top level at the same place, which the rays must not take for each other.
    Scene a(*vk, rtr, 1 << 20), b(*vk, rtr, 1 << 20);
    auto top_a = top_of(a, 0), top_b = top_of(b, 2);
    EXPECT_EQ(trace(a, a.heap, top_a).code, RTC_LAUNCH_ERROR_NONE);
    EXPECT_EQ(said[0], base + 50);
    EXPECT_EQ(said[1], base + 7);
    expect_elsewhere(trace(a, b.heap, top_a), "lies in heap " + number(a, top_a) + " of the RtrDevice, and rtrCmdSetHeap set heap " +
                                                  number(b, top_b) + ": the ray missed");
    EXPECT_EQ(trace(a, b.heap, top_b).code, RTC_LAUNCH_ERROR_NONE);
    EXPECT_EQ(said[0], base + 7);
    EXPECT_EQ(said[1], base + 50);
}

TEST_F(ElsewhereTest, TheNullStructureLiesNowhere) {
    ASSERT_EQ(create(), VK_SUCCESS);
    Scene a(*vk, rtr, 1 << 20), b(*vk, rtr, 1 << 20);
    const RtrAccelerationStructure never = nullptr;
    null_heap = b.heap;
    EXPECT_EQ(trace(a, a.heap, never).code, RTC_LAUNCH_ERROR_NONE);
    for (uint32_t word : said) EXPECT_EQ(word, base + 7);
}

TEST_F(ElsewhereTest, TheOtherAddressingMode) {
    if (!vk->GetBufferDeviceAddress) GTEST_SKIP() << "the device has no bufferDeviceAddress";
    Scene heap(*vk, rtr, 1 << 20), addresses(*vk, rtr, 1 << 20, true);
    auto in_heap = top_of(heap, 0), at_address = top_of(addresses, 0);
    ASSERT_EQ(create(), VK_SUCCESS);
    expect_elsewhere(trace(heap, heap.heap, at_address), "lies at a device address");
    rtrDestroyPipeline(rtr, pipeline, nullptr);
    ASSERT_EQ(create_for_addresses(), VK_SUCCESS);
    EXPECT_EQ(trace(addresses, nullptr, at_address).code, RTC_LAUNCH_ERROR_NONE);
    EXPECT_EQ(said[0], base + 50);
    expect_elsewhere(trace(heap, nullptr, in_heap), "and the module was linked with --addressing=address");
}

}  // namespace
