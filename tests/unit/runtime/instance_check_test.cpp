// RtrDeviceCreateInfo::validation: references of instances that lead to no living bottom level
// are never followed, and launches tell of them.
#include <algorithm>
#include <cmath>

#include "launch_fixture.h"
#include "module_util.h"
#include "scene_util.h"
#include "spv/module_trace.h"
#include "spv/module_trace_address.h"

namespace {

class InstanceCheckTest : public ValidatedLaunchTest {
  protected:
    InstanceCheckTest() : ValidatedLaunchTest(true, true) {}

    std::vector<bool> modes() const {
        return vk->GetBufferDeviceAddress ? std::vector<bool>{false, true} : std::vector<bool>{false};
    }

    static VkGeometryNV triangle(Scene& scene) {
        return scene.triangles({{-1, -1, 1}, {1, -1, 1}, {0, 1, 1}});
    }

    // A bound bottom level that nothing is built into and that the scene does not own.
    RtrAccelerationStructure unbuilt(Scene& scene, const VkGeometryNV& geometry) {
        VkAccelerationStructureCreateInfoNV create{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_NV};
        create.info.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV;
        create.info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
        create.info.geometryCount = 1;
        create.info.pGeometries = &geometry;
        RtrAccelerationStructure as = nullptr;
        EXPECT_EQ(rtrCreateAccelerationStructure(rtr, &create, nullptr, &as), VK_SUCCESS);
        scene.bind(as);
        return as;
    }

    void build(Scene& scene, RtrAccelerationStructure as, const VkGeometryNV& geometry) {
        VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
        info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
        info.geometryCount = 1;
        info.pGeometries = &geometry;
        Buffer scratch = vk->buffer(scene.scratch_size(as), RTR_SCRATCH_BUFFER_USAGE);
        scene.run([&] {
            EXPECT_EQ(rtrCmdBuildAccelerationStructure(scene.recorder, &info, VK_NULL_HANDLE, 0, VK_FALSE, as,
                                                       nullptr, scratch.handle, 0),
                      VK_SUCCESS);
        });
    }

    // One ray along z at the triangle; hits[0].t is 0 where nothing ran.
    void prepare(Scene& scene, RtrAccelerationStructure top) {
        const float ray[8] = {0, 0, 0, 0, 0, 0, 1, 1e30f};
        rays_ = scene.upload(ray, sizeof ray);
        hits_ = scene.upload(nullptr, 256);
        sbt_ = scene.upload(nullptr, 1024);
        memset(sbt_.data, 0, 1024);
        if (!layout) make_set(3);
        VkDescriptorBufferInfo header;
        ASSERT_EQ(rtrGetAccelerationStructureDescriptor(rtr, top, &header), VK_SUCCESS);
        write(0, header);
        write(1, {rays_.handle, 0, VK_WHOLE_SIZE});
        write(2, {hits_.handle, 0, VK_WHOLE_SIZE});
        rtrDestroyPipeline(rtr, pipeline, nullptr);
        RtcModuleHeader h = module_header(1u << RTC_BINDING_PARAMS | 1u << RTC_BINDING_CONTROL, 1);
        std::vector<uint32_t> code;
        if (scene.address_mode) {
            h.flags = RTC_MODULE_ADDRESS_MODE;
            code = with_reflection(module_trace_address_spv, sizeof module_trace_address_spv, h, "{}");
        } else {
            h.used_bindings |= 1u << RTC_BINDING_HEAP_TEXELS | 1u << RTC_BINDING_HEAP;
            code = with_reflection(module_trace_spv, sizeof module_trace_spv, h, "{}");
        }
        ASSERT_EQ(make_pipeline(code, 4), VK_SUCCESS);
        if (rtrGetDeviceSupport(rtr)->needsResumableModules) expect_runtime_error("not-resumable");
        uint32_t handle[8];
        ASSERT_EQ(rtrGetRayTracingShaderGroupHandles(rtr, pipeline, 0, 1, 32, handle), VK_SUCCESS);
        memcpy(sbt_.data, handle, 32);
    }

    void record_launch(Scene& scene) {
        uint32_t first = 0;
        memset(hits_.data, 0, 256);
        rtrCmdBindPipeline(scene.recorder, pipeline);
        rtrCmdBindDescriptorSets(scene.recorder, 0, 1, &set, 0, nullptr);
        rtrCmdPushConstants(scene.recorder, 0, 4, &first);
        if (!scene.address_mode) rtrCmdSetHeap(scene.recorder, scene.heap);
        RtrStridedBufferRegion raygen{sbt_.handle, 0, 0, 32};
        EXPECT_EQ(rtrCmdTraceRaysRegions(scene.recorder, &raygen, nullptr, nullptr, nullptr, 1, 1, 1), VK_SUCCESS);
        VkDescriptorBufferInfo place;
        EXPECT_EQ(rtrGetLaunchErrorLocation(scene.recorder, 0, &place), VK_SUCCESS);
        at_ = place.offset;
    }

