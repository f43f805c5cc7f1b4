// Where tier `exact` promises nothing: numbers below 2^-126, which devices may flush when they read or make them.
#pragma once

#include <optional>

#include "host_scene.h"
#include "oracle.h"
#include "ray_tracer.h"

namespace rtc::lab {

bool is_denormal(float v);

// Whether a denormal float has a part in what this ray hits: one in the ray's origin or
// direction, in the ray of the object space of either
// hit's instance or in what that is summed from, or in a vertex of the triangle that exact arithmetic or the device
// hits. (Differences and products on the way that are denormal excuse nothing: the tier must bear them.)
bool denormals_at_stake(const HostScene& scene, const Ray& ray, const std::optional<OracleHit>& expected,
                        const RayResult& got);

}  // namespace rtc::lab
