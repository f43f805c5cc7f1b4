/* Acceleration structures: static meshes are built once and compacted, the cloth is refitted and the top
 * level rebuilt in every frame. */
#include "engine.h"

#include <string.h>

/* [guide: geometry] */
static VkGeometryNV mesh_geometry(const Mesh* mesh, VkBuffer vertices, VkBuffer indices) {
    VkGeometryNV geometry = {VK_STRUCTURE_TYPE_GEOMETRY_NV};
    geometry.geometryType = VK_GEOMETRY_TYPE_TRIANGLES_NV;
    geometry.geometry.triangles = (VkGeometryTrianglesNV){.sType = VK_STRUCTURE_TYPE_GEOMETRY_TRIANGLES_NV,
                                                          .vertexData = vertices,
                                                          .vertexCount = mesh->vertexCount,
                                                          .vertexStride = sizeof(Vertex),
                                                          .vertexFormat = VK_FORMAT_R32G32B32_SFLOAT,
                                                          .indexData = indices,
                                                          .indexCount = mesh->indexCount,
                                                          .indexType = VK_INDEX_TYPE_UINT32};
    geometry.geometry.aabbs.sType = VK_STRUCTURE_TYPE_GEOMETRY_AABB_NV;
    geometry.flags = mesh->cutout ? 0 : VK_GEOMETRY_OPAQUE_BIT_NV; /* cutouts run their any-hit shader */
    return geometry;
}

static VkAccelerationStructureInfoNV bottom_info(uint32_t mesh, const VkGeometryNV* geometry) {
    VkAccelerationStructureInfoNV info = {VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV};
    info.type = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
    info.flags = mesh == MESH_CLOTH ? VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV
                                    : VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_COMPACTION_BIT_NV |
                                          VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_NV;
    info.geometryCount = 1;
    info.pGeometries = geometry;
    return info;
}
/* [guide] */

static const VkAccelerationStructureInfoNV kTopInfo = {
    .sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV,
    .type = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV,
    .flags = VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_BUILD_BIT_NV,
    .instanceCount = INSTANCE_COUNT};

/* Creates a structure and gives it a piece of the heap. */
/* [guide: create] */
static RtrAccelerationStructure create(Gpu* gpu, RtrHeap heap, const VkAccelerationStructureInfoNV* info,
                                       VkDeviceSize compactedSize) {
    VkAccelerationStructureCreateInfoNV createInfo = {
        VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_NV};
    createInfo.compactedSize =
        compactedSize; /* not 0: the target of a compacting copy, info without counts */
    createInfo.info = *info;
    RtrAccelerationStructure structure;
    CHECK(rtrCreateAccelerationStructure(gpu->rtr, &createInfo, NULL, &structure));

    VkMemoryRequirements2 needs = {VK_STRUCTURE_TYPE_MEMORY_REQUIREMENTS_2};
    rtrGetAccelerationStructureMemoryRequirements(
        gpu->rtr, VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_OBJECT_NV, structure, &needs);
    RtrBindAccelerationStructureMemoryInfo bind = {0};
    bind.accelerationStructure = structure;
    bind.heap = heap;
    CHECK(rtrAllocateHeapRange(heap, needs.memoryRequirements.size, 0, &bind.heapOffset));
    CHECK(rtrBindAccelerationStructureMemory(gpu->rtr, 1, &bind));
    return structure;
}
/* [guide] */

static VkDeviceSize scratch_size(Gpu* gpu, RtrAccelerationStructure structure,
                                 VkAccelerationStructureMemoryRequirementsTypeNV type) {
    VkMemoryRequirements2 needs = {VK_STRUCTURE_TYPE_MEMORY_REQUIREMENTS_2};
    rtrGetAccelerationStructureMemoryRequirements(gpu->rtr, type, structure, &needs);
    return needs.memoryRequirements.size ? needs.memoryRequirements.size : 256;
}

/* Builds write, and everything later reads, in the stages and accesses of the extension; translated they are
 * valid without it. */
/* [guide: barrier] */
static void build_barrier(VkCommandBuffer cb) {
    VkMemoryBarrier barrier = {VK_STRUCTURE_TYPE_MEMORY_BARRIER};
    barrier.srcAccessMask = rtrTranslateAccess(VK_ACCESS_ACCELERATION_STRUCTURE_WRITE_BIT_NV);
    barrier.dstAccessMask = rtrTranslateAccess(VK_ACCESS_ACCELERATION_STRUCTURE_READ_BIT_NV |
                                               VK_ACCESS_ACCELERATION_STRUCTURE_WRITE_BIT_NV);
    const VkPipelineStageFlags build =
        rtrTranslatePipelineStages(VK_PIPELINE_STAGE_ACCELERATION_STRUCTURE_BUILD_BIT_NV);
    const VkPipelineStageFlags use = rtrTranslatePipelineStages(
        VK_PIPELINE_STAGE_ACCELERATION_STRUCTURE_BUILD_BIT_NV | VK_PIPELINE_STAGE_RAY_TRACING_SHADER_BIT_NV);
    vkCmdPipelineBarrier(cb, build | use, use, 0, 1, &barrier, 0, NULL, 0, NULL);
}
/* [guide] */

