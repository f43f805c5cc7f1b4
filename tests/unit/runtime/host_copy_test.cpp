// Copies, blobs and queries on the host: the same bytes as the device makes.
#include <random>

#include "scene_util.h"

namespace {

// Parameter: address mode.
class HostCopyTest : public RuntimeTest, public ::testing::WithParamInterface<bool> {
  protected:
    void SetUp() override {
        RuntimeTest::SetUp();
        if (vk && GetParam() && !vk->GetBufferDeviceAddress) GTEST_SKIP() << "the device has no bufferDeviceAddress";
    }
    static std::vector<Vec3> soup(size_t triangles) {
        std::mt19937 rng(5);
        std::uniform_real_distribution<float> u(-1, 1);
        std::vector<Vec3> v;
        for (size_t i = 0; i < 3 * triangles; i++) v.push_back({u(rng), u(rng), u(rng)});
        return v;
    }
    static void* memory(const Scene& scene, RtrAccelerationStructure as) {
        return const_cast<uint32_t*>(scene.words(as));
    }
    RtrAccelerationStructure create(Scene& scene, bool top, VkDeviceSize size) {
        VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
        info.type = top ? VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV : VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
        return scene.create(info, size);
    }
    uint64_t on_device(Scene& scene, RtrAccelerationStructure as, VkQueryType type) {
        Buffer out = scene.upload(nullptr, 256);
        scene.run([&] {
            EXPECT_EQ(rtrCmdWriteAccelerationStructuresProperties(scene.recorder, 1, &as, type, out.handle, 0),
                      VK_SUCCESS);
        });
        return *out.as<uint64_t>();
    }
};

constexpr VkQueryType kQueries[] = {VK_QUERY_TYPE_ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR,
                                    VK_QUERY_TYPE_ACCELERATION_STRUCTURE_SIZE_KHR,
                                    VK_QUERY_TYPE_ACCELERATION_STRUCTURE_SERIALIZATION_SIZE_KHR,
                                    VK_QUERY_TYPE_ACCELERATION_STRUCTURE_SERIALIZATION_BOTTOM_LEVEL_POINTERS_KHR};

TEST_P(HostCopyTest, TheSameAsTheDevice) {
    Scene scene(*vk, rtr, 8 << 20, GetParam());
    std::vector<std::array<float, 6>> boxes;
    for (int i = 0; i < 77; i++) boxes.push_back({float(i), 0, 0, i + 0.5f, 1, 1});
    auto triangles = scene.build_bottom({scene.triangles(soup(1000))});
    RtrAccelerationStructure all[] = {triangles, scene.build_bottom({scene.aabbs(boxes)}), scene.build_bottom({}),
                                      scene.build_top({scene.instance(triangles), scene.instance(nullptr),
                                                       scene.instance(triangles), scene.instance(triangles)})};
    const void* blocks[4];
    for (int i = 0; i < 4; i++) blocks[i] = memory(scene, all[i]);
    for (VkQueryType type : kQueries) {
        uint64_t answers[8];
        ASSERT_EQ(rtrWriteAccelerationStructuresPropertiesOnHost(rtr, 4, all, blocks, type, sizeof answers, answers, 16),
                  VK_SUCCESS);
        for (int i = 0; i < 4; i++) EXPECT_EQ(answers[2 * i], on_device(scene, all[i], type)) << type << " " << i;
    }
    for (int i = 0; i < 4; i++) {
        SCOPED_TRACE(i);
        auto as = all[i];
        const bool top = i == 3;
        for (auto mode : {VK_COPY_ACCELERATION_STRUCTURE_MODE_CLONE_NV, VK_COPY_ACCELERATION_STRUCTURE_MODE_COMPACT_NV}) {
            const bool compact = mode == VK_COPY_ACCELERATION_STRUCTURE_MODE_COMPACT_NV;
            const VkDeviceSize size = on_device(scene, as, kQueries[compact ? 0 : 1]);
            auto here = create(scene, top, size), there = create(scene, top, size);
            memset(memory(scene, here), 0, size);
            memset(memory(scene, there), 0, size);
            ASSERT_EQ(rtrCopyAccelerationStructureOnHost(rtr, here, memory(scene, here), as, memory(scene, as), mode),
                      VK_SUCCESS);
            scene.run([&] { EXPECT_EQ(rtrCmdCopyAccelerationStructure(scene.recorder, there, as, mode), VK_SUCCESS); });
            TreeFacts facts;
            if (i != 2) check_structure(scene, here, facts);
            EXPECT_EQ(memcmp(scene.words(here) + 2, scene.words(there) + 2, size - 8), 0);
            const uint64_t handle = scene.handle(here);
            EXPECT_EQ(memcmp(scene.words(here), &handle, 8), 0);
        }
        // Blobs, byte for byte.
        const uint64_t bytes = on_device(scene, as, kQueries[2]);
        Buffer there = scene.upload(nullptr, bytes);
        scene.run([&] {
            EXPECT_EQ(rtrCmdCopyAccelerationStructureToMemory(scene.recorder, as, there.handle, 0, bytes), VK_SUCCESS);
        });
        std::vector<char> here(bytes);
        ASSERT_EQ(rtrCopyAccelerationStructureToMemoryOnHost(rtr, as, memory(scene, as), bytes, here.data()),
                  VK_SUCCESS);
        EXPECT_EQ(memcmp(here.data(), there.data, bytes), 0);
        EXPECT_EQ(rtrCopyAccelerationStructureToMemoryOnHost(rtr, as, memory(scene, as), bytes - 1, here.data()),
                  VK_ERROR_VALIDATION_FAILED_EXT);
        expect_runtime_error("blob-range");
        RtrSerializedInfo info;
        ASSERT_EQ(rtrGetSerializedAccelerationStructureInfo(rtr, here.data(), bytes, &info), VK_SUCCESS);
        auto back = create(scene, top, info.deserializedSize);
        VkResult r = rtrCopyMemoryToAccelerationStructureOnHost(rtr, bytes, here.data(), back, memory(scene, back));
        if (top) {
            EXPECT_EQ(r, VK_ERROR_VALIDATION_FAILED_EXT);
            expect_runtime_error("blob");
            continue;
        }
        ASSERT_EQ(r, VK_SUCCESS);
        TreeFacts facts, original;
        if (i == 2) continue;
        check_structure(scene, back, facts);
        check_structure(scene, as, original);
        EXPECT_EQ(facts.sah, original.sah);
        EXPECT_EQ(facts.slots.size(), original.slots.size());
        // Damage is named, or at least led nowhere.
        for (size_t at : {32u, 40u, 256u + 4 * RTC_HDR_MAGIC, 256u + 4 * RTC_HDR_NODE_COUNT, 256u + 4 * RTC_HDR_SLOTS,
                          256u + 4 * RTC_HDR_SLOT_COUNT, 256u + 4 * RTC_HDR_KIND}) {
            auto bad = here;
            bad[at] = static_cast<char>(bad[at] ^ 0x55);
            EXPECT_NE(rtrCopyMemoryToAccelerationStructureOnHost(rtr, bytes, bad.data(), back, memory(scene, back)),
                      VK_SUCCESS)
                << at;
            vk->runtime_messages.clear();
        }
    }
}

TEST_P(HostCopyTest, WrongUsesAreNamed) {
    Scene scene(*vk, rtr, 1 << 20, GetParam());
    auto as = scene.build_bottom({scene.triangles(soup(100))});
    auto small = create(scene, false, 512), other = create(scene, false, 65536);
    auto copy = [&](RtrAccelerationStructure dst, const void* from, VkCopyAccelerationStructureModeNV mode) {
        return rtrCopyAccelerationStructureOnHost(rtr, dst, memory(scene, dst), as, from, mode);
    };
    const auto clone = VK_COPY_ACCELERATION_STRUCTURE_MODE_CLONE_NV;
    EXPECT_EQ(copy(small, memory(scene, as), clone), VK_ERROR_VALIDATION_FAILED_EXT);
    expect_runtime_error("copy-size");
    EXPECT_EQ(copy(other, memory(scene, other), clone), VK_ERROR_VALIDATION_FAILED_EXT);
    expect_runtime_error("host-memory");
    EXPECT_EQ(copy(other, nullptr, clone), VK_ERROR_VALIDATION_FAILED_EXT);
    expect_runtime_error("not-bound");
    EXPECT_EQ(copy(as, memory(scene, as), clone), VK_ERROR_VALIDATION_FAILED_EXT);
    expect_runtime_error("copy");
    EXPECT_EQ(copy(other, memory(scene, as), VK_COPY_ACCELERATION_STRUCTURE_MODE_SERIALIZE_KHR),
              VK_ERROR_VALIDATION_FAILED_EXT);
    expect_runtime_error("copy-mode");
    uint64_t answer;
    const void* block = memory(scene, as);
    EXPECT_EQ(rtrWriteAccelerationStructuresPropertiesOnHost(rtr, 1, &as, &block, VK_QUERY_TYPE_OCCLUSION, 8, &answer, 8),
              VK_ERROR_FEATURE_NOT_PRESENT);
    expect_runtime_error("query-type");
    EXPECT_EQ(rtrWriteAccelerationStructuresPropertiesOnHost(rtr, 1, &as, &block, kQueries[0], 4, &answer, 8),
              VK_ERROR_VALIDATION_FAILED_EXT);
    expect_runtime_error("query-buffer");
}

INSTANTIATE_TEST_SUITE_P(Modes, HostCopyTest, ::testing::Bool(),
                         [](const auto& info) { return info.param ? "Address" : "Heap"; });

}  // namespace
