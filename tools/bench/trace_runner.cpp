#include "trace_runner.h"

#include <filesystem>
#include <fstream>

#include "../native/glsl.h"
#include "error.h"
#include "job_descriptors.h"
#include "pipeline_statistics.h"

namespace rtc::bench {
namespace {

using tools::Context;
using tools::Error;
using tools::Integrator;
using tools::JobDescriptors;
using tools::JobPipeline;
using tools::JobShader;
using tools::RayTracingJob;
using tools::RenderJob;
using tools::RtcLauncher;
using tools::RtcScene;

RenderJob make_job(const Context& context, const tools::Scene& scene, const Workload& workload, bool ext) {
    tools::RenderSettings settings = workload.settings;
    settings.ext_dialect = ext;
    return RenderJob(context, scene, settings);
}

// Primary rays alone: no colour, only the first hits.
void strip_color(const Workload& workload, RenderJob& job) {
    if (workload.name == "primary") job.passes[0].pipeline.shaders[0].constants = {{0, 0}};
}

class RtcRunner final : public TraceRunner {
  public:
    RtcRunner(const tools::RtcDevice& device, const tools::Scene& scene, std::shared_ptr<RtcScene> structures,
              const Workload& workload, const TraceVariant& variant, ModuleCache& modules)
        : TraceRunner(variant.name),
          structures_(std::move(structures)),
          job_(make_job(device.context, scene, workload, variant.ext_dialect)) {
        strip_color(workload, job_);
        for (const RayTracingJob& pass : job_.passes) {
            launchers_.push_back(std::make_unique<RtcLauncher>(
                device, *structures_, pass,
                modules.get(workload.name, pass, variant, device), &variant.options));
            for (const auto& [what, value] : tools::pipeline_statistics(device.context, launchers_.back()->info().pipeline))
                statistics += (statistics.empty() ? "" : ", ") + what + " " + value;
        }
    }

    void record(VkCommandBuffer commands, uint32_t sample) override {
        for (const auto& launcher : launchers_) launcher->record(commands, job_.push_constants(sample));
    }
    void finish() override {
        for (const auto& launcher : launchers_) launcher->finish();
    }
    uint32_t max_batch() const override { return launchers_[0]->max_launches(); }
    const RenderJob& job() const override { return job_; }

  private:
    std::shared_ptr<RtcScene> structures_;
    RenderJob job_;
    std::vector<std::unique_ptr<RtcLauncher>> launchers_;
};

class NativeRunner final : public TraceRunner {
  public:
    NativeRunner(const Context& context, const tools::Scene& scene, const Workload& workload, bool khr)
        : TraceRunner(khr ? "native KHR" : "native NV"), job_(make_job(context, scene, workload, khr)) {
        strip_color(workload, job_);
        const native::World world = native::world_of(scene);
        for (const RayTracingJob& pass : job_.passes) passes_.push_back(make_pass(context, pass, world, khr));
    }

    void record(VkCommandBuffer commands, uint32_t sample) override {
        for (Pass& pass : passes_) {
            pass.launch.push_constants = job_.push_constants(sample);
            pass.executor->trace(commands, pass.launch);
            tools::full_barrier(commands);
        }
    }
    const RenderJob& job() const override { return job_; }
    void set_size(uint32_t width, uint32_t height) override {
        for (Pass& pass : passes_) {
            pass.launch.width = width ? width : job_.settings.width;
            pass.launch.height = height ? height : job_.settings.height;
        }
    }

  private:
    struct Pass {
        std::unique_ptr<native::Executor> executor;
        std::unique_ptr<JobDescriptors> descriptors;
        native::Launch launch;
    };

    static Pass make_pass(const Context& context, const RayTracingJob& job, const native::World& world, bool khr) {
        Pass pass;
        pass.executor = khr ? native::make_khr(context) : native::make_nv(context);
        JobPipeline pipeline = job.pipeline;
        for (JobShader& shader : pipeline.shaders) {
            native::GlslSource source;
            source.text = native::read_text(shader.file);
            source.file = shader.file;
            source.stage = shader.stage;
            shader.spirv = native::compile_glsl(source);
        }
        pass.executor->build(world);
        native::Executor& executor = *pass.executor;
        pass.descriptors = std::make_unique<JobDescriptors>(
            context, job.bindings, executor.stages(), executor.top_descriptor(),
            [&](VkDescriptorSet set, uint32_t binding, uint32_t element) {
                executor.write_top(set, binding, element, 0);
            });
        executor.create_pipeline(pipeline, pass.descriptors->layouts, uint32_t(job.push_constants.size()));
        executor.set_tables(native::tables_of(job.table));
        pass.launch.width = job.width;
        pass.launch.height = job.height;
        pass.launch.sets = pass.descriptors->sets;
        return pass;
    }