/* Copies the static bottom levels into memory of their true size. */
static void compact(Gpu* gpu, Structures* s, RtrRecorder recorder, const Buffer* sizes) {
    RtrAccelerationStructure large[MESH_COUNT];
    memcpy(large, s->bottom, sizeof large);
    VkCommandBuffer cb = commands_begin(gpu);
    CHECK(rtrBeginRecorder(recorder, cb));
    for (uint32_t i = 0; i < MESH_COUNT; ++i) {
        if (i == MESH_CLOTH) continue;
        VkAccelerationStructureInfoNV info = bottom_info(i, NULL);
        info.geometryCount = 0;
        const VkDeviceSize size = ((const uint64_t*)sizes->mapped)[i];
        s->bottom[i] = create(gpu, s->heap, &info, size);
        s->after += size;
        CHECK(rtrCmdCopyAccelerationStructure(recorder, s->bottom[i], large[i],
                                              VK_COPY_ACCELERATION_STRUCTURE_MODE_COMPACT_NV));
        build_barrier(
            cb); /* copies bind the whole heap, and synchronisation validation looks at what is bound */
    }
    commands_finish(gpu, cb);
    CHECK(rtrRetireRecorder(recorder));
    for (uint32_t i = 0; i < MESH_COUNT; ++i)
        if (i != MESH_CLOTH) rtrDestroyAccelerationStructure(gpu->rtr, large[i], NULL);
}

void structures_create(Gpu* gpu, const Scene* scene, const Resources* resources, Structures* s) {
    memset(s, 0, sizeof *s);
    /* [guide: heap] */
    /* A real engine asks the requirements first: all that a launch reaches lies in one heap. */
    const VkDeviceSize heapBytes = 4u << 20;
    s->heapBuffer = buffer_create(gpu, heapBytes, RTR_HEAP_BUFFER_USAGE, MEMORY_DEVICE);
    RtrHeapCreateInfo heap = {0};
    heap.buffer = s->heapBuffer.handle;
    heap.size = heapBytes;
    CHECK(rtrCreateHeap(gpu->rtr, &heap, NULL, &s->heap));
    /* [guide] */

    VkGeometryNV geometries[MESH_COUNT];
    VkDeviceSize scratch = 0;
    for (uint32_t i = 0; i < MESH_COUNT; ++i) {
        geometries[i] = mesh_geometry(&scene->meshes[i], resources_vertices(resources, i, 0),
                                      resources->indices[i].handle);
        const VkAccelerationStructureInfoNV info = bottom_info(i, &geometries[i]);
        s->bottom[i] = create(gpu, s->heap, &info, 0);
        const VkDeviceSize needed = scratch_size(
            gpu, s->bottom[i], VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_BUILD_SCRATCH_NV);
        scratch = needed > scratch ? needed : scratch;
    }
    s->top = create(gpu, s->heap, &kTopInfo, 0);
    const VkDeviceSize top =
        scratch_size(gpu, s->top, VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_BUILD_SCRATCH_NV);
    scratch = top > scratch ? top : scratch;
    s->scratch = buffer_create(gpu, scratch, RTR_SCRATCH_BUFFER_USAGE, MEMORY_DEVICE);
    s->clothScratch =
        buffer_create(gpu,
                      scratch_size(gpu, s->bottom[MESH_CLOTH],
                                   VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_UPDATE_SCRATCH_NV),
                      RTR_SCRATCH_BUFFER_USAGE, MEMORY_DEVICE);

    memcpy(resources->cloth[0].mapped, scene->meshes[MESH_CLOTH].vertices, (size_t)resources->cloth[0].size);
    Buffer sizes =
        buffer_create(gpu, MESH_COUNT * sizeof(uint64_t), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, MEMORY_HOST);
    const RtrRecorderCreateInfo recorderInfo = {0}; /* it only builds: no control region */
    RtrRecorder recorder;
    CHECK(rtrCreateRecorder(gpu->rtr, &recorderInfo, NULL, &recorder));

    /* [guide: build] */
    VkCommandBuffer cb = commands_begin(gpu);
    CHECK(rtrBeginRecorder(recorder, cb));
    CHECK(rtrCmdInitializeHeap(recorder, s->heap));
    for (uint32_t i = 0; i < MESH_COUNT; ++i) {
        const VkAccelerationStructureInfoNV info = bottom_info(i, &geometries[i]);
        CHECK(rtrCmdBuildAccelerationStructure(recorder, &info, VK_NULL_HANDLE, 0, VK_FALSE, s->bottom[i],
                                               NULL, s->scratch.handle, 0));
        build_barrier(cb); /* the next build uses the same scratch */
    }
    CHECK(rtrCmdWriteAccelerationStructuresProperties(recorder, MESH_COUNT, s->bottom,
                                                      VK_QUERY_TYPE_ACCELERATION_STRUCTURE_COMPACTED_SIZE_NV,
                                                      sizes.handle, 0));
    /* [guide] */
    VkMemoryBarrier toHost = {VK_STRUCTURE_TYPE_MEMORY_BARRIER, NULL, VK_ACCESS_SHADER_WRITE_BIT,
                              VK_ACCESS_HOST_READ_BIT};
    vkCmdPipelineBarrier(cb, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &toHost,
                         0, NULL, 0, NULL);
    commands_finish(gpu, cb);
    CHECK(rtrRetireRecorder(recorder));
    for (uint32_t i = 0; i < MESH_COUNT; ++i) {
        VkMemoryRequirements2 needs = {VK_STRUCTURE_TYPE_MEMORY_REQUIREMENTS_2};
        rtrGetAccelerationStructureMemoryRequirements(
            gpu->rtr, VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_OBJECT_NV, s->bottom[i], &needs);
        if (i != MESH_CLOTH) s->before += needs.memoryRequirements.size;
    }
    compact(gpu, s, recorder, &sizes);
    rtrDestroyRecorder(gpu->rtr, recorder, NULL);
    buffer_destroy(gpu, &sizes);
}

