// What updates may not change is named, on the host or on the device; compacted and deserialised
// structures can be updated too.
#include <cmath>
#include <functional>
#include <random>

#include "faulty_vulkan.h"
#include "scene_util.h"

namespace {

constexpr auto kUpdate = VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV;

std::vector<Vec3> soup(size_t triangles, uint32_t seed, float reach) {
    std::mt19937 rng(seed);
    std::uniform_real_distribution<float> u(-1, 1);
    std::vector<Vec3> v;
    for (size_t i = 0; i < triangles; i++) {
        Vec3 c{reach * u(rng), reach * u(rng), reach * u(rng)};
        for (int k = 0; k < 3; k++) v.push_back({c.x + 0.02f * u(rng), c.y + 0.02f * u(rng), c.z + 0.02f * u(rng)});
    }
    return v;
}

// Parameter: address mode.
class UpdateTest : public RuntimeTest, public ::testing::WithParamInterface<bool> {
  protected:
    void SetUp() override {
        RuntimeTest::SetUp();
        if (vk && GetParam() && !vk->GetBufferDeviceAddress) GTEST_SKIP() << "the device has no bufferDeviceAddress";
    }

    static VkAccelerationStructureInfoNV bottom(const std::vector<VkGeometryNV>& geometry) {
        VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
        info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
        info.flags = kUpdate;
        info.geometryCount = static_cast<uint32_t>(geometry.size());
        info.pGeometries = geometry.data();
        return info;
    }

    VkResult record(Scene& scene, const VkAccelerationStructureInfoNV& info, Buffer instances,
                    RtrAccelerationStructure dst, RtrAccelerationStructure src) {
        Buffer scratch = vk->buffer(scene.scratch_size(dst, true), RTR_SCRATCH_BUFFER_USAGE);
        return rtrCmdBuildAccelerationStructure(scene.recorder, &info, instances.handle, 0, VK_TRUE, dst, src,
                                                scratch.handle, 0);
    }
    void update(Scene& scene, const VkAccelerationStructureInfoNV& info, Buffer instances,
                RtrAccelerationStructure dst, RtrAccelerationStructure src = nullptr) {
        scene.run([&] { EXPECT_EQ(record(scene, info, instances, dst, src), VK_SUCCESS); });
    }

    RtrAccelerationStructure compact(Scene& scene, RtrAccelerationStructure as, VkAccelerationStructureTypeNV type) {
        Buffer out = scene.upload(nullptr, 256);
        scene.run([&] {
            EXPECT_EQ(rtrCmdWriteAccelerationStructuresProperties(
                          scene.recorder, 1, &as, VK_QUERY_TYPE_ACCELERATION_STRUCTURE_COMPACTED_SIZE_NV,
                          out.handle, 0),
                      VK_SUCCESS);
        });
        VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
        info.type = type;
        info.flags = kUpdate;
        auto small = scene.create(info, *out.as<uint64_t>());
        scene.run([&] {
            EXPECT_EQ(rtrCmdCopyAccelerationStructure(scene.recorder, small, as,
                                                      VK_COPY_ACCELERATION_STRUCTURE_MODE_COMPACT_NV),
                      VK_SUCCESS);
        });
        EXPECT_LT(*out.as<uint64_t>(), scene.words(as)[RTC_HDR_SLOTS] * 16ull + 1000000);
        return small;
    }

