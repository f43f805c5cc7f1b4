#include "render_job.h"

#include <stb/stb_image_resize.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "error.h"
#include "scene_tables.h"

namespace rtc::tools {
namespace {

constexpr uint32_t kMaxTextureSize = 1024;
constexpr uint64_t kLogRecordBytes = 48;  // trace_log.glsl

struct LaunchBlock {
    uint32_t sample_index;
};

constexpr std::pair<const char*, Integrator> kIntegrators[] = {{"path", Integrator::Path},
                                                               {"reflections", Integrator::Reflections},
                                                               {"shadows", Integrator::Shadows},
                                                               {"ao", Integrator::AmbientOcclusion},
                                                               {"primary", Integrator::Primary}};

uint8_t encode_srgb(float linear) {
    const float value = std::clamp(linear, 0.0f, 1.0f);
    const float encoded =
        value <= 0.0031308f ? 12.92f * value : 1.055f * std::pow(value, 1.0f / 2.4f) - 0.055f;
    return uint8_t(std::lround(encoded * 255.0f));
}

JobBinding table_binding(uint32_t binding, const BufferView& view) {
    JobBinding result;
    result.set = 0;
    result.binding = binding;
    result.type = VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
    result.texel_buffers = {view.handle};
    return result;
}

JobBinding image_binding(uint32_t binding, const Image& image) {
    JobBinding result;
    result.set = 1;
    result.binding = binding;
    result.type = VK_DESCRIPTOR_TYPE_STORAGE_IMAGE;
    result.images = {{VK_NULL_HANDLE, image.view, VK_IMAGE_LAYOUT_GENERAL}};
    return result;
}

}  // namespace

Integrator integrator_from_name(const std::string& name) {
    std::string list;
    for (const auto& [known, integrator] : kIntegrators) {
        if (name == known) return integrator;
        list += std::string(" ") + known;
    }
    throw Error("no integrator '" + name + "'; there are:" + list);
}

std::vector<std::string> integrator_names() {
    std::vector<std::string> names;
    for (const auto& entry : kIntegrators) names.push_back(entry.first);
    return names;
}

std::string default_shader_folder() {
    namespace fs = std::filesystem;
    std::vector<fs::path> candidates;
    if (const char* wanted = std::getenv("RTC_SHADERS")) candidates.push_back(wanted);
    std::error_code problem;
    const fs::path program = fs::read_symlink("/proc/self/exe", problem);
    if (!problem) candidates.push_back(program.parent_path().parent_path() / "share/rtc/shaders/render");
    candidates.push_back(RTC_SOURCE_SHADERS);
    for (const fs::path& folder : candidates)
        if (fs::exists(folder / "path.rgen", problem)) return folder.string();
    throw Error("the shaders are not where they should be; name their folder with --shaders or RTC_SHADERS");
}

RenderJob::SamplerOwner::~SamplerOwner() {
    if (device) vkDestroySampler(device, handle, nullptr);
}

RenderJob::RenderJob(const Context& context, const Scene& scene, const RenderSettings& wanted)
    : settings(wanted) {
    if (settings.width == 0 || settings.height == 0 || settings.width > 16384 || settings.height > 16384)
        throw Error("the picture's size must be between 1 and 16384 each way");
    for (const Mesh& mesh : scene.meshes)
        if (mesh.procedural())
            throw Error("mesh '" + mesh.name + "' is procedural; rtc-render draws triangles");
    std::string folder = settings.shader_folder.empty() ? default_shader_folder() : settings.shader_folder;
    folder += settings.ext_dialect ? "/ext/" : "/";

    upload_tables(context, scene);
    upload_textures(context, scene);
    ImageDesc desc;
    desc.extent = {settings.width, settings.height, 1};
    accumulation = Image(context, desc);
    desc.format = VK_FORMAT_R32G32B32A32_UINT;
    gbuffer = Image(context, desc);

    if (settings.log_rays) make_log(context);
    switch (settings.integrator) {
        case Integrator::Path:
            add_pass(folder, "primary.rgen", "hit.rchit", "miss.rmiss", 1, false);
            passes.back().pipeline.shaders[0].constants = {{0, 0}};  // no colour, only the G-buffer
            add_pass(folder, "path.rgen", "hit.rchit", "miss.rmiss", 1, true);
            break;
        case Integrator::Reflections:
            // A camera ray, eight reflections, and the last one's shadow ray.
            add_pass(folder, "reflections.rgen", "reflections.rchit", "reflections.rmiss", 10, true);
            break;
        case Integrator::Shadows:
            add_pass(folder, "shadows.rgen", "hit.rchit", "miss.rmiss", 1, true);
            break;
        case Integrator::AmbientOcclusion:
            add_pass(folder, "ao.rgen", "hit.rchit", "miss.rmiss", 1, true);
            break;
        case Integrator::Primary:
            add_pass(folder, "primary.rgen", "hit.rchit", "miss.rmiss", 1, false);
            break;
    }
}

void RenderJob::upload_tables(const Context& context, const Scene& scene) {
    SceneTables tables = make_tables(scene, float(settings.width) / float(settings.height));
    FrameBlock& frame = tables.frame;
    frame.max_bounces = settings.max_bounces;
    frame.shadow_samples = std::max(1u, settings.shadow_samples);
    frame.ao_samples = std::max(1u, settings.ao_samples);
    glm::vec3 low, high;
    scene.bounds(low, high);
    frame.eye.w = settings.ao_radius > 0 ? settings.ao_radius : 0.25f * glm::length(high - low);

    auto upload = [&](const auto& rows, VkFormat format) {
        Table table;
        table.buffer = upload_vector(context, rows, VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT);
        table.view = BufferView(context, table.buffer, format);
        return table;
    };
    instances_ = upload(tables.instances, VK_FORMAT_R32G32B32A32_SFLOAT);
    vertices_ = upload(tables.vertices, VK_FORMAT_R32G32B32A32_SFLOAT);
    triangles_ = upload(tables.triangles, VK_FORMAT_R32G32B32A32_UINT);
    materials_ = upload(tables.materials, VK_FORMAT_R32G32B32A32_SFLOAT);
    lights_ = upload(tables.lights, VK_FORMAT_R32G32B32A32_SFLOAT);
    frame_ = upload_buffer(context, &frame, sizeof frame, VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT);
}

// One array texture, its layers resized to one size: no descriptor indexing needed.
void RenderJob::upload_textures(const Context& context, const Scene& scene) {
    ImageDesc desc;
    desc.view_type = VK_IMAGE_VIEW_TYPE_2D_ARRAY;
    desc.format = VK_FORMAT_R8G8B8A8_SRGB;
    desc.usage = VK_IMAGE_USAGE_SAMPLED_BIT;
    for (const Picture& texture : scene.textures) {
        desc.extent.width = std::max(desc.extent.width, std::min(texture.width, kMaxTextureSize));
        desc.extent.height = std::max(desc.extent.height, std::min(texture.height, kMaxTextureSize));
    }
    desc.layers = std::max(1u, uint32_t(scene.textures.size()));
    if (desc.layers > context.properties.limits.maxImageArrayLayers)
        throw Error("the scene has " + std::to_string(desc.layers) +
                    " textures, the device's maxImageArrayLayers is " +
                    std::to_string(context.properties.limits.maxImageArrayLayers));
    textures_ = Image(context, desc);
    const size_t layer_texels = size_t(desc.extent.width) * desc.extent.height;
    std::vector<uint8_t> texels(layer_texels * desc.layers * 4, 255);
    std::vector<float> resized(layer_texels * 4);
    for (size_t layer = 0; layer < scene.textures.size(); ++layer) {
        const Picture& texture = scene.textures[layer];
        if (!stbir_resize_float(texture.pixels.data(), int(texture.width), int(texture.height), 0,
                                resized.data(), int(desc.extent.width), int(desc.extent.height), 0, 4))
            throw Error("a texture cannot be resized");
        for (size_t i = 0; i < resized.size(); ++i)
            texels[layer * layer_texels * 4 + i] =
                i % 4 == 3 ? uint8_t(std::lround(std::clamp(resized[i], 0.0f, 1.0f) * 255.0f))
                           : encode_srgb(resized[i]);
    }
    upload_image(context, textures_, texels);

    VkSamplerCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO;
    info.magFilter = info.minFilter = VK_FILTER_LINEAR;
    info.addressModeU = info.addressModeV = info.addressModeW = VK_SAMPLER_ADDRESS_MODE_REPEAT;
    sampler_.device = context.device;
    check(vkCreateSampler(context.device, &info, nullptr, &sampler_.handle), "vkCreateSampler");
}

// A record for every ray that a pixel can trace in one launch.
void RenderJob::make_log(const Context& context) {
    switch (settings.integrator) {
        case Integrator::Path:
            log_places = 1 + 2 * settings.max_bounces;
            break;
        case Integrator::Reflections:
            log_places = 2 * (8 + 1);
            break;
        case Integrator::Shadows:
            log_places = 1 + std::max(1u, settings.shadow_samples);
            break;
        case Integrator::AmbientOcclusion:
            log_places = 1 + std::max(1u, settings.ao_samples);
            break;
        case Integrator::Primary:
            log_places = 1;
            break;
    }
    const uint64_t pixel_bytes = uint64_t(settings.width) * settings.height * kLogRecordBytes;
    const uint64_t limit = context.properties.limits.maxStorageBufferRange;
    if (pixel_bytes * log_places > limit)
        throw Error("a record of " + std::to_string(log_places) + " rays a pixel takes " +
                    std::to_string(pixel_bytes * log_places >> 20) +
                    " MiB, the device's maxStorageBufferRange is " + std::to_string(limit >> 20) +
                    " MiB; draw a smaller picture, or fewer --max-bounces (" +
                    std::to_string(limit / pixel_bytes / 2) + " fit)");
    ray_log = Buffer(context, pixel_bytes * log_places,
                     VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT |
                         VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                     MemoryKind::Device);
}

void RenderJob::clear_log(VkCommandBuffer commands) const {
    vkCmdFillBuffer(commands, ray_log.handle, 0, VK_WHOLE_SIZE, 0);
    full_barrier(commands);
}

void RenderJob::add_pass(const std::string& folder, const char* raygen, const char* closest_hit,
                         const char* miss, uint32_t recursion, bool shadows) {
    RayTracingJob job;
    auto add_shader = [&](JobStage stage, const char* file) {
        JobShader shader;
        shader.stage = stage;
        shader.name = file;
        shader.file = folder + file;
        if (log_places) shader.defines = {"RTC_TRACE_LOG=" + std::to_string(log_places)};
        job.pipeline.shaders.push_back(shader);
        return int(job.pipeline.shaders.size() - 1);
    };
    auto add_general = [&](JobStage stage, const char* file) {
        JobGroup group;
        group.name = file;
        group.general = add_shader(stage, file);
        job.pipeline.groups.push_back(group);
        return JobRecord{uint32_t(job.pipeline.groups.size() - 1), {}};
    };
    job.table.raygen.push_back(add_general(JobStage::RayGen, raygen));
    job.table.miss.push_back(add_general(JobStage::Miss, miss));
    if (shadows) job.table.miss.push_back(add_general(JobStage::Miss, "shadow.rmiss"));
    JobGroup hit;
    hit.name = "surface";
    hit.closest_hit = add_shader(JobStage::ClosestHit, closest_hit);
    job.pipeline.groups.push_back(hit);
    job.table.hit.push_back({uint32_t(job.pipeline.groups.size() - 1), {}});
    job.pipeline.max_recursion = recursion;

    JobBinding structure;
    structure.set = 0;
    structure.binding = 0;
    structure.acceleration_structure = true;
    JobBinding texture;
    texture.set = 0;
    texture.binding = 6;
    texture.type = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER;
    texture.images = {{sampler_.handle, textures_.view, VK_IMAGE_LAYOUT_GENERAL}};
    JobBinding frame;
    frame.set = 1;
    frame.binding = 0;
    frame.buffers = {{frame_.handle, 0, VK_WHOLE_SIZE}};
    frame.type = VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER;
    job.bindings = {structure,
                    table_binding(1, instances_.view),
                    table_binding(2, vertices_.view),
                    table_binding(3, triangles_.view),
                    table_binding(4, materials_.view),
                    table_binding(5, lights_.view),
                    texture,
                    frame,
                    image_binding(1, accumulation),
                    image_binding(2, gbuffer)};
    if (log_places) {
        JobBinding log;
        log.set = 1;
        log.binding = 3;
        log.buffers = {{ray_log.handle, 0, VK_WHOLE_SIZE}};
        job.bindings.push_back(log);
    }
    job.push_constants = push_constants(0);
    job.width = settings.width;
    job.height = settings.height;
    passes.push_back(std::move(job));
}

std::vector<uint8_t> RenderJob::push_constants(uint32_t sample) const {
    const LaunchBlock block{sample};
    std::vector<uint8_t> bytes(sizeof block);
    std::memcpy(bytes.data(), &block, sizeof block);
    return bytes;
}

Picture RenderJob::picture(const Context& context, uint32_t samples) const {
    const std::vector<uint8_t> texels = download_image(context, accumulation);
    Picture picture(settings.width, settings.height, 4);
    std::memcpy(picture.pixels.data(), texels.data(), texels.size());
    for (size_t i = 0; i < picture.pixels.size(); ++i)
        picture.pixels[i] = i % 4 == 3 ? 1.0f : picture.pixels[i] / float(samples);
    return picture;
}

double RenderJob::rays(const Context& context) const {
    const std::vector<uint8_t> texels = download_image(context, accumulation);
    double sum = 0;
    for (size_t i = 12; i + 4 <= texels.size(); i += 16) {
        float rays;
        std::memcpy(&rays, &texels[i], sizeof rays);
        sum += double(rays);
    }
    return sum;
}

}  // namespace rtc::tools
