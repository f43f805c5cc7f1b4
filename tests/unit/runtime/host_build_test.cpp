// Bottom levels built on the host: the same slots as the device's, a tree that holds what
// both promise, and everything a structure can do afterwards.
#include <algorithm>
#include <cmath>
#include <random>

#include "scene_util.h"

namespace {

std::vector<Vec3> soup(size_t count, uint32_t seed, float size = 0.05f) {
    std::mt19937 rng(seed);
    std::uniform_real_distribution<float> u(-1, 1);
    std::vector<Vec3> v;
    for (size_t i = 0; i < count; i++) {
        Vec3 c{u(rng), u(rng), u(rng)};
        for (int k = 0; k < 3; k++) v.push_back({c.x + size * u(rng), c.y + size * u(rng), c.z + size * u(rng)});
    }
    return v;
}

class HostBuildTest : public RuntimeTest {
  protected:
    // Makes and binds an object for the geometries, and builds it in the mapped heap.
    RtrAccelerationStructure build(Scene& scene, const std::vector<VkGeometryNV>& geometries,
                                   const std::vector<RtrHostGeometry>& data,
                                   VkBuildAccelerationStructureFlagsNV flags = 0) {
        VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
        info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
        info.flags = flags;
        info.geometryCount = static_cast<uint32_t>(geometries.size());
        info.pGeometries = geometries.data();
        auto as = scene.create(info);
        EXPECT_EQ(rtrBuildAccelerationStructureOnHost(rtr, &info, data.data(), as,
                                                      const_cast<uint32_t*>(scene.words(as)), nullptr),
                  VK_SUCCESS);
        return as;
    }

    static std::vector<Slot> sorted(std::vector<Slot> slots) {
        std::sort(slots.begin(), slots.end(), [](const Slot& a, const Slot& b) {
            return std::pair(a.geometry_word & RTC_SLOT_GEOMETRY_MASK, a.primitive) <
                   std::pair(b.geometry_word & RTC_SLOT_GEOMETRY_MASK, b.primitive);
        });
        return slots;
    }

