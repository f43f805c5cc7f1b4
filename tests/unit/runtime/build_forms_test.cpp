// Builds take different ways by device and size: trees fitted in one dispatch or level by level, three
// ways to sort. All make the same tree.
#include <limits>
#include <random>

#include "faulty_vulkan.h"
#include "scene_util.h"

namespace {

// Clusters of small triangles and some that reach across them, so that rotations have much to do.
std::vector<Vec3> mixed(size_t count) {
    std::mt19937 rng(7);
    std::uniform_real_distribution<float> u(-1, 1);
    std::vector<Vec3> v;
    for (size_t i = 0; i < count; i++) {
        const float size = i % 97 == 0 ? 1.5f : 0.01f, spread = i % 5 == 0 ? 1.0f : 0.1f;
        const Vec3 c{float(i % 3) + spread * u(rng), spread * u(rng), spread * u(rng)};
        for (int k = 0; k < 3; k++) v.push_back({c.x + size * u(rng), c.y + size * u(rng), c.z + size * u(rng)});
    }
    return v;
}

class BuildFormsTest : public RuntimeTest {
  protected:
    TreeFacts build(RtrDevice device, const std::vector<Vec3>& vertices, VkBuildAccelerationStructureFlagsNV flags) {
        Scene scene(*vk, device, (vertices.size() / 3 + 100) * 128);
        TreeFacts facts;
        auto as = scene.build_bottom({scene.triangles(vertices)}, flags);
        check_structure(scene, as, facts);
        return facts;
    }
    void expect_same(const TreeFacts& a, const TreeFacts& b) {
        EXPECT_EQ(a.nodes, b.nodes);
        EXPECT_EQ(a.depth, b.depth);
        EXPECT_EQ(a.sah, b.sah);
        ASSERT_EQ(a.slots.size(), b.slots.size());
        for (size_t i = 0; i < a.slots.size(); i++) ASSERT_EQ(a.slots[i].primitive, b.slots[i].primitive) << i;
    }
};

TEST_F(BuildFormsTest, LevelByLevelOrAtOnce) {
    FaultyVulkan faulty(*vk);
    faulty.type = VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU;
    const RtrDevice at_once = faulty.create();
    faulty.type = VK_PHYSICAL_DEVICE_TYPE_CPU;
    const RtrDevice by_level = faulty.create();
    for (size_t n : {2, 1023, 1025, 2100, 9000, 20000}) {
        for (VkBuildAccelerationStructureFlagsNV flags :
             {VkBuildAccelerationStructureFlagsNV(VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_NV),
              VkBuildAccelerationStructureFlagsNV(VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_BUILD_BIT_NV),
              VkBuildAccelerationStructureFlagsNV(VK_BUILD_ACCELERATION_STRUCTURE_LOW_MEMORY_BIT_NV)}) {
            SCOPED_TRACE(testing::Message() << n << " triangles, flags " << flags);
            const auto vertices = mixed(n);
            expect_same(build(at_once, vertices, flags), build(by_level, vertices, flags));
        }
    }
    // Top levels too.
    for (auto device : {at_once, by_level}) {
        Scene scene(*vk, device, 4 << 20);
        auto bottom = scene.build_bottom({scene.triangles(mixed(10))});
        std::vector<VkAccelerationStructureInstanceNV> instances(3000, scene.instance(bottom));
        for (size_t i = 0; i < instances.size(); i++) {
            instances[i].transform.matrix[0][3] = float(i * 37 % 101);
            instances[i].transform.matrix[1][3] = float(i * 11 % 53);
        }
        TreeFacts facts;
        check_structure(scene, scene.build_top(instances), facts);
        EXPECT_GT(facts.nodes, 2000u);
    }
    rtrDestroyDevice(at_once, nullptr);
    rtrDestroyDevice(by_level, nullptr);
}

// One primitive more takes another way to sort; if it is inactive, the tree is that of the rest.
TEST_F(BuildFormsTest, WaysToSort) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    for (size_t most : {4096, 131072}) {  // RTR_SORT_SMALL, RTR_SORT_FUSED
        SCOPED_TRACE(most);
        auto vertices = mixed(most);
        const TreeFacts below = build(rtr, vertices, VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_BUILD_BIT_NV);
        for (int k = 0; k < 3; k++) vertices.push_back({nan, 0, 0});
        expect_same(below, build(rtr, vertices, VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_BUILD_BIT_NV));
        EXPECT_EQ(below.slots.size(), most);
    }
}

}  // namespace
