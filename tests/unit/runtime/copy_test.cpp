// Clone, compaction, property queries, updates.
#include <algorithm>
#include <cmath>
#include <random>

#include "scene_util.h"

namespace {

std::vector<Vec3> ball(size_t count, uint32_t seed, float reach, float size = 0.02f) {
    std::mt19937 rng(seed);
    std::uniform_real_distribution<float> u(-1, 1);
    std::vector<Vec3> v;
    for (size_t i = 0; i < count; i++) {
        Vec3 c{reach * u(rng), reach * u(rng), reach * u(rng)};
        for (int k = 0; k < 3; k++)
            v.push_back({c.x + size * u(rng), c.y + size * u(rng), c.z + size * u(rng)});
    }
    return v;
}

// Parameter: address mode.
class CopyTest : public RuntimeTest, public ::testing::WithParamInterface<bool> {
  protected:
    void SetUp() override {
        RuntimeTest::SetUp();
        if (vk && GetParam() && !vk->GetBufferDeviceAddress)
            GTEST_SKIP() << "the device has no bufferDeviceAddress";
    }

    VkDeviceSize compacted_size(Scene& scene, RtrAccelerationStructure as) {
        Buffer out = scene.upload(nullptr, 512);
        RtrAccelerationStructure list[2] = {as, as};
        scene.run([&] {
            EXPECT_EQ(rtrCmdWriteAccelerationStructuresProperties(
                          scene.recorder, 2, list, VK_QUERY_TYPE_ACCELERATION_STRUCTURE_COMPACTED_SIZE_NV,
                          out.handle, 248),
                      VK_SUCCESS);
        });
        EXPECT_EQ(*out.as<uint64_t>(248), *out.as<uint64_t>(256));
        return *out.as<uint64_t>(256);
    }
};

TEST_P(CopyTest, CompactKeepsTheTree) {
    for (int kind = 0; kind < 3; kind++) {
        SCOPED_TRACE(kind);
        Scene scene(*vk, rtr, 4 << 20, GetParam());
        RtrAccelerationStructure as, leaf = nullptr;
        if (kind == 0) {
            as = scene.build_bottom({scene.triangles(ball(3000, 1, 0.1f, 0.1f))},
                                    VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_COMPACTION_BIT_NV);
        } else if (kind == 1) {
            std::vector<std::array<float, 6>> boxes(500, {0, 0, 0, 1, 1, 1});
            as = scene.build_bottom({scene.aabbs(boxes)});
        } else {
            leaf = scene.build_bottom({scene.triangles(ball(9, 1, 1))});
            as = scene.build_top(std::vector<VkAccelerationStructureInstanceNV>(77, scene.instance(leaf)));
        }
        TreeFacts before, after, cloned;
        check_structure(scene, as, before);
        VkDeviceSize size = compacted_size(scene, as);
        EXPECT_EQ(size, scene.words(as)[RTC_HDR_SIZE_QUADS] * 16u);
        VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
        info.type = kind == 2 ? VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV
                              : VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
        auto small = scene.create(info, size);
        scene.run([&] {
            EXPECT_EQ(rtrCmdCopyAccelerationStructure(scene.recorder, small, as,
                                                      VK_COPY_ACCELERATION_STRUCTURE_MODE_COMPACT_NV),
                      VK_SUCCESS);
        });
        check_structure(scene, small, after);
        EXPECT_EQ(before.nodes, after.nodes);
        EXPECT_EQ(before.sah, after.sah);
        ASSERT_EQ(before.slots.size(), after.slots.size());
        for (size_t i = 0; i < before.slots.size(); i++)
            EXPECT_EQ(memcmp(&before.slots[i], &after.slots[i], sizeof(Slot)), 0);
        // A clone of the compacted one, and its compaction again, are the same size.
        auto clone = scene.create(info, size);
        scene.run([&] {
            EXPECT_EQ(rtrCmdCopyAccelerationStructure(scene.recorder, clone, small,
                                                      VK_COPY_ACCELERATION_STRUCTURE_MODE_CLONE_NV),
                      VK_SUCCESS);
        });
        check_structure(scene, clone, cloned);
        EXPECT_EQ(compacted_size(scene, clone), size);
    }
}

// Fewer nodes, and so fewer bytes, of the same primitives; with either builder.
TEST_P(CopyTest, LowMemoryCompactsToLess) {
    for (auto builder : {0, int(VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_BUILD_BIT_NV)}) {
        Scene scene(*vk, rtr, 8 << 20, GetParam());
        const std::vector<VkGeometryNV> geometry{scene.triangles(ball(5000, 3, 1))};
        VkDeviceSize sizes[2];
        TreeFacts facts[2];
        for (int low : {0, 1}) {
            int flags = builder | (low ? int(VK_BUILD_ACCELERATION_STRUCTURE_LOW_MEMORY_BIT_NV) : 0);
            auto as = scene.build_bottom(geometry, static_cast<VkBuildAccelerationStructureFlagsNV>(flags));
            check_structure(scene, as, facts[low]);
            sizes[low] = compacted_size(scene, as);
            EXPECT_LE(scene.scratch_size(as), 5000u * 105 + 4096);
        }
        EXPECT_LT(facts[1].nodes, facts[0].nodes);
        EXPECT_LT(static_cast<double>(sizes[1]), 0.95 * static_cast<double>(sizes[0]));
        EXPECT_EQ(facts[1].slots.size(), 5000u);
    }
}

TEST_P(CopyTest, WhatDoesNotFitIsANullStructure) {
    Scene scene(*vk, rtr, 4 << 20, GetParam());
    auto as = scene.build_bottom({scene.triangles(ball(3000, 1, 0.1f, 0.1f))});
    auto whole = scene.build_top(std::vector<VkAccelerationStructureInstanceNV>(77, scene.instance(as)));
    VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
    for (auto source : {as, whole}) {
        info.type = source == as ? VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV
                                 : VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
        const VkDeviceSize size = compacted_size(scene, source);
        // As large as asked for, and by as little less as memory requirements can tell.
        auto fits = scene.create(info, size), small = scene.create(info, (size - 1) / 256 * 256),
             tiny = scene.create(info, 256);
        scene.run([&] {
            for (auto dst : {fits, small, tiny}) {
                EXPECT_EQ(rtrCmdCopyAccelerationStructure(scene.recorder, dst, source,
                                                          VK_COPY_ACCELERATION_STRUCTURE_MODE_COMPACT_NV),
                          VK_SUCCESS);
                vk->compute_barrier();  // the heap is read whole
            }
        });
        EXPECT_EQ(scene.words(fits)[RTC_HDR_MAGIC], RTC_AS_MAGIC);
        for (auto dst : {small, tiny}) {
            const uint32_t* w = scene.words(dst);
            for (uint32_t i = 0; i < RTC_AS_HEADER_QUADS * 4; i++)
                EXPECT_EQ(w[i], i == RTC_HDR_SIZE_QUADS ? size / RTC_QUAD_BYTES : 0u) << i;
        }
        if (source != as) continue;
        auto top = scene.build_top({scene.instance(fits), scene.instance(small)});
        EXPECT_EQ(scene.words(top)[RTC_HDR_ACTIVE_COUNT], 1u);
        EXPECT_EQ(scene.words(top)[RTC_HDR_BAD_INSTANCE], 1u + 1);
    }
}

TEST_P(CopyTest, RefitFollowsTheVertices) {
    for (bool in_place : {true, false}) {
        for (auto extra : {0, int(VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_BUILD_BIT_NV)}) {
            SCOPED_TRACE(in_place);
            Scene scene(*vk, rtr, 8 << 20, GetParam());
            const auto flags = VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV | extra;
            auto a = ball(2000, 3, 1), b = ball(700, 4, 1);
            std::vector<uint32_t> indices;
            for (uint32_t i = 0; i < 2100; i++) indices.push_back(2099 - i);
            std::vector<VkGeometryNV> geometry{scene.triangles(a),
                                               scene.triangles(b, &indices, VK_GEOMETRY_OPAQUE_BIT_NV)};
            auto as = scene.build_bottom(geometry, static_cast<VkBuildAccelerationStructureFlagsNV>(flags));
            TreeFacts before, after;
            check_structure(scene, as, before);
            auto moved_a = ball(2000, 5, 3), moved_b = ball(700, 6, 0.5f);
            std::vector<VkGeometryNV> moved{scene.triangles(moved_a),
                                            scene.triangles(moved_b, &indices, VK_GEOMETRY_OPAQUE_BIT_NV)};
            VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
            info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
            info.flags = static_cast<VkBuildAccelerationStructureFlagsNV>(flags);
            info.geometryCount = 2;
            info.pGeometries = moved.data();
            auto dst = in_place ? as : scene.create(info);
            Buffer scratch = vk->buffer(scene.scratch_size(as, true), RTR_SCRATCH_BUFFER_USAGE);
            scene.run([&] {
                EXPECT_EQ(rtrCmdBuildAccelerationStructure(scene.recorder, &info, VK_NULL_HANDLE, 0, VK_TRUE,
                                                           dst, in_place ? nullptr : as, scratch.handle, 0),
                          VK_SUCCESS);
            });
            check_structure(scene, dst, after);
            ASSERT_EQ(after.slots.size(), 2700u);
            for (auto& s : after.slots) {
                bool second = s.geometry_word & RTC_SLOT_GEOMETRY_MASK;
                EXPECT_EQ(s.geometry_word, second ? 1u | RTC_SLOT_OPAQUE : 0u);
                for (uint32_t k = 0; k < 3; k++) {
                    const Vec3& v =
                        second ? moved_b[2099 - (3 * s.primitive + k)] : moved_a[3 * s.primitive + k];
                    EXPECT_EQ(memcmp(&v, &s.v[k], 12), 0);
                }
            }
            vk->destroy(scratch);
            if (!in_place) {
                TreeFacts untouched;
                check_structure(scene, as, untouched);
                EXPECT_EQ(before.sah, untouched.sah);
            }
        }
    }
}

TEST_P(CopyTest, RefitOfInstancesAndBoxes) {
    Scene scene(*vk, rtr, 4 << 20, GetParam());
    const auto flags = VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV;
    std::vector<std::array<float, 6>> boxes;
    for (int i = 0; i < 300; i++) boxes.push_back({float(i), 0, 0, i + 0.5f, 1, 1});
    auto leaf = scene.build_bottom({scene.aabbs(boxes)}, flags);
    std::vector<VkAccelerationStructureInstanceNV> instances(50, scene.instance(leaf));
    for (int i = 0; i < 50; i++) instances[static_cast<size_t>(i)].transform.matrix[1][3] = 2.0f * i;
    instances[7] = scene.instance(nullptr);
    auto top = scene.build_top(instances, flags);
    for (auto& b : boxes) b[2] -= 10, b[4] += 3;
    std::reverse(boxes.begin(), boxes.end());
    VkGeometryNV geometry = scene.aabbs(boxes, 0, 40, 16);  // an update may lie otherwise
    for (int i = 0; i < 50; i++) instances[static_cast<size_t>(i)].transform.matrix[0][3] = -3.0f * i;
    instances[9].mask = 1;
    Buffer data = scene.upload(instances.data(), instances.size() * sizeof instances[0]);
    VkAccelerationStructureInfoNV bottom_info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV},
        top_info = bottom_info;
    bottom_info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
    bottom_info.flags = top_info.flags = flags;
    bottom_info.geometryCount = 1;
    bottom_info.pGeometries = &geometry;
    top_info.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
    top_info.instanceCount = 50;
    scene.run([&] {
        EXPECT_EQ(rtrCmdBuildAccelerationStructure(scene.recorder, &bottom_info, VK_NULL_HANDLE, 0, VK_TRUE,
                                                   leaf, leaf, scene.scratch.handle, 0),
                  VK_SUCCESS);
        vk->compute_barrier();
        EXPECT_EQ(rtrCmdBuildAccelerationStructure(scene.recorder, &top_info, data.handle, 0, VK_TRUE, top,
                                                   top, scene.scratch.handle, 0),
                  VK_SUCCESS);
    });
    TreeFacts bottom_facts, top_facts;
    check_structure(scene, leaf, bottom_facts);
    check_structure(scene, top, top_facts);
    EXPECT_EQ(scene.words(top)[RTC_HDR_FACTS],
              (GetParam() ? RTC_FACT_ADDRESSES : 0u) | RTC_FACT_HAS_AABBS | RTC_FACT_IDENTITY_TRANSFORMS * 0 | RTC_FACT_NO_INSTANCE_FLAGS);
    EXPECT_EQ(scene.words(top)[RTC_HDR_FIRST_OFFENDER], 0u);  // not opaque
    const float* lo = reinterpret_cast<const float*>(scene.words(top) + RTC_HDR_BOUNDS_MIN);
    EXPECT_LE(lo[2], -10);
}

