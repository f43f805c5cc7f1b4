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
    void make_pipeline(bool checked, rtcc_accuracy accuracy = RTCC_ACCURACY_WATERTIGHT, RtrDevice of = nullptr) {
        rtrDestroyPipeline(rtr, pipeline, nullptr);
        pipeline = nullptr;
        auto options = rtcc_options_create();
        rtcc_options_set_checked(options, checked);
        rtcc_options_set_accuracy(options, accuracy);
        rtcc_options_set_addressing(options, GetParam() ? RTCC_ADDRESSING_ADDRESS : RTCC_ADDRESSING_HEAP);
        if (of) std::swap(rtr, of);
        const VkResult r = create(options);
        if (of) std::swap(rtr, of);
        rtcc_options_release(options);
        ASSERT_EQ(r, VK_SUCCESS);
        RtrPipelineInfo info;
        rtrGetPipelineInfo(pipeline, &info);
        ASSERT_EQ((info.moduleFlags & RTC_MODULE_CHECKED) != 0, checked || !of);
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

    // The error of a launch, whose scene is declared or not: then nothing looks at it before.
    RtrLaunchError launch_rays(bool declare = true) {
        RtrLaunchError error{};
        vk->begin();
        auto rec = scene->recorder;
        EXPECT_EQ(rtrBeginRecorder(rec, vk->cmd), VK_SUCCESS);
        const RtrAccelerationStructure declared[2] = {top, bottom};
        if (declare) {
            EXPECT_EQ(rtrCmdDeclareScene(rec, 2, declared), VK_SUCCESS);
        }
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
    // Without validation the pipeline is what its options say.
    RtrDeviceCreateInfo info{};
    info.instance = vk->instance;
    info.physicalDevice = vk->physical_device;
    info.device = vk->device;
    info.pfnGetInstanceProcAddr = vk->get_instance_proc_addr;
    info.bufferDeviceAddress = GetParam();
    RtrDevice plain = nullptr;
    ASSERT_EQ(rtrCreateDevice(&info, nullptr, &plain), VK_SUCCESS);
    EXPECT_FALSE(rtrIsValidating(plain));
    EXPECT_TRUE(rtrIsValidating(rtr));
    make_pipeline(false, RTCC_ACCURACY_WATERTIGHT, plain);
    make_table();
    memset(result.data, 0, 4 * kRays);
    ASSERT_EQ(launch_rays().code, RTC_LAUNCH_ERROR_NONE);
    EXPECT_EQ(memcmp(result.data, hits.data(), 4 * kRays), 0);
    rtrDestroyPipeline(plain, pipeline, nullptr);
    pipeline = nullptr;
    rtrDestroyDevice(plain, nullptr);
}

// A device that validates asks for the checking traversal, whatever the options say.
TEST_P(CheckedTest, ValidationLinksIt) {
    make_pipeline(false);
    RtrPipelineInfo info;
    rtrGetPipelineInfo(pipeline, &info);
    EXPECT_NE(info.moduleFlags & RTC_MODULE_CHECKED, 0u);
}

// What the next test is about; the launch declares no scene, so that nothing but the traversal looks.
struct Reference {
    uint32_t kind, instance;
    std::string says;
};

void expect_reported(const RtrLaunchError& error, const Reference& expected) {
    char text[256];
    rtrFormatLaunchError(&error, text, sizeof text);
    EXPECT_EQ(error.code, RTC_LAUNCH_ERROR_BAD_MEMORY);
    EXPECT_GT(error.count, 0u);
    EXPECT_EQ(error.detail[1] >> RTC_BAD_SHIFT, expected.kind) << text;
    EXPECT_EQ(error.detail[1] & RTC_BAD_INSTANCE_MASK, expected.instance) << text;
    EXPECT_NE(std::string(text).find(expected.says), std::string::npos) << text;
}

TEST_P(CheckedTest, ReferencesToNothingAreNamedNotFollowed) {
    constexpr uint32_t in_top = RTC_BAD_INSTANCE_MASK;
    ASSERT_EQ(launch_rays(false).code, RTC_LAUNCH_ERROR_NONE);
    // All instances but 2 keep out of the way.
    auto record = [&](uint32_t i) { return words(top) + 4 * words(top)[RTC_HDR_SLOTS] + 32 * i; };
    for (uint32_t i = 0; i < 5; i++)
        if (i != 2) record(i)[24] = record(i)[25] = 0;
    ASSERT_EQ(launch_rays(false).code, RTC_LAUNCH_ERROR_NONE);
    auto refer = [&](uint64_t base) {
        record(2)[24] = uint32_t(base);
        record(2)[25] = uint32_t(base >> 32);
    };
    const uint64_t at = scene->handle(bottom), page = GetParam() ? 4096 : 4096 / RTC_QUAD_BYTES;
    const uint64_t anywhere[] = {at + (GetParam() ? 256 : 16), at + (GetParam() ? 16 : 1), at - 1, at + 64 * page,
                                 0x18, 0xffffffff, 0x0000123456789a00, 0xfffffffffffff000, ~0ull, scene->handle(top)};
    for (const uint64_t base : anywhere) {
        // In a heap rays do not look at the high word, which says which heap.
        if (!GetParam() && base >> 32 && base >> 32 != at >> 32) continue;
        SCOPED_TRACE(base);
        refer(base);
        if (base == scene->handle(top))
            expect_reported(launch_rays(false), {RTC_BAD_HEADER, 2, "instance 2 a ray met a header that cannot be one"});
        else
            expect_reported(launch_rays(false), {RTC_BAD_BASE, 2, "to no structure that is bound and not destroyed"});
    }
    refer(at);
    ASSERT_EQ(launch_rays(false).code, RTC_LAUNCH_ERROR_NONE);
    // The top level says of itself that it were elsewhere; that is what shaders trace into.
    uint32_t* self = words(top);
    const uint32_t kept[2] = {self[RTC_HDR_SELF_LO], self[RTC_HDR_SELF_HI]};
    for (const uint64_t base : {uint64_t(at - 1), uint64_t(0x0000123456789a00), uint64_t(0x7fffffffffffffff)}) {
        SCOPED_TRACE(base);
        self[RTC_HDR_SELF_LO] = uint32_t(base);
        self[RTC_HDR_SELF_HI] = GetParam() ? uint32_t(base >> 32) : kept[1];
        expect_reported(launch_rays(false), {RTC_BAD_BASE, in_top, "in the top level"});
    }
    self[RTC_HDR_SELF_LO] = kept[0];
    self[RTC_HDR_SELF_HI] = kept[1];
    // A header that is no header of this object: more slots than it has room for, and slots behind it.
    for (const auto& [word, value] : {std::pair{RTC_HDR_SLOT_COUNT, 0x0fffffffu}, std::pair{RTC_HDR_SLOT_COUNT, 400u},
                                     std::pair{RTC_HDR_SLOTS, 0x7fffff00u}, std::pair{RTC_HDR_NODE_COUNT, 100000u}}) {
        SCOPED_TRACE(word);
        const uint32_t before = words(bottom)[word];
        words(bottom)[word] = value;
        expect_reported(launch_rays(false), {RTC_BAD_HEADER, 2, "header that cannot be one"});
        words(bottom)[word] = before;
    }
    ASSERT_EQ(launch_rays(false).code, RTC_LAUNCH_ERROR_NONE);
}

// A structure that is destroyed is met by nobody, whatever lies in its memory by then.
TEST_P(CheckedTest, DestroyedStructuresAreNamed) {
    VkGeometryNV geometry = scene->triangles({{0, 0, 0}, {200, 0, 0}, {0, 200, 0}});
    VkAccelerationStructureCreateInfoNV create_info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_NV};
    VkAccelerationStructureInfoNV& info = create_info.info;
    info.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV;
    info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
    info.geometryCount = 1;
    info.pGeometries = &geometry;
    RtrAccelerationStructure mortal = nullptr;
    ASSERT_EQ(rtrCreateAccelerationStructure(rtr, &create_info, nullptr, &mortal), VK_SUCCESS);
    RtrBindAccelerationStructureMemoryInfo bind{};
    bind.accelerationStructure = mortal;
    const VkDeviceSize place = 1 << 16;  // free in this scene
    if (GetParam())
        bind.buffer = scene->heap_buffer.handle, bind.bufferOffset = place;
    else
        bind.heap = scene->heap, bind.heapOffset = place;
    ASSERT_EQ(rtrBindAccelerationStructureMemory(rtr, 1, &bind), VK_SUCCESS);
    scene->run([&] {
        EXPECT_EQ(rtrCmdBuildAccelerationStructure(scene->recorder, &info, VK_NULL_HANDLE, 0, VK_FALSE, mortal, nullptr,
                                                   scene->scratch.handle, 0),
                  VK_SUCCESS);
    });
    top = scene->build_top({scene->instance(mortal)});
    ASSERT_EQ(rtrUpdateAccelerationStructureDescriptors(rtr, set, 0, 0, 1, &top, nullptr), VK_SUCCESS);
    ASSERT_EQ(launch_rays(false).code, RTC_LAUNCH_ERROR_NONE);
    ASSERT_EQ(result.as<uint32_t>()[0], 1050u);
    const Reference dead{RTC_BAD_BASE, 0, "to no structure that is bound and not destroyed"};
    rtrDestroyAccelerationStructure(rtr, mortal, nullptr);
    expect_reported(launch_rays(false), dead);  // all is still there
    memset(scene->heap_buffer.as<char>(place), 0x7f, 4096);
    expect_reported(launch_rays(false), dead);
    // Its place is another's by now: one that is not built, then one that is.
    ASSERT_EQ(rtrCreateAccelerationStructure(rtr, &create_info, nullptr, &mortal), VK_SUCCESS);
    bind.accelerationStructure = mortal;
    ASSERT_EQ(rtrBindAccelerationStructureMemory(rtr, 1, &bind), VK_SUCCESS);
    expect_reported(launch_rays(false), {RTC_BAD_HEADER, 0, "header that cannot be one"});
    scene->run([&] {
        EXPECT_EQ(rtrCmdBuildAccelerationStructure(scene->recorder, &info, VK_NULL_HANDLE, 0, VK_FALSE, mortal, nullptr,
                                                   scene->scratch.handle, 0),
                  VK_SUCCESS);
    });
    EXPECT_EQ(launch_rays(false).code, RTC_LAUNCH_ERROR_NONE);
    rtrDestroyAccelerationStructure(rtr, mortal, nullptr);
}

