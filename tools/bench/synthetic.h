// Synthetic pipelines for benchmarks: one ray generation and one miss shader, and `count` closest-hit shaders
// that each trace once with values alive across the trace.
#pragma once

#include <string>
#include <vector>

#include "frontend/frontend.h"

namespace rtc::bench {

struct SyntheticPipeline {
    std::vector<GlslSource> sources;  // [0] raygen, [1] miss, then the closest-hits
};

SyntheticPipeline synthetic_pipeline(unsigned count);

// Stages and groups ready to link: raygen and miss are general groups, each closest-hit a triangles group.
PipelineInput link_input(const std::vector<std::vector<uint32_t>>& modules);

}  // namespace rtc::bench
