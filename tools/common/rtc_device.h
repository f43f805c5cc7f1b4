// rtc's runtime in C++ clothes: results become exceptions that carry the
// runtime's own messages, and objects end with their scope.
#pragma once

#include <rtc/abi.h>
#include <rtc/runtime.h>

#include <memory>
#include <string>
#include <vector>

#include "addressing.h"
#include "job_descriptors.h"
#include "ray_tracing_job.h"
#include "resources.h"
#include "scene.h"
#include "vulkan_context.h"

namespace rtc::tools {

class RtcDevice {
  public:
    explicit RtcDevice(const Context& context);
    ~RtcDevice();
    RtcDevice(const RtcDevice&) = delete;
    RtcDevice& operator=(const RtcDevice&) = delete;

    const Context& context;
    RtrDevice handle = nullptr;
    RtrPhysicalDeviceSupport support{};

    // Whether structures are to be reached by device address, see tools::by_address.
    bool by_address(Addressing wanted) const;

    // Throws an Error with what the runtime said since the last one.
    void check(VkResult result, const char* call) const;

  private:
    std::unique_ptr<std::string> messages_;
};

struct RtcSceneOptions {
    bool fast_build = false;
    bool addresses = false;  // for modules of address mode; without, for those that read a heap
    bool allow_update = false;
};

// A scene's acceleration structures, built on the device.
class RtcScene {
  public:
    // Geometries of a bottom level each: all triangles or all boxes.
    using Bottoms = std::vector<std::vector<const Mesh*>>;

    RtcScene(const RtcDevice& device, const Scene& scene, bool fast_build = false, bool addresses = false);
    // `mesh` of an instance is the number of its bottom level.
    RtcScene(const RtcDevice& device, const Bottoms& bottoms, const std::vector<Instance>& instances,
             const RtcSceneOptions& options);
    ~RtcScene();
    RtcScene(const RtcScene&) = delete;
    RtcScene& operator=(const RtcScene&) = delete;

    // All levels updated in place: other vertices, boxes and transforms, as many as there were. Needs allow_update.
    void update(const Bottoms& bottoms, const std::vector<Instance>& instances);

    // The top level as it lies in memory, in abi.h's layout.
    std::vector<uint32_t> top_words() const;

    RtrHeap heap = nullptr;  // null in address mode
    RtrAccelerationStructure top = nullptr;
    VkDescriptorBufferInfo descriptor() const;
    double build_seconds = 0;  // wall time of recording, building and waiting
    VkDeviceSize bytes = 0;    // of all structures

  private:
    void build(const Bottoms& bottoms, const std::vector<Instance>& instances, bool update);

    const RtcDevice& device_;
    RtcSceneOptions options_;
    Buffer memory_;
    VkDeviceSize top_offset_ = 0, top_size_ = 0;
    std::vector<RtrAccelerationStructure> bottoms_;
};

// A compiled job with its descriptors and shader binding table, ready to be launched many times.
class RtcLauncher {
  public:
    // The job's buffers and images must outlive the launcher. `options` null: as the device recommends.
    RtcLauncher(const RtcDevice& device, const RtcScene& scene, const RayTracingJob& job,
                const std::vector<uint32_t>& module, const RtrTraceOptions* options = nullptr);
    ~RtcLauncher();
    RtcLauncher(const RtcLauncher&) = delete;
    RtcLauncher& operator=(const RtcLauncher&) = delete;

    // Records one launch; `push_constants` replaces the job's. At most max_launches() between two checks.
    void record(VkCommandBuffer commands, const std::vector<uint8_t>& push_constants);
    // Later launches see this scene instead. No recorded launch may be pending.
    void use_scene(const RtcScene& scene);
    // After the commands have completed: throws an Error for the first launch that failed, and frees what
    // the recorded launches held.
    void finish();
    uint32_t max_launches() const { return kLaunches; }
    RtrPipelineInfo info() const;
    double create_seconds = 0;  // the driver's share of getting ready, as far as it does it then

  private:
    static constexpr uint32_t kLaunches = 64;
    void make_table(const JobTable& table);
    void make_recorder();
    void write_structure(const RtcScene& scene, VkDescriptorSet set, uint32_t binding, uint32_t element) const;
    void write_reserved() const;

    const RtcDevice& device_;
    RtrPipeline pipeline_ = nullptr;
    RtrRecorder recorder_ = nullptr;
    Buffer table_, control_, scratch_;
    RtrSbtLayout table_layout_{};
    uint32_t rounds_ = 1;  // of a launch, at most
    VkDeviceSize raygen_offset_ = 0;
    struct StructurePlace {
        VkDescriptorSet set;
        uint32_t binding, element;
    };
    std::vector<StructurePlace> structures_;
    std::unique_ptr<JobDescriptors> descriptors_;
    VkExtent3D extent_{};
    VkCommandBuffer recording_ = VK_NULL_HANDLE;
    RtrHeap heap_ = nullptr;
};

}  // namespace rtc::tools
