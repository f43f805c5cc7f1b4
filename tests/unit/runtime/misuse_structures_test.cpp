// Every diagnostic about heaps, acceleration structures and their builds: what provokes it, its id,
// VkResult and advice. (Misuse that needs more of a scene is beside the feature it misuses.)
#include "expect_refused.h"
#include "faulty_vulkan.h"
#include "scene_util.h"

namespace {

constexpr VkResult kInvalid = VK_ERROR_VALIDATION_FAILED_EXT, kAbsent = VK_ERROR_FEATURE_NOT_PRESENT;

class MisuseStructuresTest : public RuntimeTest {
  protected:
    // A bottom level of this geometry, not created if all is well.
    VkResult create(const VkGeometryNV& geometry) { return create(std::vector<VkGeometryNV>{geometry}); }
    VkResult create(std::vector<VkGeometryNV> geometries) {
        VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
        info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
        info.geometryCount = static_cast<uint32_t>(geometries.size());
        info.pGeometries = geometries.data();
        return create(info);
    }
    VkResult create(const VkAccelerationStructureInfoNV& info) {
        VkAccelerationStructureCreateInfoNV create{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_NV};
        create.info = info;
        RtrAccelerationStructure as = nullptr;
        VkResult r = rtrCreateAccelerationStructure(rtr, &create, nullptr, &as);
        EXPECT_EQ(as == nullptr, r != VK_SUCCESS);
        rtrDestroyAccelerationStructure(rtr, as, nullptr);
        return r;
    }
};

VkGeometryNV some_triangles() {
    VkGeometryNV g{VK_STRUCTURE_TYPE_GEOMETRY_NV};
    g.geometryType = VK_GEOMETRY_TYPE_TRIANGLES_NV;
    auto& t = g.geometry.triangles;
    t.sType = VK_STRUCTURE_TYPE_GEOMETRY_TRIANGLES_NV;
    t.vertexCount = 3;
    t.vertexStride = 12;
    t.vertexFormat = VK_FORMAT_R32G32B32_SFLOAT;
    t.indexType = VK_INDEX_TYPE_NONE_NV;
    g.geometry.aabbs.sType = VK_STRUCTURE_TYPE_GEOMETRY_AABB_NV;
    return g;
}

VkGeometryNV some_boxes() {
    VkGeometryNV g = some_triangles();
    g.geometryType = VK_GEOMETRY_TYPE_AABBS_NV;
    g.geometry.aabbs.numAABBs = 1;
    g.geometry.aabbs.stride = 24;
    return g;
}

TEST_F(MisuseStructuresTest, Geometry) {
    const VkGeometryNV triangles = some_triangles(), boxes = some_boxes();
    ASSERT_EQ(create(triangles), VK_SUCCESS);
    ASSERT_EQ(create(boxes), VK_SUCCESS);
    const struct {
        const char* id;
        const char* says;
        VkGeometryNV geometry;
        std::function<void(VkGeometryNV&)> spoil;
        VkResult result = kInvalid;
    } rows[] = {
        {"vertex-format", "R32G32B32_SFLOAT", triangles,
         [](auto& g) { g.geometry.triangles.vertexFormat = VK_FORMAT_R8G8B8A8_UNORM; }, kAbsent},
        {"vertex-stride", "multiple of the component size", triangles,
         [](auto& g) { g.geometry.triangles.vertexStride = 13; }},
        {"vertex-stride", "hold a vertex", triangles, [](auto& g) { g.geometry.triangles.vertexStride = 8; }},
        {"vertex-offset", "multiple of the component size", triangles,
         [](auto& g) { g.geometry.triangles.vertexOffset = 2; }},
        {"vertex-count", "multiple of 3", triangles, [](auto& g) { g.geometry.triangles.vertexCount = 4; }},
        {"index-count", "must be 0 with VK_INDEX_TYPE_NONE_NV", triangles,
         [](auto& g) { g.geometry.triangles.indexCount = 3; }},
        {"index-count", "multiple of 3", triangles,
         [](auto& g) {
             g.geometry.triangles.indexType = VK_INDEX_TYPE_UINT32;
             g.geometry.triangles.indexCount = 4;
         }},
        {"vertex-count", "indices but no vertices", triangles,
         [](auto& g) {
             g.geometry.triangles.indexType = VK_INDEX_TYPE_UINT16;
             g.geometry.triangles.indexCount = 3;
             g.geometry.triangles.vertexCount = 0;
         }},
        {"index-offset", "multiple of the index size", triangles,
         [](auto& g) {
             g.geometry.triangles.indexType = VK_INDEX_TYPE_UINT32;
             g.geometry.triangles.indexOffset = 2;
         }},
        {"index-type", "NONE_NV, UINT8_EXT, UINT16 or UINT32", triangles,
         [](auto& g) { g.geometry.triangles.indexType = VK_INDEX_TYPE_MAX_ENUM; }},
        {"transform-offset", "multiple of 16", triangles,
         [](auto& g) { g.geometry.triangles.transformOffset = 8; }},
        {"aabb-stride", "multiple of 8 and at least 24", boxes, [](auto& g) { g.geometry.aabbs.stride = 28; }},
        {"aabb-stride", "multiple of 8 and at least 24", boxes, 
         [](auto& g) {
             g.geometry.aabbs.numAABBs = 2;
             g.geometry.aabbs.stride = 16;
         }},
        {"aabb-offset", "multiple of 8", boxes, [](auto& g) { g.geometry.aabbs.offset = 4; }},
        {"geometry-type", "TRIANGLES or AABBS", triangles,
         [](auto& g) { g.geometryType = VK_GEOMETRY_TYPE_INSTANCES_KHR; }},
        {"geometry-flags", "other than OPAQUE", triangles, [](auto& g) { g.flags = 8; }},
        {"sType", "VkGeometryNV::sType is 5", triangles, [](auto& g) { g.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO; }},
        {"sType", "VkGeometryTrianglesNV::sType is 0", triangles,
         [](auto& g) { g.geometry.triangles.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO; }},
        {"sType", "VkGeometryAABBNV::sType is 0", boxes,
         [](auto& g) { g.geometry.aabbs.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO; }},
        {"maxTriangleCount", "the limit is 67108864", boxes,
         [](auto& g) { g.geometry.aabbs.numAABBs = (1u << 26) + 1; }, kAbsent},
    };
    for (auto& row : rows) {
        VkGeometryNV g = row.geometry;
        row.spoil(g);
        expect_refused(*vk, {{row.id, row.result, row.says, [&] { return create(g); }}});
    }
    expect_refused(*vk, {{"mixed-geometry", kInvalid, "either triangles or AABBs",
                          [&] { return create({triangles, boxes}); }}});
}

TEST_F(MisuseStructuresTest, Structures) {
    const VkGeometryNV triangles = some_triangles();
    VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV}, top = info, bottom = info;
    top.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
    bottom.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
    auto with = [&](VkAccelerationStructureInfoNV i, uint32_t instances, uint32_t geometries) {
        i.instanceCount = instances;
        i.geometryCount = geometries;
        i.pGeometries = &triangles;
        return [this, i] { return create(i); };
    };
    VkAccelerationStructureInfoNV unknown = info, generic = info, both = bottom, strange = bottom, untyped = bottom;
    unknown.type = VK_ACCELERATION_STRUCTURE_TYPE_MAX_ENUM_KHR;
    generic.type = VK_ACCELERATION_STRUCTURE_TYPE_GENERIC_KHR;
    both.flags = VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_NV |
                 VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_BUILD_BIT_NV;
    strange.flags = 0x20;
    untyped.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
    expect_refused(*vk, {
        {"as-counts", kInvalid, "a top level has no geometries", with(top, 0, 1)},
        {"as-counts", kInvalid, "a bottom level has no instances", with(bottom, 1, 0)},
        {"maxInstanceCount", kAbsent, "the limit is 16777216", with(top, (1u << 24) + 1, 0)},
        {"maxGeometryCount", kAbsent, "the limit is 16777215", with(bottom, 0, 1u << 24)},
        {"as-type", kInvalid, "must be TOP_LEVEL or BOTTOM_LEVEL", with(unknown, 0, 0)},
        {"as-type", kInvalid, "must be TOP_LEVEL or BOTTOM_LEVEL", with(generic, 0, 0)},
        {"build-flags", kInvalid, "exclude each other", with(both, 0, 0)},
        {"build-flags", kInvalid, "flags 0x20", with(strange, 0, 0)},
        {"sType", kInvalid, "VkAccelerationStructureInfoNV::sType is 0", with(untyped, 0, 0)},
    });
    VkAccelerationStructureCreateInfoNV compacted{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_NV};
    compacted.info = top;
    compacted.info.instanceCount = 1;
    compacted.compactedSize = 1024;
    RtrAccelerationStructure as = nullptr;
    expect_refused(*vk, {{"compacted-size", kInvalid, "must be 0",
                          [&] { return rtrCreateAccelerationStructure(rtr, &compacted, nullptr, &as); }}});
    compacted.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_KHR;
    expect_refused(*vk, {{"sType", kInvalid, "VkAccelerationStructureCreateInfoNV::sType is",
                          [&] { return rtrCreateAccelerationStructure(rtr, &compacted, nullptr, &as); }}});
}

