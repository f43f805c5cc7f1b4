#include "pipeline_tracer.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "error.h"
#include "rays_job.h"
#include "resources.h"
#include "rtc_compile.h"
#include "rtc_device.h"

namespace rtc::lab {
namespace {

tools::Mesh mesh_of(const Geometry& geometry) {
    tools::Mesh mesh;
    mesh.opaque = geometry.opaque;
    mesh.no_duplicate_any_hit = true;
    for (const Triangle& triangle : geometry.triangles)
        for (const Vec3& v : triangle) {
            mesh.indices.push_back(uint32_t(mesh.positions.size()));
            mesh.positions.emplace_back(v.x, v.y, v.z);
        }
    return mesh;
}

std::vector<std::vector<tools::Mesh>> meshes_of(const HostScene& scene) {
    std::vector<std::vector<tools::Mesh>> meshes;
    for (const Blas& blas : scene.blases) {
        meshes.emplace_back();
        for (const Geometry& geometry : blas.geometries) meshes.back().push_back(mesh_of(geometry));
    }
    return meshes;
}

tools::RtcScene::Bottoms pointers(const std::vector<std::vector<tools::Mesh>>& meshes) {
    tools::RtcScene::Bottoms bottoms;
    for (const auto& list : meshes) {
        bottoms.emplace_back();
        for (const tools::Mesh& mesh : list) bottoms.back().push_back(&mesh);
    }
    return bottoms;
}

std::vector<tools::Instance> instances_of(const HostScene& scene) {
    std::vector<tools::Instance> instances;
    for (const Instance& instance : scene.instances) {
        tools::Instance converted;
        converted.mesh = instance.blas;
        for (int row = 0; row < 3; ++row)
            for (int column = 0; column < 4; ++column)
                converted.transform[column][row] = instance.object_to_world[row][column];
        converted.custom_index = instance.custom_index;
        converted.mask = instance.mask;
        converted.sbt_offset = instance.sbt_offset;
        converted.flags = instance.flags;
        instances.push_back(converted);
    }
    return instances;
}

rtcc_accuracy accuracy_of(const std::string& tier) {
    if (tier == "watertight") return RTCC_ACCURACY_WATERTIGHT;
    if (tier == "fast") return RTCC_ACCURACY_FAST;
    if (tier == "exact") return RTCC_ACCURACY_EXACT;
    if (tier == "exact64") return RTCC_ACCURACY_EXACT_FLOAT64;
    throw tools::Error("unknown tier \"" + tier + "\" of pipelines: fast, watertight, exact or exact64");
}

uint32_t whole_rows(const tools::Context& context, uint32_t wanted) {
    const uint32_t suits = context.properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU ? 1u << 16 : 1u << 18;
    return (std::max(wanted ? wanted : suits, 1u) + kRaysWidth - 1) / kRaysWidth * kRaysWidth;
}

class RtcRays final : public PipelineTracer {
  public:
    RtcRays(const tools::Context& context, const PipelineTracerOptions& options)
        : context_(context), lanes_(whole_rows(context, options.lanes)), device_(context),
          timer_(context), job_(rays_job(options.any_hit)) {
        addresses_ = device_.by_address(options.addressing);
        tools::CompileOptions compile;
        compile.resumable = device_.support.needsResumableModules;
        compile.accuracy = accuracy_of(options.tier);
        compile.addresses = addresses_;
        module_ = tools::compile_job(job_.pipeline, compile).words;
        const VkBufferUsageFlags in = VK_BUFFER_USAGE_TRANSFER_DST_BIT, out = VK_BUFFER_USAGE_TRANSFER_SRC_BIT;
        const VkBufferUsageFlags storage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
        rays_ = tools::Buffer(context, lanes_ * sizeof(Ray), storage | in, tools::MemoryKind::Device);
        rays_here_ = tools::Buffer(context, lanes_ * sizeof(Ray), out, tools::MemoryKind::Host);
        results_ = tools::Buffer(context, lanes_ * sizeof(RayResult), storage | in | out, tools::MemoryKind::Device);
        results_here_ = tools::Buffer(context, lanes_ * sizeof(RayResult), in, tools::MemoryKind::Readback);
        tools::JobBinding structure, rays, results;
        structure.acceleration_structure = true;
        rays.binding = 1;
        rays.buffers = {{rays_.handle, 0, VK_WHOLE_SIZE}};
        results.binding = 2;
        results.buffers = {{results_.handle, 0, VK_WHOLE_SIZE}};
        job_.bindings = {structure, rays, results};
        job_.push_constants.resize(2 * sizeof(uint32_t));
        job_.width = kRaysWidth;
        job_.height = lanes_ / kRaysWidth;
    }

