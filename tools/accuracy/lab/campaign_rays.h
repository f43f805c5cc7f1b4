// Rays of a campaign. shaders/campaign_ray.glsl makes them on the device from their number; this is its twin
// on the host, bit for bit, for whoever wants to look at one again.
#pragma once

#include <cstdint>
#include <vector>

#include "host_scene.h"
#include "meshes.h"

namespace rtc::lab {

// Push constants.
struct CampaignPush {
    float object_to_world[12];
    float ball[4];  // centre in object space, half the edge of the cube on which origins lie
    uint32_t first_low, first_high, seed, mode;
    uint32_t first_corner, triangles, rays, pad;
};
static_assert(sizeof(CampaignPush) == 96);

enum CampaignMode : uint32_t {
    kModeInterior = 0,
    kModeEdge = 1,
    kModeVertex = 2,
    kModeInside = 4,  // origins inside a convex mesh
    kModeAxes = 8,    // one ray in eight runs along an axis of the world
    kModeNaive = 16,  // spawn.rgen: second rays start where t says
};

constexpr uint32_t kCampaignRing = 32;

// The buffer behind binding 2.
struct CampaignCounters {
    uint32_t events, missed, pad[2];  // leaks, double hits or self-hits; rays without candidate
    struct Offender {
        uint32_t low, high;  // the ray's number
        uint32_t flags;      // gl_RayFlags*
        uint32_t front, back;
        float origin[3], direction[3];
        uint32_t pad;
    } ring[kCampaignRing];
};
static_assert(sizeof(CampaignCounters) == 16 + 48 * kCampaignRing);

struct CampaignRay {
    Vec3 origin, direction;
    bool closest = false;  // asks for the closest hit instead of counting all
};

// `triangles`: those of the point's mesh, in its order.
CampaignRay campaign_ray(const CampaignPush& push, const std::vector<Triangle>& triangles, uint64_t number);

// What exact arithmetic says about a ray in object space and a closed mesh: faces entered and left, with
// the rule of tier `exact` for rays that meet edges and vertices exactly.
struct ExactBalance {
    uint32_t front = 0, back = 0;
    uint32_t touched = 0;      // triangles met exactly on an edge or a vertex
    double nearest_edge = 1;   // smallest distance from an edge, in barycentric weight, of those met
};
ExactBalance exact_balance(const Vec3& origin, const Vec3& direction, const std::vector<Triangle>& triangles);

}  // namespace rtc::lab
