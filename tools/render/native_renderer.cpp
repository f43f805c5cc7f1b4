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

// One pass on an executor of its own; each builds the scene for itself.
struct NativePass {
    NativePass(const Context& context, const RayTracingJob& job, const native::World& world, bool khr,
               RenderResult& result)
        : executor(khr ? native::make_khr(context) : native::make_nv(context)) {
        Clock::time_point start = Clock::now();
        JobPipeline pipeline = job.pipeline;
        for (JobShader& shader : pipeline.shaders) {
            native::GlslSource source;
            source.text = native::read_text(shader.file);
            source.file = shader.file;
            source.stage = shader.stage;
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

}  // namespace

RenderResult render_natively(const Context& context, const Scene& scene, const RenderOptions& options) {
    RenderResult result;
    RenderJob job(context, scene, options.settings);
    const native::World world = native::world_of(scene);
    std::vector<std::unique_ptr<NativePass>> passes;
    for (const RayTracingJob& pass : job.passes)
        passes.push_back(
            std::make_unique<NativePass>(context, pass, world, options.settings.ext_dialect, result));

    Progress progress(std::string("tracing with ") + passes[0]->executor->name(), options.samples,
                      options.quiet);
    const Clock::time_point start = Clock::now();
    double rays_per_sample = 0;
    for (uint32_t sample = 0; sample < options.samples; ++sample) {
        context.run([&](VkCommandBuffer commands) {
            for (const auto& pass : passes) {
                pass->launch.push_constants = job.push_constants(sample);
                pass->executor->trace(commands, pass->launch);
                full_barrier(commands);
            }
        });
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
