// Several builds in one call, and builds whose ranges come from the device: the same structures
// as built one by one from the host's counts.
#include <cmath>
#include <map>
#include <random>

#include "scene_util.h"

namespace {

constexpr auto kUpdate = VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV;

std::vector<Vec3> soup(size_t triangles, uint32_t seed) {
    std::mt19937 rng(seed);
    std::uniform_real_distribution<float> u(-1, 1);
    std::vector<Vec3> v;
    for (size_t i = 0; i < triangles; i++) {
        Vec3 c{u(rng), u(rng), u(rng)};
        for (int k = 0; k < 3; k++) v.push_back({c.x + 0.05f * u(rng), c.y + 0.05f * u(rng), c.z + 0.05f * u(rng)});
    }
    return v;
}

VkAccelerationStructureInfoNV bottom(const std::vector<VkGeometryNV>& geometry,
                                     VkBuildAccelerationStructureFlagsNV flags = 0) {
    VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
    info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
    info.flags = flags;
    info.geometryCount = static_cast<uint32_t>(geometry.size());
    info.pGeometries = geometry.data();
    return info;
}
VkAccelerationStructureInfoNV top(uint32_t instances, VkBuildAccelerationStructureFlagsNV flags = 0) {
    VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
    info.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
    info.flags = flags;
    info.instanceCount = instances;
    return info;
}

// Slots by (geometry, primitive), as vertices.
std::map<std::pair<uint32_t, uint32_t>, std::vector<float>> by_primitive(const TreeFacts& facts) {
    std::map<std::pair<uint32_t, uint32_t>, std::vector<float>> out;
    for (auto& s : facts.slots) {
        auto& v = out[{s.geometry_word, s.primitive}];
        for (auto& x : s.v) v.insert(v.end(), {x.x, x.y, x.z});
    }
    return out;
}

// Parameter: address mode.
class BatchTest : public RuntimeTest, public ::testing::WithParamInterface<bool> {
  protected:
    void SetUp() override {
        RuntimeTest::SetUp();
        if (vk && GetParam() && !vk->GetBufferDeviceAddress) GTEST_SKIP() << "the device has no bufferDeviceAddress";
    }