    void set_scene(const HostScene& scene) override {
        const auto meshes = meshes_of(scene);
        tools::RtcSceneOptions how;
        how.addresses = addresses_;
        how.allow_update = allow_update;
        how.fast_build = fast_build;
        auto next = std::make_unique<tools::RtcScene>(device_, pointers(meshes), instances_of(scene), how);
        if (launcher_) {
            launcher_->use_scene(*next);
        } else {
            launcher_ = std::make_unique<tools::RtcLauncher>(device_, *next, job_, module_);
        }
        scene_ = std::move(next);
        top_.clear();
    }

    void refit(const HostScene& scene) override {
        const auto meshes = meshes_of(scene);
        scene_->update(pointers(meshes), instances_of(scene));
        top_.clear();
    }

    std::vector<RayResult> trace(const std::vector<Ray>& rays) override {
        std::vector<RayResult> all(rays.size());
        seconds = 0;
        for (size_t first = 0; first < rays.size(); first += lanes_) {
            const size_t count = std::min<size_t>(lanes_, rays.size() - first);
            std::memcpy(rays_here_.mapped, rays.data() + first, count * sizeof(Ray));
            const uint32_t push[2] = {0, uint32_t(count)};
            std::memcpy(job_.push_constants.data(), push, sizeof push);
            context_.run([&](VkCommandBuffer commands) {
                timer_.reset(commands);
                const VkBufferCopy in{0, 0, count * sizeof(Ray)}, out{0, 0, count * sizeof(RayResult)};
                vkCmdCopyBuffer(commands, rays_here_.handle, rays_.handle, 1, &in);
                vkCmdFillBuffer(commands, results_.handle, 0, VK_WHOLE_SIZE, 0);
                tools::full_barrier(commands);
                timer_.begin(commands);  // no bus is timed
                launcher_->record(commands, job_.push_constants);
                timer_.end(commands);
                tools::full_barrier(commands);
                vkCmdCopyBuffer(commands, results_.handle, results_here_.handle, 1, &out);
                tools::full_barrier(commands);
            });
            launcher_->finish();
            seconds += timer_.seconds();
            std::memcpy(all.data() + first, results_here_.mapped, count * sizeof(RayResult));
        }
        return all;
    }

    uint64_t scene_bytes() const override { return scene_ ? scene_->bytes : 0; }

    std::optional<Transform> world_to_object(uint32_t instance) const override {
        if (top_.empty()) top_ = scene_->top_words();
        const size_t at = (size_t(top_.at(RTC_HDR_SLOTS)) + size_t(instance) * RTC_INSTANCE_QUADS) * 4;
        Transform w;
        for (size_t i = 0; i < 12; ++i) w[i / 4][i % 4] = std::bit_cast<float>(top_.at(at + i));
        return w;
    }

    bool by_address() const override { return addresses_; }

  private:
    const tools::Context& context_;
    uint32_t lanes_;
    tools::RtcDevice device_;
    tools::GpuTimer timer_;
    tools::RayTracingJob job_;
    bool addresses_ = false;
    std::vector<uint32_t> module_;
    tools::Buffer rays_, results_;            // on the device
    tools::Buffer rays_here_, results_here_;  // on the host
    std::unique_ptr<tools::RtcScene> scene_;
    std::unique_ptr<tools::RtcLauncher> launcher_;
    mutable std::vector<uint32_t> top_;  // read when asked for
};

}  // namespace

std::unique_ptr<PipelineTracer> make_pipeline_tracer(const tools::Context& context,
                                                     const PipelineTracerOptions& options) {
    return std::make_unique<RtcRays>(context, options);
}

}  // namespace rtc::lab
