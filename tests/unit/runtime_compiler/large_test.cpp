// 4 million triangles: more nodes than a storage buffer of lavapipe reaches. Built, traced, updated, traced.
// Long: ctest runs it by its name.
#include "stages_fixture.h"

namespace {

class LargeTest : public StagesTest {
  protected:
    static constexpr uint32_t kRays = 256;

    std::vector<uint32_t> trace(Scene& scene, RtrAccelerationStructure top) {
        RtrLaunchError error{};
        return StagesTest::trace(scene, scene.heap, top, kRays, error);
    }
};

TEST_F(LargeTest, DISABLED_FourMillionFollowTheirVertices) {
    const uint32_t n = 1448;  // 2 n^2 = 4 193 408 triangles
    ASSERT_EQ(create(), VK_SUCCESS);
    Scene scene(*vk, rtr, 512u << 20);
    std::vector<Vec3> vertices, raised;
    std::vector<uint32_t> indices;
    // Under the rays and out of their reach; then lifted into it, an even cell's column (x / 2 odd) left below.
    for (uint32_t y = 0; y <= n; y++) {
        for (uint32_t x = 0; x <= n; x++) {
            vertices.push_back({float(x), float(y), -500.0f});
            raised.push_back({float(x), float(y), x / 2 % 2 ? -500.0f : -5.0f + float((x ^ y) & 3)});
        }
    }
    for (uint32_t y = 0; y < n; y++) {
        for (uint32_t x = 0; x < n; x++) {
            const uint32_t a = y * (n + 1) + x;
            for (uint32_t i : {a, a + 1, a + n + 1, a + 1, a + n + 2, a + n + 1}) indices.push_back(i);
        }
    }
    const auto flags = VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV;
    VkGeometryNV before = scene.triangles(vertices, &indices), after = scene.triangles(raised, &indices);
    auto bottom = scene.build_bottom({before}, flags);
    ASSERT_NE(bottom, nullptr);
    for (const uint32_t value : trace(scene, scene.build_top({scene.instance(bottom)}))) EXPECT_EQ(value, base + 7);
    VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
    info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
    info.flags = flags;
    info.geometryCount = 1;
    info.pGeometries = &after;
    Buffer scratch = vk->buffer(scene.scratch_size(bottom, true), RTR_SCRATCH_BUFFER_USAGE);
    scene.run([&] {
        EXPECT_EQ(rtrCmdBuildAccelerationStructure(scene.recorder, &info, VK_NULL_HANDLE, 0, VK_TRUE, bottom, nullptr,
                                                   scratch.handle, 0),
                  VK_SUCCESS);
    });
    vk->destroy(scratch);
    // Rays at x = 0.1 + 2 i, y = 0.1: the first triangle of cell 2 i, near its corner.
    const auto values = trace(scene, scene.build_top({scene.instance(bottom)}));
    for (uint32_t i = 0; i < kRays; i++) EXPECT_EQ(values[i], i % 2 ? base + 7 : base + 50 + 2 * (2 * i)) << i;
    TreeFacts facts;
    check_structure(scene, bottom, facts);
    EXPECT_EQ(facts.slots.size(), 2u * n * n);
}

}  // namespace
