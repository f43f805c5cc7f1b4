// The laboratory's rays as users trace theirs: pipelines that rtc links, over structures that its runtime builds on
// the device. Nothing is shared with host_scene's trees but the primitives.
#pragma once

#include <memory>
#include <string>

#include "addressing.h"
#include "ray_tracer.h"
#include "vulkan_context.h"

namespace rtc::lab {

struct PipelineTracerOptions {
    std::string tier = "watertight";  // or fast, exact, exact64
    bool any_hit = false;             // whether the pipeline has an any-hit shader
    uint32_t lanes = 0;  // of a launch; 0: as suits the device
    tools::Addressing addressing = tools::Addressing::Recommended;
};

// Triangles only; no ray mode but kIgnore. Launch errors are thrown (tools::Error).
class PipelineTracer : public RayTracer {
  public:
    // How the next set_scene builds; refit() needs allow_update.
    bool allow_update = false, fast_build = false;

    // The scene with other vertices and transforms, updated where it lies: as many of all as set_scene had.
    virtual void refit(const HostScene& scene) = 0;
    virtual bool by_address() const = 0;
};

// The context must outlive the tracer.
std::unique_ptr<PipelineTracer> make_pipeline_tracer(const tools::Context& context,
                                                     const PipelineTracerOptions& options);

}  // namespace rtc::lab
