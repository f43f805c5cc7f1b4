#include "scene_util.h"

#include <chrono>
#include <cmath>
#include <cstdlib>

Scene::Scene(Vulkan& v, RtrDevice d, VkDeviceSize heap_size, bool address)
    : vk(v), rtr(d), address_mode(address) {
    heap_buffer = vk.buffer(heap_size, address ? RTR_ADDRESS_BUFFER_USAGE : RTR_HEAP_BUFFER_USAGE);
    if (address) {
        VkBufferDeviceAddressInfo info{VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO};
        info.buffer = heap_buffer.handle;
        address_ = vk.GetBufferDeviceAddress(vk.device, &info);
    } else {
        RtrHeapCreateInfo info{};
        info.buffer = heap_buffer.handle;
        info.size = heap_buffer.size;
        EXPECT_EQ(rtrCreateHeap(rtr, &info, nullptr, &heap), VK_SUCCESS);
    }
    control = vk.buffer(1 << 20, RTR_CONTROL_BUFFER_USAGE);
    RtrRecorderCreateInfo recorder_info{};
    recorder_info.controlBuffer = control.handle;
    recorder_info.controlSize = control.size;
    EXPECT_EQ(rtrCreateRecorder(rtr, &recorder_info, nullptr, &recorder), VK_SUCCESS);
    if (heap) run([&] { EXPECT_EQ(rtrCmdInitializeHeap(recorder, heap), VK_SUCCESS); });
}

Scene::~Scene() {
    for (auto as : structures_) rtrDestroyAccelerationStructure(rtr, as, nullptr);
    rtrDestroyRecorder(rtr, recorder, nullptr);
    rtrDestroyHeap(rtr, heap, nullptr);
    for (auto& b : buffers_) vk.destroy(b);
    vk.destroy(heap_buffer);
    vk.destroy(control);
    if (scratch.handle) vk.destroy(scratch);
}

Buffer Scene::upload(const void* data, size_t size) {
    Buffer b = vk.buffer(size ? size : 4, RTR_INPUT_BUFFER_USAGE);
    if (data && size) memcpy(b.data, data, size);
    buffers_.push_back(b);
    return b;
}

void Scene::run(const std::function<void()>& record) {
    vk.begin();
    EXPECT_EQ(rtrBeginRecorder(recorder, vk.cmd), VK_SUCCESS);
    record();
    auto begin = std::chrono::steady_clock::now();
    vk.submit();
    if (getenv("RTC_TEST_TIMES"))
        printf("submit %.1f ms\n",
               std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() * 1e3);
    EXPECT_EQ(rtrRetireRecorder(recorder), VK_SUCCESS);
}

VkGeometryNV Scene::triangles(const std::vector<Vec3>& vertices, const std::vector<uint32_t>* indices,
                              VkGeometryFlagsNV flags) {
    VkGeometryNV g{VK_STRUCTURE_TYPE_GEOMETRY_NV};
    g.geometryType = VK_GEOMETRY_TYPE_TRIANGLES_NV;
    g.flags = flags;
    VkGeometryTrianglesNV& t = g.geometry.triangles;
    t.sType = VK_STRUCTURE_TYPE_GEOMETRY_TRIANGLES_NV;
    t.vertexData = upload(vertices.data(), vertices.size() * sizeof(Vec3)).handle;
    t.vertexCount = static_cast<uint32_t>(vertices.size());
    t.vertexStride = sizeof(Vec3);
    t.vertexFormat = VK_FORMAT_R32G32B32_SFLOAT;
    t.indexType = VK_INDEX_TYPE_NONE_NV;
    if (indices) {
        t.indexData = upload(indices->data(), indices->size() * 4).handle;
        t.indexCount = static_cast<uint32_t>(indices->size());
        t.indexType = VK_INDEX_TYPE_UINT32;
    }
    g.geometry.aabbs.sType = VK_STRUCTURE_TYPE_GEOMETRY_AABB_NV;
    return g;
}

std::vector<char> aabb_bytes(const std::vector<std::array<float, 6>>& boxes, uint32_t stride, uint32_t offset) {
    std::vector<char> bytes(offset + boxes.size() * stride + 8, '\xff');
    for (size_t i = 0; i < boxes.size(); i++) {
        const auto& b = boxes[i];
        const VkAabbPositionsNV box{b[0], b[1], b[2], b[3], b[4], b[5]};
        memcpy(&bytes[offset + i * stride], &box, sizeof box);
    }
    return bytes;
}

