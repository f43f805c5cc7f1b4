// What runs a ray tracing pipeline: a device's own extension (khr.cpp, nv.cpp)
// or rtc (tools/run). All take the same stages, scene and records, so that
// their results can be compared.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "../common/error.h"
#include "../common/ray_tracing_job.h"
#include "../common/resources.h"
#include "../common/vulkan_context.h"

namespace rtc::native {

using tools::Buffer;
using tools::Context;
using tools::Error;

// ---- the scene, as acceleration structures are built from it -------------------

struct Geometry {
    bool boxes = false;
    std::vector<float> positions;   // xyz each
    std::vector<uint32_t> indices;  // three a triangle; empty: positions in order
    std::vector<float> bounds;      // boxes: min xyz, max xyz each
    uint32_t flags = 0;             // VkGeometryFlagsKHR
    std::vector<float> transform;   // 12 floats, row-major 3x4, or none
    uint32_t primitive_count() const {
        return uint32_t(boxes ? bounds.size() / 6
                              : (indices.empty() ? positions.size() / 9 : indices.size() / 3));
    }
};

struct Bottom {
    std::string name;
    std::vector<Geometry> geometries;
    std::vector<Geometry> built_from;  // not empty: built of these and then updated in place
    VkBuildAccelerationStructureFlagsKHR flags = VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_KHR;
};

struct Placement {
    int bottom = -1;  // index into World::bottoms; -1: an inactive instance
    float transform[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    uint32_t custom_index = 0, mask = 0xff, sbt_offset = 0, flags = 0;
};

struct Top {
    std::string name;
    std::vector<Placement> instances;
};

struct World {
    std::vector<Bottom> bottoms;
    std::vector<Top> tops;
};

World world_of(const tools::Scene& scene);

// ---- shader binding table --------------------------------------------------------

struct Table {
    std::vector<tools::JobRecord> records;
    uint32_t stride = 0;  // 0: the smallest that fits
};

struct Tables {
    Table raygen, miss, hit, callable;
    uint32_t raygen_index = 0;
};

Tables tables_of(const tools::JobTable& table);

// One buffer with the four regions, as offsets; shared by every executor.
struct TableLayout {
    struct Region {
        VkDeviceSize offset = 0, size = 0;
        uint32_t stride = 0;
    };
    Region raygen, miss, hit, callable;
    std::vector<uint8_t> bytes;
};

struct TableLimits {
    uint32_t handle_bytes = 32, handle_alignment = 32, base_alignment = 64;
};

// `handles` holds one handle a group. Throws on a group that does not exist or a stride too small.
TableLayout lay_out(const Tables& tables, const std::vector<uint8_t>& handles, const TableLimits& limits);

// ---- executors -------------------------------------------------------------------

struct Launch {
    uint32_t width = 1, height = 1, depth = 1;
    std::vector<VkDescriptorSet> sets;
    std::vector<uint8_t> push_constants;
};

class Executor {
  public:
    virtual ~Executor() = default;
    virtual const char* name() const = 0;
    virtual VkShaderStageFlags stages() const = 0;
    // What a descriptor of an acceleration structure is to this executor.
    virtual VkDescriptorType top_descriptor() const = 0;
    virtual void build(const World& world) = 0;
    // `set_layouts` are the application's, one for each set from 0 up.
    virtual void create_pipeline(const tools::JobPipeline& pipeline,
                                 const std::vector<VkDescriptorSetLayout>& set_layouts,
                                 uint32_t push_bytes) = 0;
    virtual void set_tables(const Tables& tables) = 0;
    // `top` indexes World::tops; ~0u writes a null acceleration structure where the executor can.
    virtual void write_top(VkDescriptorSet set, uint32_t binding, uint32_t element, uint32_t top) = 0;
    virtual void trace(VkCommandBuffer commands, const Launch& launch) = 0;
    // After the commands have completed: "" or the launch error, as "NAME: text" ("recursion-depth: ...").
    virtual std::string finish() { return {}; }
    // Of all acceleration structures built, 0 where nobody counts them.
    virtual VkDeviceSize structure_bytes() const { return 0; }
    // Device address of a top level, 0 where there is none.
    virtual VkDeviceAddress top_address(uint32_t) const { return 0; }
};

// What a device must be created with for an executor.
class Requirements {
  public:
    enum class Kind { Khr, Nv };
    explicit Requirements(Kind kind);
    void apply(tools::ContextOptions& options);  // `this` must live until the Context is made

  private:
    Kind kind_;
    VkPhysicalDeviceAccelerationStructureFeaturesKHR as_{};
    VkPhysicalDeviceRayTracingPipelineFeaturesKHR pipeline_{};
    // VkPhysicalDeviceRayTracingPositionFetchFeaturesKHR, which is younger than Debian's headers.
    struct PositionFetch {
        VkStructureType type = VkStructureType(1000481000);
        void* next = nullptr;
        VkBool32 rayTracingPositionFetch = VK_TRUE;
    } position_fetch_;
};

std::unique_ptr<Executor> make_khr(const Context& context);
std::unique_ptr<Executor> make_nv(const Context& context);

// Shared by both: stages with their specialisation, kept alive for pipeline creation.
class StageList {
  public:
    StageList(VkDevice device, const tools::JobPipeline& pipeline);
    ~StageList();
    StageList(const StageList&) = delete;
    StageList& operator=(const StageList&) = delete;
    const std::vector<VkPipelineShaderStageCreateInfo>& infos() const { return infos_; }

  private:
    struct Constants {
        std::vector<VkSpecializationMapEntry> entries;
        std::vector<uint8_t> data;
        VkSpecializationInfo info{};
    };
    VkDevice device_;
    std::vector<VkShaderModule> modules_;
    std::vector<std::unique_ptr<Constants>> constants_;
    std::vector<VkPipelineShaderStageCreateInfo> infos_;
};

// The geometries of a bottom level as VK_NV_ray_tracing takes them, with the buffers they name.
struct NvGeometries {
    NvGeometries(const Context& context, const Bottom& bottom, VkBufferUsageFlags usage);
    std::vector<VkGeometryNV> geometries;

  private:
    VkBuffer input(const Context& context, const void* data, size_t bytes, VkBufferUsageFlags usage);
    std::vector<Buffer> buffers_;
};

// VkAccelerationStructureInstanceKHR and its NV twin have one layout.
VkAccelerationStructureInstanceKHR instance_of(const Placement& placement, uint64_t reference);

}  // namespace rtc::native