TEST_F(MisuseStructuresTest, HeapsAndBinding) {
    Buffer buffer = vk->buffer(4096, RTR_HEAP_BUFFER_USAGE);
    RtrHeap made = nullptr;
    auto heap_of = [&](VkBuffer b, VkDeviceSize offset, VkDeviceSize size) {
        return [&, b, offset, size] {
            RtrHeapCreateInfo info{nullptr, b, offset, size};
            return rtrCreateHeap(rtr, &info, nullptr, &made);
        };
    };
    const VkDeviceSize most = rtrGetDeviceSupport(rtr)->maxHeapSizeTexel;
    expect_refused(*vk, {
        {"heap-range", kInvalid, "buffer missing", heap_of(VK_NULL_HANDLE, 0, 4096)},
        {"heap-range", kInvalid, "offset 64 must be a multiple of 256", heap_of(buffer.handle, 64, 1024)},
        {"heap-range", kInvalid, "at least 512", heap_of(buffer.handle, 0, 256)},
        {"heap-size", kAbsent, "address mode would lift this", heap_of(buffer.handle, 0, most + 256)},
    });
    ASSERT_EQ(made, nullptr);

    Scene scene(*vk, rtr, 1 << 16);
    VkAccelerationStructureCreateInfoNV create{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_NV};
    create.info.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV;
    create.info.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
    create.info.instanceCount = 1;
    RtrAccelerationStructure as = nullptr;
    ASSERT_EQ(rtrCreateAccelerationStructure(rtr, &create, nullptr, &as), VK_SUCCESS);
    auto bind = [&](RtrHeap heap, VkDeviceSize offset, VkBuffer b = VK_NULL_HANDLE, VkDeviceSize in_buffer = 0) {
        return [&, heap, offset, b, in_buffer] {
            RtrBindAccelerationStructureMemoryInfo info{nullptr, as, heap, offset, b, in_buffer};
            return rtrBindAccelerationStructureMemory(rtr, 1, &info);
        };
    };
    uint64_t handle = 0;
    VkDescriptorBufferInfo descriptor;
    expect_refused(*vk, {
        {"bind", kInvalid, "a heap or", bind(nullptr, 0)},
        {"bind", kInvalid, "not both", bind(scene.heap, 256, buffer.handle)},
        {"bind-offset", kInvalid, "multiple of 256 and not 0", bind(scene.heap, 0)},
        {"bind-offset", kInvalid, "multiple of 256 and not 0", bind(scene.heap, 300)},
        {"bind-range", kInvalid, "do not fit a heap of 65536", bind(scene.heap, 65536 - 256)},
        {"bind-range", kInvalid, "do not fit a heap of 65536", bind(scene.heap, VkDeviceSize(1) << 40)},
        {"not-bound", kInvalid, "rtrBindAccelerationStructureMemory first",
         [&] { return rtrGetAccelerationStructureHandle(rtr, as, 8, &handle); }},
        {"not-bound", kInvalid, "rtrBindAccelerationStructureMemory first",
         [&] { return rtrGetAccelerationStructureDescriptor(rtr, as, &descriptor); }},
    });
    if (vk->GetBufferDeviceAddress)
        expect_refused(*vk, {{"bind-offset", kInvalid, "must be a multiple of 256", bind(nullptr, 0, buffer.handle, 128)}});
    ASSERT_EQ(bind(scene.heap, 256)(), VK_SUCCESS);
    expect_refused(*vk, {{"handle-size", kInvalid, "8 or more",
                          [&] { return rtrGetAccelerationStructureHandle(rtr, as, 4, &handle); }},
                         {"bind", kInvalid, "not bound yet", bind(scene.heap, 256)}});
    rtrDestroyAccelerationStructure(rtr, as, nullptr);
    vk->destroy(buffer);
}

