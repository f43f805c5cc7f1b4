// Draws a RenderJob through rtc.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "render_job.h"
#include "rtc_compile.h"
#include "rtc_device.h"

namespace rtc::tools {

struct RenderOptions {
    RenderSettings settings;
    uint32_t samples = 16;
    bool fast_build = false;
    bool quiet = false;
    bool optimize = true;
    Addressing addressing = Addressing::Recommended;  // where modules are compiled
    bool keep_gbuffer = false;         // fill RenderResult::gbuffer
    std::vector<std::string> modules;  // precompiled, one a pass; empty: compile the shaders
    std::string save_modules;          // folder for what was compiled; empty: nowhere
};

struct RenderResult {
    Picture picture;
    std::vector<uint8_t> gbuffer;  // four words a pixel: the last sample's first hits
    double rays = 0, trace_seconds = 0, compile_seconds = 0, build_seconds = 0;
};

// The passes of a job compiled, with their acceleration structures: whatever launches samples.
class RtcPasses {
  public:
    // `job` and `device` must outlive the passes. Times go to `result`.
    RtcPasses(const RtcDevice& device, const Scene& scene, const RenderJob& job, const RenderOptions& options,
              RenderResult& result);
    // Launches `count` samples, at most max_launches(), and waits. Throws Error for a launch that failed.
    void launch(uint32_t first, uint32_t count);
    uint32_t max_launches() const { return launchers_[0]->max_launches(); }

  private:
    RtcPasses(const RtcDevice& device, const Scene& scene, const RenderJob& job, const RenderOptions& options,
              RenderResult& result, const std::vector<std::vector<uint32_t>>& modules);

    const Context& context_;
    const RenderJob& job_;
    RtcScene structures_;
    std::vector<std::unique_ptr<RtcLauncher>> launchers_;
};

// `device` may be shared by several pictures.
RenderResult render(const RtcDevice& device, const Scene& scene, const RenderOptions& options);

}  // namespace rtc::tools