    // The builds with scratch for each, one behind the other.
    struct Batch {
        std::vector<RtrAccelerationStructureBuildInfo> infos;
        Buffer scratch;
    };
    void add_scratch(Scene& scene, Batch& batch) {
        VkDeviceSize size = 0;
        for (auto& b : batch.infos) {
            b.scratchOffset = size;
            size += scene.scratch_size(b.dst, b.update);
        }
        batch.scratch = vk->buffer(size, RTR_SCRATCH_BUFFER_USAGE);
        for (auto& b : batch.infos) b.scratch = batch.scratch.handle;
    }
    void run(Scene& scene, Batch& batch) {
        add_scratch(scene, batch);
        scene.run([&] {
            EXPECT_EQ(rtrCmdBuildAccelerationStructures(scene.recorder, static_cast<uint32_t>(batch.infos.size()),
                                                        batch.infos.data()),
                      VK_SUCCESS);
        });
        vk->destroy(batch.scratch);
    }
    static RtrAccelerationStructureBuildInfo make(const VkAccelerationStructureInfoNV& info, RtrAccelerationStructure dst,
                                                  bool update = false, RtrAccelerationStructure src = nullptr) {
        RtrAccelerationStructureBuildInfo b{};
        b.pInfo = &info;
        b.dst = dst;
        b.src = src;
        b.update = update;
        return b;
    }
    static void expect_same(const Scene& scene, RtrAccelerationStructure a, RtrAccelerationStructure b) {
        TreeFacts x, y;
        check_structure(scene, a, x);
        check_structure(scene, b, y);
        EXPECT_EQ(x.nodes, y.nodes);
        EXPECT_EQ(x.sah, y.sah);
        EXPECT_EQ(by_primitive(x), by_primitive(y));
    }
};

TEST_P(BatchTest, TheSameAsOneByOne) {
    Scene scene(*vk, rtr, 32 << 20, GetParam());
    std::vector<std::vector<VkGeometryNV>> geometries;
    for (uint32_t i = 0; i < 14; i++) {
        std::vector<VkGeometryNV> g;
        if (i == 3) g.push_back(scene.aabbs({{0, 0, 0, 1, 1, 1}, {2, 0, 0, 3, 1, 1}, {4, 4, 4, 5, 5, 5}}));
        else if (i != 5)  // number 5 is empty
            for (uint32_t k = 0; k <= i % 3; k++) g.push_back(scene.triangles(soup(1 + i * i * 23, i + 100 * k)));
        geometries.push_back(g);
    }
    std::vector<VkAccelerationStructureInfoNV> infos;
    for (uint32_t i = 0; i < 14; i++)
        infos.push_back(bottom(geometries[i], i % 4 == 1   ? kUpdate
                                              : i % 4 == 2 ? VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_BUILD_BIT_NV
                                                           : 0));
    std::vector<VkAccelerationStructureInstanceNV> instances;
    Batch batch;
    for (auto& info : infos) {
        batch.infos.push_back(make(info, scene.create(info)));
        for (int k = 0; k < 3 && info.geometryCount; k++) {
            instances.push_back(scene.instance(batch.infos.back().dst));
            instances.back().transform.matrix[k][3] = 5.0f * static_cast<float>(instances.size());
        }
    }
    // Top levels of what is built in the same call, one before and one after the rest in the list.
    auto top_info = top(static_cast<uint32_t>(instances.size()));
    Buffer data = scene.upload(instances.data(), instances.size() * sizeof instances[0]);
    for (int k = 0; k < 2; k++) {
        auto b = make(top_info, scene.create(top_info));
        b.instanceData = data.handle;
        batch.infos.insert(k ? batch.infos.begin() : batch.infos.end(), b);
    }
    const auto built = batch.infos;
    run(scene, batch);
    for (uint32_t i = 0; i < 14; i++) {
        SCOPED_TRACE(i);
        expect_same(scene, built[i + 1].dst, scene.build_bottom(geometries[i], infos[i].flags));
    }
    auto alone = scene.build_top(instances);
    for (auto as : {built.front().dst, built.back().dst}) {
        expect_same(scene, as, alone);
        EXPECT_EQ(scene.words(as)[RTC_HDR_ACTIVE_COUNT], 39u);
    }

    // Updates and builds together.
    std::vector<std::vector<VkGeometryNV>> moved;
    Batch mixed;
    for (uint32_t i = 0; i < 14; i++) {
        moved.emplace_back();
        for (uint32_t k = 0; k < geometries[i].size(); k++)
            moved[i].push_back(i == 3 ? geometries[i][k] : scene.triangles(soup(1 + i * i * 23, 1000 + i + 100 * k)));
    }
    for (uint32_t i = 0; i < 14; i++) infos[i].pGeometries = moved[i].data();
    for (uint32_t i = 0; i < 14; i++) {
        bool other = i == 9;  // into another structure
        mixed.infos.push_back(make(infos[i], other ? scene.create(infos[i]) : built[i + 1].dst, i % 4 == 1,
                                   other ? built[i + 1].dst : nullptr));
    }
    mixed.infos.push_back(built.back());
    run(scene, mixed);
    for (uint32_t i = 0; i < 14; i++) {
        SCOPED_TRACE(i);
        TreeFacts facts, wanted;
        check_structure(scene, mixed.infos[i].dst, facts);
        check_structure(scene, scene.build_bottom(moved[i], infos[i].flags), wanted);
        EXPECT_EQ(by_primitive(facts), by_primitive(wanted));
    }
    TreeFacts facts;
    check_structure(scene, built.back().dst, facts);
}

TEST_P(BatchTest, MistakesAreNamed) {
    Scene scene(*vk, rtr, 4 << 20, GetParam());
    std::vector<VkGeometryNV> geometry{scene.triangles(soup(300, 1))};
    auto info = bottom(geometry);
    Batch batch;
    for (int i = 0; i < 3; i++) batch.infos.push_back(make(info, scene.create(info)));
    add_scratch(scene, batch);
    auto refused = [&](const std::vector<RtrAccelerationStructureBuildInfo>& infos, const char* id) {
        scene.run([&] {
            EXPECT_EQ(rtrCmdBuildAccelerationStructures(scene.recorder, static_cast<uint32_t>(infos.size()),
                                                        infos.data()),
                      VK_ERROR_VALIDATION_FAILED_EXT);
        });
        expect_runtime_error(id);
    };
    auto bad = batch.infos;
    bad[2].scratchOffset = bad[1].scratchOffset + 256;
    refused(bad, "batch-overlap");
    bad = batch.infos;
    bad[2].dst = bad[0].dst;
    refused(bad, "batch-overlap");
    bad = batch.infos;
    bad[1].pNext = &bad;
    refused(bad, "pNext");
    bad = batch.infos;
    bad[1].indirectBuffer = scene.scratch.handle ? scene.scratch.handle : batch.scratch.handle;
    bad[1].indirectOffset = 2;
    refused(bad, "indirect-build");
    scene.run([&] { EXPECT_EQ(rtrCmdBuildAccelerationStructures(scene.recorder, 0, nullptr), VK_SUCCESS); });
    scene.run([&] {
        EXPECT_EQ(rtrCmdBuildAccelerationStructures(scene.recorder, 3, batch.infos.data()), VK_SUCCESS);
    });
    for (auto& b : batch.infos) {
        TreeFacts facts;
        check_structure(scene, b.dst, facts);
    }
    vk->destroy(batch.scratch);
}

// A call of many records the barriers of the one among them that has most.
PFN_vkGetDeviceProcAddr real_device_proc;
PFN_vkGetInstanceProcAddr real_instance_proc;
PFN_vkCmdPipelineBarrier real_barrier;
int barriers;
VKAPI_ATTR void VKAPI_CALL count_barrier(VkCommandBuffer cmd, VkPipelineStageFlags a, VkPipelineStageFlags b,
                                         VkDependencyFlags c, uint32_t d, const VkMemoryBarrier* e, uint32_t f,
                                         const VkBufferMemoryBarrier* g, uint32_t h, const VkImageMemoryBarrier* i) {
    barriers++;
    real_barrier(cmd, a, b, c, d, e, f, g, h, i);
}
VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL device_proc(VkDevice device, const char* name) {
    auto f = real_device_proc(device, name);
    if (strcmp(name, "vkCmdPipelineBarrier") != 0) return f;
    real_barrier = reinterpret_cast<PFN_vkCmdPipelineBarrier>(f);
    return reinterpret_cast<PFN_vkVoidFunction>(count_barrier);
}
VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL instance_proc(VkInstance instance, const char* name) {
    auto f = real_instance_proc(instance, name);
    if (strcmp(name, "vkGetDeviceProcAddr") != 0) return f;
    real_device_proc = reinterpret_cast<PFN_vkGetDeviceProcAddr>(f);
    return reinterpret_cast<PFN_vkVoidFunction>(device_proc);
}

TEST_P(BatchTest, BarriersAreShared) {
    real_instance_proc = vk->get_instance_proc_addr;
    RtrDeviceCreateInfo info{};
    info.instance = vk->instance;
    info.physicalDevice = vk->physical_device;
    info.device = vk->device;
    info.pfnGetInstanceProcAddr = instance_proc;
    info.bufferDeviceAddress = vk->GetBufferDeviceAddress != nullptr;
    RtrDevice counting = nullptr;
    ASSERT_EQ(rtrCreateDevice(&info, nullptr, &counting), VK_SUCCESS);
    {
        Scene scene(*vk, counting, 4 << 20, GetParam());
        std::vector<VkGeometryNV> geometry{scene.triangles(soup(500, 1))};
        auto build_info = bottom(geometry);
        int of_one = 0;
        for (int n : {1, 9}) {
            Batch batch;
            for (int i = 0; i < n; i++) batch.infos.push_back(make(build_info, scene.create(build_info)));
            barriers = 0;
            run(scene, batch);
            if (n == 1) of_one = barriers;
            EXPECT_EQ(barriers, of_one) << n;
            EXPECT_GT(barriers, 3);
        }
    }
    rtrDestroyDevice(counting, nullptr);
}

// ---- Ranges from the device ------------------------------------------------------------------

using Range = VkAccelerationStructureBuildRangeInfoKHR;

TEST_P(BatchTest, RangesOfTriangles) {
    Scene scene(*vk, rtr, 16 << 20, GetParam());
    auto vertices = soup(1000, 7);
    std::vector<uint32_t> wide;
    std::vector<uint16_t> narrow;
    std::mt19937 rng(3);
    for (uint32_t i = 0; i < 900; i++) wide.push_back(rng() % 2000);
    for (uint32_t i = 0; i < 900; i++) narrow.push_back(static_cast<uint16_t>(rng() % 2000));
    float transforms[24] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 2, 0, 0, 1, 0, 2, 0, 2, 0, 0, 2, 3};
    Buffer moves = scene.upload(transforms, sizeof transforms);
    std::vector<VkGeometryNV> most{scene.triangles(vertices), scene.triangles(vertices, &wide),
                                   scene.triangles(vertices, &wide), scene.triangles(vertices, &wide)};
    auto& small = most[2].geometry.triangles;
    small.indexData = scene.upload(narrow.data(), narrow.size() * 2).handle;
    small.indexType = VK_INDEX_TYPE_UINT16;
    most[3].geometry.triangles.transformData = moves.handle;
    for (auto flags : {VkBuildAccelerationStructureFlagsNV(0), VkBuildAccelerationStructureFlagsNV(kUpdate)}) {
        const Range ranges[2][4] = {
            {{700, 5 * 36, 0, 0}, {200, 12, 900, 0}, {100, 6, 11, 0}, {299, 12, 0, 48}},
            {{0, 0, 0, 0}, {1, 0, 0, 0}, {300, 0, 0, 0}, {0, 0, 0, 0}},
        };
        for (auto& r : ranges) {
            const size_t stride = 24;
            std::vector<char> bytes(8 + stride * 4);
            for (size_t g = 0; g < 4; g++) memcpy(&bytes[8 + stride * g], &r[g], sizeof(Range));
            Buffer indirect = scene.upload(bytes.data(), bytes.size());
            auto info = bottom(most, flags);
            Batch batch;
            batch.infos.push_back(make(info, scene.create(info)));
            auto& b = batch.infos[0];
            b.indirectBuffer = indirect.handle;
            b.indirectOffset = 8;
            b.indirectStride = stride;
            auto dst = b.dst;
            run(scene, batch);
            // The same by the host's counts.
            auto direct = most;
            for (size_t g = 0; g < 4; g++) {
                auto& t = direct[g].geometry.triangles;
                if (g == 0) {
                    t.vertexOffset = r[g].primitiveOffset + r[g].firstVertex * t.vertexStride;
                    t.vertexCount = 3 * r[g].primitiveCount;
                } else {
                    t.indexOffset = r[g].primitiveOffset;
                    t.indexCount = 3 * r[g].primitiveCount;
                    t.vertexOffset = r[g].firstVertex * t.vertexStride;
                    t.vertexCount -= r[g].firstVertex;
                    t.transformOffset = r[g].transformOffset;
                }
            }
            auto wanted = scene.build_bottom(direct, flags);
            TreeFacts x, y;
            check_structure(scene, dst, x);
            check_structure(scene, wanted, y);
            EXPECT_EQ(by_primitive(x), by_primitive(y));
            EXPECT_EQ(x.sah, y.sah);
            if (!(flags & kUpdate)) continue;
            batch.infos[0].update = VK_TRUE;
            run(scene, batch);
            TreeFacts again;
            check_structure(scene, dst, again);
            EXPECT_EQ(by_primitive(again), by_primitive(y));
            EXPECT_EQ(scene.words(dst)[RTC_HDR_BAD_UPDATE], 0u);
        }
    }
}

