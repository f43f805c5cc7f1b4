// Leak campaigns: billions of rays made and judged on the device, through whole ray tracing pipelines over
// structures that the device built. rtc's tiers, or the device's own ray tracing, on the same rays.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "campaign_rays.h"
#include "scene.h"
#include "vulkan_context.h"

namespace rtc::lab {

// One mesh at one place.
struct CampaignPoint {
    std::string mesh, transform;
    std::string place;  // where the offset is: "vertices" or "instance"
    double offset = 0;  // in sizes
    bool promised = true;  // offset <= 1e4
    std::shared_ptr<const IndexedMesh> shape;  // as the structure is built from it
    Transform object_to_world = kIdentity;
    float ball[4] = {};
    bool convex = false;  // rays from inside are possible
    uint32_t first_corner = 0;  // of the shape in campaign_corners(), in floats
};

// 4 meshes x offsets 0, 1e1 ... 1e4 in the vertices and in the instance x identity, rotated, sheared and
// mirrored; `beyond`: offsets 1e5 ... 1e8 instead.
std::vector<CampaignPoint> campaign_points(bool beyond);
// Binding 1 of leaks.rgen for these points, whose shapes may be shared.
std::vector<float> campaign_corners(const std::vector<CampaignPoint>& points);
tools::Scene campaign_scene(const CampaignPoint& point);

// Something that can run leaks.rgen over the points.
class CampaignTracer {
  public:
    virtual ~CampaignTracer() = default;
    virtual void use(size_t point) = 0;
    // Seconds on the device. `counters` is what this launch counted.
    virtual double launch(const CampaignPush& push, CampaignCounters& counters) = 0;
    virtual uint32_t lanes() const = 0;  // of one launch
};

struct CampaignSettings {
    uint64_t rays = 1'000'000;  // for each of the two aims, over all points within the promise
    uint64_t beyond = 0;        // the same, over all points beyond it
    double seconds = 0;         // stop each point's share in time for the whole to take this long; 0: no limit
    uint32_t seed = 1;
    bool quiet = false;
};

struct CampaignRow {
    std::string mesh, transform, place, aim;
    double offset = 0;
    bool promised = true;
    uint64_t rays = 0, unbalanced = 0, missed = 0;
    double seconds = 0;
};

// An unbalanced ray, looked at again on the host.
struct CampaignOffender {
    size_t row = 0;
    uint64_t number = 0;
    bool closest = false;
    bool same_ray = true;  // the host makes the same ray from its number
    Vec3 origin, direction;
    uint32_t front = 0, back = 0;  // what the device counted
    ExactBalance exact;            // of the ray in object space, by the host's inverse
};

struct CampaignReport {
    std::string subject, device;
    uint32_t seed = 1;
    std::vector<CampaignRow> rows;
    std::vector<CampaignOffender> offenders;  // at most a few of every row
    uint64_t rays(bool promised) const;
    uint64_t unbalanced(bool promised) const;
};

CampaignReport run_campaign(CampaignTracer& tracer, const std::vector<CampaignPoint>& points, bool beyond,
                            const CampaignSettings& settings);

// "watertight", "fast", "exact", "exact64", "contracted" (the negative control) or "native" (the device's
// VK_KHR_ray_tracing_pipeline). A context that suits it; throws tools::Error where the device cannot.
std::unique_ptr<tools::Context> campaign_context(const std::string& subject, const std::string& device, bool validate);
// Context and points must outlive the tracer. `lanes`: rays of one launch, 0: as suits the device.
std::unique_ptr<CampaignTracer> make_campaign_tracer(const tools::Context& context, const std::string& subject,
                                                     const std::vector<CampaignPoint>& points, uint32_t lanes = 0);

}  // namespace rtc::lab