TEST_F(MisuseStructuresTest, AddressOfTheWrongBuffer) {
    if (!vk->GetBufferDeviceAddress) GTEST_SKIP() << "no address mode here";
    FaultyVulkan faulty(*vk);
    faulty.null_addresses = true;
    RtrDevice d = faulty.create(true, true);
    ASSERT_NE(d, nullptr);
    Buffer buffer = vk->buffer(4096, RTR_ADDRESS_BUFFER_USAGE);
    VkAccelerationStructureCreateInfoNV create{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_NV};
    create.info.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV;
    create.info.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
    RtrAccelerationStructure as = nullptr;
    ASSERT_EQ(rtrCreateAccelerationStructure(d, &create, nullptr, &as), VK_SUCCESS);
    RtrBindAccelerationStructureMemoryInfo info{nullptr, as, nullptr, 0, buffer.handle, 0};
    expect_refused(*vk, {{"bind-address", kInvalid, "needs the usages of RTR_ADDRESS_BUFFER_USAGE",
                          [&] { return rtrBindAccelerationStructureMemory(d, 1, &info); }}});
    rtrDestroyAccelerationStructure(d, as, nullptr);
    rtrDestroyDevice(d, nullptr);
    vk->destroy(buffer);
}

TEST_F(MisuseStructuresTest, Builds) {
    Scene scene(*vk, rtr, 1 << 20);
    const std::vector<Vec3> two{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 0, 0}, {3, 0, 0}, {2, 1, 0}};
    const std::vector<VkGeometryNV> geometry{scene.triangles(two)};
    VkAccelerationStructureInfoNV bottom{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
    bottom.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
    bottom.geometryCount = 1;
    bottom.pGeometries = geometry.data();
    VkAccelerationStructureInfoNV top{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
    top.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
    top.instanceCount = 1;
    const RtrAccelerationStructure dst = scene.create(bottom), tlas = scene.create(top);
    Buffer scratch = vk->buffer(1 << 16, RTR_SCRATCH_BUFFER_USAGE), instances = scene.upload(nullptr, 256);
    auto build = [&](VkAccelerationStructureInfoNV info, RtrAccelerationStructure to, VkBuffer data = VK_NULL_HANDLE,
                     VkDeviceSize offset = 0, VkBool32 update = VK_FALSE, VkDeviceSize at = 0) {
        return [&, info, to, data, offset, update, at] {
            return rtrCmdBuildAccelerationStructure(scene.recorder, &info, data, offset, update, to, nullptr,
                                                    scratch.handle, at);
        };
    };
    auto flagged = bottom, more = bottom, crowd = top, wide = bottom;
    flagged.flags = VK_BUILD_ACCELERATION_STRUCTURE_LOW_MEMORY_BIT_NV;
    const std::vector<VkGeometryNV> twice{geometry[0], geometry[0]};
    more.geometryCount = 2;
    more.pGeometries = twice.data();
    crowd.instanceCount = 2;
    auto larger = geometry;
    larger[0].geometry.triangles.vertexCount = 9;
    wide.pGeometries = larger.data();
    auto lost = geometry;
    lost[0].geometry.triangles.vertexData = VK_NULL_HANDLE;
    auto nowhere = bottom;
    nowhere.pGeometries = lost.data();
    scene.run([&] {
        expect_refused(*vk, {
            {"not-bound", kInvalid, "dst is not bound", build(bottom, nullptr)},
            {"as-info", kInvalid, "differ from dst's creation", build(flagged, dst)},
            {"as-counts", kInvalid, "created for 1", build(more, dst)},
            {"as-counts", kInvalid, "created for 1", build(crowd, tlas, instances.handle)},
            {"as-geometry", kInvalid, "do not fit its creation (2)", build(wide, dst)},
            {"instance-data", kInvalid, "instanceData missing", build(top, tlas)},
            {"instance-data", kInvalid, "not a multiple of 16", build(top, tlas, instances.handle, 8)},
            {"geometry-data", kInvalid, "vertexData is VK_NULL_HANDLE", build(nowhere, dst)},
            {"update-not-allowed", kInvalid, "create and build it with that flag",
             build(bottom, dst, VK_NULL_HANDLE, 0, VK_TRUE)},
            {"scratch", kInvalid, "not a multiple of 256", build(bottom, dst, VK_NULL_HANDLE, 0, VK_FALSE, 100)},
        });
        const RtrAccelerationStructure both[2] = {dst, nullptr};
        expect_refused(*vk, {{"declare-scene", kInvalid, "structure 1 is NULL",
                              [&] { return rtrCmdDeclareScene(scene.recorder, 2, both); }}});
    });
    vk->destroy(scratch);
}

// Limits of storage buffers, which lavapipe and GPUs put out of a test's reach.
TEST_F(MisuseStructuresTest, SmallStorageBuffers) {
    FaultyVulkan faulty(*vk);
    uint32_t limit = 0;
    faulty.remembered = [&](VkPhysicalDeviceLimits& l) { l.maxStorageBufferRange = limit; };
    // Triangles that share 300 vertices, boxes far apart, and instances.
    std::vector<Vec3> vertices(300);
    for (uint32_t i = 0; i < 300; i++) vertices[i] = {float(i % 7), float(i % 11), float(i)};
    std::vector<uint32_t> indices{0, 100, 299};
    auto with_limit = [&](uint32_t bytes, const char* says, const std::function<VkResult(Scene&, VkBuffer)>& call) {
        limit = bytes;
        RtrDevice d = faulty.create();
        ASSERT_NE(d, nullptr);
        {
            Scene scene(*vk, d, 1 << 20);
            Buffer scratch = vk->buffer(1 << 18, RTR_SCRATCH_BUFFER_USAGE);
            scene.run([&] {
                expect_refused(*vk, {{"maxStorageBufferRange", kAbsent, says,
                                      [&] { return call(scene, scratch.handle); }}});
            });
            vk->destroy(scratch);
        }
        rtrDestroyDevice(d, nullptr);
    };
    auto build = [&](Scene& scene, const VkGeometryNV& g, VkBuffer scratch, VkBuffer indirect = VK_NULL_HANDLE) {
        VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
        info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
        info.geometryCount = 1;
        info.pGeometries = &g;
        RtrAccelerationStructureBuildInfo b{};
        b.pInfo = &info;
        b.dst = scene.create(info);
        b.scratch = scratch;
        b.indirectBuffer = indirect;
        b.indirectStride = 16;
        return rtrCmdBuildAccelerationStructures(scene.recorder, 1, &b);
    };
    with_limit(3200, "allows 100", [&](Scene& scene, VkBuffer scratch) {
        return build(scene, scene.aabbs(std::vector<std::array<float, 6>>(101)), scratch);
    });
    with_limit(4096, "vertex data of 3600 bytes", [&](Scene& scene, VkBuffer scratch) {
        return build(scene, scene.triangles(vertices, &indices), scratch);
    });
    with_limit(4096, "one triangle of 12000 bytes", [&](Scene& scene, VkBuffer scratch) {
        auto g = scene.triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
        g.geometry.triangles.vertexStride = 4000;
        return build(scene, g, scratch);
    });
    with_limit(4096, "indirect build: its input must lie within", [&](Scene& scene, VkBuffer scratch) {
        Buffer ranges = scene.upload(nullptr, 256);
        auto g = scene.aabbs(std::vector<std::array<float, 6>>(2));
        g.geometry.aabbs.stride = 4000;
        return build(scene, g, scratch, ranges.handle);
    });
    with_limit(4096, "reaches the handles of 256 instances", [&](Scene& scene, VkBuffer) {
        VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
        info.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
        auto top = scene.create(info, 100000);
        return rtrCmdCopyMemoryToAccelerationStructure(scene.recorder, top, scene.upload(nullptr, 4096).handle, 0, 4096);
    });
}

}  // namespace
