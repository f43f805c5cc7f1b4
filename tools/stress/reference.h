// What a ray may and must hit, by arithmetic in double with the error bounds of the watertight test, and by
// the laboratory's rationals where those leave it open.
#pragma once

#include <cstdint>
#include <vector>

#include "content.h"

namespace rtc::stress {

struct Ray {  // as rays are given to the device, std430
    Vec3 origin;
    float tmin = 0;
    Vec3 direction;
    float tmax = 0;
    uint32_t flags = 0, mask = 0xff;
    uint32_t sbt_offset = 0;
    uint32_t mode = 0;
};
enum Mode : uint32_t { kNearest, kIgnoreAll, kTerminate, kModes };  // what the any-hit shader does

struct Candidate {
    uint32_t instance = 0, geometry = 0, primitive = 0;
    bool front = true, facing_certain = true, opaque = false;
    bool certain = false;  // it must be hit; otherwise it may
    double t = 0, t_error = 0;
    double weights[2] = {0, 0}, weight_error = 0;  // triangles
};

struct ObjectRay {
    Vec3 origin, direction;
    float tmin = 0, tmax = 0;
};

// One bottom level with a tree of its own.
class BottomReference {
  public:
    explicit BottomReference(const Content& content);

    // Candidates of the ray, facing, flags and instances not considered. `brute`: without the tree.
    void candidates(const ObjectRay& ray, bool brute, std::vector<Candidate>& out, uint64_t& tests) const;
    bool empty() const { return slots_.empty(); }
    double reach() const;  // the largest coordinate
    const Content& content() const { return content_; }

  private:
    struct Slot {
        uint32_t geometry, primitive;
    };
    struct Node {
        float min[3], max[3];
        uint32_t first, count;  // count 0: children at first and first + 1
    };
    void bounds(const Slot& slot, float* min, float* max) const;
    void build(uint32_t node, uint32_t begin, uint32_t end);
    bool test(const ObjectRay& ray, const Slot& slot, Candidate& c) const;

    const Content& content_;
    std::vector<Slot> slots_;
    std::vector<Node> nodes_;
};

struct InstanceReference {
    const BottomReference* bottom = nullptr;  // null: inactive
    Transform world_to_object = lab::kIdentity;
    uint32_t custom = 0, mask = 0xff, flags = 0, first_record = 0;
};

struct RayReference {
    std::vector<Candidate> candidates;  // that the flags of ray, geometry and instance let through
    uint64_t tests = 0;
};

RayReference trace_reference(const Ray& ray, const std::vector<InstanceReference>& instances, bool brute);

// Of an undecided candidate: does exact arithmetic on the same floats hit it?
bool exactly_hit(const Ray& ray, const InstanceReference& instance, const Candidate& c);

}  // namespace rtc::stress
