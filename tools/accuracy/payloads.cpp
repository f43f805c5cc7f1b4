#include "payloads.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <ctime>
#include <memory>
#include <optional>

#include "campaign.h"
#include "error.h"
#include "rtc_compile.h"
#include "rtc_device.h"

namespace rtc::lab {
namespace {

constexpr uint32_t kRaygen[] = {
#include "payload_rgen.inc"
};
constexpr uint32_t kClosestHit[] = {
#include "payload_rchit.inc"
};
constexpr uint32_t kMiss[] = {
#include "payload_rmiss.inc"
};
constexpr uint32_t kRaygen16[] = {
#include "payload16_rgen.inc"
};
constexpr uint32_t kClosestHit16[] = {
#include "payload16_rchit.inc"
};
constexpr uint32_t kMiss16[] = {
#include "payload16_rmiss.inc"
};

CampaignPoint knot() {
    CampaignPoint point;
    point.mesh = "torus-knot";
    point.shape = std::make_shared<const IndexedMesh>(make_torus_knot(400, 24));
    return point;
}

// One pipeline and what it paints into.
struct Painter {
    template <typename Words>
    static void add(tools::RayTracingJob& job, tools::JobStage stage, const char* name, const Words& words) {
        tools::JobShader shader;
        shader.stage = stage;
        shader.name = name;
        shader.spirv.assign(std::begin(words), std::end(words));
        tools::JobGroup group;
        group.name = name;
        (stage == tools::JobStage::ClosestHit ? group.closest_hit : group.general) = int(job.pipeline.shaders.size());
        job.pipeline.shaders.push_back(shader);
        job.pipeline.groups.push_back(group);
    }

    Painter(const tools::RtcDevice& device, const tools::RtcScene& scene, const tools::Buffer& corners, uint32_t side, bool packed)
        : pixels(device.context, VkDeviceSize(side) * side * 16, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, tools::MemoryKind::Readback),
          timer(device.context) {
        if (packed) {
            add(job, tools::JobStage::RayGen, "rgen", kRaygen16);
            add(job, tools::JobStage::Miss, "rmiss", kMiss16);
            add(job, tools::JobStage::ClosestHit, "rchit", kClosestHit16);
        } else {
            add(job, tools::JobStage::RayGen, "rgen", kRaygen);
            add(job, tools::JobStage::Miss, "rmiss", kMiss);
            add(job, tools::JobStage::ClosestHit, "rchit", kClosestHit);
        }
        job.table.raygen.push_back({0, {}});
        job.table.miss.push_back({1, {}});
        job.table.hit.push_back({2, {}});
        tools::JobBinding structure, in, out;
        structure.acceleration_structure = true;
        in.binding = 1;
        in.buffers = {{corners.handle, 0, VK_WHOLE_SIZE}};
        out.binding = 2;
        out.buffers = {{pixels.handle, 0, VK_WHOLE_SIZE}};
        job.bindings = {structure, in, out};
        job.width = job.height = side;
        tools::CompileOptions options;
        options.resumable = device.support.needsResumableModules;
        options.addresses = device.by_address(tools::Addressing::Recommended);
        launcher = std::make_unique<tools::RtcLauncher>(device, scene, job, tools::compile_job(job.pipeline, options).words);
    }

    double paint(const tools::Context& context) {
        const std::clock_t before = std::clock();
        context.run([&](VkCommandBuffer commands) {
            timer.reset(commands);
            timer.begin(commands);
            launcher->record(commands, {});
            timer.end(commands);
            tools::full_barrier(commands);
        });
        launcher->finish();
        const double cpu = double(std::clock() - before) / CLOCKS_PER_SEC;
        return context.properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU ? cpu : timer.seconds();
    }

    tools::RayTracingJob job;
    tools::Buffer pixels;
    tools::GpuTimer timer;
    std::unique_ptr<tools::RtcLauncher> launcher;
};

double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

}  // namespace

std::vector<PayloadRow> measure_payloads(const tools::Context& context, uint32_t side, unsigned repeats) {
    const tools::RtcDevice device(context);
    const std::vector<CampaignPoint> points = {knot()};
    const tools::RtcScene scene(device, campaign_scene(points[0]), false, device.by_address(tools::Addressing::Recommended));
    const tools::Buffer corners = tools::upload_vector(context, campaign_corners(points), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT);
    std::array<std::optional<Painter>, 2> painters;
    std::vector<double> seconds[2], ratios;
    for (int i = 0; i < 2; ++i) painters[i].emplace(device, scene, corners, side, i == 1);
    for (unsigned repeat = 0; repeat <= repeats; ++repeat) {
        double took[2];
        for (int i = 0; i < 2; ++i) took[i] = painters[i]->paint(context);
        if (repeat == 0) continue;  // warms up
        for (int i = 0; i < 2; ++i) seconds[i].push_back(took[i]);
        ratios.push_back(took[1] / took[0]);
    }
    double sum = 0, most = 0;
    const float* colours[2] = {static_cast<const float*>(painters[0]->pixels.mapped),
                               static_cast<const float*>(painters[1]->pixels.mapped)};
    for (size_t i = 0; i < size_t(side) * side; ++i)
        for (int c = 0; c < 3; ++c) {
            const double off = std::fabs(double(colours[0][i * 4 + c]) - colours[1][i * 4 + c]);
            sum += off;
            most = std::max(most, off);
        }
    return {{"floats", 28, median(seconds[0]), 1, 0, 0},
            {"halves", 16, median(seconds[1]), median(ratios), sum / (3.0 * side * side), most}};
}

}  // namespace rtc::lab
