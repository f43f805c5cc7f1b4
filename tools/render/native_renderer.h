// Draws a RenderJob with the device's own ray tracing: the peer pictures are compared with.
#pragma once

#include "../native/executor.h"
#include "render_job.h"
#include "renderer.h"

namespace rtc::tools {

// `dialect` chooses the extension: settings.ext_dialect false: VK_NV_ray_tracing, true:
// VK_KHR_ray_tracing_pipeline. The context must have been made with native::Requirements of that kind.
class NativePasses {
  public:
    // `job` and `context` must outlive the passes. Times go to `result`.
    NativePasses(const Context& context, const Scene& scene, const RenderJob& job, bool khr,
                 RenderResult& result);
    ~NativePasses();
    void launch(uint32_t sample);  // and waits
    const char* name() const;

  private:
    struct Pass;
    const Context& context_;
    const RenderJob& job_;
    std::vector<std::unique_ptr<Pass>> passes_;
};

RenderResult render_natively(const Context& context, const Scene& scene, const RenderOptions& options);

}  // namespace rtc::tools
