// Campaigns: billions of rays made and judged on the device, through whole ray tracing pipelines over
// structures that the device built. rtc's tiers, or the device's own ray tracing, on the same rays.
//   leaks: a ray leaves a closed mesh as often as it enters. Events: leaks and double hits.
//   spawn: rays leave the triangles they hit from rtc/spawn.glsl's origins. Events: hits of that triangle.
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
// The former, transforms that scale by 1e-6 to 1e6, stretch, and lie far away, and slivers of 1e-1 to 1e-4.
std::vector<CampaignPoint> spawn_points();
// Binding 1 of the shaders for these points, whose shapes may be shared.
std::vector<float> campaign_corners(const std::vector<CampaignPoint>& points);
tools::Scene campaign_scene(const CampaignPoint& point);

enum class CampaignProgram { Leaks, Spawn };

// Something that can run a program over the points.
class CampaignTracer {
  public:
    virtual ~CampaignTracer() = default;
    virtual void use(size_t point) = 0;
    // Seconds on the device. `counters` is what this launch counted.
    virtual double launch(const CampaignPush& push, CampaignCounters& counters) = 0;
    virtual uint32_t lanes() const = 0;  // of one launch
};

struct CampaignSettings {
    CampaignProgram program = CampaignProgram::Leaks;
    bool naive = false;         // spawn: second rays start where t says, as a control
    uint64_t rays = 1'000'000;  // for each aim, over all points within the promise
    uint64_t beyond = 0;        // the same, over all points beyond it
    double seconds = 0;         // stop each point's share in time for the whole to take this long; 0: no limit
    uint32_t seed = 1;
    bool quiet = false;
};

struct CampaignRow {
    std::string mesh, transform, place, aim;
    double offset = 0;
    bool promised = true;
    uint64_t rays = 0, events = 0, missed = 0;
    double seconds = 0;
};

// The ray of an event, looked at again on the host.
struct CampaignOffender {
    size_t row = 0;
    uint64_t number = 0;
    bool closest = false;
    bool same_ray = true;  // the host makes the same ray from its number
    Vec3 origin, direction;
    uint32_t front = 0, back = 0;  // what the device counted; spawn: the triangle, and its hits by this ray
    ExactBalance exact;            // leaks: of the ray in object space, by the host's inverse
};

struct CampaignReport {
    std::string subject, device;
    uint32_t seed = 1;
    std::vector<CampaignRow> rows;
    std::vector<CampaignOffender> offenders;  // at most a few of every row
    uint64_t rays(bool promised) const;
    uint64_t events(bool promised) const;
};

CampaignReport run_campaign(CampaignTracer& tracer, const std::vector<CampaignPoint>& points, bool beyond,
                            const CampaignSettings& settings);

// "watertight", "fast", "exact", "exact64", "contracted" (the negative control) or "native" (the device's
// VK_KHR_ray_tracing_pipeline). A context that suits it; throws tools::Error where the device cannot.
std::unique_ptr<tools::Context> campaign_context(const std::string& subject, const std::string& device, bool validate);
// Context and points must outlive the tracer. `lanes`: rays of one launch, 0: as suits the device.
std::unique_ptr<CampaignTracer> make_campaign_tracer(const tools::Context& context, const std::string& subject,
                                                     CampaignProgram program, const std::vector<CampaignPoint>& points,
                                                     uint32_t lanes = 0);

}  // namespace rtc::lab