VkGeometryNV Scene::aabbs(const std::vector<std::array<float, 6>>& boxes, VkGeometryFlagsNV flags, uint32_t stride,
                          uint32_t offset) {
    const std::vector<char> bytes = aabb_bytes(boxes, stride, offset);
    VkGeometryNV g{VK_STRUCTURE_TYPE_GEOMETRY_NV};
    g.geometryType = VK_GEOMETRY_TYPE_AABBS_NV;
    g.flags = flags;
    g.geometry.triangles.sType = VK_STRUCTURE_TYPE_GEOMETRY_TRIANGLES_NV;
    VkGeometryAABBNV& b = g.geometry.aabbs;
    b.sType = VK_STRUCTURE_TYPE_GEOMETRY_AABB_NV;
    b.aabbData = upload(bytes.data(), bytes.size()).handle;
    b.numAABBs = static_cast<uint32_t>(boxes.size());
    b.stride = stride;
    b.offset = offset;
    return g;
}

RtrAccelerationStructure Scene::create(const VkAccelerationStructureInfoNV& info, VkDeviceSize compacted) {
    VkAccelerationStructureCreateInfoNV create{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_NV};
    create.info = info;
    create.compactedSize = compacted;
    RtrAccelerationStructure as = nullptr;
    EXPECT_EQ(rtrCreateAccelerationStructure(rtr, &create, nullptr, &as), VK_SUCCESS);
    if (!as) return nullptr;
    structures_.push_back(as);
    bind(as);
    return as;
}

void Scene::bind(RtrAccelerationStructure as) {
    VkMemoryRequirements2 need{VK_STRUCTURE_TYPE_MEMORY_REQUIREMENTS_2};
    rtrGetAccelerationStructureMemoryRequirements(
        rtr, VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_OBJECT_NV, as, &need);
    RtrBindAccelerationStructureMemoryInfo bind{};
    bind.accelerationStructure = as;
    if (address_mode) {
        bind.buffer = heap_buffer.handle;
        bind.bufferOffset = used_;
        used_ += need.memoryRequirements.size;
        EXPECT_LE(used_, heap_buffer.size);
    } else {
        bind.heap = heap;
        EXPECT_EQ(rtrAllocateHeapRange(heap, need.memoryRequirements.size, 0, &bind.heapOffset), VK_SUCCESS);
    }
    EXPECT_EQ(rtrBindAccelerationStructureMemory(rtr, 1, &bind), VK_SUCCESS);
}

VkDeviceSize Scene::scratch_size(RtrAccelerationStructure as, bool update) const {
    VkMemoryRequirements2 need{VK_STRUCTURE_TYPE_MEMORY_REQUIREMENTS_2};
    rtrGetAccelerationStructureMemoryRequirements(
        rtr,
        update ? VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_UPDATE_SCRATCH_NV
               : VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_BUILD_SCRATCH_NV,
        as, &need);
    return need.memoryRequirements.size;
}

RtrAccelerationStructure Scene::build_bottom(const std::vector<VkGeometryNV>& geometries,
                                             VkBuildAccelerationStructureFlagsNV flags) {
    VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
    info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
    info.flags = flags;
    info.geometryCount = static_cast<uint32_t>(geometries.size());
    info.pGeometries = geometries.data();
    auto as = create(info);
    if (!as) return nullptr;
    if (scratch.size < scratch_size(as)) {
        if (scratch.handle) vk.destroy(scratch);
        scratch = vk.buffer(scratch_size(as), RTR_SCRATCH_BUFFER_USAGE);
    }
    run([&] {
        EXPECT_EQ(rtrCmdBuildAccelerationStructure(recorder, &info, VK_NULL_HANDLE, 0, VK_FALSE, as, nullptr,
                                                   scratch.handle, 0),
                  VK_SUCCESS);
    });
    return as;
}

RtrAccelerationStructure Scene::build_top(const std::vector<VkAccelerationStructureInstanceNV>& instances,
                                          VkBuildAccelerationStructureFlagsNV flags) {
    VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
    info.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
    info.flags = flags;
    info.instanceCount = static_cast<uint32_t>(instances.size());
    auto as = create(info);
    if (!as) return nullptr;
    if (scratch.size < scratch_size(as)) {
        if (scratch.handle) vk.destroy(scratch);
        scratch = vk.buffer(scratch_size(as), RTR_SCRATCH_BUFFER_USAGE);
    }
    Buffer data = upload(instances.data(), instances.size() * sizeof(instances[0]));
    run([&] {
        EXPECT_EQ(rtrCmdBuildAccelerationStructure(recorder, &info, data.handle, 0, VK_FALSE, as, nullptr,
                                                   scratch.handle, 0),
                  VK_SUCCESS);
    });
    return as;
}

uint64_t Scene::handle(RtrAccelerationStructure as) const {
    uint64_t h = 0;
    EXPECT_EQ(rtrGetAccelerationStructureHandle(rtr, as, sizeof h, &h), VK_SUCCESS);
    return h;
}

