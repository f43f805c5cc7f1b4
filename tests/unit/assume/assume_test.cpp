// Scenes that break what the module was told try to be traced: built so, bound in place of
// another, or updated after they were fine. None may yield a picture.
#include "assume_util.h"

using testing::AllOf;
using testing::HasSubstr;
using Instance = VkAccelerationStructureInstanceNV;

namespace {

struct Case {
    std::string assume;
    uint32_t fact;
    uint32_t group;  // of the hit region
    // A scene that is as assumed, and one that is not; `bad` has the offender in instance 1.
    std::function<std::vector<Instance>(Scene&, RtrAccelerationStructure opaque, RtrAccelerationStructure see_through,
                                        RtrAccelerationStructure boxes, bool good)>
        instances;
    std::string names;  // part of the message
    bool by_update = true;
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.assume; }

std::vector<Instance> pair_of(Scene& scene, RtrAccelerationStructure a, RtrAccelerationStructure b) {
    return {scene.instance(a), scene.instance(b)};
}

const Case kCases[] = {
    {"opaque", RTC_FACT_ALL_OPAQUE, 2,
     [](Scene& s, auto opaque, auto see_through, auto, bool good) {
         return pair_of(s, opaque, good ? opaque : see_through);
     },
     "geometry 1 of the bottom level of instance 1 is not opaque"},
    {"opaque", RTC_FACT_ALL_OPAQUE, 2,
     [](Scene& s, auto opaque, auto, auto, bool good) {
         auto list = pair_of(s, opaque, opaque);
         if (!good) list[1].flags = VK_GEOMETRY_INSTANCE_FORCE_NO_OPAQUE_BIT_NV;
         return list;
     },
     "instance 1 is not opaque"},
    {"single-level", RTC_FACT_SINGLE_LEVEL, 2,
     [](Scene& s, auto opaque, auto, auto, bool good) {
         auto list = pair_of(s, opaque, opaque);
         if (good) list[1] = s.instance(nullptr);
         return list;
     },
     "2 active instances", false},
    {"identity-transforms", RTC_FACT_IDENTITY_TRANSFORMS, 2,
     [](Scene& s, auto opaque, auto, auto, bool good) {
         auto list = pair_of(s, opaque, opaque);
         if (!good) list[1].transform.matrix[2][3] = -1.0f;
         return list;
     },
     "instance 1 has a transform"},
    {"no-masks", RTC_FACT_FULL_MASKS, 2,
     [](Scene& s, auto opaque, auto, auto, bool good) {
         auto list = pair_of(s, opaque, opaque);
         if (!good) list[1].mask = 0x7f;
         return list;
     },
     "instance 1 has a mask"},
    {"no-instance-flags", RTC_FACT_NO_INSTANCE_FLAGS, 2,
     [](Scene& s, auto opaque, auto, auto, bool good) {
         auto list = pair_of(s, opaque, opaque);
         if (!good) list[1].flags = VK_GEOMETRY_INSTANCE_TRIANGLE_CULL_DISABLE_BIT_NV;
         return list;
     },
     "instance 1 has instance flags"},
    {"triangles", RTC_FACT_HAS_AABBS, 2,
     [](Scene& s, auto opaque, auto, auto boxes, bool good) { return pair_of(s, opaque, good ? opaque : boxes); },
     "instance 1 is made of AABBs"},
    {"aabbs", RTC_FACT_HAS_TRIANGLES, 3,
     [](Scene& s, auto opaque, auto, auto boxes, bool good) { return pair_of(s, boxes, good ? boxes : opaque); },
     "instance 1 is made of triangles"},
};

// Of each case, in heap and in address mode.
class EachAssumption : public AssumeTest, public testing::WithParamInterface<std::tuple<Case, bool>> {
  protected:
    EachAssumption() { addresses = std::get<1>(GetParam()); }
    const Case& kase() const { return std::get<0>(GetParam()); }
    std::vector<Instance> instances(bool good) {
        return kase().instances(*scene, opaque, see_through, boxes, good);
    }
    void expect_refused(const Outcome& out) {
        EXPECT_EQ(out.value, kUntouched);
        EXPECT_EQ(out.error.code, RTC_LAUNCH_ERROR_ASSUMPTION);
        EXPECT_EQ(out.error.detail[0], kase().fact);
        EXPECT_EQ(out.error.count, kLanes);
        EXPECT_THAT(out.text, AllOf(HasSubstr("'" + kase().assume + "'"), HasSubstr(kase().names),
                                    HasSubstr("--assume=" + kase().assume)));
    }
    void expect_hit(const Outcome& out) {
        EXPECT_EQ(out.value, kHit);
        EXPECT_EQ(out.error.code, RTC_LAUNCH_ERROR_NONE) << out.text;
    }
};

TEST_P(EachAssumption, BuiltOtherwiseIsRefused) {
    use(kase().assume, kase().group);
    expect_refused(trace(top(instances(false))));
}

TEST_P(EachAssumption, BoundInPlaceOfAnotherIsRefused) {
    use(kase().assume, kase().group);
    const auto good = top(instances(true)), bad = top(instances(false));
    expect_hit(trace(good));
    expect_refused(trace(bad));
    expect_hit(trace(good));
}

TEST_P(EachAssumption, UpdatedUntilItBreaksIsRefused) {
    use(kase().assume, kase().group);
    const auto changing = top(instances(true));
    expect_hit(trace(changing));
    update(changing, instances(false));
    // An instance that was not there when the tree was built is not in it after an update either.
    if (!kase().by_update) return expect_hit(trace(changing));
    expect_refused(trace(changing));
    update(changing, instances(true));
    expect_hit(trace(changing));
}

// Without the assumption the same scenes are traced: nothing above was refused for another reason.
TEST_P(EachAssumption, WithoutItTheSceneIsTraced) {
    use("", kase().group);
    const Outcome out = trace(top(instances(false)));
    EXPECT_NE(out.value, kUntouched);
    EXPECT_EQ(out.error.code, RTC_LAUNCH_ERROR_NONE) << out.text;
}

// Copies and blobs take along what they break.
TEST_P(EachAssumption, CopiedAndReadBackIsRefused) {
    use(kase().assume, kase().group);
    const auto bad = top(instances(false));
    VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
    info.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
    info.flags = VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV;
    info.instanceCount = 2;
    const auto clone = scene->create(info), back = scene->create(info);
    Buffer size = scene->upload(nullptr, 16), blob = scene->upload(nullptr, 1 << 16);
    scene->run([&] {
        EXPECT_EQ(rtrCmdCopyAccelerationStructure(scene->recorder, clone, bad,
                                                  VK_COPY_ACCELERATION_STRUCTURE_MODE_CLONE_NV), VK_SUCCESS);
        EXPECT_EQ(rtrCmdWriteAccelerationStructuresProperties(scene->recorder, 1, &bad,
                      VK_QUERY_TYPE_ACCELERATION_STRUCTURE_SERIALIZATION_SIZE_KHR, size.handle, 0), VK_SUCCESS);
    });
    const VkDeviceSize bytes = *size.as<uint64_t>();
    ASSERT_LE(bytes, blob.size);
    scene->run([&] {
        EXPECT_EQ(rtrCmdCopyAccelerationStructureToMemory(scene->recorder, bad, blob.handle, 0, bytes), VK_SUCCESS);
    });
    scene->run([&] {
        EXPECT_EQ(rtrCmdCopyMemoryToAccelerationStructure(scene->recorder, back, blob.handle, 0, bytes), VK_SUCCESS);
    });
    expect_refused(trace(clone));
    expect_refused(trace(back));
}

INSTANTIATE_TEST_SUITE_P(All, EachAssumption, testing::Combine(testing::ValuesIn(kCases), testing::Bool()),
                         [](const testing::TestParamInfo<std::tuple<Case, bool>>& info) {
                             std::string name = std::get<0>(info.param).assume + std::to_string(info.index / 2) +
                                                (std::get<1>(info.param) ? "_address" : "");
                             std::replace(name.begin(), name.end(), '-', '_');
                             return name;
                         });

TEST_F(AssumeTest, AllTogetherTraceWhatTheyDescribe) {
    use("opaque,single-level,identity-transforms,no-masks,no-instance-flags,triangles");
    EXPECT_EQ(trace(top({scene->instance(opaque)})).value, kHit);
    auto hidden = scene->instance(opaque);
    EXPECT_EQ(trace(top({scene->instance(nullptr), hidden})).value, kHit) << "not the first instance";
    EXPECT_EQ(trace(top({scene->instance(nullptr)})).value, kMiss) << "no instance at all";
    use("single-level");
    hidden.transform.matrix[0][3] = 10;
    EXPECT_EQ(trace(top({hidden})).value, kMiss);
    hidden = scene->instance(opaque);
    hidden.mask = 0;
    EXPECT_EQ(trace(top({hidden})).value, kMiss);
    EXPECT_EQ(trace(top({scene->instance(see_through)})).value, kMiss) << "its any-hit ignores";
}

// An any-hit shader that may still run must still run, whatever the geometry is assumed to be.
TEST_F(AssumeTest, RayFlagsOutrankOpaqueGeometry) {
    use("opaque", 2, "gl_RayFlagsNoOpaqueNV");
    EXPECT_EQ(trace(top({scene->instance(opaque)})).value, kMiss);
    use("", 2, "gl_RayFlagsOpaqueNV");
    EXPECT_EQ(trace(top({scene->instance(see_through)})).value, kHit);
    use("", 2, "gl_RayFlagsCullOpaqueNV");
    EXPECT_EQ(trace(top({scene->instance(opaque)})).value, kMiss);
    use("", 2, "(gl_LaunchIDNV.x < 1000u ? gl_RayFlagsNoOpaqueNV : 0u)");
    EXPECT_EQ(trace(top({scene->instance(opaque)})).value, kMiss);
}

// A bottom level that the host built says what it holds, too.
TEST_F(AssumeTest, HostBuiltBottomLevelsAreRefused) {
    use("opaque");
    const std::vector<Vec3> corners = {{-1, -1, 0}, {1, -1, 0}, {0, 2, 0}};
    const VkGeometryNV geometry = scene->triangles(corners);
    VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
    info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
    info.geometryCount = 1;
    info.pGeometries = &geometry;
    const auto built = scene->create(info);
    RtrHostGeometry data{};
    data.pVertexData = corners.data();
    ASSERT_EQ(rtrBuildAccelerationStructureOnHost(rtr, &info, &data, built, const_cast<uint32_t*>(scene->words(built)),
                                                  nullptr), VK_SUCCESS);
    const Outcome out = trace(top({scene->instance(opaque), scene->instance(built)}));
    EXPECT_EQ(out.value, kUntouched);
    EXPECT_EQ(out.error.code, RTC_LAUNCH_ERROR_ASSUMPTION);
    EXPECT_THAT(out.text, HasSubstr("geometry 0 of the bottom level of instance 1 is not opaque"));
}

TEST_F(AssumeTest, NothingIsRefusedInANullStructure) {
    use("opaque,single-level");
    VkDescriptorBufferInfo null{};
    EXPECT_EQ(rtrGetNullAccelerationStructureDescriptor(rtr, scene->heap, &null), VK_SUCCESS);
    const auto empty = top({scene->instance(nullptr)});
    EXPECT_EQ(trace(empty).value, kMiss);
}

}  // namespace