    RenderJob job_;
    std::vector<Pass> passes_;
};

}  // namespace

std::vector<std::string> workload_names() { return {"primary", "ao", "path", "recursive"}; }

Workload make_workload(const std::string& name, uint32_t width, uint32_t height) {
    Workload workload;
    workload.name = name;
    workload.settings.width = width;
    workload.settings.height = height;
    workload.settings.max_bounces = 4;
    if (name == "primary")
        workload.settings.integrator = Integrator::Primary;
    else if (name == "ao")
        workload.settings.integrator = Integrator::AmbientOcclusion;
    else if (name == "path")
        workload.settings.integrator = Integrator::Path;
    else if (name == "recursive")
        workload.settings.integrator = Integrator::Reflections;
    else
        throw Error("no workload '" + name + "'; there are: primary, ao, path, recursive");
    return workload;
}

bool by_address(const TraceVariant& variant, const tools::RtcDevice& device) {
    namespace fs = std::filesystem;
    if (variant.addressing == tools::Addressing::Recommended && !variant.modules.empty())
        for (const fs::directory_entry& file : fs::directory_iterator(variant.modules))
            if (file.path().extension() == ".spv") return tools::is_address_module(tools::read_words_file(file.path().string()));
    return device.by_address(variant.addressing);
}

const std::vector<uint32_t>& ModuleCache::get(const std::string& workload, const RayTracingJob& pass,
                                              const TraceVariant& variant, const tools::RtcDevice& device) {
    namespace fs = std::filesystem;
    const bool resumable = variant.resumable < 0 ? device.support.needsResumableModules : variant.resumable != 0;
    const std::string stem = workload + "-" + fs::path(pass.pipeline.shaders[0].file).stem().string();
    const bool addresses = by_address(variant, device);
    const std::string key = stem + (resumable ? " resumable" : "") + (addresses ? " address" : "") +
                            (variant.optimize ? " O" : "") + (variant.ext_dialect ? " ext" : "") +
                            (variant.specialize ? "" : " whole") + " " + variant.assume + " " + variant.modules;
    if (const auto found = modules_.find(key); found != modules_.end()) return found->second;
    if (!variant.modules.empty())
        return modules_[key] = tools::read_words_file(variant.modules + "/" + stem + ".spv");
    tools::CompileOptions options;
    options.optimize = variant.optimize;
    options.resumable = resumable;
    options.specialize = variant.specialize;
    options.assume = variant.assume;
    options.addresses = addresses;
    std::vector<uint32_t> words = tools::compile_job(pass.pipeline, options).words;
    if (!save_folder_.empty()) {
        fs::create_directories(save_folder_);
        std::ofstream file(save_folder_ + "/" + stem + ".spv", std::ios::binary);
        file.write(reinterpret_cast<const char*>(words.data()), std::streamsize(words.size() * 4));
        if (!file) throw Error("cannot write to " + save_folder_);
    }
    return modules_[key] = std::move(words);
}

std::unique_ptr<TraceRunner> make_rtc_runner(const tools::RtcDevice& device, const tools::Scene& scene,
                                             std::shared_ptr<RtcScene> structures, const Workload& workload,
                                             const TraceVariant& variant, ModuleCache& modules) {
    return std::make_unique<RtcRunner>(device, scene, std::move(structures), workload, variant, modules);
}

std::unique_ptr<TraceRunner> make_native_runner(const Context& context, const tools::Scene& scene,
                                                const Workload& workload, native::Requirements::Kind kind) {
    return std::make_unique<NativeRunner>(context, scene, workload, kind == native::Requirements::Kind::Khr);
}

tools::RenderResult result_of(const Context& context, const RenderJob& job, uint32_t samples) {
    tools::RenderResult result;
    result.picture = job.picture(context, samples);
    result.gbuffer = tools::download_image(context, job.gbuffer);
    result.rays = job.rays(context);
    return result;
}

}  // namespace rtc::bench