const uint32_t* Scene::words(RtrAccelerationStructure as) const {
    return block(handle(as));
}

const uint32_t* Scene::block(uint64_t handle) const {
    return heap_buffer.as<uint32_t>(address_mode ? handle - address_ : (handle & 0xffffffffu) * RTC_QUAD_BYTES);
}

VkAccelerationStructureInstanceNV Scene::instance(RtrAccelerationStructure as) const {
    VkAccelerationStructureInstanceNV i{};
    i.transform.matrix[0][0] = i.transform.matrix[1][1] = i.transform.matrix[2][2] = 1;
    i.mask = 0xff;
    i.accelerationStructureReference = as ? handle(as) : 0;
    return i;
}

namespace {

struct Box {
    float lo[3], hi[3];
};

class Walker {
  public:
    Walker(const Scene& scene, const uint32_t* w, TreeFacts& facts)
        : scene_(scene), w_(w), facts_(facts), top_(w[RTC_HDR_KIND] == RTC_AS_KIND_TOP) {
        nodes_ = w + 4 * w[RTC_HDR_NODES];
        slots_ = w + 4 * w[RTC_HDR_SLOTS];
        seen_nodes_.resize(w[RTC_HDR_NODE_COUNT]);
        seen_slots_.resize(w[RTC_HDR_SLOT_COUNT]);
    }

    void run() {
        Box root;
        double area = 0;
        walk(0, 1, root, area);
        uint32_t reached = 0;
        for (auto n : seen_nodes_) EXPECT_EQ(n, 1u) << "a node is reached " << n << " times";
        for (size_t s = 0; s < seen_slots_.size(); s++) {
            reached += seen_slots_[s];
            EXPECT_LE(seen_slots_[s], 1u);
            if (!top_)
                EXPECT_EQ(seen_slots_[s], 1u) << "slot " << s;
            else
                EXPECT_EQ(seen_slots_[s], instance_active(static_cast<uint32_t>(s)) ? 1u : 0u)
                    << "instance " << s;
        }
        EXPECT_EQ(reached, w_[RTC_HDR_ACTIVE_COUNT]);
        EXPECT_EQ(facts_.depth, w_[RTC_HDR_MAX_DEPTH]);
        EXPECT_LE(facts_.depth, RTC_MAX_DEPTH);
        const float* lo = reinterpret_cast<const float*>(w_ + RTC_HDR_BOUNDS_MIN);
        const float* hi = reinterpret_cast<const float*>(w_ + RTC_HDR_BOUNDS_MAX);
        if (reached) {
            for (int k = 0; k < 3; k++) {
                EXPECT_LE(lo[k], root.lo[k]);
                EXPECT_GE(hi[k], root.hi[k]);
            }
        } else {
            EXPECT_GT(lo[0], hi[0]);
        }
        if (root_area_ > 0) facts_.sah /= root_area_;
    }

  private:
    bool instance_active(uint32_t i) const { return (slots_[32 * i + 24] | slots_[32 * i + 25]) != 0; }

    static double area(const Box& b) {
        double e[3];
        for (int k = 0; k < 3; k++) e[k] = double(b.hi[k]) - b.lo[k];
        return e[0] * e[1] + e[1] * e[2] + e[2] * e[0];
    }

    static void grow(Box& b, const float* v) {
        for (int k = 0; k < 3; k++) {
            b.lo[k] = std::fmin(b.lo[k], v[k]);
            b.hi[k] = std::fmax(b.hi[k], v[k]);
        }
    }

