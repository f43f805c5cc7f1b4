// What the host sees before the device does, and profiles of built scenes.
#include "assume_util.h"

using testing::AllOf;
using testing::HasSubstr;

namespace {

TEST_F(AssumeTest, ADeclaredSceneThatCannotBeRightIsNotRecorded) {
    const auto mixed = top({scene->instance(opaque), scene->instance(boxes)});
    use("triangles");
    EXPECT_EQ(trace(mixed, {mixed, opaque, boxes}).recorded, VK_ERROR_VALIDATION_FAILED_EXT);
    EXPECT_THAT(vk->runtime_messages.back(), AllOf(HasSubstr("'triangles'"), HasSubstr("structure 2"),
                                                   HasSubstr("AABBs"), HasSubstr("--assume=triangles")));
    expect_runtime_error("assumption");
    EXPECT_EQ(trace(top({scene->instance(opaque)}), {opaque}).recorded, VK_SUCCESS);

    use("aabbs", 3);
    EXPECT_EQ(trace(mixed, {opaque}).recorded, VK_ERROR_VALIDATION_FAILED_EXT);
    expect_runtime_error("assumption");

    use("opaque,no-instance-flags");
    EXPECT_EQ(trace(mixed, {opaque, see_through}).recorded, VK_ERROR_VALIDATION_FAILED_EXT);
    EXPECT_THAT(vk->runtime_messages.back(), AllOf(HasSubstr("geometry 1 of structure 1"), HasSubstr("not opaque")));
    expect_runtime_error("assumption");
    // With instance flags the host cannot know: the device decides.
    use("opaque");
    auto forced = scene->instance(see_through);
    forced.flags = VK_GEOMETRY_INSTANCE_FORCE_OPAQUE_BIT_NV;
    const Outcome out = trace(top({forced}), {see_through});
    EXPECT_EQ(out.recorded, VK_SUCCESS);
    EXPECT_EQ(out.value, kHit);
}

TEST_F(AssumeTest, ProfilesSayWhatHoldsAndTheCompilerTakesThem) {
    auto moved = scene->instance(opaque);
    moved.transform.matrix[1][3] = 0.25f;
    const auto one = top({scene->instance(opaque)}), two = top({scene->instance(opaque), moved});
    auto profile = [&](const std::vector<RtrAccelerationStructure>& tops) {
        std::vector<const void*> headers;
        for (auto as : tops) headers.push_back(scene->words(as));
        size_t size = 0;
        EXPECT_EQ(rtrWriteSceneProfile(rtr, static_cast<uint32_t>(headers.size()), headers.data(), &size, nullptr),
                  VK_SUCCESS);
        std::string text(size, ' ');
        EXPECT_EQ(rtrWriteSceneProfile(rtr, static_cast<uint32_t>(headers.size()), headers.data(), &size, text.data()),
                  VK_SUCCESS);
        size_t less = size - 1;
        EXPECT_EQ(rtrWriteSceneProfile(rtr, static_cast<uint32_t>(headers.size()), headers.data(), &less, text.data()),
                  VK_INCOMPLETE);
        return text;
    };
    EXPECT_THAT(profile({one}), HasSubstr("\"assume\": [\"opaque\", \"single-level\", \"identity-transforms\", "
                                          "\"no-masks\", \"no-instance-flags\", \"triangles\"]"));
    const std::string both = profile({one, two});
    EXPECT_THAT(both, HasSubstr("\"assume\": [\"opaque\", \"no-masks\", \"no-instance-flags\", \"triangles\"]"));

    rtcc_options_t options = rtcc_options_create();
    EXPECT_EQ(rtcc_options_add_scene_profile(options, both.data(), both.size()), RTCC_STATUS_SUCCESS);
    for (const char* bad : {"", "{}", "[1]", R"({"rtcSceneProfile": 2, "assume": []})",
                            R"({"rtcSceneProfile": 1, "assume": ["tall"]})", R"({"rtcSceneProfile": 1, "assume": 3})"})
        EXPECT_EQ(rtcc_options_add_scene_profile(options, bad, strlen(bad)), RTCC_STATUS_INVALID_ARGUMENT) << bad;
    rtcc_options_release(options);

    const void* header = scene->words(opaque);
    size_t size = 0;
    EXPECT_EQ(rtrWriteSceneProfile(rtr, 1, &header, &size, nullptr), VK_ERROR_VALIDATION_FAILED_EXT);
    expect_runtime_error("scene-profile");
}

TEST(AssumptionNames, ListsAndErrors) {
    rtcc_options_t options = rtcc_options_create();
    for (size_t i = 0; rtcc_assumption_name(i); ++i)
        EXPECT_EQ(rtcc_options_assume(options, rtcc_assumption_name(i)), RTCC_STATUS_SUCCESS);
    EXPECT_EQ(rtcc_options_assume(options, " opaque,  triangles,\n"), RTCC_STATUS_SUCCESS);
    for (const char* bad : {"opaques", "opaque;triangles", "OPAQUE"})
        EXPECT_EQ(rtcc_options_assume(options, bad), RTCC_STATUS_INVALID_ARGUMENT) << bad;
    EXPECT_EQ(rtcc_options_assume(options, nullptr), RTCC_STATUS_INVALID_ARGUMENT);
    EXPECT_EQ(rtcc_options_assume(nullptr, "opaque"), RTCC_STATUS_INVALID_ARGUMENT);
    rtcc_options_release(options);
}

}  // namespace