    RtrLaunchError error(Scene& scene) {
        RtrLaunchError e;
        rtrDecodeLaunchError(scene.control.as<uint32_t>(at_), &e);
        char text[256];
        rtrFormatLaunchError(&e, text, sizeof text);
        said = text;
        return e;
    }

    RtrLaunchError launch(Scene& scene, const std::vector<RtrAccelerationStructure>& declared) {
        scene.run([&] {
            EXPECT_EQ(rtrCmdDeclareScene(scene.recorder, static_cast<uint32_t>(declared.size()), declared.data()),
                      VK_SUCCESS);
            record_launch(scene);
        });
        return error(scene);
    }

    bool ran() const { return hits_.as<uint32_t>()[0] != 0; }

    std::string said;

  private:
    Buffer rays_, hits_, sbt_;
    VkDeviceSize at_ = 0;
};

const uint32_t* record_of(const Scene& scene, RtrAccelerationStructure top, uint32_t instance) {
    const uint32_t* w = scene.words(top);
    return w + 4 * (w[RTC_HDR_SLOTS] + RTC_INSTANCE_QUADS * instance);
}

TEST_F(InstanceCheckTest, OnlyLivingBottomLevelsAreFollowed) {
    for (bool address : modes()) {
        SCOPED_TRACE(address ? "address mode" : "heap mode");
        Scene scene(*vk, rtr, 4 << 20, address);
        auto geometry = triangle(scene);
        std::vector<RtrAccelerationStructure> extra;  // so many that the table comes in pieces
        for (int i = 0; i < 150; i++) extra.push_back(unbuilt(scene, geometry));
        auto one = scene.build_bottom({geometry});
        for (int i = 0; i < 150; i++) extra.push_back(unbuilt(scene, geometry));
        auto two = scene.build_bottom({geometry});
        auto gone = unbuilt(scene, geometry);
        build(scene, gone, geometry);
        auto gone_instance = scene.instance(gone);
        rtrDestroyAccelerationStructure(rtr, gone, nullptr);
        auto top = scene.build_top({scene.instance(one)});

        auto bad = [&](uint64_t reference) {
            auto i = scene.instance(one);
            i.accelerationStructureReference = reference;
            return i;
        };
        const uint64_t live = scene.handle(one);
        std::vector<VkAccelerationStructureInstanceNV> instances = {
            scene.instance(one),   scene.instance(nullptr), scene.instance(two), gone_instance,
            scene.instance(top),   scene.instance(extra[7]), bad(live + 16),     bad(0x7ffff0000000ull),
            bad(~0ull),            bad(1),                  scene.instance(two)};
        const uint32_t good[] = {0, 2, 10};
        for (auto flags : {VkBuildAccelerationStructureFlagsNV(0),
                           VkBuildAccelerationStructureFlagsNV(VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV)}) {
            auto as = scene.build_top(instances, flags);
            const uint32_t* w = scene.words(as);
            EXPECT_EQ(w[RTC_HDR_ACTIVE_COUNT], 3u);
            EXPECT_EQ(w[RTC_HDR_BAD_INSTANCE], 3u + 1);
            for (uint32_t i = 0; i < instances.size(); i++) {
                const uint32_t* q = record_of(scene, as, i) + 24;
                bool is_good = std::count(std::begin(good), std::end(good), i) != 0;
                EXPECT_EQ(q[0] | uint64_t(q[1]) << 32, is_good ? instances[i].accelerationStructureReference : 0)
                    << i;
            }
            TreeFacts facts;
            check_structure(scene, as, facts);
        }
        // An update finds what has gone bad since.
        auto as = scene.build_top({scene.instance(one), scene.instance(two)},
                                  VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV);
        EXPECT_EQ(scene.words(as)[RTC_HDR_BAD_INSTANCE], 0u);
        VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
        info.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
        info.flags = VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV;
        info.instanceCount = 2;
        VkAccelerationStructureInstanceNV changed[2] = {scene.instance(one), gone_instance};
        Buffer data = scene.upload(changed, sizeof changed);
        Buffer scratch = vk->buffer(scene.scratch_size(as, true), RTR_SCRATCH_BUFFER_USAGE);
        scene.run([&] {
            EXPECT_EQ(rtrCmdBuildAccelerationStructure(scene.recorder, &info, data.handle, 0, VK_TRUE, as, nullptr,
                                                       scratch.handle, 0),
                      VK_SUCCESS);
        });
        EXPECT_EQ(scene.words(as)[RTC_HDR_BAD_INSTANCE], 1u + 1);
        EXPECT_EQ(record_of(scene, as, 1)[24], 0u);
        EXPECT_NE(record_of(scene, as, 0)[24], 0u);
        for (auto e : extra) rtrDestroyAccelerationStructure(rtr, e, nullptr);
    }
}

TEST_F(InstanceCheckTest, LaunchesTellOfThem) {
    for (bool address : modes()) {
        SCOPED_TRACE(address ? "address mode" : "heap mode");
        Scene scene(*vk, rtr, 1 << 20, address);
        auto geometry = triangle(scene);
        auto one = scene.build_bottom({geometry});
        auto passing = unbuilt(scene, geometry);
        build(scene, passing, geometry);
        auto instances = std::vector{scene.instance(one), scene.instance(passing)};
        auto top = scene.build_top(instances), other = scene.build_top({scene.instance(one)});
        prepare(scene, top);
        EXPECT_EQ(launch(scene, {other, top}).code, RTC_LAUNCH_ERROR_NONE) << said;
        EXPECT_TRUE(ran());

        // Gone since the build: found where the scene is declared.
        rtrDestroyAccelerationStructure(rtr, passing, nullptr);
        auto e = launch(scene, {other, top});
        EXPECT_EQ(e.code, RTC_LAUNCH_ERROR_BAD_INSTANCE);
        EXPECT_EQ(e.detail[0], 1u);
        EXPECT_EQ(e.detail[1], 1u);
        EXPECT_FALSE(ran());
        EXPECT_NE(said.find("instance 1 of structure 1 of rtrCmdDeclareScene"), std::string::npos) << said;
        EXPECT_EQ(launch(scene, {other}).code, RTC_LAUNCH_ERROR_NONE) << said;
        EXPECT_TRUE(ran());

        // Built with it in the recording of the launch: found without a word.
        VkAccelerationStructureInfoNV info{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
        info.type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;
        info.instanceCount = 2;
        Buffer data = scene.upload(instances.data(), instances.size() * sizeof instances[0]);
        Buffer scratch = vk->buffer(scene.scratch_size(top), RTR_SCRATCH_BUFFER_USAGE);
        auto build_and_launch = [&] {
            scene.run([&] {
                EXPECT_EQ(rtrCmdBuildAccelerationStructure(scene.recorder, &info, data.handle, 0, VK_FALSE, top,
                                                           nullptr, scratch.handle, 0),
                          VK_SUCCESS);
                record_launch(scene);
            });
            return error(scene);
        };
        e = build_and_launch();
        EXPECT_EQ(e.code, RTC_LAUNCH_ERROR_BAD_INSTANCE);
        EXPECT_EQ(e.detail[0], 1u);
        EXPECT_EQ(e.detail[1], RTC_ERROR_BUILT);
        EXPECT_FALSE(ran());
        EXPECT_NE(said.find("structure that this recording built"), std::string::npos) << said;
        // A later launch does not know of it, and the instance is inactive.
        scene.run([&] { record_launch(scene); });
        EXPECT_EQ(error(scene).code, RTC_LAUNCH_ERROR_NONE);
        EXPECT_TRUE(ran());
        data.as<VkAccelerationStructureInstanceNV>()[1] = scene.instance(one);
        EXPECT_EQ(build_and_launch().code, RTC_LAUNCH_ERROR_NONE) << said;
        EXPECT_TRUE(ran());

        // An update that makes active what the build left out.
        const VkBuildAccelerationStructureFlagsNV updatable = VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV;
        const float nan = std::nanf("");
        auto moving = scene.build_bottom({scene.triangles({{-1, -1, 1}, {1, -1, 1}, {0, 1, 1}, {nan, 0, 0}, {1, 0, 0}, {0, 1, 0}})}, updatable);
        auto good = scene.triangles({{-1, -1, 1}, {1, -1, 1}, {0, 1, 1}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
        VkAccelerationStructureInfoNV bottom{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
        bottom.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
        bottom.flags = updatable;
        bottom.geometryCount = 1;
        bottom.pGeometries = &good;
        scene.run([&] {
            EXPECT_EQ(rtrCmdBuildAccelerationStructure(scene.recorder, &bottom, VK_NULL_HANDLE, 0, VK_TRUE, moving,
                                                       nullptr, scratch.handle, 0),
                      VK_SUCCESS);
            record_launch(scene);
        });
        e = error(scene);
        EXPECT_EQ(e.code, RTC_LAUNCH_ERROR_BAD_UPDATE);
        EXPECT_EQ(e.detail[0], RTC_BAD_UPDATE_ACTIVE);
        EXPECT_FALSE(ran());
        EXPECT_NE(said.find("made inactive primitives active"), std::string::npos) << said;

        // A declared structure that nothing was built into.
        VkAccelerationStructureInfoNV empty = info;
        auto never = scene.create(empty);
        EXPECT_EQ(launch(scene, {never}).code, RTC_LAUNCH_ERROR_ABI);
        EXPECT_FALSE(ran());
    }
}

}  // namespace
