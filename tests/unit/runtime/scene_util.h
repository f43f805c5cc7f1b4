// Scenes for the build tests, and a checker that walks a built structure on the CPU.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "vulkan_harness.h"

struct Vec3 {
    float x, y, z;
};

// Boxes as a buffer holds them, with NaN before, between and behind.
std::vector<char> aabb_bytes(const std::vector<std::array<float, 6>>& boxes, uint32_t stride, uint32_t offset);

// A bottom or top level with the buffers it needs, kept alive by the Vulkan object.
struct BuiltStructure {
    RtrAccelerationStructure as = nullptr;
    VkDeviceSize offset = 0;
    VkDeviceSize size = 0;
};

// Owns a heap, a recorder and the structures of a test. In address mode the "heap" is a
// buffer without an RtrHeap, whose ranges are given out one after the other.
class Scene {
  public:
    Scene(Vulkan& vk, RtrDevice rtr, VkDeviceSize heap_size, bool address_mode = false);
    ~Scene();

    VkGeometryNV triangles(const std::vector<Vec3>& vertices, const std::vector<uint32_t>* indices = nullptr,
                           VkGeometryFlagsNV flags = 0);
    VkGeometryNV aabbs(const std::vector<std::array<float, 6>>& boxes, VkGeometryFlagsNV flags = 0, uint32_t stride = 24,
                       uint32_t offset = 0);
    RtrAccelerationStructure create(const VkAccelerationStructureInfoNV& info, VkDeviceSize compacted = 0);
    // Create, bind, build, submit, wait.
    RtrAccelerationStructure build_bottom(const std::vector<VkGeometryNV>& geometries,
                                          VkBuildAccelerationStructureFlagsNV flags = 0);
    RtrAccelerationStructure build_top(const std::vector<VkAccelerationStructureInstanceNV>& instances,
                                       VkBuildAccelerationStructureFlagsNV flags = 0);
    VkAccelerationStructureInstanceNV instance(RtrAccelerationStructure as) const;
    uint64_t handle(RtrAccelerationStructure as) const;
    VkDeviceSize scratch_size(RtrAccelerationStructure as, bool update = false) const;
    const uint32_t* words(RtrAccelerationStructure as) const;  // of the block, in the mapped heap
    const uint32_t* block(uint64_t handle) const;
    // Binds to the next free range.
    void bind(RtrAccelerationStructure as);
    Buffer upload(const void* data, size_t size);
    void run(const std::function<void()>& record);  // begin, record, submit

    Vulkan& vk;
    RtrDevice rtr;
    Buffer heap_buffer, scratch;
    RtrHeap heap = nullptr;
    RtrRecorder recorder = nullptr;
    Buffer control;
    bool address_mode;

  private:
    VkDeviceAddress address_ = 0;
    VkDeviceSize used_ = 0;
    std::vector<RtrAccelerationStructure> structures_;
    std::vector<Buffer> buffers_;
};

struct Slot {
    Vec3 v[3];
    uint32_t primitive, geometry_word;
};

struct TreeFacts {
    uint32_t nodes = 0, depth = 0, leaves = 0;
    std::vector<Slot> slots;  // in slot order (bottom level)
    double sah = 0;           // expected node visits of a random ray that hits the root
};

// Walks the block: header fields, every box conservative, every slot or active instance
// reached exactly once, depth within the bound, node indices used exactly once.
void check_structure(const Scene& scene, RtrAccelerationStructure as, TreeFacts& facts);