    // Builds both ways; same slots bit by bit; returns the facts of host and device.
    std::pair<TreeFacts, TreeFacts> compare(Scene& scene, const std::vector<VkGeometryNV>& geometries,
                                            const std::vector<RtrHostGeometry>& data) {
        auto device = scene.build_bottom(geometries);
        auto host = build(scene, geometries, data);
        TreeFacts h, d;
        check_structure(scene, host, h);
        check_structure(scene, device, d);
        auto a = sorted(h.slots), b = sorted(d.slots);
        EXPECT_EQ(a.size(), b.size());
        for (size_t i = 0; i < std::min(a.size(), b.size()); i++)
            EXPECT_EQ(memcmp(&a[i], &b[i], sizeof(Slot)), 0) << i;
        const uint32_t *hw = scene.words(host), *dw = scene.words(device);
        for (uint32_t w : {RTC_HDR_KIND, RTC_HDR_FACTS, RTC_HDR_ACTIVE_COUNT, RTC_HDR_GEOMETRY_COUNT, RTC_HDR_SLOTS,
                           RTC_HDR_SLOT_COUNT, RTC_HDR_BUILD_FLAGS, RTC_HDR_PRIMITIVE_COUNT,
                           RTC_HDR_FIRST_OFFENDER, RTC_HDR_BOUNDS_MIN, RTC_HDR_BOUNDS_MAX + 2})
            EXPECT_EQ(hw[w], dw[w]) << "word " << w;
        EXPECT_EQ(hw[RTC_HDR_SIZE_QUADS],
                  RTC_AS_HEADER_QUADS + 4 * ((h.nodes + 3) & ~3u) +
                      hw[RTC_HDR_SLOT_COUNT] * (hw[RTC_HDR_FACTS] & RTC_FACT_AABBS ? 2 : 3));
        return {h, d};
    }
};

TEST_F(HostBuildTest, TreesAreGood) {
    for (bool address : {false, true}) {
        if (address && !vk->GetBufferDeviceAddress) continue;
        Scene scene(*vk, rtr, 16 << 20, address);
        auto points = soup(20000, 3);
        auto [host, device] = compare(scene, {scene.triangles(points)}, {{points.data(), nullptr, nullptr, nullptr}});
        EXPECT_LT(host.sah, device.sah * 1.02);
        // A fine terrain beside a huge triangle: the split must find them apart.
        std::vector<Vec3> terrain;
        for (int i = 0; i < 5000; i++) {
            float x = float(i % 100), y = float(i / 100);
            terrain.insert(terrain.end(), {{x, y, 0}, {x + 1, y, 0.1f}, {x, y + 1, 0.2f}});
        }
        terrain.insert(terrain.end(), {{-1e6f, 0, -9}, {1e6f, 0, -9}, {0, 1e6f, -9}});
        auto [host2, device2] =
            compare(scene, {scene.triangles(terrain)}, {{terrain.data(), nullptr, nullptr, nullptr}});
        EXPECT_LT(host2.sah, device2.sah * 1.05);
    }
}

TEST_F(HostBuildTest, EveryFieldOfTheGeometry) {
    Scene scene(*vk, rtr, 4 << 20);
    auto points = soup(100, 11);
    std::vector<unsigned char> raw(8 + points.size() * 20);
    for (size_t i = 0; i < points.size(); i++) memcpy(&raw[8 + 20 * i], &points[i], 12);
    std::vector<uint16_t> indices(3, 0xffff);
    for (uint16_t i = 0; i < 300; i++) indices.push_back(static_cast<uint16_t>(i % 7 ? 299 - i : 1000 + i));
    float transform[16] = {0, 0, 0, 0, 0.3f, 2, 0.7f, 10, -1, 0.1f, 0, 20, 0, 0, 0.5f, 30};
    VkGeometryNV g0 = scene.triangles({});
    auto& t = g0.geometry.triangles;
    t.vertexData = scene.upload(raw.data(), raw.size()).handle;
    t.vertexOffset = 8;
    t.vertexCount = 300;
    t.vertexStride = 20;
    t.indexData = scene.upload(indices.data(), indices.size() * 2).handle;
    t.indexOffset = 6;
    t.indexCount = 300;
    t.indexType = VK_INDEX_TYPE_UINT16;
    t.transformData = scene.upload(transform, sizeof transform).handle;
    t.transformOffset = 16;
    std::vector<uint32_t> wide{12345};
    for (uint32_t i = 0; i < 30; i++) wide.push_back((i * 7) % 300);
    VkGeometryNV g1 = scene.triangles(points, &wide, VK_GEOMETRY_OPAQUE_BIT_NV);
    g1.geometry.triangles.indexOffset = 4;
    g1.geometry.triangles.indexCount = 30;
    std::vector<uint8_t> narrow{77};
    for (uint32_t i = 0; i < 60; i++) narrow.push_back(static_cast<uint8_t>(255 - 3 * i));
    VkGeometryNV g2 = scene.triangles(points, nullptr, VK_GEOMETRY_NO_DUPLICATE_ANY_HIT_INVOCATION_BIT_NV);
    g2.geometry.triangles.indexData = scene.upload(narrow.data(), narrow.size()).handle;
    g2.geometry.triangles.indexType = VK_INDEX_TYPE_UINT8_EXT;
    g2.geometry.triangles.indexOffset = 1;
    g2.geometry.triangles.indexCount = 60;
    compare(scene, {g0, g1, g2},
            {{raw.data(), indices.data(), transform, nullptr},
             {points.data(), wide.data(), nullptr, nullptr},
             {points.data(), narrow.data(), nullptr, nullptr}});
}

TEST_F(HostBuildTest, VertexFormats) {
    Scene scene(*vk, rtr, 4 << 20);
    // Halves: 1, -2, 0.5, denormal, -denormal, 0, largest; as SNORM just other numbers.
    const uint16_t values[9] = {0x3c00, 0xc000, 0x3800, 0x0001, 0x83ff, 0x0000, 0x7bff, 0x0400, 0x8001};
    for (auto [format, bytes] :
         {std::pair{VK_FORMAT_R16G16B16_SFLOAT, 6u}, std::pair{VK_FORMAT_R16G16_SFLOAT, 4u},
          std::pair{VK_FORMAT_R16G16B16A16_SFLOAT, 8u}, std::pair{VK_FORMAT_R16G16B16_SNORM, 6u},
          std::pair{VK_FORMAT_R16G16_SNORM, 4u}, std::pair{VK_FORMAT_R32G32_SFLOAT, 8u}}) {
        SCOPED_TRACE(format);
        std::vector<unsigned char> raw(3 * bytes);
        if (format == VK_FORMAT_R32G32_SFLOAT) {
            const float f[6] = {1, 2, -3, 4, 5, -6};
            memcpy(raw.data(), f, sizeof f);
        } else {
            for (uint32_t i = 0; i < 3 * bytes / 2; i++) memcpy(&raw[2 * i], &values[i % 9], 2);
        }
        VkGeometryNV g = scene.triangles({});
        g.geometry.triangles.vertexData = scene.upload(raw.data(), raw.size()).handle;
        g.geometry.triangles.vertexCount = 3;
        g.geometry.triangles.vertexStride = bytes;
        g.geometry.triangles.vertexFormat = format;
        auto device = scene.build_bottom({g});
        auto host = build(scene, {g}, {{raw.data(), nullptr, nullptr, nullptr}});
        TreeFacts h, d;
        check_structure(scene, host, h);
        check_structure(scene, device, d);
        ASSERT_EQ(h.slots.size(), 1u);
        ASSERT_EQ(d.slots.size(), 1u);
        for (int k = 0; k < 3; k++) {
            // A device may be an ulp off in the division of SNORM.
            EXPECT_FLOAT_EQ(h.slots[0].v[k].x, d.slots[0].v[k].x);
            EXPECT_FLOAT_EQ(h.slots[0].v[k].y, d.slots[0].v[k].y);
            EXPECT_FLOAT_EQ(h.slots[0].v[k].z, d.slots[0].v[k].z);
        }
    }
}

TEST_F(HostBuildTest, BoxesAndOddInput) {
    Scene scene(*vk, rtr, 8 << 20);
    const float nan = NAN;
    std::vector<std::array<float, 6>> boxes{{0, 0, 0, 1, 1, 1}, {nan, 0, 0, 1, 1, 1}, {3, 3, 3, 2, 2, 2}};
    for (int i = 0; i < 300; i++) boxes.push_back({float(i), 0, 0, i + 0.5f, 1, 3e38f});
    compare(scene, {scene.aabbs(boxes)}, {{nullptr, nullptr, nullptr, boxes.data()}});
    for (const auto& [stride, offset] : {std::pair{32u, 8u}, {40u, 16u}, {24u, 48u}}) {
        const std::vector<char> bytes = aabb_bytes(boxes, stride, offset);
        compare(scene, {scene.aabbs(boxes, 0, stride, offset)}, {{nullptr, nullptr, nullptr, bytes.data()}});
    }
    compare(scene, {}, {});
    for (size_t n : {1u, 2u, 3u, 4u, 5u}) {
        auto few = soup(n, 5);
        compare(scene, {scene.triangles(few)}, {{few.data(), nullptr, nullptr, nullptr}});
    }
    // NaN and degenerate triangles are inactive; all inactive is empty.
    std::vector<Vec3> odd{{nan, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 1}, {1, 1, 1}, {2, 2, 2}};
    compare(scene, {scene.triangles(odd)}, {{odd.data(), nullptr, nullptr, nullptr}});
    // Everything at one place, and a geometric chain that would degenerate into a list.
    std::vector<Vec3> same, chain;
    for (int i = 0; i < 1000; i++) same.insert(same.end(), {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
    compare(scene, {scene.triangles(same)}, {{same.data(), nullptr, nullptr, nullptr}});
    float x = 1e-30f;
    for (int i = 0; i < 200; i++, x *= 1.5f) chain.insert(chain.end(), {{x, 0, 0}, {x * 1.1f, 0, 0}, {x, x, 0}});
    compare(scene, {scene.triangles(chain)}, {{chain.data(), nullptr, nullptr, nullptr}});
    std::vector<Vec3> far{{3e38f, 3e38f, 0}, {-3e38f, 0, 0}, {0, -3e38f, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1},
                          {2, 0, 0},         {0, 2, 0},      {0, 0, 2}};
    compare(scene, {scene.triangles(far)}, {{far.data(), nullptr, nullptr, nullptr}});
}

// After it the structure is one like any other.
TEST_F(HostBuildTest, InstancesCompactionAndUpdate) {
    Scene scene(*vk, rtr, 8 << 20);
    auto points = soup(2000, 9);
    std::vector<VkGeometryNV> geometry{scene.triangles(points)};
    const auto flags = VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV;
    auto as = build(scene, geometry, {{points.data(), nullptr, nullptr, nullptr}}, flags);
    auto top = scene.build_top({scene.instance(as)});
    TreeFacts facts, before, after, small_facts;
    check_structure(scene, top, facts);
    EXPECT_EQ(scene.words(top)[RTC_HDR_ACTIVE_COUNT], 1u);
    check_structure(scene, as, before);
    VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
    info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
    auto small = scene.create(info, scene.words(as)[RTC_HDR_SIZE_QUADS] * 16ull);
    auto moved = soup(2000, 10);
    std::vector<VkGeometryNV> moved_geometry{scene.triangles(moved)};
    info.flags = flags;
    info.geometryCount = 1;
    info.pGeometries = moved_geometry.data();
    Buffer scratch = scene.upload(nullptr, scene.scratch_size(as, true));
    scene.run([&] {
        EXPECT_EQ(rtrCmdCopyAccelerationStructure(scene.recorder, small, as,
                                                  VK_COPY_ACCELERATION_STRUCTURE_MODE_COMPACT_NV),
                  VK_SUCCESS);
        vk->compute_barrier();
        EXPECT_EQ(rtrCmdBuildAccelerationStructure(scene.recorder, &info, VK_NULL_HANDLE, 0, VK_TRUE, as,
                                                   nullptr, scratch.handle, 0),
                  VK_SUCCESS);
    });
    check_structure(scene, small, small_facts);
    EXPECT_EQ(before.sah, small_facts.sah);
    check_structure(scene, as, after);
    for (auto& s : after.slots)
        for (uint32_t k = 0; k < 3; k++) EXPECT_EQ(memcmp(&moved[3 * s.primitive + k], &s.v[k], 12), 0);
}

TEST_F(HostBuildTest, WrongUsesAreNamed) {
    Scene scene(*vk, rtr, 1 << 20);
    auto points = soup(10, 1);
    std::vector<uint32_t> indices{0, 1, 2};
    std::vector<VkGeometryNV> geometry{scene.triangles(points)};
    RtrHostGeometry data{points.data(), nullptr, nullptr, nullptr};
    VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
    info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
    info.geometryCount = 1;
    info.pGeometries = geometry.data();
    auto as = scene.create(info);
    void* memory = const_cast<uint32_t*>(scene.words(as));
    auto refused = [&](RtrAccelerationStructure dst, const RtrHostGeometry* host, void* at, const char* id) {
        EXPECT_EQ(rtrBuildAccelerationStructureOnHost(rtr, &info, host, dst, at, nullptr),
                  VK_ERROR_VALIDATION_FAILED_EXT);
        expect_runtime_error(id);
    };
    refused(nullptr, &data, memory, "not-bound");
    refused(as, &data, nullptr, "not-bound");
    refused(as, nullptr, memory, "as-counts");
    info.flags = VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV;
    refused(as, &data, memory, "as-info");
    info.flags = 0;
    data.pVertexData = nullptr;
    refused(as, &data, memory, "geometry-data");
    data.pVertexData = points.data();
    VkGeometryNV indexed = scene.triangles(points, &indices);
    info.pGeometries = &indexed;
    refused(as, &data, memory, "geometry-data");
    auto more = soup(11, 1);
    VkGeometryNV larger = scene.triangles(more);
    info.pGeometries = &larger;
    refused(as, &data, memory, "as-geometry");
    VkGeometryNV boxes = scene.aabbs({{0, 0, 0, 1, 1, 1}});
    info.pGeometries = &boxes;
    refused(as, &data, memory, "as-geometry");
    std::vector<VkGeometryNV> two{geometry[0], geometry[0]};
    info.geometryCount = 2;
    info.pGeometries = two.data();
    refused(as, &data, memory, "as-counts");
    info.geometryCount = 0;
    info.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
    refused(as, &data, memory, "as-info");
}

}  // namespace
