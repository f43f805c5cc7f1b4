#include "rays_job.h"

#include <iterator>

namespace rtc::lab {
namespace {

constexpr uint32_t kRaygen[] = {
#include "rays_rgen.inc"
};
constexpr uint32_t kAnyHit[] = {
#include "rays_rahit.inc"
};
constexpr uint32_t kClosestHit[] = {
#include "rays_rchit.inc"
};
constexpr uint32_t kMiss[] = {
#include "rays_rmiss.inc"
};

}  // namespace

tools::RayTracingJob rays_job(bool any_hit) {
    tools::RayTracingJob job;
    auto add = [&](tools::JobStage stage, const char* name, const auto& words) {
        tools::JobShader shader;
        shader.stage = stage;
        shader.name = name;
        shader.spirv.assign(std::begin(words), std::end(words));
        job.pipeline.shaders.push_back(shader);
        return int(job.pipeline.shaders.size() - 1);
    };
    job.pipeline.groups.resize(3);
    job.pipeline.groups[0].name = "raygen";
    job.pipeline.groups[0].general = add(tools::JobStage::RayGen, "rgen", kRaygen);
    job.pipeline.groups[1].name = "miss";
    job.pipeline.groups[1].general = add(tools::JobStage::Miss, "rmiss", kMiss);
    job.pipeline.groups[2].name = "hit";
    if (any_hit) job.pipeline.groups[2].any_hit = add(tools::JobStage::AnyHit, "rahit", kAnyHit);
    job.pipeline.groups[2].closest_hit = add(tools::JobStage::ClosestHit, "rchit", kClosestHit);
    job.table.raygen.push_back({0, {}});
    job.table.miss.push_back({1, {}});
    job.table.hit.push_back({2, {}});
    return job;
}

}  // namespace rtc::lab
