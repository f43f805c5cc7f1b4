#include "native_renderer.h"

#include <chrono>
#include <cstdio>

#include "../native/glsl.h"
#include "job_descriptors.h"
#include "progress.h"

namespace rtc::tools {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

}  // namespace

// One pass on an executor of its own; each builds the scene for itself.
struct NativePasses::Pass {
    Pass(const Context& context, const RayTracingJob& job, const native::World& world, bool khr,
               RenderResult& result)
        : executor(khr ? native::make_khr(context) : native::make_nv(context)) {
        Clock::time_point start = Clock::now();
        JobPipeline pipeline = job.pipeline;
        for (JobShader& shader : pipeline.shaders) {
            native::GlslSource source;
            source.text = native::read_text(shader.file);
            source.file = shader.file;
            source.stage = shader.stage;
            source.defines = shader.defines;
            shader.spirv = native::compile_glsl(source);
        }
        result.compile_seconds += seconds_since(start);
        start = Clock::now();
        executor->build(world);
        result.build_seconds += seconds_since(start);
        descriptors = std::make_unique<JobDescriptors>(
            context, job.bindings, executor->stages(), executor->top_descriptor(),
            [&](VkDescriptorSet set, uint32_t binding, uint32_t element) {
                executor->write_top(set, binding, element, 0);
            });
        executor->create_pipeline(pipeline, descriptors->layouts, uint32_t(job.push_constants.size()));
        executor->set_tables(native::tables_of(job.table));
        launch.width = job.width;
        launch.height = job.height;
        launch.depth = job.depth;
        launch.sets = descriptors->sets;
    }

    std::unique_ptr<native::Executor> executor;
    std::unique_ptr<JobDescriptors> descriptors;
    native::Launch launch;
};

NativePasses::NativePasses(const Context& context, const Scene& scene, const RenderJob& job, bool khr,
                           RenderResult& result)
    : context_(context), job_(job) {
    const native::World world = native::world_of(scene);
    for (const RayTracingJob& pass : job.passes)
        passes_.push_back(std::make_unique<Pass>(context, pass, world, khr, result));
}

NativePasses::~NativePasses() = default;

const char* NativePasses::name() const { return passes_[0]->executor->name(); }

void NativePasses::launch(uint32_t sample) {
    context_.run([&](VkCommandBuffer commands) {
        if (job_.log_places) job_.clear_log(commands);
        for (const auto& pass : passes_) {
            pass->launch.push_constants = job_.push_constants(sample);
            pass->executor->trace(commands, pass->launch);
            full_barrier(commands);
        }
    });
}

RenderResult render_natively(const Context& context, const Scene& scene, const RenderOptions& options) {
    RenderResult result;
    RenderJob job(context, scene, options.settings);
    NativePasses passes(context, scene, job, options.settings.ext_dialect, result);

    Progress progress(std::string("tracing with ") + passes.name(), options.samples, options.quiet);
    const Clock::time_point start = Clock::now();
    double rays_per_sample = 0;
    for (uint32_t sample = 0; sample < options.samples; ++sample) {
        passes.launch(sample);
        if (rays_per_sample == 0) rays_per_sample = job.rays(context);
        progress.update(sample + 1, rays_per_sample * (sample + 1));
    }
    result.trace_seconds = seconds_since(start);
    result.rays = job.rays(context);
    progress.finish(result.rays);
    result.picture = job.picture(context, options.samples);
    if (options.keep_gbuffer) result.gbuffer = download_image(context, job.gbuffer);
    return result;
}

}  // namespace rtc::tools