// A structure may be built, and then updated, with less than it was created for.
TEST_P(CopyTest, FewerThanCreatedFor) {
    Scene scene(*vk, rtr, 1 << 20, GetParam());
    const auto flags = VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV;
    auto vertices = ball(100, 1, 1);
    std::vector<VkGeometryNV> geometry{scene.triangles(vertices)};
    VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
    info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
    info.flags = flags;
    info.geometryCount = 1;
    info.pGeometries = geometry.data();
    auto as = scene.create(info);
    Buffer scratch = vk->buffer(scene.scratch_size(as), RTR_SCRATCH_BUFFER_USAGE);
    geometry[0].geometry.triangles.vertexCount = 60;
    for (VkBool32 update : {VK_FALSE, VK_TRUE}) {
        scene.run([&] {
            EXPECT_EQ(rtrCmdBuildAccelerationStructure(scene.recorder, &info, VK_NULL_HANDLE, 0, update, as,
                                                       nullptr, scratch.handle, 0),
                      VK_SUCCESS);
        });
        TreeFacts facts;
        check_structure(scene, as, facts);
        EXPECT_EQ(facts.slots.size(), 20u);
    }
    vk->destroy(scratch);
}

TEST_P(CopyTest, WrongUsesAreNamed) {
    Scene scene(*vk, rtr, 1 << 20, GetParam());
    auto vertices = ball(10, 1, 1);
    std::vector<VkGeometryNV> geometry{scene.triangles(vertices)};
    auto as = scene.build_bottom(geometry);
    VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
    info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
    info.geometryCount = 1;
    info.pGeometries = geometry.data();
    auto build = [&](VkBool32 update, VkDeviceSize scratch_offset) {
        return rtrCmdBuildAccelerationStructure(scene.recorder, &info, VK_NULL_HANDLE, 0, update, as, nullptr,
                                                scene.scratch.handle, scratch_offset);
    };
    scene.run([&] {
        EXPECT_EQ(build(VK_TRUE, 0), VK_ERROR_VALIDATION_FAILED_EXT);
        expect_runtime_error("update-not-allowed");
        EXPECT_EQ(build(VK_FALSE, 4), VK_ERROR_VALIDATION_FAILED_EXT);
        expect_runtime_error("scratch");
        auto more = ball(11, 1, 1);
        std::vector<VkGeometryNV> larger{scene.triangles(more)};
        info.pGeometries = larger.data();
        EXPECT_EQ(build(VK_FALSE, 0), VK_ERROR_VALIDATION_FAILED_EXT);
        expect_runtime_error("as-geometry");
        EXPECT_EQ(rtrCmdCopyAccelerationStructure(scene.recorder, as, as,
                                                  VK_COPY_ACCELERATION_STRUCTURE_MODE_CLONE_NV),
                  VK_ERROR_VALIDATION_FAILED_EXT);
        expect_runtime_error("copy");
    });
    VkAccelerationStructureCreateInfoNV create{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_NV};
    create.info = info;
    RtrAccelerationStructure out = nullptr;
    auto expect = [&](const char* id, VkResult result = VK_ERROR_VALIDATION_FAILED_EXT) {
        EXPECT_EQ(rtrCreateAccelerationStructure(rtr, &create, nullptr, &out), result);
        EXPECT_EQ(out, nullptr);
        expect_runtime_error(id);
    };
    auto with = [&](auto change, const char* id, VkResult result = VK_ERROR_VALIDATION_FAILED_EXT) {
        VkGeometryNV g = geometry[0];
        change(g);
        create.info.pGeometries = &g;
        expect(id, result);
        create.info.pGeometries = geometry.data();
    };
    with([](VkGeometryNV& g) { g.geometry.triangles.vertexFormat = VK_FORMAT_R8G8B8A8_UNORM; },
         "vertex-format", VK_ERROR_FEATURE_NOT_PRESENT);
    with([](VkGeometryNV& g) { g.geometry.triangles.vertexStride = 11; }, "vertex-stride");
    with([](VkGeometryNV& g) { g.geometry.triangles.vertexOffset = 2; }, "vertex-offset");
    with([](VkGeometryNV& g) { g.geometry.triangles.vertexCount = 31; }, "vertex-count");
    with([](VkGeometryNV& g) { g.geometry.triangles.indexType = VK_INDEX_TYPE_MAX_ENUM; }, "index-type");
    with([](VkGeometryNV& g) { g.pNext = &g; }, "pNext");
    std::vector<VkGeometryNV> mixed{geometry[0], scene.aabbs({{0, 0, 0, 1, 1, 1}})};
    create.info.geometryCount = 2;
    create.info.pGeometries = mixed.data();
    expect("mixed-geometry");
    create.info.geometryCount = 1;
    create.compactedSize = 1000;
    expect("compacted-size");
}

