// The two shaders of "RTX on Vulkan" (GDC 2019), corrected, draw their picture. They use descriptor sets
// 0 to 3, all that Vulkan guarantees.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "mesh_tools.h"
#include "rtc_compile.h"
#include "rtc_device.h"

namespace rtc::tools {
namespace {

constexpr uint32_t kSize = 33;
constexpr float kDistance = 2.0f;

struct TraceParameters {
    uint32_t sbt_miss = 0, sbt_offset = 0, sbt_stride = 0, padding = 0;
    float origin[4] = {0.5f, 0.5f, 0, 0};
    float dir[4] = {0, 0, -1, 0};
};

struct Sampler {
    explicit Sampler(VkDevice device_) : device(device_) {
        VkSamplerCreateInfo info{};
        info.sType = VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO;
        info.magFilter = info.minFilter = VK_FILTER_LINEAR;
        info.addressModeU = info.addressModeV = info.addressModeW = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
        vkCreateSampler(device, &info, nullptr, &handle);
    }
    ~Sampler() { vkDestroySampler(device, handle, nullptr); }
    VkDevice device;
    VkSampler handle = VK_NULL_HANDLE;
};

// A solid texture whose red is x and green is y: texel centres at (i + 0.5) / 8.
std::vector<uint8_t> solid_texture() {
    std::vector<float> texels(8 * 8 * 8 * 4);
    for (size_t i = 0; i < 512; ++i) {
        texels[4 * i] = (float(i % 8) + 0.5f) / 8;
        texels[4 * i + 1] = (float(i / 8 % 8) + 0.5f) / 8;
        texels[4 * i + 2] = 0.25f;
        texels[4 * i + 3] = 1;
    }
    std::vector<uint8_t> bytes(texels.size() * sizeof(float));
    std::memcpy(bytes.data(), texels.data(), bytes.size());
    return bytes;
}

JobShader shader(JobStage stage, const char* file) {
    JobShader result;
    result.stage = stage;
    result.name = file;
    result.file = std::string(RTC_TESTDATA) + "/shaders/seed/corrected/" + file;
    return result;
}

// `reserved`: the set whose bindings from 16 on are rtc's own; -1: a set above the seed's four.
void draw_the_solid_texture(int reserved) {
    Context context;
    const RtcDevice device(context);

    Scene scene;  // a unit square, so that hit positions are texture coordinates
    scene.meshes = {make_quad({0, 0, -kDistance}, {1, 0, 0}, {0, 1, 0}, 0)};
    scene.instances.resize(1);
    scene.finish(true);
    const RtcScene structures(device, scene);

    RayTracingJob job;
    job.pipeline.shaders = {shader(JobStage::RayGen, "raygen.rgen"),
                            shader(JobStage::ClosestHit, "closesthit.rchit")};
    job.pipeline.groups.resize(2);
    job.pipeline.groups[0].name = "raygen";
    job.pipeline.groups[0].general = 0;
    job.pipeline.groups[1].name = "solid";
    job.pipeline.groups[1].closest_hit = 1;
    job.table.raygen = {{0, {}}};
    job.table.miss = {
        {~0u, {}}};  // the slides show no miss shader: a null record leaves the payload as it was
    job.table.hit = {{1, {}}};
    job.width = job.height = kSize;

    ImageDesc framebuffer_desc;
    framebuffer_desc.extent = {kSize, kSize, 1};
    const Image framebuffer(context, framebuffer_desc);
    ImageDesc solid_desc;
    solid_desc.view_type = VK_IMAGE_VIEW_TYPE_3D;
    solid_desc.extent = {8, 8, 8};
    solid_desc.usage = VK_IMAGE_USAGE_SAMPLED_BIT;
    const Image solid(context, solid_desc);
    upload_image(context, solid, solid_texture());
    const Sampler sampler(context.device);
    const TraceParameters parameters;
    const Buffer uniform =
        upload_buffer(context, &parameters, sizeof parameters, VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT);

    job.bindings.resize(4);
    for (uint32_t set = 0; set < 4; ++set) job.bindings[set].set = set;
    job.bindings[0].acceleration_structure = true;
    job.bindings[1].type = VK_DESCRIPTOR_TYPE_STORAGE_IMAGE;
    job.bindings[1].images = {{VK_NULL_HANDLE, framebuffer.view, VK_IMAGE_LAYOUT_GENERAL}};
    job.bindings[2].type = VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER;
    job.bindings[2].buffers = {{uniform.handle, 0, VK_WHOLE_SIZE}};
    job.bindings[3].type = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER;
    job.bindings[3].images = {{sampler.handle, solid.view, VK_IMAGE_LAYOUT_GENERAL}};

    CompileOptions options;
    options.resumable = device.support.needsResumableModules;
    options.reserved_set = reserved;
    options.reserved_binding = reserved < 0 ? 0 : 16;
    RtcLauncher launcher(device, structures, job, compile_job(job.pipeline, options).words);
    EXPECT_EQ(launcher.info().reservedSet, reserved < 0 ? 4u : uint32_t(reserved));
    EXPECT_EQ(launcher.info().reservedInAppSet == VK_TRUE, reserved >= 0);
    context.run([&](VkCommandBuffer commands) { launcher.record(commands, {}); });
    launcher.finish();

    const std::vector<uint8_t> bytes = download_image(context, framebuffer);
    std::vector<float> texels(bytes.size() / sizeof(float));
    std::memcpy(texels.data(), bytes.data(), bytes.size());
    int inside = 0;
    for (uint32_t y = 0; y < kSize; ++y)
        for (uint32_t x = 0; x < kSize; ++x) {
            // computeDir sees 90 degrees along -z: the plane at distance 2 spans 4 units.
            const float px = 0.5f + kDistance * ((float(x) + 0.5f) / kSize * 2 - 1);
            const float py = 0.5f - kDistance * ((float(y) + 0.5f) / kSize * 2 - 1);
            const float* texel = &texels[(y * kSize + x) * 4];
            const bool hit = px > 0 && px < 1 && py > 0 && py < 1;
            inside += hit;
            const float low = 0.5f / 8, high = 7.5f / 8;
            EXPECT_NEAR(texel[0], hit ? std::clamp(px, low, high) : 0.0f, 0.01f) << x << " " << y;
            EXPECT_NEAR(texel[1], hit ? std::clamp(py, low, high) : 0.0f, 0.01f) << x << " " << y;
            EXPECT_EQ(texel[2], hit ? 0.25f : 0.0f) << x << " " << y;
        }
    EXPECT_GT(inside, 40);
    EXPECT_TRUE(context.validation_messages().empty());
}

TEST(Seed, CorrectedShadersDrawTheSolidTexture) { draw_the_solid_texture(-1); }

// As on a device with no set beyond the guaranteed four.
TEST(Seed, CorrectedShadersDrawInTheirFourSetsAlone) {
    for (int set : {0, 3}) draw_the_solid_texture(set);
}

}  // namespace
}  // namespace rtc::tools