TEST_P(BatchTest, RangesOfBoxesAndInstances) {
    Scene scene(*vk, rtr, 8 << 20, GetParam());
    std::vector<std::array<float, 6>> boxes;
    for (int i = 0; i < 500; i++) boxes.push_back({float(i), 0, 0, i + 0.5f, 1, 1});
    std::vector<VkGeometryNV> most{scene.aabbs(boxes)};
    auto info = bottom(most);
    const Range box_range{123, 24 * 100, 0, 0};
    Batch batch;
    batch.infos.push_back(make(info, scene.create(info)));
    batch.infos[0].indirectBuffer = scene.upload(&box_range, sizeof box_range).handle;
    auto leaf = batch.infos[0].dst;
    run(scene, batch);
    auto direct = most;
    direct[0].geometry.aabbs.offset = 24 * 100;
    direct[0].geometry.aabbs.numAABBs = 123;
    expect_same(scene, leaf, scene.build_bottom(direct));

    // Behind the count lies what is no instance.
    std::vector<VkAccelerationStructureInstanceNV> instances(64, scene.instance(leaf));
    memset(&instances[50], 0xee, 14 * sizeof instances[0]);
    for (int i = 0; i < 50; i++) instances[static_cast<size_t>(i)].transform.matrix[1][3] = 3.0f * i;
    const Range range{40, 10 * 64, 0, 0};
    auto top_info = top(50);
    batch.infos = {make(top_info, scene.create(top_info))};
    auto& b = batch.infos[0];
    b.instanceData = scene.upload(instances.data(), instances.size() * sizeof instances[0]).handle;
    b.indirectBuffer = scene.upload(&range, sizeof range).handle;
    auto as = b.dst;
    run(scene, batch);
    TreeFacts facts;
    check_structure(scene, as, facts);
    const uint32_t* w = scene.words(as);
    EXPECT_EQ(w[RTC_HDR_ACTIVE_COUNT], 40u);
    EXPECT_EQ(w[RTC_HDR_BAD_INSTANCE], 0u);
    for (uint32_t i = 0; i < 50; i++) {
        const float* record = reinterpret_cast<const float*>(w + 4 * (w[RTC_HDR_SLOTS] + RTC_INSTANCE_QUADS * i));
        EXPECT_EQ(record[12 + 7], i < 40 ? 3.0f * static_cast<float>(i + 10) : 0.0f) << i;
    }
}

INSTANTIATE_TEST_SUITE_P(Modes, BatchTest, ::testing::Bool(),
                         [](const auto& info) { return info.param ? "Address" : "Heap"; });

}  // namespace
