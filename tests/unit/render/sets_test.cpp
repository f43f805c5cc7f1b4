// A pipeline whose shaders use all eight descriptor sets of lavapipe: rtc's own descriptors then share one
// of them (rtc --reserved=SET.BINDING).
#include <gtest/gtest.h>

#include <cstring>

#include "error.h"
#include "mesh_tools.h"
#include "rtc_compile.h"
#include "rtc_device.h"

namespace rtc::tools {
namespace {

constexpr uint32_t kSize = 16;

class EightSets : public testing::Test {
  protected:
    EightSets() : device(context), scene(make_scene()), structures(device, scene) {
        for (const auto& [stage, file] : {std::pair(JobStage::RayGen, "eight.rgen"),
                                          std::pair(JobStage::ClosestHit, "eight.rchit"),
                                          std::pair(JobStage::Miss, "eight.rmiss")}) {
            JobShader shader;
            shader.stage = stage;
            shader.name = file;
            shader.file = std::string(RTC_TESTDATA) + "/shaders/sets/" + file;
            job.pipeline.shaders.push_back(shader);
        }
        job.pipeline.groups.resize(3);
        job.pipeline.groups[0].name = "raygen";
        job.pipeline.groups[0].general = 0;
        job.pipeline.groups[1].name = "surface";
        job.pipeline.groups[1].closest_hit = 1;
        job.pipeline.groups[2].name = "sky";
        job.pipeline.groups[2].general = 2;
        job.table.raygen = {{0, {}}};
        job.table.hit = {{1, {}}};
        job.table.miss = {{2, {}}};
        job.width = job.height = kSize;

        ImageDesc desc;
        desc.extent = {kSize, kSize, 1};
        picture = Image(context, desc);
        desc.extent = {1, 1, 1};
        desc.usage = VK_IMAGE_USAGE_SAMPLED_BIT;
        green = Image(context, desc);
        const float texel[4] = {9, 0.5f, 9, 9};
        upload_image(context, green, {reinterpret_cast<const uint8_t*>(texel), sizeof texel});
        VkSamplerCreateInfo info{};
        info.sType = VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO;
        vkCreateSampler(context.device, &info, nullptr, &sampler);

        job.bindings.resize(8);
        for (uint32_t set = 0; set < 8; ++set) job.bindings[set].set = set;
        job.bindings[0].acceleration_structure = true;
        job.bindings[1].type = VK_DESCRIPTOR_TYPE_STORAGE_IMAGE;
        job.bindings[1].images = {{VK_NULL_HANDLE, picture.view, VK_IMAGE_LAYOUT_GENERAL}};
        buffer(2, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, {-0.5f, -0.5f, 1, 0});
        buffer(3, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, {2});
        buffer(4, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, {0.25f});
        job.bindings[5].type = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER;
        job.bindings[5].images = {{sampler, green.view, VK_IMAGE_LAYOUT_GENERAL}};
        buffer(6, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, {0.125f, 0.0625f, 0});
        buffer(7, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, {0.75f, 0, 0, 0});
    }
    ~EightSets() override {
        vkDestroySampler(context.device, sampler, nullptr);
        EXPECT_TRUE(context.validation_messages().empty());
    }

    // The quarter of the picture with x and y above one half.
    static Scene make_scene() {
        Scene scene;
        scene.meshes = {make_quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0)};
        scene.instances.resize(1);
        scene.finish(true);
        return scene;
    }

    void buffer(uint32_t set, VkDescriptorType type, const std::vector<float>& values) {
        buffers[set] = upload_vector(context, values,
                                     type == VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER
                                         ? VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT
                                         : VK_BUFFER_USAGE_STORAGE_BUFFER_BIT);
        job.bindings[set].type = type;
        job.bindings[set].buffers = {{buffers[set].handle, 0, VK_WHOLE_SIZE}};
    }

    std::vector<uint32_t> module(int set, uint32_t binding) const {
        CompileOptions options;
        options.resumable = device.support.needsResumableModules;
        options.reserved_set = set;
        options.reserved_binding = binding;
        return compile_job(job.pipeline, options).words;
    }

    Context context;
    RtcDevice device;
    Scene scene;
    RtcScene structures;
    RayTracingJob job;
    Image picture, green;
    Buffer buffers[8];
    VkSampler sampler = VK_NULL_HANDLE;
};

TEST_F(EightSets, DrawWithTheReservedBindingsInAnyOfThem) {
    if (context.properties.limits.maxBoundDescriptorSets < 8) GTEST_SKIP() << "the device binds fewer sets";
    for (const auto& [set, binding] : {std::pair(7, 1u), std::pair(0, 4u), std::pair(5, 100u)}) {
        RtcLauncher launcher(device, structures, job, module(set, binding));
        EXPECT_TRUE(launcher.info().reservedInAppSet);
        context.run([&](VkCommandBuffer commands) { launcher.record(commands, {}); });
        launcher.finish();
        const std::vector<uint8_t> bytes = download_image(context, picture);
        std::vector<float> texels(bytes.size() / sizeof(float));
        std::memcpy(texels.data(), bytes.data(), bytes.size());
        for (uint32_t y = 0; y < kSize; ++y)
            for (uint32_t x = 0; x < kSize; ++x) {
                const bool hit = x >= kSize / 2 && y >= kSize / 2;
                const float* texel = &texels[(y * kSize + x) * 4];
                EXPECT_EQ(texel[0], hit ? 0.5f : 0.25f) << set << ": " << x << " " << y;
                EXPECT_EQ(texel[1], hit ? 1.0f : 0.125f) << set << ": " << x << " " << y;
                EXPECT_EQ(texel[2], 1.5f) << set << ": " << x << " " << y;
                EXPECT_EQ(texel[3], 1.0f) << set << ": " << x << " " << y;
            }
    }
}

TEST_F(EightSets, WithoutTheOptionTheErrorNamesIt) {
    const uint32_t limit = context.properties.limits.maxBoundDescriptorSets;
    const uint32_t set = std::max(limit, 8u);  // what a module whose shaders use all sets asks for
    if (set > 31) GTEST_SKIP() << "the device binds " << limit << " sets";
    try {
        RtcLauncher launcher(device, structures, job, limit == 8 ? module(-1, 0) : module(int(set), 0));
        FAIL() << "set " << set << " was bound";
    } catch (const Error& problem) {
        const std::string text = problem.what();
        EXPECT_NE(text.find("maxBoundDescriptorSets is " + std::to_string(limit)), std::string::npos) << text;
        EXPECT_NE(text.find("--reserved"), std::string::npos) << text;
    }
}

TEST_F(EightSets, BindingsThatAreTakenAreRefused) {
    try {
        module(5, 0);
        FAIL() << "set 5 binding 0 is a texture";
    } catch (const Error& problem) {
        const std::string text = problem.what();
        EXPECT_NE(text.find("set 5 binding 0"), std::string::npos) << text;
        EXPECT_NE(text.find("--reserved"), std::string::npos) << text;
    }
}

}  // namespace
}  // namespace rtc::tools
