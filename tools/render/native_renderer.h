// Draws a RenderJob with the device's own ray tracing: the peer pictures are compared with.
#pragma once

#include "../native/executor.h"
#include "render_job.h"
#include "renderer.h"

namespace rtc::tools {

// `dialect` chooses the extension: settings.ext_dialect false: VK_NV_ray_tracing, true:
// VK_KHR_ray_tracing_pipeline. The context must have been made with native::Requirements of that kind.
RenderResult render_natively(const Context& context, const Scene& scene, const RenderOptions& options);

}  // namespace rtc::tools
