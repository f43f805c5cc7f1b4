// Launches through hand-written modules: traversal of built structures against brute
// force, lanes, rounds, tiles, shader binding tables, launch errors.
#include <algorithm>
#include <cmath>
#include <random>

#include "launch_fixture.h"
#include "module_util.h"
#include "scene_util.h"
#include "spv/module_resume.h"
#include "spv/module_resume_in_set.h"
#include "spv/module_trace.h"

namespace {

constexpr uint32_t kAllUsed = 1u << RTC_BINDING_PARAMS | 1u << RTC_BINDING_HEAP_TEXELS |
                              1u << RTC_BINDING_HEAP | 1u << RTC_BINDING_SBT_RAYGEN |
                              1u << RTC_BINDING_SBT_HIT | 1u << RTC_BINDING_CONTROL |
                              1u << RTC_BINDING_SCRATCH;

class TraceTest : public LaunchTest {};

struct Ray {
    float o[3], tmin, d[3], tmax;
};
struct Hit {
    uint32_t t, instance, geometry, primitive;
};

// Brute force in double over transformed triangles.
struct FlatTriangle {
    double v[3][3];
    uint32_t instance, geometry, primitive;
};
double closest(const Ray& r, const std::vector<FlatTriangle>& triangles) {
    double best = r.tmax;
    for (auto& t : triangles) {
        double e1[3], e2[3], tv[3], pv[3], qv[3];
        for (int k = 0; k < 3; k++) {
            e1[k] = t.v[1][k] - t.v[0][k];
            e2[k] = t.v[2][k] - t.v[0][k];
            tv[k] = r.o[k] - t.v[0][k];
        }
        auto cross = [](const double* a, const auto* b, double* c) {
            for (int k = 0; k < 3; k++)
                c[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
        };
        auto dot = [](const double* a, const auto* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
        double d[3] = {r.d[0], r.d[1], r.d[2]};
        cross(d, e2, pv);
        double det = dot(e1, pv);
        if (det == 0) continue;
        double u = dot(tv, pv) / det;
        cross(tv, e1, qv);
        double v = dot(d, qv) / det, at = dot(e2, qv) / det;
        if (u >= 0 && v >= 0 && u + v <= 1 && at > 0 && at < best) best = at;
    }
    return best;
}

TEST_F(TraceTest, ClosestHitsMatchBruteForce) {
    for (int fetch : {RTR_FETCH_TEXEL, RTR_FETCH_STORAGE}) {
        for (int fast_build : {0, 1}) {
            SCOPED_TRACE(fetch * 2 + fast_build);
            VkBuildAccelerationStructureFlagsNV flags =
                fast_build ? VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_BUILD_BIT_NV : 0;
            Scene scene(*vk, rtr, 4 << 20);
            std::mt19937 rng(42);
            std::uniform_real_distribution<float> u(-1, 1);
            std::vector<Vec3> meshes[3];
            std::vector<RtrAccelerationStructure> bottoms;
            for (int m = 0; m < 3; m++) {
                for (int i = 0; i < (m + 1) * 150; i++) {
                    Vec3 c{u(rng), u(rng), u(rng)};
                    for (int k = 0; k < 3; k++)
                        meshes[m].push_back({c.x + 0.2f * u(rng), c.y + 0.2f * u(rng), c.z + 0.2f * u(rng)});
                }
                bottoms.push_back(scene.build_bottom({scene.triangles(meshes[m])}, flags));
            }
            std::vector<VkAccelerationStructureInstanceNV> instances;
            std::vector<FlatTriangle> flat;
            for (uint32_t i = 0; i < 12; i++) {
                auto instance = scene.instance(i == 5 ? nullptr : bottoms[i % 3]);
                for (int r = 0; r < 3; r++)
                    for (int c = 0; c < 4; c++)
                        instance.transform.matrix[r][c] = u(rng) * (c == 3 ? 3 : 0.4f) + (r == c ? 1 : 0);
                instances.push_back(instance);
                if (i == 5) continue;
                auto& mesh = meshes[i % 3];
                for (uint32_t p = 0; p < mesh.size() / 3; p++) {
                    FlatTriangle t{};
                    t.instance = i;
                    t.primitive = p;
                    for (int v = 0; v < 3; v++)
                        for (int r = 0; r < 3; r++) {
                            auto& m = instance.transform.matrix[r];
                            auto& x = mesh[3 * p + v];
                            t.v[v][r] = double(m[0]) * x.x + double(m[1]) * x.y + double(m[2]) * x.z + m[3];
                        }
                    flat.push_back(t);
                }
            }
            auto top = scene.build_top(instances, flags);

            const uint32_t w = 20, h = 17, depth = 2;
            std::vector<Ray> rays(w * h * depth);
            for (auto& r : rays) {
                r = {{6 * u(rng), 6 * u(rng), 6 * u(rng)}, 0, {}, 1e30f};
                float target[3] = {2 * u(rng), 2 * u(rng), 2 * u(rng)};
                for (int k = 0; k < 3; k++) r.d[k] = target[k] - r.o[k];
            }
            Buffer ray_buffer = scene.upload(rays.data(), rays.size() * sizeof(Ray));
            Buffer hit_buffer = scene.upload(nullptr, rays.size() * sizeof(Hit));
            if (!layout) make_set(3);
            VkDescriptorBufferInfo header;
            ASSERT_EQ(rtrGetAccelerationStructureDescriptor(rtr, top, &header), VK_SUCCESS);
            write(0, header);
            write(1, {ray_buffer.handle, 0, VK_WHOLE_SIZE});
            write(2, {hit_buffer.handle, 0, VK_WHOLE_SIZE});

            RtcModuleHeader h0 = module_header(1u << RTC_BINDING_PARAMS | 1u << RTC_BINDING_HEAP_TEXELS |
                                                   1u << RTC_BINDING_HEAP | 1u << RTC_BINDING_CONTROL,
                                               1);
            RtrTraceOptions options = RTR_TRACE_OPTIONS_DEFAULT;
            options.fetch = static_cast<RtrFetch>(fetch);
            options.workgroupSize = 64;
            rtrDestroyPipeline(rtr, pipeline, nullptr);
            ASSERT_EQ(make_pipeline(with_reflection(module_trace_spv, sizeof module_trace_spv, h0, ""), 4,
                                    &options),
                      VK_SUCCESS);
            if (rtrGetDeviceSupport(rtr)->needsResumableModules) expect_runtime_error("not-resumable");
            Buffer sbt = scene.upload(nullptr, 256);
            uint32_t first = 0;
            scene.run([&] {
                auto rec = scene.recorder;
                rtrCmdBindPipeline(rec, pipeline);
                rtrCmdBindDescriptorSets(rec, 0, 1, &set, 0, nullptr);
                rtrCmdPushConstants(rec, 0, 4, &first);
                EXPECT_EQ(rtrCmdSetHeap(rec, scene.heap), VK_SUCCESS);
                EXPECT_EQ(rtrCmdTraceRays(rec, sbt.handle, 0, VK_NULL_HANDLE, 0, 0, VK_NULL_HANDLE, 0, 0,
                                          VK_NULL_HANDLE, 0, 0, w, h, depth),
                          VK_SUCCESS);
            });
            int hit_count = 0;
            for (size_t i = 0; i < rays.size(); i++) {
                const Hit& hit = hit_buffer.as<Hit>()[i];
                double expected = closest(rays[i], flat);
                if (expected >= 1e30) {
                    EXPECT_EQ(hit.t, 0xffffffffu) << "ray " << i;
                } else {
                    float t;
                    memcpy(&t, &hit.t, 4);
                    EXPECT_NEAR(t, expected, 1e-3) << "ray " << i;
                    hit_count++;
                }
            }
            EXPECT_GT(hit_count, 100);
        }
    }
}

TEST_F(TraceTest, NullStructureMisses) {
    Scene scene(*vk, rtr, 1 << 16);
    Ray ray{{0, 0, 0}, 0, {0, 0, 1}, 1e30f};
    Buffer rays = scene.upload(&ray, sizeof ray), hits = scene.upload(&ray, sizeof(Hit)),
           sbt = scene.upload(nullptr, 64);
    make_set(3);
    VkDescriptorBufferInfo header;
    ASSERT_EQ(rtrGetNullAccelerationStructureDescriptor(rtr, scene.heap, &header), VK_SUCCESS);
    EXPECT_EQ(header.buffer, scene.heap_buffer.handle);
    RtrAccelerationStructure none = nullptr;
    EXPECT_EQ(rtrUpdateAccelerationStructureDescriptors(rtr, set, 0, 0, 1, &none, nullptr),
              VK_ERROR_VALIDATION_FAILED_EXT);
    expect_runtime_error("not-bound");
    EXPECT_EQ(rtrUpdateAccelerationStructureDescriptors(rtr, set, 0, 0, 1, &none, scene.heap), VK_SUCCESS);
    write(1, {rays.handle, 0, VK_WHOLE_SIZE});
    write(2, {hits.handle, 0, VK_WHOLE_SIZE});
    ASSERT_EQ(
        make_pipeline(with_reflection(module_trace_spv, sizeof module_trace_spv,
                                      module_header(1u << RTC_BINDING_PARAMS | 1u << RTC_BINDING_HEAP_TEXELS |
                                                        1u << RTC_BINDING_HEAP | 1u << RTC_BINDING_CONTROL,
                                                    1),
                                      "", 1),
                      4),
        VK_SUCCESS);
    if (rtrGetDeviceSupport(rtr)->needsResumableModules) expect_runtime_error("not-resumable");
    uint32_t first = 0;
    scene.run([&] {
        rtrCmdBindPipeline(scene.recorder, pipeline);
        rtrCmdBindDescriptorSets(scene.recorder, 0, 1, &set, 0, nullptr);
        rtrCmdPushConstants(scene.recorder, 0, 4, &first);
        rtrCmdSetHeap(scene.recorder, scene.heap);
        EXPECT_EQ(rtrCmdTraceRays(scene.recorder, sbt.handle, 0, VK_NULL_HANDLE, 0, 0, VK_NULL_HANDLE, 0, 0,
                                  VK_NULL_HANDLE, 0, 0, 1, 1, 1),
                  VK_SUCCESS);
    });
    EXPECT_EQ(hits.as<Hit>()->t, 0xffffffffu);
}

// More elements than one call writes at once: the last one is a structure, the rest are null.
TEST_F(TraceTest, ArraysOfStructures) {
    Scene scene(*vk, rtr, 1 << 16);
    auto as = scene.build_bottom({scene.triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}})});
    make_set(1, {{1, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 90, VK_SHADER_STAGE_COMPUTE_BIT, nullptr}});
    std::vector<RtrAccelerationStructure> all(90, nullptr);
    all[89] = as;
    EXPECT_EQ(rtrUpdateAccelerationStructureDescriptors(rtr, set, 1, 0, 90, all.data(), scene.heap),
              VK_SUCCESS);
    VkAccelerationStructureCreateInfoNV create{VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_NV};
    create.info.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV;
    RtrAccelerationStructure unbound = nullptr;
    ASSERT_EQ(rtrCreateAccelerationStructure(rtr, &create, nullptr, &unbound), VK_SUCCESS);
    all[3] = unbound;
    EXPECT_EQ(rtrUpdateAccelerationStructureDescriptors(rtr, set, 1, 0, 90, all.data(), scene.heap),
              VK_ERROR_VALIDATION_FAILED_EXT);
    expect_runtime_error("not-bound");
    rtrDestroyAccelerationStructure(rtr, unbound, nullptr);
}

