// The laboratory's rays as a ray tracing pipeline (shaders/rays.*), for whoever runs it.
#pragma once

#include "ray_tracing_job.h"

namespace rtc::lab {

constexpr uint32_t kRaysWidth = 1024;  // of launches; their heights follow

// Shaders, groups and shader binding table. `any_hit`: whether the pipeline has an any-hit shader.
tools::RayTracingJob rays_job(bool any_hit);

}  // namespace rtc::lab
