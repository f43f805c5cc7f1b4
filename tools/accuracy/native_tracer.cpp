// A device's own ray tracing as a RayTracer: structures, pipeline and descriptors are made anew for every scene.
#include "native_tracer.h"

#include <algorithm>
#include <cstring>

#include "../native/executor.h"
#include "error.h"
#include "job_descriptors.h"
#include "rays_job.h"
#include "resources.h"

namespace rtc::lab {
namespace {

native::World world_of(const HostScene& scene) {
    native::World world;
    for (const Blas& blas : scene.blases) {
        native::Bottom bottom;
        for (const Geometry& geometry : blas.geometries) {
            native::Geometry g;
            for (const Triangle& triangle : geometry.triangles)
                for (const Vec3& v : triangle) g.positions.insert(g.positions.end(), {v.x, v.y, v.z});
            g.flags = VK_GEOMETRY_NO_DUPLICATE_ANY_HIT_INVOCATION_BIT_KHR;
            if (geometry.opaque) g.flags |= VK_GEOMETRY_OPAQUE_BIT_KHR;
            bottom.geometries.push_back(std::move(g));
        }
        world.bottoms.push_back(std::move(bottom));
    }
    native::Top top;
    for (const Instance& instance : scene.instances) {
        native::Placement placement;
        placement.bottom = int(instance.blas);
        for (int i = 0; i < 12; ++i) placement.transform[i] = instance.object_to_world[i / 4][i % 4];
        placement.custom_index = instance.custom_index;
        placement.mask = instance.mask;
        placement.flags = instance.flags;
        top.instances.push_back(placement);
    }
    world.tops.push_back(std::move(top));
    return world;
}

class NativeRays final : public RayTracer {
  public:
    NativeRays(const tools::Context& context, bool any_hit) : context_(context), job_(rays_job(any_hit)) {}

    void set_scene(const HostScene& scene) override {
        descriptors_.reset();
        executor_ = native::make_khr(context_);
        executor_->build(world_of(scene));
        fresh_ = true;
    }

    std::vector<RayResult> trace(const std::vector<Ray>& rays) override {
        const uint32_t lanes = (uint32_t(rays.size()) + kRaysWidth - 1) / kRaysWidth * kRaysWidth;
        if (lanes > capacity_) {
            descriptors_.reset();
            const VkBufferUsageFlags in = VK_BUFFER_USAGE_TRANSFER_DST_BIT, out = VK_BUFFER_USAGE_TRANSFER_SRC_BIT;
            const VkBufferUsageFlags storage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
            rays_ = tools::Buffer(context_, lanes * sizeof(Ray), storage | in, tools::MemoryKind::Device);
            rays_here_ = tools::Buffer(context_, lanes * sizeof(Ray), out, tools::MemoryKind::Host);
            results_ = tools::Buffer(context_, lanes * sizeof(RayResult), storage | out, tools::MemoryKind::Device);
            results_here_ = tools::Buffer(context_, lanes * sizeof(RayResult), in, tools::MemoryKind::Readback);
            capacity_ = lanes;
        }
        if (!descriptors_) bind();
        std::memcpy(rays_here_.mapped, rays.data(), rays.size() * sizeof(Ray));
        const uint32_t push[2] = {0, uint32_t(rays.size())};
        native::Launch launch;
        launch.width = kRaysWidth;
        launch.height = lanes / kRaysWidth;
        launch.sets = descriptors_->sets;
        launch.push_constants.resize(sizeof push);
        std::memcpy(launch.push_constants.data(), push, sizeof push);
        tools::GpuTimer timer(context_);
        context_.run([&](VkCommandBuffer commands) {
            timer.reset(commands);
            const VkBufferCopy in{0, 0, rays.size() * sizeof(Ray)}, out{0, 0, rays.size() * sizeof(RayResult)};
            vkCmdCopyBuffer(commands, rays_here_.handle, rays_.handle, 1, &in);
            tools::full_barrier(commands);
            timer.begin(commands);  // no bus is timed
            executor_->trace(commands, launch);
            timer.end(commands);
            tools::full_barrier(commands);
            vkCmdCopyBuffer(commands, results_.handle, results_here_.handle, 1, &out);
            tools::full_barrier(commands);
        });
        seconds = timer.seconds();
        std::vector<RayResult> results(rays.size());
        std::memcpy(results.data(), results_here_.mapped, results.size() * sizeof(RayResult));
        return results;
    }

    uint64_t scene_bytes() const override { return executor_ ? executor_->structure_bytes() : 0; }

  private:
    void bind() {
        tools::JobBinding structure, in, out;
        structure.acceleration_structure = true;
        in.binding = 1;
        in.buffers = {{rays_.handle, 0, VK_WHOLE_SIZE}};
        out.binding = 2;
        out.buffers = {{results_.handle, 0, VK_WHOLE_SIZE}};
        descriptors_ = std::make_unique<tools::JobDescriptors>(
            context_, std::vector<tools::JobBinding>{structure, in, out}, executor_->stages(),
            executor_->top_descriptor(), [&](VkDescriptorSet set, uint32_t binding, uint32_t element) {
                executor_->write_top(set, binding, element, 0);
            });
        if (fresh_) {
            executor_->create_pipeline(job_.pipeline, descriptors_->layouts, 2 * sizeof(uint32_t));
            executor_->set_tables(native::tables_of(job_.table));
            fresh_ = false;
        }
    }

    const tools::Context& context_;
    tools::RayTracingJob job_;
    std::unique_ptr<native::Executor> executor_;
    std::unique_ptr<tools::JobDescriptors> descriptors_;
    tools::Buffer rays_, results_;            // on the device
    tools::Buffer rays_here_, results_here_;  // on the host
    uint32_t capacity_ = 0;
    bool fresh_ = true;  // the executor has no pipeline yet
};

}  // namespace

std::unique_ptr<RayTracer> make_native_tracer(const tools::Context& context, bool any_hit) {
    return std::make_unique<NativeRays>(context, any_hit);
}

}  // namespace rtc::lab
