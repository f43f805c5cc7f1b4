// What runs a campaign's shaders: rtc's pipelines, or the device's own.
#include <cstring>
#include <map>

#include "../native/executor.h"
#include "../native/glsl.h"
#include "campaign.h"
#include "error.h"
#include "job_descriptors.h"
#include "resources.h"
#include "rtc_compile.h"
#include "rtc_device.h"
#include "spirv_edit.h"

namespace rtc::lab {
namespace {

using tools::Buffer;
using tools::Context;
using tools::Error;

constexpr uint32_t kLeaksRaygen[] = {
#include "leaks_rgen.inc"
};
constexpr uint32_t kLeaksAnyHit[] = {
#include "leaks_rahit.inc"
};
constexpr uint32_t kLeaksClosestHit[] = {
#include "leaks_rchit.inc"
};
constexpr uint32_t kLeaksMiss[] = {
#include "leaks_rmiss.inc"
};
constexpr uint32_t kSpawnRaygen[] = {
#include "spawn_rgen.inc"
};
constexpr uint32_t kSpawnAnyHit[] = {
#include "spawn_rahit.inc"
};
constexpr uint32_t kSpawnClosestHit[] = {
#include "spawn_rchit.inc"
};
constexpr uint32_t kSpawnMiss[] = {
#include "spawn_rmiss.inc"
};

constexpr uint32_t kWidth = 1024;

uint32_t suitable_lanes(const Context& context, uint32_t wanted) {
    const uint32_t fit = context.properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU ? 1u << 16 : 1u << 22;
    return (std::max(wanted ? wanted : fit, kWidth) + kWidth - 1) / kWidth * kWidth;
}

// Buffers and the launch that both kinds share.
struct Launch {
    Launch(const Context& context, CampaignProgram program, const std::vector<CampaignPoint>& points, uint32_t lanes)
        : context(context),
          corners(tools::upload_vector(context, campaign_corners(points), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT)),
          counters(context, sizeof(CampaignCounters),
                   VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT |
                       VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                   tools::MemoryKind::Device),
          read(context, sizeof(CampaignCounters), VK_BUFFER_USAGE_TRANSFER_DST_BIT, tools::MemoryKind::Readback),
          timer(context) {
        auto add = [&](tools::JobStage stage, const auto& leaks, const auto& spawn) {
            tools::JobShader shader;
            shader.stage = stage;
            shader.name = native::stage_suffix(stage);
            if (program == CampaignProgram::Leaks) shader.spirv.assign(std::begin(leaks), std::end(leaks));
            if (program == CampaignProgram::Spawn) shader.spirv.assign(std::begin(spawn), std::end(spawn));
            job.pipeline.shaders.push_back(shader);
            return int(job.pipeline.shaders.size() - 1);
        };
        auto group = [&](const char* name) -> tools::JobGroup& {
            job.pipeline.groups.emplace_back().name = name;
            return job.pipeline.groups.back();
        };
        group("raygen").general = add(tools::JobStage::RayGen, kLeaksRaygen, kSpawnRaygen);
        group("miss").general = add(tools::JobStage::Miss, kLeaksMiss, kSpawnMiss);
        tools::JobGroup& hit = group("hit");
        hit.any_hit = add(tools::JobStage::AnyHit, kLeaksAnyHit, kSpawnAnyHit);
        hit.closest_hit = add(tools::JobStage::ClosestHit, kLeaksClosestHit, kSpawnClosestHit);
        job.table.raygen.push_back({0, {}});
        job.table.miss.push_back({1, {}});
        job.table.hit.push_back({2, {}});
        tools::JobBinding structure;
        structure.acceleration_structure = true;
        tools::JobBinding triangles;
        triangles.binding = 1;
        triangles.buffers = {{corners.handle, 0, VK_WHOLE_SIZE}};
        tools::JobBinding counts;
        counts.binding = 2;
        counts.buffers = {{counters.handle, 0, VK_WHOLE_SIZE}};
        job.bindings = {structure, triangles, counts};
        job.push_constants.resize(sizeof(CampaignPush));
        job.width = kWidth;
        job.height = lanes / kWidth;
    }

    template <typename Trace>
    double run(const CampaignPush& push, CampaignCounters& result, Trace trace) {
        std::vector<uint8_t> bytes(sizeof push);
        std::memcpy(bytes.data(), &push, sizeof push);
        context.run([&](VkCommandBuffer commands) {
            timer.reset(commands);
            vkCmdFillBuffer(commands, counters.handle, 0, VK_WHOLE_SIZE, 0);
            tools::full_barrier(commands);
            timer.begin(commands);
            trace(commands, bytes);
            timer.end(commands);
            tools::full_barrier(commands);
            const VkBufferCopy copy{0, 0, sizeof(CampaignCounters)};
            vkCmdCopyBuffer(commands, counters.handle, read.handle, 1, &copy);
            tools::full_barrier(commands);
        });
        std::memcpy(&result, read.mapped, sizeof result);
        return timer.seconds();
    }