TEST_F(TraceTest, DeferredCompilation) {
    Scene scene(*vk, rtr, 1 << 16);
    Buffer result = scene.upload(nullptr, 4096), sbt = scene.upload(nullptr, 4096),
           scratch = scene.upload(nullptr, 1 << 16);
    memset(result.data, 0, result.size);
    RtcModuleHeader h = module_header(kAllUsed, 2);
    h.flags = RTC_MODULE_RESUMABLE;
    h.scratch_words = 1;
    h.stack_words = 5;
    make_set(1);
    write(0, {result.handle, 0, VK_WHOLE_SIZE});
    uint32_t app_constant = 3;
    VkSpecializationMapEntry entry{7, 0, 4};
    VkSpecializationInfo specialization{1, &entry, 4, &app_constant};
    {
        // Nothing of the application's is used after the creation.
        auto code = with_reflection(module_resume_spv, sizeof module_resume_spv, h, "{}");
        ASSERT_EQ(make_pipeline(code, 8, nullptr, &specialization, nullptr,
                                VK_PIPELINE_CREATE_DEFER_COMPILE_BIT_NV),
                  VK_SUCCESS);
        std::fill(code.begin(), code.end(), 0u);
        app_constant = 0;
        specialization = {};
    }
    EXPECT_EQ(rtrGetRayTracingShaderGroupStackSize(rtr, pipeline, 0, VK_SHADER_GROUP_SHADER_GENERAL_KHR), 20u);
    EXPECT_EQ(rtrGetRayTracingShaderGroupStackSize(rtr, pipeline, 1, VK_SHADER_GROUP_SHADER_CLOSEST_HIT_KHR),
              0u);
    EXPECT_EQ(rtrGetRayTracingShaderGroupStackSize(rtr, pipeline, 2, VK_SHADER_GROUP_SHADER_GENERAL_KHR), 0u);
    auto trace = [&] {
        return rtrCmdTraceRays(scene.recorder, sbt.handle, 0, VK_NULL_HANDLE, 0, 0, sbt.handle, 0, 64,
                               VK_NULL_HANDLE, 0, 0, 5, 1, 1);
    };
    auto record = [&] {
        rtrCmdBindPipeline(scene.recorder, pipeline);
        rtrCmdBindDescriptorSets(scene.recorder, 0, 1, &set, 0, nullptr);
        uint32_t push[2] = {3, 0};
        rtrCmdPushConstants(scene.recorder, 0, 8, push);
        rtrCmdSetHeap(scene.recorder, scene.heap);
        rtrCmdSetLaunchScratch(scene.recorder, scratch.handle, 0, scratch.size);
    };
    EXPECT_EQ(rtrCmdSetRayTracingPipelineStackSize(scene.recorder, 20), VK_SUCCESS);
    scene.run([&] {
        record();
        EXPECT_EQ(trace(), VK_ERROR_VALIDATION_FAILED_EXT);
        expect_runtime_error("not-compiled");
    });
    ASSERT_EQ(rtrCompileDeferred(rtr, pipeline, 0, nullptr), VK_SUCCESS);
    EXPECT_EQ(rtrCompileDeferred(rtr, pipeline, 1, nullptr), VK_SUCCESS);
    scene.run([&] {
        record();
        EXPECT_EQ(rtrCmdSetRayTracingPipelineStackSize(scene.recorder, 19), VK_SUCCESS);
        EXPECT_EQ(trace(), VK_ERROR_VALIDATION_FAILED_EXT);
        expect_runtime_error("stack-size");
        EXPECT_EQ(rtrCmdSetRayTracingPipelineStackSize(scene.recorder, 20), VK_SUCCESS);
        EXPECT_EQ(trace(), VK_SUCCESS);
    });
    EXPECT_NE(result.as<uint32_t>()[0], 0u);
}

