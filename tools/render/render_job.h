// Everything a picture takes, for whoever traces the rays: the scene's tables
// and the images on the device, the passes as RayTracingJobs. rtc-render runs
// them through rtc; a native executor can run the same ones.
#pragma once

#include <string>
#include <vector>

#include "image_file.h"
#include "ray_tracing_job.h"
#include "resources.h"
#include "scene.h"
#include "vulkan_context.h"

namespace rtc::tools {

enum class Integrator { Path, Reflections, Shadows, AmbientOcclusion, Primary };

Integrator integrator_from_name(const std::string& name);  // throws Error listing the names
std::vector<std::string> integrator_names();

struct RenderSettings {
    Integrator integrator = Integrator::Path;
    uint32_t width = 512, height = 512;
    uint32_t max_bounces = 64;    // Russian roulette ends nearly all paths before
    uint32_t shadow_samples = 4;  // per launch
    uint32_t ao_samples = 4;      // per launch
    float ao_radius = 0;          // 0: a quarter of the scene's diagonal
    bool ext_dialect = false;     // the GL_EXT_ray_tracing twins
    std::string shader_folder;    // empty: default_shader_folder()
    bool log_rays = false;        // RenderJob::ray_log
};

// $RTC_SHADERS, share/rtc/shaders/render of the installation, or the source tree's. Throws Error.
std::string default_shader_folder();

class RenderJob {
  public:
    RenderJob(const Context& context, const Scene& scene, const RenderSettings& settings);

    RenderSettings settings;
    // To be launched in this order for every sample; the results add up in `accumulation`.
    std::vector<RayTracingJob> passes;
    std::vector<uint8_t> push_constants(uint32_t sample) const;

    Image accumulation;  // sum of radiance; w: rays traced
    Image gbuffer;       // instance, primitive, barycentrics as bits
    // With settings.log_rays: log_places records a pixel, as trace_log.glsl describes them.
    Buffer ray_log;
    uint32_t log_places = 0;
    // Makes all records empty; to be recorded before a sample's passes.
    void clear_log(VkCommandBuffer commands) const;

    // The mean of `samples` launches, alpha 1.
    Picture picture(const Context& context, uint32_t samples) const;
    double rays(const Context& context) const;

  private:
    void upload_tables(const Context& context, const Scene& scene);
    void upload_textures(const Context& context, const Scene& scene);
    void make_log(const Context& context);
    void add_pass(const std::string& folder, const char* raygen, const char* closest_hit, const char* miss,
                  uint32_t recursion, bool shadows);

    struct Table {
        Buffer buffer;
        BufferView view;
    };
    Table instances_, vertices_, triangles_, materials_, lights_;
    Buffer frame_;
    Image textures_;
    struct SamplerOwner {
        VkDevice device = VK_NULL_HANDLE;
        VkSampler handle = VK_NULL_HANDLE;
        SamplerOwner() = default;
        SamplerOwner(const SamplerOwner&) = delete;
        SamplerOwner& operator=(const SamplerOwner&) = delete;
        ~SamplerOwner();
    } sampler_;
};

}  // namespace rtc::tools
