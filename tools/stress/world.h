// Acceleration structures that live, change and die at random, on the device and as a reference.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "content.h"
#include "reference.h"
#include "tracer.h"

namespace rtc::stress {

struct Limits {
    uint64_t primitives = 2000000;  // of all bottom levels
    uint64_t instances = 100000;
    double large = 0;      // share of new bottom levels that take all the primitives there may be
    uint32_t rays = 256;  // of a trace
    uint64_t brute_tests =
        20000000;  // a step whose rays need no more is checked without the reference's tree
    VkDeviceSize heap_bytes = 1ull << 30;
};

struct Counts {
    uint64_t steps = 0, builds = 0, updates = 0, clones = 0, compactions = 0, serialisations = 0,
             top_builds = 0, top_updates = 0, evictions = 0, rays = 0, hits = 0, tests = 0, brute_steps = 0;
    uint64_t most_primitives = 0, most_instances = 0;
    uint64_t candidates = 0;       // of the reference
    uint64_t undecided = 0;        // of these, candidates within the error bound, judged by exact arithmetic
    uint64_t undecided_agree = 0;  // of these that decided a result: the device did as exact arithmetic says
    uint64_t undecided_differ = 0;
};

class World {
  public:
    World(Device& device, const Limits& limits, uint64_t seed);
    ~World();
    World(const World&) = delete;
    World& operator=(const World&) = delete;

    // Some random operations, then rays against the reference. Throws tools::Error at the first difference.
    void step();
    std::string describe_step() const;  // the last one: operations, seconds
    const Counts& counts() const { return counts_; }
    // Destroys everything; throws unless the heap is whole again.
    void finish();

  private:
    struct Structure {
        RtrAccelerationStructure handle = nullptr;
        VkDeviceSize offset = 0, size = 0;      // in the heap, or in its own buffer
        std::shared_ptr<tools::Buffer> buffer;  // address mode
    };
    struct Bottom {
        Content content;
        std::unique_ptr<BottomReference> reference;
        VkBuildAccelerationStructureFlagsNV flags = 0;
        Structure structure;
        bool copied = false;  // made by a copy, for which no counts were given: it is not built again, only updated
        uint32_t first_record = 0;
    };
    struct Top {
        Structure structure;
        VkBuildAccelerationStructureFlagsNV flags = 0;
        std::vector<VkAccelerationStructureInstanceNV> instances;
        std::vector<int> bottoms;  // keys of bottoms_, -1: inactive
        std::vector<bool> empty;   // had the bottom level nothing to hit?
        bool copied = false;
    };
    struct Inputs;  // device buffers of one build

    Structure create(const VkAccelerationStructureInfoNV& info, VkDeviceSize compacted_size);
    void destroy(Structure& structure);
    bool evict(int keep);
    bool place(Structure& structure);
    void record(const std::function<void(RtrRecorder)>& commands);
    VkDeviceSize scratch_size(RtrAccelerationStructure structure, bool update);
    void build(Bottom& bottom, bool update, Structure* target);
    VkDeviceSize query(RtrAccelerationStructure structure, VkQueryType type);
    enum class Copy { Clone, CloneOfItsKind, Compact };  // of its kind: created like the source, not by size
    void copy(Structure& structure, const VkAccelerationStructureInfoNV& info, Copy how);
    void serialise(Structure& structure, VkAccelerationStructureTypeNV type,
                   VkBuildAccelerationStructureFlagsNV flags, const Top* top);
    void add_bottom();
    void change_bottom();
    void make_top();
    void make_instances(Top& top, uint64_t count);
    void build_top(bool update);
    void record_top(const VkAccelerationStructureInfoNV& info, const tools::Buffer& instances,
                    VkDeviceSize offset, bool update, const tools::Buffer& scratch);
    bool top_updatable() const;
    void trace();
    std::vector<Ray> make_rays(const std::vector<InstanceReference>& instances);
    void compare(const Ray& ray, const Hit& hit, const RayReference& reference,
                 const std::vector<InstanceReference>& instances);
    uint64_t primitives() const;

    Device& device_;
    Limits limits_;
    Random random_;
    Tracer tracer_;
    tools::Buffer heap_buffer_;
    RtrHeap heap_ = nullptr;  // null in address mode
    VkDeviceSize used_ = 0;   // bytes bound to buffers
    std::map<int, Bottom> bottoms_;
    int next_key_ = 0, in_use_ = -1;
    std::unique_ptr<Top> top_;
    Counts counts_;
    void take_step();
    std::string history_;  // of the current step, for messages
    double trace_seconds_ = 0, reference_seconds_ = 0;
};

}  // namespace rtc::stress