class ResumeTest : public TraceTest {
  protected:
    struct Run {
        uint32_t w = 37, h = 21, d = 1, turns = 100, mask = 63, budget = 16, rounds = 32;
        uint64_t tile = 0;
        VkDeviceSize scratch = 1 << 20;
        VkResult expected = VK_SUCCESS;
        int launches = 1;
        bool in_set = false;
        uint32_t max[3] = {0, 0, 0};  // indirect when set
        uint32_t tiles = 1;           // of a launch of w x h x d
    };

    void run(const Run& c) {
        Scene scene(*vk, rtr, 1 << 16);
        Buffer result = scene.upload(nullptr, 16ull * c.w * c.h * c.d), sbt = scene.upload(nullptr, 4096);
        memset(result.data, 0, result.size);
        Buffer scratch = scene.upload(nullptr, c.scratch);
        RtcModuleHeader h = module_header(kAllUsed, 2);
        h.flags = RTC_MODULE_RESUMABLE;
        h.scratch_words = 1;
        if (c.in_set) h.reserved_set = 0, h.reserved_binding = 20;
        auto code = c.in_set
                        ? with_reflection(module_resume_in_set_spv, sizeof module_resume_in_set_spv, h, "{}")
                        : with_reflection(module_resume_spv, sizeof module_resume_spv, h, "{\"a\": 1}");
        std::vector<VkDescriptorSetLayoutBinding> reserved;
        if (c.in_set) {
            uint32_t set_index = 9, count = 0;
            ASSERT_EQ(rtrGetReservedBindings(rtr, code.data(), code.size() * 4, &set_index, &count, nullptr),
                      VK_SUCCESS);
            EXPECT_EQ(set_index, 0u);
            reserved.resize(count);
            ASSERT_EQ(
                rtrGetReservedBindings(rtr, code.data(), code.size() * 4, nullptr, &count, reserved.data()),
                VK_SUCCESS);
        }
        make_set(1, reserved);
        write(0, {result.handle, 0, VK_WHOLE_SIZE});
        RtrTraceOptions options = RTR_TRACE_OPTIONS_DEFAULT;
        options.stepBudget = c.budget;
        options.workgroupSize = 32;
        uint32_t app_constant = 3;
        VkSpecializationMapEntry entry{7, 0, 4};
        VkSpecializationInfo specialization{1, &entry, 4, &app_constant};
        ASSERT_EQ(make_pipeline(code, 8, &options, &specialization), VK_SUCCESS);

        EXPECT_EQ(rtrGetLaunchTileCount(rtr, pipeline, c.w, c.h, c.d, c.scratch, c.tile), c.tiles);
        EXPECT_EQ(rtrGetLaunchTileCount(rtr, pipeline, c.w, 0, c.d, c.scratch, c.tile), 0u);
        EXPECT_EQ(rtrGetLaunchTileCount(rtr, pipeline, 65536, 65536, 1, c.scratch, c.tile), 0u);

        // Hit record 1 carries data; the table lies at an odd place of its buffer.
        uint32_t data[4] = {11, 22, 33, 44};
        RtrSbtRecord raygen{0, 0, nullptr}, hits[2] = {{1, 4, &data[0]}, {1, 12, &data[1]}};
        RtrSbtInfo sbt_info{};
        sbt_info.raygenCount = 1;
        sbt_info.pRaygen = &raygen;
        sbt_info.hitCount = 2;
        sbt_info.pHit = hits;
        RtrSbtLayout table;
        ASSERT_EQ(rtrGetSbtLayout(rtr, &sbt_info, &table), VK_SUCCESS);
        EXPECT_EQ(table.hit.stride, 64u);
        ASSERT_EQ(rtrWriteSbt(rtr, pipeline, &sbt_info, &table, sbt.as<char>(320)), VK_SUCCESS);
        if (c.in_set) {
            RtrReservedDescriptors d{};
            d.heap = scene.heap;
            d.recorder = scene.recorder;
            d.raygenBuffer = d.hitBuffer = sbt.handle;
            d.launchScratch = scratch.handle;
            d.launchScratchSize = c.scratch;
            ASSERT_EQ(rtrWriteReservedDescriptors(rtr, pipeline, set, &d), VK_SUCCESS);
        }
        vk->begin();
        ASSERT_EQ(rtrBeginRecorder(scene.recorder, vk->cmd), VK_SUCCESS);
        auto rec = scene.recorder;
        rtrCmdBindPipeline(rec, pipeline);
        rtrCmdBindDescriptorSets(rec, 0, 1, &set, 0, nullptr);
        uint32_t push[2] = {c.turns, c.mask};
        rtrCmdPushConstants(rec, 0, 8, push);
        rtrCmdSetHeap(rec, scene.heap);
        rtrCmdSetLaunchScratch(rec, scratch.handle, 0, c.scratch);
        rtrCmdSetLaunchLimits(rec, c.tile, c.rounds);
        for (int l = 0; l < c.launches; l++) {
            RtrStridedBufferRegion rg{sbt.handle, 320 + table.raygen.offset, table.raygen.stride,
                                      table.raygen.size};
            RtrStridedBufferRegion hg{sbt.handle, 320 + table.hit.offset, table.hit.stride, table.hit.size};
            if (c.max[0]) {
                VkTraceRaysIndirectCommandKHR extents{c.w, c.h, c.d};
                Buffer indirect = scene.upload(nullptr, 512);
                memcpy(indirect.as<char>(260), &extents, sizeof extents);
                ASSERT_EQ(rtrCmdTraceRaysIndirect(rec, &rg, nullptr, &hg, nullptr, indirect.handle, 260,
                                                  c.max[0], c.max[1], c.max[2]),
                          c.expected);
                vk->compute_barrier();
                continue;
            }
            ASSERT_EQ(rtrCmdTraceRaysRegions(rec, &rg, nullptr, &hg, nullptr, c.w, c.h, c.d), c.expected);
            vk->compute_barrier();
        }
        vk->submit();
        ASSERT_EQ(rtrGetLaunchCount(rec), c.expected == VK_SUCCESS ? static_cast<uint32_t>(c.launches) : 0u);
        uint32_t unfinished = 0;
        for (uint32_t i = 0; i < c.w * c.h * c.d; i++) {
            const uint32_t* r = result.as<uint32_t>() + 4 * i;
            uint32_t x = i % c.w, y = i / c.w % c.h;
            uint32_t goal = c.turns + ((x * 7 + y * 3) & c.mask);
            bool too_large = c.max[0] && c.w > c.max[0];
            if (goal > c.budget * c.rounds || c.expected != VK_SUCCESS || too_large) {
                EXPECT_EQ(r[0], 0u) << i;
                unfinished++;
                continue;
            }
            ASSERT_EQ(r[0], static_cast<uint32_t>(c.launches)) << i;
            EXPECT_EQ(r[1], goal * app_constant);
            EXPECT_EQ(r[2], 100u);
            EXPECT_EQ(r[3], 22u);
        }
        for (uint32_t l = 0; l < rtrGetLaunchCount(rec); l++) {
            RtrLaunchError error;
            VkResult r = rtrGetLaunchError(rec, l, scene.control.data, &error);
            if (unfinished) {
                EXPECT_EQ(r, VK_ERROR_UNKNOWN);
                EXPECT_EQ(error.code, RTC_LAUNCH_ERROR_UNFINISHED);
                EXPECT_GE(error.suspendedLanes, 32u);
                expect_runtime_error("launch-error");
            } else {
                EXPECT_EQ(r, VK_SUCCESS) << error.code;
                EXPECT_EQ(error.suspendedLanes, 0u);
            }
        }
        rtrRetireRecorder(rec);
    }
};