    // The tight box of what lies below; EXPECTs that the stored boxes contain it.
    void walk(uint32_t node, uint32_t depth, Box& out, double&) {
        ASSERT_LT(node, seen_nodes_.size());
        ASSERT_LE(depth, 64u);
        seen_nodes_[node]++;
        facts_.nodes++;
        facts_.depth = std::max(facts_.depth, depth);
        out = Box{{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
        const uint32_t* n = nodes_ + 16 * node;
        Box stored_all{{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
        for (int c = 0; c < 2; c++) {
            Box stored, tight{{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
            memcpy(stored.lo, n + 8 * c, 12);
            memcpy(stored.hi, n + 8 * c + 4, 12);
            uint32_t ref = n[c == 0 ? 3 : 7];
            double unused = 0;
            if (!(ref & RTC_REF_LEAF)) {
                walk(ref, depth + 1, tight, unused);
            } else {
                uint32_t count = (ref >> RTC_REF_COUNT_SHIFT) & RTC_REF_COUNT_MASK,
                         first = ref & RTC_REF_INDEX_MASK;
                if (count == 0) continue;
                EXPECT_LE(count, RTC_MAX_LEAF_SLOTS);
                facts_.leaves++;
                for (uint32_t s = first; s < first + count; s++) leaf(s, tight);
                facts_.sah += area(stored) * count;
            }
            for (int k = 0; k < 3; k++) {
                EXPECT_LE(stored.lo[k], tight.lo[k]) << "node " << node << " child " << c;
                EXPECT_GE(stored.hi[k], tight.hi[k]) << "node " << node << " child " << c;
            }
            grow(out, tight.lo);
            grow(out, tight.hi);
            grow(stored_all, stored.lo);
            grow(stored_all, stored.hi);
        }
        if (std::isfinite(stored_all.lo[0])) {
            if (depth == 1) root_area_ = area(stored_all);
            facts_.sah += area(stored_all) * 1.2;
        }
    }

    void leaf(uint32_t s, Box& tight) {
        ASSERT_LT(s, seen_slots_.size());
        seen_slots_[s]++;
        if (top_) {
            instance_box(s, tight);
        } else if (w_[RTC_HDR_FACTS] & RTC_FACT_AABBS) {
            const float* f = reinterpret_cast<const float*>(slots_ + 8 * s);
            grow(tight, f);
            grow(tight, f + 4);
        } else {
            const float* f = reinterpret_cast<const float*>(slots_ + 12 * s);
            for (int v = 0; v < 3; v++) grow(tight, f + 4 * v);
        }
    }

    // Corners of the bottom level's bounds, transformed in double.
    void instance_box(uint32_t i, Box& tight) {
        const uint32_t* r = slots_ + 32 * i;
        const float* m = reinterpret_cast<const float*>(r + 12);
        uint64_t base = r[24] | uint64_t(r[25]) << 32;
        const uint32_t* blas = scene_.block(base);
        EXPECT_EQ(blas[RTC_HDR_MAGIC], RTC_AS_MAGIC);
        EXPECT_EQ(r[28] & ~RTC_FACT_IDENTITY_TRANSFORMS, blas[RTC_HDR_FACTS]);
        EXPECT_EQ(r[29], blas[RTC_HDR_SLOTS]);
        EXPECT_EQ(r[30], blas[RTC_HDR_NODES]);
        if (blas[RTC_HDR_ACTIVE_COUNT] == 0) return;
        const float* lo = reinterpret_cast<const float*>(blas + RTC_HDR_BOUNDS_MIN);
        const float* hi = reinterpret_cast<const float*>(blas + RTC_HDR_BOUNDS_MAX);
        for (int corner = 0; corner < 8; corner++) {
            float p[3];
            for (int row = 0; row < 3; row++) {
                double sum = m[4 * row + 3];
                for (int k = 0; k < 3; k++) sum += double(m[4 * row + k]) * (corner >> k & 1 ? hi[k] : lo[k]);
                p[row] = static_cast<float>(sum);
            }
            grow(tight, p);
        }
    }

    const Scene& scene_;
    const uint32_t* w_;
    TreeFacts& facts_;
    bool top_;
    const uint32_t *nodes_, *slots_;
    std::vector<uint32_t> seen_nodes_, seen_slots_;
    double root_area_ = 0;
};

}  // namespace

void check_structure(const Scene& scene, RtrAccelerationStructure as, TreeFacts& facts) {
    const uint32_t* w = scene.words(as);
    ASSERT_EQ(w[RTC_HDR_MAGIC], RTC_AS_MAGIC);
    EXPECT_EQ(w[RTC_HDR_SELF_LO] | uint64_t(w[RTC_HDR_SELF_HI]) << 32, scene.handle(as));
    EXPECT_EQ(w[RTC_HDR_NODE_FORMAT], RTC_NODE_FORMAT_BVH2);
    EXPECT_EQ(w[RTC_HDR_NODES], RTC_AS_HEADER_QUADS);
    ASSERT_LE(w[RTC_HDR_NODE_COUNT], w[RTC_HDR_PRIMITIVE_COUNT] + 1);
    ASSERT_LE(w[RTC_HDR_SLOT_COUNT], w[RTC_HDR_PRIMITIVE_COUNT]);
    Walker(scene, w, facts).run();
    if (w[RTC_HDR_KIND] == RTC_AS_KIND_BOTTOM && !(w[RTC_HDR_FACTS] & RTC_FACT_AABBS)) {
        const uint32_t* slots = w + 4 * w[RTC_HDR_SLOTS];
        for (uint32_t s = 0; s < w[RTC_HDR_SLOT_COUNT]; s++) {
            Slot slot;
            for (int v = 0; v < 3; v++) memcpy(&slot.v[v], slots + 12 * s + 4 * v, 12);
            slot.primitive = slots[12 * s + 3];
            slot.geometry_word = slots[12 * s + 7];
            facts.slots.push_back(slot);
        }
    }
}