void structures_destroy(Gpu* gpu, Structures* s) {
    for (uint32_t i = 0; i < MESH_COUNT; ++i) rtrDestroyAccelerationStructure(gpu->rtr, s->bottom[i], NULL);
    rtrDestroyAccelerationStructure(gpu->rtr, s->top, NULL);
    rtrDestroyHeap(gpu->rtr, s->heap, NULL);
    buffer_destroy(gpu, &s->heapBuffer);
    buffer_destroy(gpu, &s->scratch);
    buffer_destroy(gpu, &s->clothScratch);
}

/* [guide: instances] */
void structures_write_instances(Gpu* gpu, const Structures* s, const Scene* scene, void* mapped) {
    VkAccelerationStructureInstanceNV* out = mapped;
    for (uint32_t i = 0; i < INSTANCE_COUNT; ++i) {
        const Instance* instance = &scene->instances[i];
        VkAccelerationStructureInstanceNV converted = {.instanceCustomIndex = i, .mask = 0xff};
        memcpy(converted.transform.matrix, instance->transform, sizeof converted.transform.matrix);
        converted.instanceShaderBindingTableRecordOffset = 2 * instance->mesh; /* two ray types a mesh */
        converted.flags = VK_GEOMETRY_INSTANCE_TRIANGLE_CULL_DISABLE_BIT_NV;
        CHECK(rtrGetAccelerationStructureHandle(gpu->rtr, s->bottom[instance->mesh], sizeof(uint64_t),
                                                &converted.accelerationStructureReference));
        out[i] = converted;
    }
}
/* [guide] */

/* [guide: frame-build] */
void structures_record(const Structures* s, const Scene* scene, const Resources* resources,
                       RtrRecorder recorder, VkCommandBuffer cb, uint32_t slot) {
    build_barrier(cb); /* the frame before may still trace, and used the same scratch */
    const VkGeometryNV cloth = mesh_geometry(&scene->meshes[MESH_CLOTH], resources->cloth[slot].handle,
                                             resources->indices[MESH_CLOTH].handle);
    const VkAccelerationStructureInfoNV info = bottom_info(MESH_CLOTH, &cloth);
    CHECK(rtrCmdBuildAccelerationStructure(recorder, &info, VK_NULL_HANDLE, 0, VK_TRUE, s->bottom[MESH_CLOTH],
                                           s->bottom[MESH_CLOTH], s->clothScratch.handle,
                                           0)); /* a refit in place */
    build_barrier(cb);                          /* the top level reads the cloth's new bounds */
    CHECK(rtrCmdBuildAccelerationStructure(recorder, &kTopInfo, resources->instances[slot].handle, 0,
                                           VK_FALSE, s->top, NULL, s->scratch.handle, 0));
    build_barrier(cb); /* the launch reads both */
}
/* [guide] */