    static void expect_vertices(const TreeFacts& facts, const std::vector<Vec3>& vertices) {
        ASSERT_EQ(facts.slots.size(), vertices.size() / 3);
        for (auto& s : facts.slots)
            for (uint32_t k = 0; k < 3; k++) EXPECT_EQ(memcmp(&vertices[3 * s.primitive + k], &s.v[k], 12), 0);
    }
};

// Nodes that no binding reaches are updated through windows; what comes of it is the same, bit by bit.
TEST_P(UpdateTest, NodesThroughWindows) {
    FaultyVulkan faulty(*vk);
    std::vector<std::vector<uint32_t>> blocks[2];
    std::vector<std::array<float, 6>> boxes, moved_boxes;
    for (int i = 0; i < 450; i++) {
        boxes.push_back({float(i), 0, 0, i + 0.5f, 1, 1});
        moved_boxes.push_back({float(i), float(i % 7), 0, i + 0.5f, 9, 1 + float(i % 3)});
    }
    auto vertices = soup(500, 1, 2), moved = soup(500, 2, 5), again = soup(500, 3, 1);
    for (const bool small : {false, true}) {
        // 64 bytes a node: 128 in a window; 32 bytes a primitive: 512 in all.
        faulty.remembered = [&](VkPhysicalDeviceLimits& l) {
            if (small) l.maxStorageBufferRange = 16384;
        };
        RtrDevice device = faulty.create(true, GetParam());
        ASSERT_NE(device, nullptr);
        {
            Scene scene(*vk, device, 4 << 20, GetParam());
            auto keep = [&](RtrAccelerationStructure as) {
                TreeFacts facts;
                check_structure(scene, as, facts);
                EXPECT_EQ(scene.words(as)[RTC_HDR_BAD_UPDATE], 0u);
                const uint32_t* words = scene.words(as);
                blocks[small].emplace_back(words, words + 4 * words[RTC_HDR_SIZE_QUADS]);
                return words[RTC_HDR_NODE_COUNT];
            };
            std::vector<VkGeometryNV> geometry{scene.triangles(vertices)}, second{scene.triangles(moved)},
                third{scene.triangles(again)}, leaf_boxes{scene.aabbs(moved_boxes)};
            auto first = scene.build_bottom(geometry, kUpdate), copy = scene.create(bottom(geometry));
            update(scene, bottom(second), {}, first);
            EXPECT_GT(keep(first), 128u);
            update(scene, bottom(third), {}, copy, first);
            EXPECT_GT(keep(copy), 128u);
            keep(first);
            auto leaf = compact(scene, scene.build_bottom({scene.aabbs(boxes)}, kUpdate),
                                VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV);
            update(scene, bottom(leaf_boxes), {}, leaf);
            EXPECT_GT(keep(leaf), 128u);
            std::vector<VkAccelerationStructureInstanceNV> instances(400, scene.instance(leaf));
            for (int i = 0; i < 400; i++) instances[static_cast<size_t>(i)].transform.matrix[1][3] = 2.0f * i;
            instances[7] = scene.instance(nullptr);
            auto top = scene.build_top(instances, kUpdate);
            for (int i = 0; i < 400; i++) instances[static_cast<size_t>(i)].transform.matrix[0][3] = -3.0f * (i % 50);
            VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
            info.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
            info.flags = kUpdate;
            info.instanceCount = 400;
            Buffer data = scene.upload(instances.data(), instances.size() * sizeof instances[0]);
            update(scene, info, data, top);
            EXPECT_GT(keep(top), 256u);  // three windows and a piece
        }
        rtrDestroyDevice(device, nullptr);
    }
    ASSERT_EQ(blocks[0].size(), blocks[1].size());
    for (size_t i = 0; i < blocks[0].size(); i++) {
        SCOPED_TRACE(i);
        // Addresses differ from run to run: of a header all but its own, of instances all but theirs.
        auto without_bases = [&](std::vector<uint32_t> words) {
            words[RTC_HDR_SELF_LO] = words[RTC_HDR_SELF_HI] = 0;
            if (words[RTC_HDR_KIND] == RTC_AS_KIND_TOP)
                for (uint32_t k = 0; k < words[RTC_HDR_SLOT_COUNT]; k++)
                    words[4 * words[RTC_HDR_SLOTS] + 32 * k + 24] = words[4 * words[RTC_HDR_SLOTS] + 32 * k + 25] = 0;
            return words;
        };
        EXPECT_TRUE(without_bases(blocks[0][i]) == without_bases(blocks[1][i]));
    }
}

TEST_P(UpdateTest, CompactedStructures) {
    Scene scene(*vk, rtr, 8 << 20, GetParam());
    auto vertices = soup(3000, 1, 2), moved = soup(3000, 2, 5), again = soup(3000, 3, 1);
    std::vector<VkGeometryNV> geometry{scene.triangles(vertices)}, second{scene.triangles(moved)},
        third{scene.triangles(again)};
    auto full = scene.build_bottom(geometry, kUpdate);
    auto small = compact(scene, full, VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV);
    ASSERT_LT(scene.words(small)[RTC_HDR_SLOTS], scene.words(full)[RTC_HDR_SLOTS]);
    update(scene, bottom(second), {}, small);
    TreeFacts facts, clone_facts, small_facts;
    check_structure(scene, small, facts);
    expect_vertices(facts, moved);
    EXPECT_EQ(scene.words(small)[RTC_HDR_BAD_UPDATE], 0u);
    // From the compacted one into one of full size, which then is laid out as compacted; and back in place.
    update(scene, bottom(third), {}, full, small);
    check_structure(scene, full, clone_facts);
    expect_vertices(clone_facts, again);
    update(scene, bottom(geometry), {}, full);
    clone_facts = {};
    check_structure(scene, full, clone_facts);
    expect_vertices(clone_facts, vertices);
    check_structure(scene, small, small_facts);
    expect_vertices(small_facts, moved);
    // A clone made with all the bytes that the requirements of its source name is no larger than its source.
    VkMemoryRequirements2 need{VK_STRUCTURE_TYPE_MEMORY_REQUIREMENTS_2};
    rtrGetAccelerationStructureMemoryRequirements(
        rtr, VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_OBJECT_NV, full, &need);
    auto blank = bottom(geometry);
    blank.geometryCount = 0;
    auto clone = scene.create(blank, need.memoryRequirements.size);
    scene.run([&] {
        EXPECT_EQ(rtrCmdCopyAccelerationStructure(scene.recorder, clone, full,
                                                  VK_COPY_ACCELERATION_STRUCTURE_MODE_CLONE_NV),
                  VK_SUCCESS);
    });
    update(scene, bottom(third), {}, full, clone);
    // The counts are known of a compacted structure too.
    second[0].geometry.triangles.vertexCount -= 3;
    scene.run([&] { EXPECT_EQ(record(scene, bottom(second), {}, small, nullptr), VK_ERROR_VALIDATION_FAILED_EXT); });
    expect_runtime_error("update-changed");
}

TEST_P(UpdateTest, CompactedBoxesAndInstances) {
    Scene scene(*vk, rtr, 4 << 20, GetParam());
    std::vector<std::array<float, 6>> boxes;
    for (int i = 0; i < 300; i++) boxes.push_back({float(i), 0, 0, i + 0.5f, 1, 1});
    auto leaf = compact(scene, scene.build_bottom({scene.aabbs(boxes)}, kUpdate),
                        VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV);
    std::vector<VkAccelerationStructureInstanceNV> instances(700, scene.instance(leaf));
    for (int i = 0; i < 700; i++) instances[static_cast<size_t>(i)].transform.matrix[1][3] = 2.0f * i;
    instances[7] = scene.instance(nullptr);
    auto top = compact(scene, scene.build_top(instances, kUpdate), VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV);
    for (auto& b : boxes) b[2] -= 10;
    std::vector<VkGeometryNV> geometry{scene.aabbs(boxes)};
    update(scene, bottom(geometry), {}, leaf);
    for (int i = 0; i < 700; i++) instances[static_cast<size_t>(i)].transform.matrix[0][3] = -3.0f * i;
    VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
    info.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
    info.flags = kUpdate;
    info.instanceCount = 700;
    update(scene, info, scene.upload(instances.data(), instances.size() * sizeof instances[0]), top);
    TreeFacts facts, top_facts;
    check_structure(scene, leaf, facts);
    check_structure(scene, top, top_facts);
    EXPECT_EQ(reinterpret_cast<const float*>(scene.words(leaf))[RTC_HDR_BOUNDS_MIN + 2], -10);
    EXPECT_LE(reinterpret_cast<const float*>(scene.words(top))[RTC_HDR_BOUNDS_MIN], -3.0f * 699);
    EXPECT_EQ(scene.words(top)[RTC_HDR_BAD_UPDATE], 0u);
}

TEST_P(UpdateTest, WhatMustStayIsCompared) {
    Scene scene(*vk, rtr, 4 << 20, GetParam());
    auto vertices = soup(100, 1, 2);
    std::vector<uint32_t> indices;
    for (uint32_t i = 0; i < 300; i++) indices.push_back(299 - i);
    const std::vector<VkGeometryNV> geometry{scene.triangles(vertices, &indices), scene.triangles(vertices)};
    auto as = scene.build_bottom(geometry, kUpdate);
    auto refused = [&](std::function<void(std::vector<VkGeometryNV>&)> change, const char* word,
                       const char* id = "update-changed") {
        SCOPED_TRACE(word);
        auto changed = geometry;
        change(changed);
        scene.run([&] {
            EXPECT_EQ(record(scene, bottom(changed), {}, as, nullptr), VK_ERROR_VALIDATION_FAILED_EXT);
        });
        ASSERT_FALSE(vk->runtime_messages.empty());
        EXPECT_NE(vk->runtime_messages[0].find(word), std::string::npos) << vk->runtime_messages[0];
        expect_runtime_error(id);
    };
    auto& t = geometry[0].geometry.triangles;
    refused([](auto& g) { g.pop_back(); }, "1 geometries");
    refused([](auto& g) { g[0].flags = VK_GEOMETRY_OPAQUE_BIT_NV; }, "flags is 1");
    refused([](auto& g) { g[0].geometry.triangles.indexCount -= 3; }, "primitives is 99");
    refused([](auto& g) { g[0].geometry.triangles.vertexCount -= 1; }, "vertexCount is 299");
    refused([](auto& g) { g[0].geometry.triangles.vertexFormat = VK_FORMAT_R32G32_SFLOAT; }, "vertexFormat");
    refused(
        [](auto& g) {
            g[0].geometry.triangles.indexType = VK_INDEX_TYPE_UINT16;
        },
        "indexType is 0");
    refused(
        [&](auto& g) {
            g[1].geometry.triangles.transformData = t.vertexData;
        },
        "geometry 1: having transformData (0 or 1) is 1");
    refused([&](auto& g) { g[1] = scene.aabbs({{0, 0, 0, 1, 1, 1}}); }, "geometryType");
    update(scene, bottom(geometry), {}, as);  // still good
    TreeFacts facts;
    check_structure(scene, as, facts);

    // A source created with other flags, or of another type.
    auto plain = scene.build_bottom(geometry);
    scene.run([&] { EXPECT_EQ(record(scene, bottom(geometry), {}, as, plain), VK_ERROR_VALIDATION_FAILED_EXT); });
    expect_runtime_error("update-src");
    auto top = scene.build_top({scene.instance(as)}, kUpdate);
    VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
    info.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
    info.flags = kUpdate;
    Buffer none = scene.upload(nullptr, 256);
    scene.run([&] { EXPECT_EQ(record(scene, info, none, top, nullptr), VK_ERROR_VALIDATION_FAILED_EXT); });
    expect_runtime_error("update-changed");
}

// What is active only the device sees: the header names the first primitive that changed.
TEST_P(UpdateTest, ActivityIsWatched) {
    Scene scene(*vk, rtr, 4 << 20, GetParam());
    auto vertices = soup(500, 1, 2);
    auto as = scene.build_bottom({scene.triangles(soup(200, 9, 1)), scene.triangles(vertices)}, kUpdate);
    vertices[3 * 123].y = NAN;
    vertices[3 * 400 + 1].x = NAN;
    const std::vector<VkGeometryNV> changed{scene.triangles(soup(200, 9, 1)), scene.triangles(vertices)};
    update(scene, bottom(changed), {}, as);
    EXPECT_EQ(scene.words(as)[RTC_HDR_BAD_UPDATE], 200u + 123 + 1);
    auto built = scene.build_bottom(changed, kUpdate);
    update(scene, bottom(changed), {}, built);
    EXPECT_EQ(scene.words(built)[RTC_HDR_BAD_UPDATE], 0u);

    auto instances = std::vector(20, scene.instance(as));
    instances[4] = scene.instance(nullptr);
    auto top = scene.build_top(instances, kUpdate);
    VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
    info.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
    info.flags = kUpdate;
    info.instanceCount = 20;
    instances[4] = instances[5];  // from inactive to active
    instances[11] = scene.instance(nullptr);
    update(scene, info, scene.upload(instances.data(), instances.size() * sizeof instances[0]), top);
    EXPECT_EQ(scene.words(top)[RTC_HDR_BAD_UPDATE], 4u + 1);
}

// Of a deserialised structure the host knows no counts; the device compares them.
TEST_P(UpdateTest, DeserialisedStructures) {
    Scene scene(*vk, rtr, 4 << 20, GetParam());
    auto vertices = soup(400, 1, 2), moved = soup(400, 2, 3), fewer = soup(399, 3, 3);
    auto as = scene.build_bottom({scene.triangles(vertices)}, kUpdate);
    const VkDeviceSize bytes = 1 << 18;
    Buffer blob = scene.upload(nullptr, bytes);
    scene.run([&] {
        EXPECT_EQ(rtrCmdCopyAccelerationStructureToMemory(scene.recorder, as, blob.handle, 0, bytes), VK_SUCCESS);
    });
    RtrSerializedInfo serialized;
    ASSERT_EQ(rtrGetSerializedAccelerationStructureInfo(rtr, blob.data, bytes, &serialized), VK_SUCCESS);
    VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
    info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
    info.flags = kUpdate;
    auto back = scene.create(info, serialized.deserializedSize);
    scene.run([&] {
        EXPECT_EQ(rtrCmdCopyMemoryToAccelerationStructure(scene.recorder, back, blob.handle, 0, bytes), VK_SUCCESS);
    });
    const std::vector<VkGeometryNV> good{scene.triangles(moved)}, bad{scene.triangles(fewer)};
    update(scene, bottom(good), {}, back);
    for (int i = 0; i < 2; i++) {  // the second time after an update that changed nothing
        TreeFacts facts;
        check_structure(scene, back, facts);
        expect_vertices(facts, moved);
        EXPECT_EQ(scene.words(back)[RTC_HDR_BAD_UPDATE], i ? RTC_BAD_UPDATE_COUNTS : 0u);
        update(scene, bottom(bad), {}, back);
    }
}

INSTANTIATE_TEST_SUITE_P(Modes, UpdateTest, ::testing::Bool(),
                         [](const auto& info) { return info.param ? "Address" : "Heap"; });

}  // namespace
