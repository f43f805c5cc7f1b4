// Structures to blobs and back: in both addressing modes and from one into the other.
#include <cmath>
#include <random>

#include "scene_util.h"

namespace {

std::vector<Vec3> ball(size_t count, uint32_t seed) {
    std::mt19937 rng(seed);
    std::uniform_real_distribution<float> u(-1, 1);
    std::vector<Vec3> v;
    for (size_t i = 0; i < count; i++) {
        Vec3 c{u(rng), u(rng), u(rng)};
        for (int k = 0; k < 3; k++)
            v.push_back({c.x + 0.1f * u(rng), c.y + 0.1f * u(rng), c.z + 0.1f * u(rng)});
    }
    return v;
}

// Parameters: the modes of source and target.
class SerializeTest : public RuntimeTest, public ::testing::WithParamInterface<std::pair<bool, bool>> {
  protected:
    void SetUp() override {
        RuntimeTest::SetUp();
        auto [from, to] = GetParam();
        if (vk && (from || to) && !vk->GetBufferDeviceAddress)
            GTEST_SKIP() << "the device has no bufferDeviceAddress";
    }

    uint64_t query(Scene& scene, RtrAccelerationStructure as, VkQueryType type) {
        Buffer out = scene.upload(nullptr, 16);
        scene.run([&] {
            EXPECT_EQ(
                rtrCmdWriteAccelerationStructuresProperties(scene.recorder, 1, &as, type, out.handle, 8),
                VK_SUCCESS);
        });
        return *out.as<uint64_t>(8);
    }

    std::vector<uint8_t> serialize(Scene& scene, RtrAccelerationStructure as, VkDeviceSize short_of = 0) {
        uint64_t size = query(scene, as, VK_QUERY_TYPE_ACCELERATION_STRUCTURE_SERIALIZATION_SIZE_KHR);
        Buffer out = scene.upload(nullptr, 256 + size);
        scene.run([&] {
            EXPECT_EQ(rtrCmdCopyAccelerationStructureToMemory(scene.recorder, as, out.handle, 256,
                                                              size - short_of),
                      VK_SUCCESS);
        });
        return {out.as<uint8_t>(256), out.as<uint8_t>(256) + size};
    }

    // From a blob; the size of the new object may differ from what the blob says.
    RtrAccelerationStructure deserialize(Scene& scene, const std::vector<uint8_t>& blob, bool top,
                                         VkDeviceSize size = 0) {
        if (!size) memcpy(&size, blob.data() + 40, 8);
        VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
        info.type = top ? VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV
                        : VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
        auto as = scene.create(info, size);
        Buffer in = scene.upload(blob.data(), blob.size());
        scene.run([&] {
            EXPECT_EQ(
                rtrCmdCopyMemoryToAccelerationStructure(scene.recorder, as, in.handle, 0, blob.size()),
                VK_SUCCESS);
        });
        return as;
    }

