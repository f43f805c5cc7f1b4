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
    bool keep_gbuffer = false;         // fill RenderResult::gbuffer
    std::vector<std::string> modules;  // precompiled, one a pass; empty: compile the shaders
    std::string save_modules;          // folder for what was compiled; empty: nowhere
};

struct RenderResult {
    Picture picture;
    std::vector<uint8_t> gbuffer;  // four words a pixel: the last sample's first hits
    double rays = 0, trace_seconds = 0, compile_seconds = 0, build_seconds = 0;
};

// `device` may be shared by several pictures.
RenderResult render(const RtcDevice& device, const Scene& scene, const RenderOptions& options);

}  // namespace rtc::tools
