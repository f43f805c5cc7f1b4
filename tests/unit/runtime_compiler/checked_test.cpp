// The checking variant of traversal (rtc --checked), under validation: whatever acceleration structure
// memory holds, a launch ends, and nothing outside is read.
#include <algorithm>
#include <cstdlib>
#include <random>

#include "stages_fixture.h"

namespace {

constexpr uint32_t kRays = 64;

class CheckedTest : public StagesTest, public ::testing::WithParamInterface<bool> {
  protected:
    void SetUp() override {
        StagesTest::SetUp();
        if (!vk) return;
        if (GetParam() && !vk->GetBufferDeviceAddress) GTEST_SKIP() << "the device has no bufferDeviceAddress";
        RtrDeviceCreateInfo info{};
        info.instance = vk->instance;
        info.physicalDevice = vk->physical_device;
        info.device = vk->device;
        info.pfnGetInstanceProcAddr = vk->get_instance_proc_addr;
        info.bufferDeviceAddress = GetParam();
        info.validation = VK_TRUE;
        ASSERT_EQ(rtrCreateDevice(&info, nullptr, &rtr), VK_SUCCESS);
        device = rtr;
        make_pipeline(true);
        scene = std::make_unique<Scene>(*vk, rtr, 1 << 17, GetParam());
        std::mt19937 rng(5);
        std::uniform_real_distribution<float> u(0, 1);
        std::vector<Vec3> vertices;
        for (int i = 0; i < 300; i++) {
            const Vec3 at{u(rng) * 130.0f, u(rng), u(rng) - 0.5f};
            for (int k = 0; k < 3; k++) vertices.push_back({at.x + 3 * u(rng), at.y + u(rng) - 0.5f, at.z});
        }
        bottom = scene->build_bottom({scene->triangles(vertices)});
        std::vector<VkAccelerationStructureInstanceNV> instances;
        for (int i = 0; i < 5; i++) {
            auto instance = scene->instance(bottom);
            instance.transform.matrix[2][3] = -0.3f * float(i);
            instance.transform.matrix[0][3] = float(i);
            instances.push_back(instance);
        }
        top = scene->build_top(instances);
        result = scene->upload(nullptr, 4 * kRays);
        ASSERT_EQ(rtrUpdateAccelerationStructureDescriptors(rtr, set, 0, 0, 1, &top, nullptr), VK_SUCCESS);
        VkDescriptorBufferInfo buffer{result.handle, 0, VK_WHOLE_SIZE};
        VkWriteDescriptorSet w{VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
        w.dstSet = set;
        w.dstBinding = 1;
        w.descriptorCount = 1;
        w.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
        w.pBufferInfo = &buffer;
        vk->UpdateDescriptorSets(vk->device, 1, &w, 0, nullptr);
        make_table();
        sound.assign(scene->heap_buffer.as<uint32_t>(), scene->heap_buffer.as<uint32_t>() + scene->heap_buffer.size / 4);
    }
    void make_pipeline(bool checked) {
        rtrDestroyPipeline(rtr, pipeline, nullptr);
        auto options = rtcc_options_create();
        rtcc_options_set_checked(options, checked);
        rtcc_options_set_addressing(options, GetParam() ? RTCC_ADDRESSING_ADDRESS : RTCC_ADDRESSING_HEAP);
        const VkResult r = create(options);
        rtcc_options_release(options);
        ASSERT_EQ(r, VK_SUCCESS);
        RtrPipelineInfo info;
        rtrGetPipelineInfo(pipeline, &info);
        ASSERT_EQ((info.moduleFlags & RTC_MODULE_CHECKED) != 0, checked);
    }
    void make_table() {
        RtrSbtRecord raygen{0, 0, nullptr}, miss{1, 0, nullptr}, hit{2, 0, nullptr};
        RtrSbtInfo sbt_info{1, &raygen, 1, &miss, 1, &hit, 0, nullptr};
        ASSERT_EQ(rtrGetSbtLayout(rtr, &sbt_info, &table), VK_SUCCESS);
        sbt = scene->upload(nullptr, table.size);
        ASSERT_EQ(rtrWriteSbt(rtr, pipeline, &sbt_info, &table, sbt.data), VK_SUCCESS);
        scratch_size = rtrGetLaunchScratchSize(rtr, pipeline, kRays, 1, 1, nullptr);
        scratch = scene->upload(nullptr, scratch_size);
    }
    void TearDown() override {
        scene.reset();
        StagesTest::TearDown();
        if (device) rtrDestroyDevice(device, nullptr);
    }

    uint32_t* words(RtrAccelerationStructure as) { return const_cast<uint32_t*>(scene->words(as)); }
    uint32_t bytes(RtrAccelerationStructure as) {
        VkMemoryRequirements2 need{VK_STRUCTURE_TYPE_MEMORY_REQUIREMENTS_2};
        rtrGetAccelerationStructureMemoryRequirements(
            rtr, VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_OBJECT_NV, as, &need);
        return uint32_t(need.memoryRequirements.size);
    }
    void restore() { memcpy(scene->heap_buffer.data, sound.data(), 4 * sound.size()); }

    // The error of a launch that declares its scene.
    RtrLaunchError launch_rays() {
        RtrLaunchError error{};
        vk->begin();
        auto rec = scene->recorder;
        EXPECT_EQ(rtrBeginRecorder(rec, vk->cmd), VK_SUCCESS);
        const RtrAccelerationStructure declared[2] = {top, bottom};
        EXPECT_EQ(rtrCmdDeclareScene(rec, 2, declared), VK_SUCCESS);
        rtrCmdBindPipeline(rec, pipeline);
        rtrCmdBindDescriptorSets(rec, 0, 1, &set, 0, nullptr);
        if (scene->heap) rtrCmdSetHeap(rec, scene->heap);
        if (scratch_size) rtrCmdSetLaunchScratch(rec, scratch.handle, 0, scratch_size);
        rtrCmdSetLaunchLimits(rec, 0, 16);
        EXPECT_EQ(rtrCmdTraceRays(rec, sbt.handle, table.raygen.offset, sbt.handle, table.miss.offset,
                                  table.miss.stride, sbt.handle, table.hit.offset, table.hit.stride, VK_NULL_HANDLE, 0,
                                  0, kRays, 1, 1),
                  VK_SUCCESS);
        vk->submit();
        rtrGetLaunchError(rec, 0, scene->control.data, &error);
        EXPECT_EQ(rtrRetireRecorder(rec), VK_SUCCESS);
        return error;
    }

    RtrDevice device = nullptr;
    std::unique_ptr<Scene> scene;
    RtrAccelerationStructure bottom = nullptr, top = nullptr;
    Buffer result, sbt, scratch;
    RtrSbtLayout table{};
    VkDeviceSize scratch_size = 0;
    std::vector<uint32_t> sound;
};
INSTANTIATE_TEST_SUITE_P(Modes, CheckedTest, ::testing::Bool(), [](const auto& p) {
    return std::string(p.param ? "Address" : "Heap");
});

TEST_P(CheckedTest, DamageIsNamed) {
    ASSERT_EQ(launch_rays().code, RTC_LAUNCH_ERROR_NONE);
    const std::vector<uint32_t> hits(result.as<uint32_t>(), result.as<uint32_t>() + kRays);
    EXPECT_GT(std::count_if(hits.begin(), hits.end(), [](uint32_t v) { return v >= 1050; }), 5);
    const uint32_t nodes = 4 * RTC_AS_HEADER_QUADS, in_top = RTC_BAD_INSTANCE_MASK;
    const struct {
        RtrAccelerationStructure as;
        uint32_t word, value, code, kind, instance;
        const char* says;
    } rows[] = {
        {bottom, nodes + 3, 1000000, RTC_LAUNCH_ERROR_BAD_MEMORY, RTC_BAD_NODE, 0, "node 1000000, which the structure"},
        {bottom, nodes + 7, 0x90000000u | 5000, RTC_LAUNCH_ERROR_BAD_MEMORY, RTC_BAD_SLOT, 0, "slot 5000, which"},
        {top, nodes + 3, 0x90000000u | 77, RTC_LAUNCH_ERROR_BAD_MEMORY, RTC_BAD_INSTANCE_INDEX, 77,
         "instance 77, which the top level does not have"},
        {bottom, nodes + 3, 0, RTC_LAUNCH_ERROR_BAD_MEMORY, RTC_BAD_CYCLE, 0, "more often than a tree"},
        {bottom, RTC_HDR_NODE_COUNT, 0x10000000, RTC_LAUNCH_ERROR_BAD_INSTANCE, 0, 0, "refers to no bottom level"},
        {top, RTC_HDR_SLOTS, 0x7fffffff, RTC_LAUNCH_ERROR_BAD_MEMORY, RTC_BAD_HEADER, in_top,
         "in the top level a ray met a header"},
        {top, RTC_HDR_SELF_LO, 0x40, RTC_LAUNCH_ERROR_BAD_MEMORY, RTC_BAD_HEADER, in_top, "header that cannot be"},
    };
    for (auto& row : rows) {
        SCOPED_TRACE(row.says);
        words(row.as)[row.word] = row.value;
        // Every ray is to meet it.
        if (row.word == nodes + 3 || row.word == nodes + 7) {
            float* box = reinterpret_cast<float*>(words(row.as)) + nodes + (row.word == nodes + 7 ? 8 : 0);
            for (int k = 0; k < 3; k++) box[k] = -1e4f, box[4 + k] = 1e4f;
        }
        const RtrLaunchError error = launch_rays();
        EXPECT_EQ(error.code, row.code);
        EXPECT_GT(error.count, 0u);
        if (row.code == RTC_LAUNCH_ERROR_BAD_MEMORY) {
            EXPECT_EQ(error.detail[1] >> RTC_BAD_SHIFT, row.kind);
            // Which instance is met first is not said.
            if (row.kind == RTC_BAD_HEADER) {
                EXPECT_EQ(error.detail[1] & RTC_BAD_INSTANCE_MASK, row.instance);
            }
        }
        char text[256];
        rtrFormatLaunchError(&error, text, sizeof text);
        EXPECT_NE(std::string(text).find(row.says), std::string::npos) << text;
        restore();
    }
    ASSERT_EQ(launch_rays().code, RTC_LAUNCH_ERROR_NONE);
    EXPECT_EQ(memcmp(result.data, hits.data(), 4 * kRays), 0);
}

TEST_P(CheckedTest, SoundScenesLookTheSame) {
    ASSERT_EQ(launch_rays().code, RTC_LAUNCH_ERROR_NONE);
    const std::vector<uint32_t> hits(result.as<uint32_t>(), result.as<uint32_t>() + kRays);
    make_pipeline(false);
    make_table();
    memset(result.data, 0, 4 * kRays);
    ASSERT_EQ(launch_rays().code, RTC_LAUNCH_ERROR_NONE);
    EXPECT_EQ(memcmp(result.data, hits.data(), 4 * kRays), 0);
}

// Words anywhere in the structures become anything; references become those of elsewhere. RTC_TEST_DAMAGES: how
// often.
TEST_P(CheckedTest, RandomDamageEndsInAnErrorOrAMiss) {
    std::mt19937 rng(GetParam() ? 11 : 12);
    const char* more = getenv("RTC_TEST_DAMAGES");
    const int damages = more ? atoi(more) : 300;
    int found = 0, silent = 0;
    for (int i = 0; i < damages; i++) {
        const RtrAccelerationStructure as = rng() % 3 ? bottom : top;
        uint32_t* w = words(as);
        const uint32_t count = bytes(as) / 4, nodes = w[RTC_HDR_NODE_COUNT], start = 4 * RTC_AS_HEADER_QUADS;
        const uint32_t changes = 1u << rng() % 6;
        for (uint32_t k = 0; k < changes; k++) {
            switch (rng() % 5) {
                case 0: w[rng() % count] = uint32_t(rng()); break;
                case 1: w[rng() % start] ^= 1u << rng() % 32; break;
                case 2: w[start + 16 * (rng() % nodes) + (rng() % 2 ? 3 : 7)] = uint32_t(rng()) % (2 * nodes); break;
                case 3: w[start + 16 * (rng() % nodes) + (rng() % 2 ? 3 : 7)] = uint32_t(rng()) | RTC_REF_LEAF; break;
                default:  // a piece of memory moves
                    memmove(w + rng() % (count - 64), w + rng() % (count - 64), 4 * (1 + rng() % 63));
            }
        }
        const RtrLaunchError error = launch_rays();
        ASSERT_FALSE(HasFailure()) << "damage " << i;
        error.code == RTC_LAUNCH_ERROR_NONE ? silent++ : found++;
        for (uint32_t r = 0; r < kRays; r++) {
            const uint32_t v = result.as<uint32_t>()[r];
            if (error.code == RTC_LAUNCH_ERROR_NONE) {
                ASSERT_TRUE(v >= 1000) << "damage " << i << ", ray " << r << " has no result";
            }
        }
        restore();
    }
    EXPECT_GT(found, damages / 4);
    ASSERT_EQ(launch_rays().code, RTC_LAUNCH_ERROR_NONE);
    RecordProperty("found", found);
    RecordProperty("silent", silent);
}

}  // namespace