    const Context& context;
    Buffer corners, counters, read;
    tools::GpuTimer timer;
    tools::RayTracingJob job;
};

class RtcTracer final : public CampaignTracer {
  public:
    RtcTracer(const Context& context, const std::string& subject, CampaignProgram program,
              const std::vector<CampaignPoint>& points, uint32_t lanes)
        : points_(points), lanes_(lanes), launch_(context, program, points, lanes), device_(context) {
        tools::CompileOptions options;
        options.resumable = device_.support.needsResumableModules;
        if (subject == "fast") options.accuracy = RTCC_ACCURACY_FAST;
        if (subject == "exact") options.accuracy = RTCC_ACCURACY_EXACT;
        if (subject == "exact64") options.accuracy = RTCC_ACCURACY_EXACT_FLOAT64;
        options.addresses = device_.by_address(tools::Addressing::Recommended);
        addresses_ = options.addresses;
        module_ = tools::compile_job(launch_.job.pipeline, options).words;
        if (subject == "contracted") contract(module_);
    }

    void use(size_t point) override {
        auto next = std::make_unique<tools::RtcScene>(device_, campaign_scene(points_[point]), false, addresses_);
        if (launcher_) {
            launcher_->use_scene(*next);
        } else {
            launcher_ = std::make_unique<tools::RtcLauncher>(device_, *next, launch_.job, module_);
        }
        scene_ = std::move(next);
    }

    double launch(const CampaignPush& push, CampaignCounters& counters) override {
        const double seconds = launch_.run(push, counters, [&](VkCommandBuffer commands, const auto& bytes) {
            launcher_->record(commands, bytes);
        });
        launcher_->finish();
        return seconds;
    }

    uint32_t lanes() const override { return lanes_; }

  private:
    const std::vector<CampaignPoint>& points_;
    uint32_t lanes_;
    Launch launch_;
    tools::RtcDevice device_;
    std::vector<uint32_t> module_;
    bool addresses_ = false;
    std::unique_ptr<tools::RtcScene> scene_;
    std::unique_ptr<tools::RtcLauncher> launcher_;
};

class NativeTracer final : public CampaignTracer {
  public:
    NativeTracer(const Context& context, CampaignProgram program, const std::vector<CampaignPoint>& points,
                 uint32_t lanes)
        : lanes_(lanes), launch_(context, program, points, lanes), executor_(native::make_khr(context)) {
        native::World world;
        std::map<const IndexedMesh*, int> bottoms;
        for (const CampaignPoint& point : points) {
            native::World one = native::world_of(campaign_scene(point));
            const auto [it, fresh] = bottoms.try_emplace(point.shape.get(), int(world.bottoms.size()));
            if (fresh) world.bottoms.push_back(std::move(one.bottoms[0]));
            one.tops[0].instances[0].bottom = it->second;
            world.tops.push_back(std::move(one.tops[0]));
        }
        executor_->build(world);
        descriptors_ = std::make_unique<tools::JobDescriptors>(
            context, launch_.job.bindings, executor_->stages(), executor_->top_descriptor(),
            [&](VkDescriptorSet set, uint32_t binding, uint32_t element) {
                executor_->write_top(set, binding, element, 0);
            });
        executor_->create_pipeline(launch_.job.pipeline, descriptors_->layouts, sizeof(CampaignPush));
        executor_->set_tables(native::tables_of(launch_.job.table));
        trace_.width = launch_.job.width;
        trace_.height = launch_.job.height;
        trace_.sets = descriptors_->sets;
    }

    void use(size_t point) override { executor_->write_top(descriptors_->sets[0], 0, 0, uint32_t(point)); }

    double launch(const CampaignPush& push, CampaignCounters& counters) override {
        return launch_.run(push, counters, [&](VkCommandBuffer commands, const auto& bytes) {
            trace_.push_constants = bytes;
            executor_->trace(commands, trace_);
        });
    }

    uint32_t lanes() const override { return lanes_; }

  private:
    uint32_t lanes_;
    Launch launch_;
    std::unique_ptr<native::Executor> executor_;
    std::unique_ptr<tools::JobDescriptors> descriptors_;
    native::Launch trace_;
};

}  // namespace

std::unique_ptr<Context> campaign_context(const std::string& subject, const std::string& device, bool validate) {
    tools::ContextOptions options;
    options.device = device;
    options.validate = validate;
    options.print_device = false;
    if (subject == "native") {
        native::Requirements needs(native::Requirements::Kind::Khr);
        needs.apply(options);
        return std::make_unique<Context>(options);
    }
    bool known = false;
    for (const char* name : {"watertight", "fast", "exact", "exact64", "contracted"}) known = known || subject == name;
    if (!known)
        throw Error("unknown tier \"" + subject + "\": fast, watertight, exact, exact64, contracted or native");
    options.all_core_features = true;  // Float64 for exact64 and the negative control
    auto context = std::make_unique<Context>(options);
    if ((subject == "exact64" || subject == "contracted") && !context->features.shaderFloat64)
        throw tools::MissingFeature(subject + " needs shaderFloat64");
    return context;
}

std::unique_ptr<CampaignTracer> make_campaign_tracer(const Context& context, const std::string& subject,
                                                     CampaignProgram program, const std::vector<CampaignPoint>& points,
                                                     uint32_t lanes) {
    lanes = suitable_lanes(context, lanes);
    if (subject == "native") return std::make_unique<NativeTracer>(context, program, points, lanes);
    return std::make_unique<RtcTracer>(context, subject, program, points, lanes);
}

}  // namespace rtc::lab