TEST_F(ResumeTest, RoundsFinishEveryLaneOnce) { run({}); }
TEST_F(ResumeTest, Tiles) {
    Run c;
    c.tile = 100;  // rounded down to three workgroups
    c.tiles = 10;
    run(c);
}
TEST_F(ResumeTest, LittleScratchMakesTiles) {
    Run c;
    c.scratch = 256;
    c.tiles = 15;
    run(c);
}
TEST_F(ResumeTest, RowsAndDepth) {
    Run c;
    c.w = 45, c.h = 1, c.d = 3;
    run(c);
}
// More workgroups of 32 lanes than maxComputeWorkGroupCount[0] is sure to be: they go on in y.
TEST_F(ResumeTest, BeyondOneRowOfWorkgroups) {
    Run c;
    c.w = 1024, c.h = 512, c.d = 5;
    c.turns = 1, c.mask = 0, c.rounds = 1;
    c.scratch = 4 * 1024 * 512 * 5;
    run(c);
}
TEST_F(ResumeTest, SeveralLaunches) {
    Run c;
    c.launches = 3;
    run(c);
}
TEST_F(ResumeTest, ReservedInTheApplicationsSet) {
    Run c;
    c.in_set = true;
    c.launches = 2;
    run(c);
}
TEST_F(ResumeTest, Indirect) {
    Run c;
    c.max[0] = 64, c.max[1] = 40, c.max[2] = 2;
    c.launches = 2;
    run(c);
}
TEST_F(ResumeTest, IndirectRowsInTiles) {
    Run c;
    c.w = 70, c.h = 1, c.d = 5;
    c.max[0] = 100, c.max[1] = 2, c.max[2] = 5;
    c.tile = 160;
    c.tiles = 3;
    run(c);
}
TEST_F(ResumeTest, IndirectBeyondItsMaximum) {
    Run c;
    c.max[0] = 16, c.max[1] = 16, c.max[2] = 1;
    run(c);
}
TEST_F(ResumeTest, RoundsRunOut) {
    Run c;
    c.rounds = 8;  // 128 turns; lanes need 100 to 163
    run(c);
}
TEST_F(ResumeTest, ControlRegionFull) {
    Run c;
    c.rounds = 16384;
    c.expected = VK_ERROR_OUT_OF_POOL_MEMORY;
    run(c);
    expect_runtime_error("control-region");
}

