#include "renderer.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "error.h"
#include "progress.h"

namespace rtc::tools {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

std::vector<std::vector<uint32_t>> get_modules(const RtcDevice& device, const RenderJob& job,
                                               const RenderOptions& options, double& seconds) {
    std::vector<std::vector<uint32_t>> modules;
    if (!options.modules.empty()) {
        if (options.modules.size() != job.passes.size())
            throw Error("this integrator has " + std::to_string(job.passes.size()) + " pass(es), but " +
                        std::to_string(options.modules.size()) + " module(s) were given");
        for (const std::string& path : options.modules) modules.push_back(read_words_file(path));
        return modules;
    }
    CompileOptions compile;
    compile.optimize = options.optimize;
    compile.resumable = device.support.needsResumableModules;
    compile.addresses = device.by_address(options.addressing);
    for (const RayTracingJob& pass : job.passes) {
        const CompiledModule module = compile_job(pass.pipeline, compile);
        if (!module.warnings.empty()) std::fprintf(stderr, "%s", module.warnings.c_str());
        seconds += module.seconds;
        modules.push_back(module.words);
        if (!options.save_modules.empty()) {
            std::filesystem::create_directories(options.save_modules);
            const std::string path = options.save_modules + "/" + pass.pipeline.shaders[0].name + ".spv";
            std::ofstream file(path, std::ios::binary);
            file.write(reinterpret_cast<const char*>(module.words.data()),
                       std::streamsize(module.words.size() * 4));
            if (!file) throw Error("cannot write " + path);
        }
    }
    return modules;
}

void warn_of_holes(const Scene& scene) {
    for (const Material& material : scene.materials)
        if (material.alpha_tested) {
            std::fprintf(stderr,
                         "rtc-render: warning: material '%s' has holes (alphaMode MASK); it is drawn solid\n",
                         material.name.c_str());
            return;
        }
}

}  // namespace

RtcPasses::RtcPasses(const RtcDevice& device, const Scene& scene, const RenderJob& job,
                     const RenderOptions& options, RenderResult& result)
    : RtcPasses(device, scene, job, options, result, get_modules(device, job, options, result.compile_seconds)) {}

RtcPasses::RtcPasses(const RtcDevice& device, const Scene& scene, const RenderJob& job, const RenderOptions& options,
                     RenderResult& result, const std::vector<std::vector<uint32_t>>& modules)
    : context_(device.context),
      job_(job),
      structures_(device, scene, options.fast_build, is_address_module(modules[0])) {
    result.build_seconds = structures_.build_seconds;
    if (!options.quiet)
        std::printf(
            "scene: %s, %zu triangles in %zu meshes, %zu instances; acceleration structures %.1f MiB in %.2f "
            "s\n",
            scene.name.c_str(), scene.triangle_count(), scene.meshes.size(), scene.instances.size(),
            double(structures_.bytes) / 1048576.0, structures_.build_seconds);
    for (size_t i = 0; i < job.passes.size(); ++i) {
        launchers_.push_back(std::make_unique<RtcLauncher>(device, structures_, job.passes[i], modules[i]));
        if (!options.quiet) {
            const RtrPipelineInfo info = launchers_.back()->info();
            std::printf("pass: %s, %u states, recursion %u, %zu KiB of SPIR-V\n",
                        job.passes[i].pipeline.shaders[0].name.c_str(), info.stateCount,
                        info.maxRecursionDepth, modules[i].size() * 4 / 1024);
        }
    }
}

void RtcPasses::launch(uint32_t first, uint32_t count) {
    context_.run([&](VkCommandBuffer commands) {
        for (uint32_t sample = first; sample < first + count; ++sample) {
            if (job_.log_places) job_.clear_log(commands);
            for (const auto& launcher : launchers_) launcher->record(commands, job_.push_constants(sample));
        }
    });
    for (const auto& launcher : launchers_) launcher->finish();
}

RenderResult render(const RtcDevice& device, const Scene& scene, const RenderOptions& options) {
    const Context& context = device.context;
    RenderResult result;
    warn_of_holes(scene);
    RenderJob job(context, scene, options.settings);
    RtcPasses passes(device, scene, job, options, result);

    Progress progress("tracing", options.samples, options.quiet);
    const Clock::time_point start = Clock::now();
    uint32_t done = 0, batch = 1;
    double rays_per_sample = 0;
    while (done < options.samples) {
        const uint32_t count = std::min(batch, options.samples - done);
        const Clock::time_point batch_start = Clock::now();
        passes.launch(done, count);
        done += count;
        if (rays_per_sample == 0) rays_per_sample = job.rays(context);  // later samples trace about as many
        progress.update(done, rays_per_sample * done);
        // Batches of about half a second keep the bar moving and the queue busy.
        const double took = seconds_since(batch_start) / count;
        batch = std::clamp(uint32_t(0.5 / std::max(took, 1e-3)), 1u, passes.max_launches());
    }
    result.trace_seconds = seconds_since(start);
    result.rays = job.rays(context);
    progress.finish(result.rays);
    result.picture = job.picture(context, options.samples);
    if (options.keep_gbuffer) result.gbuffer = download_image(context, job.gbuffer);
    return result;
}

}  // namespace rtc::tools