// All tiers look before they read.
TEST_P(CheckedTest, EveryTierChecksSlots) {
    const uint32_t nodes = 4 * RTC_AS_HEADER_QUADS;
    for (const auto accuracy : {RTCC_ACCURACY_FAST, RTCC_ACCURACY_WATERTIGHT, RTCC_ACCURACY_EXACT}) {
        SCOPED_TRACE(accuracy);
        make_pipeline(true, accuracy);
        make_table();
        ASSERT_EQ(launch_rays(false).code, RTC_LAUNCH_ERROR_NONE);
        words(bottom)[nodes + 3] = RTC_REF_LEAF | 1u << RTC_REF_COUNT_SHIFT | 0x0ffffff0u;
        float* box = reinterpret_cast<float*>(words(bottom)) + nodes;
        for (int k = 0; k < 3; k++) box[k] = -1e4f, box[4 + k] = 1e4f;
        const RtrLaunchError error = launch_rays(false);
        EXPECT_EQ(error.code, RTC_LAUNCH_ERROR_BAD_MEMORY);
        EXPECT_EQ(error.detail[1] >> RTC_BAD_SHIFT, RTC_BAD_SLOT);
        restore();
    }
}

// The table of what is alive needs room: more structures than rtrGetRecorderControlSize knew of are refused.
TEST_P(CheckedTest, AFullControlRegionIsNamed) {
    const VkDeviceSize before = rtrGetRecorderControlSize(rtr, 1, 1, 16);
    VkAccelerationStructureCreateInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_NV};
    info.info.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV;
    info.info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
    std::vector<RtrAccelerationStructure> many(3000);
    for (auto& as : many) {
        ASSERT_EQ(rtrCreateAccelerationStructure(rtr, &info, nullptr, &as), VK_SUCCESS);
        RtrBindAccelerationStructureMemoryInfo bind{};
        bind.accelerationStructure = as;
        if (GetParam())
            bind.buffer = scene->heap_buffer.handle, bind.bufferOffset = 1 << 16;
        else
            bind.heap = scene->heap, bind.heapOffset = 1 << 16;
        ASSERT_EQ(rtrBindAccelerationStructureMemory(rtr, 1, &bind), VK_SUCCESS);
    }
    const VkDeviceSize after = rtrGetRecorderControlSize(rtr, 1, 1, 16);
    EXPECT_GE(after, 3000u * 16u);
    EXPECT_GT(after, before);
    for (const VkDeviceSize size : {before, after}) {
        SCOPED_TRACE(size);
        Buffer control = vk->buffer(size, RTR_CONTROL_BUFFER_USAGE);
        RtrRecorderCreateInfo recorder_info{};
        recorder_info.controlBuffer = control.handle;
        recorder_info.controlSize = size;
        RtrRecorder small = nullptr;
        ASSERT_EQ(rtrCreateRecorder(rtr, &recorder_info, nullptr, &small), VK_SUCCESS);
        std::swap(scene->recorder, small);
        std::swap(scene->control, control);
        if (size == after) {
            EXPECT_EQ(launch_rays(false).code, RTC_LAUNCH_ERROR_NONE);
        } else {
            vk->begin();
            EXPECT_EQ(rtrBeginRecorder(scene->recorder, vk->cmd), VK_SUCCESS);
            rtrCmdBindPipeline(scene->recorder, pipeline);
            rtrCmdBindDescriptorSets(scene->recorder, 0, 1, &set, 0, nullptr);
            if (scene->heap) rtrCmdSetHeap(scene->recorder, scene->heap);
            if (scratch_size) rtrCmdSetLaunchScratch(scene->recorder, scratch.handle, 0, scratch_size);
            rtrCmdSetLaunchLimits(scene->recorder, 0, 16);
            EXPECT_EQ(rtrCmdTraceRays(scene->recorder, sbt.handle, table.raygen.offset, sbt.handle, table.miss.offset,
                                      table.miss.stride, sbt.handle, table.hit.offset, table.hit.stride,
                                      VK_NULL_HANDLE, 0, 0, kRays, 1, 1),
                      VK_ERROR_OUT_OF_POOL_MEMORY);
            vk->submit();
            EXPECT_EQ(rtrRetireRecorder(scene->recorder), VK_SUCCESS);
        }
        std::swap(scene->recorder, small);
        std::swap(scene->control, control);
        rtrDestroyRecorder(rtr, small, nullptr);
        vk->destroy(control);
    }
    for (auto as : many) rtrDestroyAccelerationStructure(rtr, as, nullptr);
    ASSERT_EQ(launch_rays().code, RTC_LAUNCH_ERROR_NONE);
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
        const RtrLaunchError error = launch_rays(i % 2 == 0);  // looked at before the launch, or by the traversal alone
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