INSTANTIATE_TEST_SUITE_P(Modes, CopyTest, ::testing::Bool(),
                         [](const auto& info) { return info.param ? "Address" : "Heap"; });

class HeapTest : public RuntimeTest {};

TEST_F(HeapTest, Ranges) {
    Scene scene(*vk, rtr, 4096);
    VkDeviceSize a, b, c, d;
    ASSERT_EQ(rtrAllocateHeapRange(scene.heap, 1000, 0, &a), VK_SUCCESS);
    ASSERT_EQ(rtrAllocateHeapRange(scene.heap, 1, 0, &b), VK_SUCCESS);
    ASSERT_EQ(rtrAllocateHeapRange(scene.heap, 1024, 512, &c), VK_SUCCESS);
    EXPECT_EQ(a, 256u);
    EXPECT_EQ(b, 1280u);
    EXPECT_EQ(c, 1536u);
    EXPECT_EQ(rtrAllocateHeapRange(scene.heap, 2048, 0, &d), VK_ERROR_OUT_OF_DEVICE_MEMORY);
    expect_runtime_error("heap-full");
    rtrFreeHeapRange(scene.heap, a);
    ASSERT_EQ(rtrAllocateHeapRange(scene.heap, 512, 0, &d), VK_SUCCESS);
    EXPECT_EQ(d, 256u);
    rtrFreeHeapRange(scene.heap, 77);
    expect_runtime_error("heap-free");
}

}  // namespace