TEST_F(TraceTest, ModulesAreChecked) {
    make_set(1);
    RtcModuleHeader h = module_header(kAllUsed, 1);
    auto create = [&](const std::vector<uint32_t>& code) { return make_pipeline(code, 8); };
    auto good = with_reflection(module_resume_spv, sizeof module_resume_spv, h, "json");
    RtcModuleHeader other = h;
    other.abi_version = 77;
    EXPECT_EQ(create(with_reflection(module_resume_spv, sizeof module_resume_spv, other, "")),
              VK_ERROR_INCOMPATIBLE_DRIVER);
    expect_runtime_error("abi-version");
    EXPECT_EQ(create({module_resume_spv, module_resume_spv + sizeof module_resume_spv / 4}),
              VK_ERROR_VALIDATION_FAILED_EXT);
    expect_runtime_error("module");
    other = h;
    other.group_count = 1000;
    auto short_groups = with_reflection(module_resume_spv, sizeof module_resume_spv, h, "");
    EXPECT_EQ(create({1, 2, 3}), VK_ERROR_VALIDATION_FAILED_EXT);
    expect_runtime_error("module");
    // Every truncation and every damaged byte of the reflection is refused or harmless.
    for (size_t n = 0; n < good.size(); n += 37) {
        std::vector<uint32_t> cut(good.begin(), good.begin() + static_cast<long>(n));
        uint32_t count = 0;
        rtrGetReservedBindings(rtr, cut.data(), cut.size() * 4, nullptr, &count, nullptr);
    }
    std::mt19937 rng(1);
    for (int i = 0; i < 3000; i++) {
        auto bad = good;
        bad[rng() % 200] ^= 1u << rng() % 32;
        uint32_t count = 0;
        rtrGetReservedBindings(rtr, bad.data(), bad.size() * 4, nullptr, &count, nullptr);
    }
    vk->runtime_messages.clear();
    ASSERT_EQ(create(good), VK_SUCCESS);
    if (rtrGetDeviceSupport(rtr)->needsResumableModules) expect_runtime_error("not-resumable");
    RtrPipelineInfo info;
    rtrGetPipelineInfo(pipeline, &info);
    EXPECT_EQ(std::string(info.pReflectionJson, info.reflectionJsonSize), "json");
    EXPECT_EQ(info.groupCount, 1u);
    uint32_t handle[8];
    EXPECT_EQ(rtrGetRayTracingShaderGroupHandles(rtr, pipeline, 0, 1, 32, handle), VK_SUCCESS);
    EXPECT_EQ(handle[0], 100u);
    EXPECT_EQ(handle[7], 0x1d1d1d1du);
    EXPECT_EQ(rtrGetRayTracingShaderGroupHandles(rtr, pipeline, 0, 2, 64, handle),
              VK_ERROR_VALIDATION_FAILED_EXT);
    expect_runtime_error("group-handles");
}

TEST_F(TraceTest, FloatProbe) {
    Scene scene(*vk, rtr, 1 << 16);
    Buffer out = scene.upload(nullptr, 256);
    scene.run([&] { EXPECT_EQ(rtrCmdProbeFloat(scene.recorder, out.handle, 0), VK_SUCCESS); });
    RtrFloatProbe probe;
    rtrDecodeFloatProbe(out.data, &probe);
    // What the builds and the watertight tests rely on, on any device.
    EXPECT_FALSE(probe.contractsPrecise);
    EXPECT_TRUE(probe.roundsToNearestEven);
    EXPECT_TRUE(probe.nanFailsComparison);
}

}  // namespace
