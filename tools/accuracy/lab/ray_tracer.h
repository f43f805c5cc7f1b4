// Rays, what becomes of them, and whoever traces them: rtc's traversal, a device's own, Embree.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "host_scene.h"

namespace rtc::lab {

struct Ray {
    Vec3 origin;
    float tmin = 0;
    Vec3 direction;
    float tmax = 0;
    uint32_t flags = 0;
    uint32_t mask = 0xff;
    uint32_t sbt = 0;  // offset | stride << 4 | mode << 8
    float report_t = 0;
};

enum RayMode : uint32_t {
    kIgnore = 1u << 8,     // any-hit ignores every candidate
    kTerminate = 2u << 8,  // any-hit terminates the ray
    kNoReport = 4u << 8,   // intersection reports nothing
    kNullRoot = 8u << 8,
    kBottomRoot = 16u << 8,  // trace a bottom level
    kPause = 32u << 8,       // what TracerOptions::pause sets
};

struct RayResult {
    float t;
    uint32_t kind, instance, primitive, geometry, record;
    uint32_t attr0, attr1, attr7;
    uint32_t front, back, boxes;
    uint32_t turns, suspensions, mismatches, last_opaque;
    bool operator==(const RayResult&) const = default;
};

constexpr uint32_t kNoInstance = 0xffffffffu;

class RayTracer {
  public:
    virtual ~RayTracer() = default;
    virtual void set_scene(const HostScene& scene) = 0;
    // One result a ray, in their order. Members that a tracer does not know are 0.
    virtual std::vector<RayResult> trace(const std::vector<Ray>& rays) = 0;
    // World to object of an instance, where the tracer's own builder computed it; else it is the HostScene's.
    virtual std::optional<Transform> world_to_object(uint32_t) const { return {}; }
    // Of the scene's structures, all levels, 0: not known.
    virtual uint64_t scene_bytes() const = 0;

    double seconds = 0;  // of the last trace, on the device
};

}  // namespace rtc::lab