    void expect_null(Scene& scene, const std::vector<uint8_t>& blob, bool top, VkDeviceSize size = 0) {
        auto as = deserialize(scene, blob, top, size);
        const uint32_t* w = scene.words(as);
        for (uint32_t i = 0; i < 4 * RTC_AS_HEADER_QUADS; i++) EXPECT_EQ(w[i], 0u) << i;
    }
};

TEST_P(SerializeTest, BottomLevelsComeBack) {
    auto [from, to] = GetParam();
    Scene source(*vk, rtr, 2 << 20, from), target(*vk, rtr, 2 << 20, to);
    std::vector<std::array<float, 6>> boxes;
    for (int i = 0; i < 77; i++) boxes.push_back({float(i), 0, 0, i + 0.5f, 1, 1});
    std::vector<RtrAccelerationStructure> all{
        source.build_bottom({source.triangles(ball(3000, 1)), source.triangles(ball(9, 2))}),
        source.build_bottom({source.aabbs(boxes)}), source.build_bottom({}),
        source.build_bottom({source.triangles(ball(1, 3))})};
    for (auto as : all) {
        TreeFacts before, after;
        check_structure(source, as, before);
        auto blob = serialize(source, as);
        RtrSerializedInfo info;
        ASSERT_EQ(rtrGetSerializedAccelerationStructureInfo(rtr, blob.data(), blob.size(), &info),
                  VK_SUCCESS);
        EXPECT_EQ(info.serializedSize, blob.size());
        EXPECT_EQ(info.handleCount, 0u);
        EXPECT_EQ(info.deserializedSize,
                  query(source, as, VK_QUERY_TYPE_ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR));
        EXPECT_EQ(query(source, as,
                        VK_QUERY_TYPE_ACCELERATION_STRUCTURE_SERIALIZATION_BOTTOM_LEVEL_POINTERS_KHR),
                  0u);
        VkMemoryRequirements2 need{VK_STRUCTURE_TYPE_MEMORY_REQUIREMENTS_2};
        rtrGetAccelerationStructureMemoryRequirements(
            rtr, VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_OBJECT_NV, as, &need);
        EXPECT_EQ(query(source, as, VK_QUERY_TYPE_ACCELERATION_STRUCTURE_SIZE_KHR),
                  need.memoryRequirements.size);
        auto copy = deserialize(target, blob, false);
        check_structure(target, copy, after);
        EXPECT_EQ(before.sah, after.sah);
        EXPECT_EQ(before.nodes, after.nodes);
        ASSERT_EQ(before.slots.size(), after.slots.size());
        for (size_t i = 0; i < before.slots.size(); i++)
            EXPECT_EQ(memcmp(&before.slots[i], &after.slots[i], sizeof(Slot)), 0);
        EXPECT_EQ(target.words(copy)[RTC_HDR_FACTS] & RTC_FACT_ADDRESSES, to ? RTC_FACT_ADDRESSES : 0u);
        // The bytes of a blob do not depend on where the structure lay.
        EXPECT_EQ(serialize(target, copy).size(), blob.size());
    }
}

TEST_P(SerializeTest, TopLevelsArePatched) {
    auto [from, to] = GetParam();
    Scene source(*vk, rtr, 4 << 20, from), target(*vk, rtr, 4 << 20, to);
    RtrAccelerationStructure leaves[2] = {source.build_bottom({source.triangles(ball(500, 1))}),
                                          source.build_bottom({source.triangles(ball(7, 2))})};
    std::vector<VkAccelerationStructureInstanceNV> instances;
    for (int i = 0; i < 70; i++) {
        instances.push_back(source.instance(i % 9 == 4 ? nullptr : leaves[i % 2]));
        instances.back().transform.matrix[0][3] = 3.0f * float(i);
        instances.back().instanceCustomIndex = static_cast<uint32_t>(i);
    }
    auto top = source.build_top(instances);
    auto blob = serialize(source, top);
    RtrSerializedInfo info;
    ASSERT_EQ(rtrGetSerializedAccelerationStructureInfo(rtr, blob.data(), blob.size(), &info), VK_SUCCESS);
    EXPECT_EQ(info.handleCount, 70u);
    EXPECT_EQ(
        query(source, top, VK_QUERY_TYPE_ACCELERATION_STRUCTURE_SERIALIZATION_BOTTOM_LEVEL_POINTERS_KHR),
        70u);
    std::vector<uint64_t> handles(70);
    memcpy(handles.data(), blob.data() + RTR_SERIALIZED_HANDLES_OFFSET, 8 * 70);
    for (size_t i = 0; i < 70; i++)
        EXPECT_EQ(handles[i], i % 9 == 4 ? 0 : source.handle(leaves[i % 2])) << i;
    RtrAccelerationStructure moved[2];
    for (int k = 0; k < 2; k++) moved[k] = deserialize(target, serialize(source, leaves[k]), false);
    for (size_t i = 0; i < 70; i++)
        if (handles[i]) handles[i] = target.handle(moved[i % 2]);
    memcpy(blob.data() + RTR_SERIALIZED_HANDLES_OFFSET, handles.data(), 8 * 70);
    auto copy = deserialize(target, blob, true);
    TreeFacts facts;
    check_structure(target, copy, facts);
    const uint32_t *a = source.words(top), *b = target.words(copy);
    EXPECT_EQ(b[RTC_HDR_FACTS] & ~RTC_FACT_ADDRESSES, a[RTC_HDR_FACTS] & ~RTC_FACT_ADDRESSES);
    for (uint32_t i = 0; i < 70; i++) {
        const uint32_t *ra = a + 4 * a[RTC_HDR_SLOTS] + 32 * i, *rb = b + 4 * b[RTC_HDR_SLOTS] + 32 * i;
        EXPECT_EQ(memcmp(ra, rb, 96), 0) << i;
        EXPECT_EQ(ra[26], rb[26]);
        EXPECT_EQ(ra[27], rb[27]);
    }
    // A handle of nothing: that instance alone is never hit, and the header tells.
    uint64_t nothing = to ? 0 : 12345;
    memcpy(blob.data() + RTR_SERIALIZED_HANDLES_OFFSET + 8 * 11, &nothing, 8);
    auto holed = deserialize(target, blob, true);
    const uint32_t* h = target.words(holed);
    EXPECT_EQ(h[RTC_HDR_FIRST_OFFENDER], std::min(11u, a[RTC_HDR_FIRST_OFFENDER]));
    EXPECT_EQ(h[RTC_HDR_FACTS] & RTC_FACT_FULL_MASKS, 0u);
    for (uint32_t i = 0; i < 70; i++) {
        const uint32_t* r = h + 4 * h[RTC_HDR_SLOTS] + 32 * i;
        EXPECT_EQ(r[26] >> 24, i == 11 ? 0u : 0xffu);
        EXPECT_EQ(r[26] & 0xffffff, i);
    }
}

TEST_P(SerializeTest, ForeignBlobsAreRefused) {
    auto [from, to] = GetParam();
    Scene source(*vk, rtr, 2 << 20, from), target(*vk, rtr, 2 << 20, to);
    auto as = source.build_bottom({source.triangles(ball(50, 1))});
    const auto blob = serialize(source, as);
    struct Case {
        size_t byte;
        const char* id;
        VkResult result;
    };
    for (const Case& c : {Case{3, "blob-driver", VK_ERROR_INCOMPATIBLE_DRIVER},
                          Case{16, "blob", VK_ERROR_VALIDATION_FAILED_EXT},
                          Case{20, "blob-version", VK_ERROR_INCOMPATIBLE_DRIVER},
                          Case{30, "blob-device", VK_ERROR_INCOMPATIBLE_DRIVER},
                          Case{45, "blob", VK_ERROR_VALIDATION_FAILED_EXT}}) {
        SCOPED_TRACE(c.byte);
        auto bad = blob;
        bad[c.byte] ^= 1;
        RtrSerializedInfo info;
        EXPECT_EQ(rtrGetSerializedAccelerationStructureInfo(rtr, bad.data(), bad.size(), &info), c.result);
        expect_runtime_error(c.id);
        VkAccelerationStructureCompatibilityKHR compatible;
        rtrGetDeviceAccelerationStructureCompatibility(rtr, bad.data(), &compatible);
        EXPECT_EQ(compatible, c.byte < 32 ? VK_ACCELERATION_STRUCTURE_COMPATIBILITY_INCOMPATIBLE_KHR
                                          : VK_ACCELERATION_STRUCTURE_COMPATIBILITY_COMPATIBLE_KHR);
        expect_null(target, bad, false, 1 << 16);
    }
    RtrSerializedInfo info;
    EXPECT_EQ(rtrGetSerializedAccelerationStructureInfo(rtr, blob.data(), 56, &info), VK_SUCCESS);
    EXPECT_EQ(rtrGetSerializedAccelerationStructureInfo(rtr, blob.data(), blob.size() - 1, &info),
              VK_ERROR_VALIDATION_FAILED_EXT);
    expect_runtime_error("blob");
    EXPECT_EQ(rtrGetSerializedAccelerationStructureInfo(rtr, blob.data(), 10, &info),
              VK_ERROR_VALIDATION_FAILED_EXT);
    expect_runtime_error("blob");
    // Another type, an object too small, a blob cut short, node and slot counts that lie.
    expect_null(target, blob, true);
    expect_null(target, blob, false, info.deserializedSize ? info.deserializedSize : 512);
    expect_null(target, {blob.begin(), blob.end() - 16}, false);
    for (uint32_t word : {RTC_HDR_NODES, RTC_HDR_SLOTS, RTC_HDR_NODE_COUNT, RTC_HDR_SLOT_COUNT}) {
        auto bad = blob;
        bad[256 + 4 * word + 1] ^= 0x40;
        expect_null(target, bad, false);
    }
    // Too little room for the blob: it has no version then.
    auto cut = serialize(source, as, 16);
    EXPECT_EQ(rtrGetSerializedAccelerationStructureInfo(rtr, cut.data(), cut.size(), &info),
              VK_ERROR_VALIDATION_FAILED_EXT);
    expect_runtime_error("blob");
}

TEST_P(SerializeTest, WrongUsesAreNamed) {
    Scene scene(*vk, rtr, 1 << 20, GetParam().first);
    auto as = scene.build_bottom({scene.triangles(ball(5, 1))});
    Buffer buffer = scene.upload(nullptr, 4096);
    auto both = [&](RtrAccelerationStructure a, VkBuffer b, VkDeviceSize offset, VkDeviceSize size,
                    const char* id) {
        EXPECT_EQ(rtrCmdCopyAccelerationStructureToMemory(scene.recorder, a, b, offset, size),
                  VK_ERROR_VALIDATION_FAILED_EXT);
        expect_runtime_error(id);
        EXPECT_EQ(rtrCmdCopyMemoryToAccelerationStructure(scene.recorder, a, b, offset, size),
                  VK_ERROR_VALIDATION_FAILED_EXT);
        expect_runtime_error(id);
    };
    EXPECT_EQ(rtrResetRecorder(scene.recorder), VK_SUCCESS);
    both(as, buffer.handle, 0, 4096, "recorder-not-begun");
    scene.run([&] {
        both(nullptr, buffer.handle, 0, 4096, "not-bound");
        both(as, VK_NULL_HANDLE, 0, 4096, "blob-range");
        both(as, buffer.handle, 128, 2048, "blob-range");
        both(as, buffer.handle, 0, 256, "blob-range");
        EXPECT_EQ(rtrCmdWriteAccelerationStructuresProperties(scene.recorder, 1, &as,
                                                              VK_QUERY_TYPE_TIMESTAMP, buffer.handle, 0),
                  VK_ERROR_FEATURE_NOT_PRESENT);
        expect_runtime_error("query-type");
        EXPECT_EQ(rtrCmdWriteAccelerationStructuresProperties(
                      scene.recorder, 1, &as, VK_QUERY_TYPE_ACCELERATION_STRUCTURE_SIZE_KHR, buffer.handle, 4),
                  VK_ERROR_VALIDATION_FAILED_EXT);
        expect_runtime_error("query-buffer");
    });
}

INSTANTIATE_TEST_SUITE_P(Modes, SerializeTest,
                         ::testing::Values(std::pair{false, false}, std::pair{true, true},
                                           std::pair{false, true}, std::pair{true, false}),
                         [](const auto& info) {
                             return std::string(info.param.first ? "Address" : "Heap") + "To" +
                                    (info.param.second ? "Address" : "Heap");
                         });

}  // namespace
