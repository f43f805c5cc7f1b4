// The laboratory's rays through a device's own VK_KHR_ray_tracing_pipeline.
#pragma once

#include <memory>

#include "ray_tracer.h"
#include "vulkan_context.h"

namespace rtc::lab {

// Triangles only; no mode but kIgnore. `any_hit`: whether the pipeline has an any-hit shader. The context must be
// campaign_context("native", ...) and outlive the tracer.
std::unique_ptr<RayTracer> make_native_tracer(const tools::Context& context, bool any_hit);

}  // namespace rtc::lab
