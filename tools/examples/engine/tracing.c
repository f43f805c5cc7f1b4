/* The ray tracing pipeline: module, descriptors, shader binding table, launches. */
#include "engine.h"

#include <stdio.h>
#include <string.h>

/* rtc has linked all ray tracing stages into one compute shader when this engine was built: once for devices
 * that index arrays of descriptors freely, once for the others. */
/* [guide: module] */
static const uint32_t kModule[] = {
#include "pipeline.inc"
};
static const uint32_t kNonUniformModule[] = {
#include "pipeline-nonuniform.inc"
};

/* Groups, in the order of rtc's command line: see CMakeLists.txt. */
enum {
    GROUP_FRAME,
    GROUP_SKY,
    GROUP_LIGHT,
    GROUP_TEXTURED,
    GROUP_STRIPES,
    GROUP_SURFACE,
    GROUP_CUTOUT,
    GROUP_HOLES
};
/* [guide] */

static VkDescriptorSetLayout set_layout(Gpu* gpu, const VkDescriptorSetLayoutBinding* bindings,
                                        uint32_t count) {
    VkDescriptorSetLayoutCreateInfo info = {VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO};
    info.bindingCount = count;
    info.pBindings = bindings;
    VkDescriptorSetLayout layout;
    CHECK(vkCreateDescriptorSetLayout(gpu->device, &info, NULL, &layout));
    return layout;
}

/* [guide: layouts] */
static void create_layouts(Gpu* gpu, Tracing* tracing) {
    /* As written for VK_NV_ray_tracing, each enum of the extension translated. */
    const VkShaderStageFlags any =
        rtrTranslateShaderStages(VK_SHADER_STAGE_RAYGEN_BIT_NV | VK_SHADER_STAGE_CLOSEST_HIT_BIT_NV |
                                 VK_SHADER_STAGE_ANY_HIT_BIT_NV | VK_SHADER_STAGE_CALLABLE_BIT_NV);
    const VkDescriptorType structure =
        rtrTranslateDescriptorType(VK_DESCRIPTOR_TYPE_ACCELERATION_STRUCTURE_NV);
    const VkDescriptorSetLayoutBinding frame[] = {{0, structure, 1, any, NULL},
                                                  {1, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, 1, any, NULL},
                                                  {2, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, 1, any, NULL},
                                                  {3, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, 1, any, NULL},
                                                  {4, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, 1, any, NULL}};
    const VkDescriptorSetLayoutBinding scene[] = {
        {0, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, MESH_COUNT, any, NULL},
        {1, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, MESH_COUNT, any, NULL},
        {2, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, TEXTURE_COUNT, any, NULL}};
    tracing->setLayouts[0] = set_layout(gpu, frame, 5);
    tracing->setLayouts[1] = set_layout(gpu, scene, 3);
}
/* [guide] */

/* [guide: pipeline] */
static void create_pipeline(Gpu* gpu, Tracing* tracing) {
    const VkPushConstantRange range = {VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(Camera)};
    RtrRayTracingPipelineCreateInfo info = {0};
    info.pCode = gpu->nonUniformIndexing ? kNonUniformModule : kModule;
    info.codeSize = gpu->nonUniformIndexing ? sizeof kNonUniformModule : sizeof kModule;
    info.setLayoutCount = 2;
    info.pSetLayouts = tracing->setLayouts;
    info.pushConstantRangeCount = 1;
    info.pPushConstantRanges = &range;
    CHECK(rtrCreateRayTracingPipeline(gpu->rtr, VK_NULL_HANDLE, &info, NULL, &tracing->pipeline));
}
/* [guide] */

/* [guide: table] */
static void create_table(Gpu* gpu, const Scene* scene, Tracing* tracing) {
    const RtrSbtRecord raygen = {GROUP_FRAME, 0, NULL};
    const RtrSbtRecord miss[] = {{GROUP_SKY, sizeof scene->sky, &scene->sky}, {GROUP_LIGHT, 0, NULL}};
    MeshRecord data[MESH_COUNT];
    RtrSbtRecord hit[2 * MESH_COUNT];
    for (uint32_t i = 0; i < MESH_COUNT; ++i) {
        const Mesh* mesh = &scene->meshes[i];
        data[i] = (MeshRecord){.vertexBuffer = i, .indexBuffer = i, mesh->texture, mesh->material};
        hit[2 * i] = (RtrSbtRecord){mesh->cutout ? GROUP_CUTOUT : GROUP_SURFACE, sizeof data[i], &data[i]};
        /* Shadow rays: only holes matter. A null group leaves the hit as it is. */
        hit[2 * i + 1] =
            (RtrSbtRecord){mesh->cutout ? GROUP_HOLES : RTR_NULL_GROUP, sizeof data[i], &data[i]};
    }
    RtrSbtRecord callable[MATERIAL_COUNT];
    for (uint32_t i = 0; i < MATERIAL_COUNT; ++i)
        callable[i] = (RtrSbtRecord){scene->materials[i].scale > 0 ? GROUP_STRIPES : GROUP_TEXTURED,
                                     sizeof(MaterialRecord), &scene->materials[i]};
    const RtrSbtInfo info = {1, &raygen, 2, miss, 2 * MESH_COUNT, hit, MATERIAL_COUNT, callable};
    CHECK(rtrGetSbtLayout(gpu->rtr, &info, &tracing->tableLayout));
    tracing->table = buffer_create(gpu, tracing->tableLayout.size,
                                   rtrTranslateBufferUsage(VK_BUFFER_USAGE_RAY_TRACING_BIT_NV), MEMORY_HOST);
    CHECK(rtrWriteSbt(gpu->rtr, tracing->pipeline, &info, &tracing->tableLayout, tracing->table.mapped));
}
/* [guide] */

static void create_picture(Gpu* gpu, const Raster* raster, Tracing* tracing) {
    tracing->picture =
        image_create(gpu, raster->width, raster->height, VK_FORMAT_R32G32B32A32_SFLOAT,
                     VK_IMAGE_USAGE_STORAGE_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT, VK_IMAGE_ASPECT_COLOR_BIT);
    VkCommandBuffer cb = commands_begin(gpu);
    image_barrier(cb, tracing->picture.handle, VK_IMAGE_ASPECT_COLOR_BIT, VK_IMAGE_LAYOUT_UNDEFINED,
                  VK_IMAGE_LAYOUT_GENERAL, VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT, 0,
                  VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_ACCESS_SHADER_WRITE_BIT);
    commands_finish(gpu, cb);
}

static void write_set(Gpu* gpu, VkDescriptorSet set, uint32_t binding, VkDescriptorType type, uint32_t count,
                      const VkDescriptorBufferInfo* buffers, const VkDescriptorImageInfo* images) {
    VkWriteDescriptorSet write = {VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
    write.dstSet = set;
    write.dstBinding = binding;
    write.descriptorCount = count;
    write.descriptorType = type;
    write.pBufferInfo = buffers;
    write.pImageInfo = images;
    vkUpdateDescriptorSets(gpu->device, 1, &write, 0, NULL);
}

static void create_sets(Gpu* gpu, const Resources* resources, const Structures* structures,
                        const Raster* raster, Tracing* tracing) {
    const VkDescriptorPoolSize sizes[] = {
        {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, FRAMES_IN_FLIGHT * (1 + 2 * MESH_COUNT)},
        {VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, FRAMES_IN_FLIGHT * 4},
        {VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, FRAMES_IN_FLIGHT * TEXTURE_COUNT}};
    VkDescriptorPoolCreateInfo pool = {VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO};
    pool.maxSets = 2 * FRAMES_IN_FLIGHT;
    pool.poolSizeCount = 3;
    pool.pPoolSizes = sizes;
    CHECK(vkCreateDescriptorPool(gpu->device, &pool, NULL, &tracing->descriptors));
    for (uint32_t slot = 0; slot < FRAMES_IN_FLIGHT; ++slot) {
        VkDescriptorSetAllocateInfo allocation = {VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO};
        allocation.descriptorPool = tracing->descriptors;
        allocation.descriptorSetCount = 2;
        allocation.pSetLayouts = tracing->setLayouts;
        CHECK(vkAllocateDescriptorSets(gpu->device, &allocation, tracing->sets[slot]));
        const VkDescriptorSet frame = tracing->sets[slot][0], scene = tracing->sets[slot][1];
        /* [guide: descriptor] */
        VkDescriptorBufferInfo top; /* an acceleration structure is a storage buffer onto its header */
        CHECK(rtrGetAccelerationStructureDescriptor(gpu->rtr, structures->top, &top));
        write_set(gpu, frame, 0, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, &top, NULL);
        /* [guide] */
        for (uint32_t i = 0; i < 4; ++i) {
            const VkDescriptorImageInfo image = {
                VK_NULL_HANDLE, i < GBUFFER_COUNT ? raster->targets[i].view : tracing->picture.view,
                VK_IMAGE_LAYOUT_GENERAL};
            write_set(gpu, frame, 1 + i, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, 1, NULL, &image);
        }
        VkDescriptorBufferInfo vertices[MESH_COUNT], indices[MESH_COUNT];
        for (uint32_t i = 0; i < MESH_COUNT; ++i) {
            vertices[i] = (VkDescriptorBufferInfo){resources_vertices(resources, i, slot), 0, VK_WHOLE_SIZE};
            indices[i] = (VkDescriptorBufferInfo){resources->indices[i].handle, 0, VK_WHOLE_SIZE};
        }
        write_set(gpu, scene, 0, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, MESH_COUNT, vertices, NULL);
        write_set(gpu, scene, 1, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, MESH_COUNT, indices, NULL);
        VkDescriptorImageInfo textures[TEXTURE_COUNT];
        for (uint32_t i = 0; i < TEXTURE_COUNT; ++i)
            textures[i] = (VkDescriptorImageInfo){resources->sampler, resources->textures[i].view,
                                                  VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL};
        write_set(gpu, scene, 2, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, TEXTURE_COUNT, NULL, textures);
    }
}

/* [guide: recorder] */
static void create_recorders(Gpu* gpu, const Raster* raster, Tracing* tracing) {
    /* Lanes of a long launch suspend into this memory; it is 0 for modules that never do. */
    const VkDeviceSize scratch =
        rtrGetLaunchScratchSize(gpu->rtr, tracing->pipeline, raster->width, raster->height, 1, NULL);
    if (scratch)
        tracing->launchScratch = buffer_create(gpu, scratch, RTR_LAUNCH_SCRATCH_BUFFER_USAGE, MEMORY_DEVICE);
    const uint32_t tiles =
        rtrGetLaunchTileCount(gpu->rtr, tracing->pipeline, raster->width, raster->height, 1, scratch, 0);
    const VkDeviceSize control =
        rtrGetRecorderControlSize(gpu->rtr, 1, tiles, 64); /* launches, tiles, rounds */
    for (uint32_t slot = 0; slot < FRAMES_IN_FLIGHT; ++slot) {
        tracing->control[slot] = buffer_create(gpu, control, RTR_CONTROL_BUFFER_USAGE, MEMORY_HOST);
        RtrRecorderCreateInfo info = {0};
        info.controlBuffer = tracing->control[slot].handle;
        info.controlSize = control;
        CHECK(rtrCreateRecorder(gpu->rtr, &info, NULL, &tracing->recorders[slot]));
    }
}
/* [guide] */

void tracing_create(Gpu* gpu, const Scene* scene, const Resources* resources, const Structures* structures,
                    const Raster* raster, Tracing* tracing) {
    memset(tracing, 0, sizeof *tracing);
    create_layouts(gpu, tracing);
    create_pipeline(gpu, tracing);
    create_table(gpu, scene, tracing);
    create_picture(gpu, raster, tracing);
    create_sets(gpu, resources, structures, raster, tracing);
    create_recorders(gpu, raster, tracing);
}

void tracing_destroy(Gpu* gpu, Tracing* tracing) {
    for (uint32_t slot = 0; slot < FRAMES_IN_FLIGHT; ++slot) {
        rtrDestroyRecorder(gpu->rtr, tracing->recorders[slot], NULL);
        buffer_destroy(gpu, &tracing->control[slot]);
    }
    buffer_destroy(gpu, &tracing->launchScratch);
    buffer_destroy(gpu, &tracing->table);
    image_destroy(gpu, &tracing->picture);
    vkDestroyDescriptorPool(gpu->device, tracing->descriptors, NULL);
    for (uint32_t i = 0; i < 2; ++i) vkDestroyDescriptorSetLayout(gpu->device, tracing->setLayouts[i], NULL);
    rtrDestroyPipeline(gpu->rtr, tracing->pipeline, NULL);
}

/* [guide: trace] */
void tracing_record(const Tracing* tracing, const Structures* structures, const Scene* scene, uint32_t slot,
                    uint32_t width, uint32_t height) {
    const RtrRecorder recorder = tracing->recorders[slot];
    CHECK(rtrCmdSetHeap(recorder, structures->heap));
    if (tracing->launchScratch.handle)
        CHECK(
            rtrCmdSetLaunchScratch(recorder, tracing->launchScratch.handle, 0, tracing->launchScratch.size));
    CHECK(rtrCmdBindPipeline(recorder, tracing->pipeline));
    CHECK(rtrCmdBindDescriptorSets(recorder, 0, 2, tracing->sets[slot], 0, NULL));
    CHECK(rtrCmdPushConstants(recorder, 0, sizeof scene->camera, &scene->camera));
    const VkBuffer table = tracing->table.handle;
    const RtrSbtLayout* at = &tracing->tableLayout;
    CHECK(rtrCmdTraceRays(recorder, table, at->raygen.offset, table, at->miss.offset, at->miss.stride, table,
                          at->hit.offset, at->hit.stride, table, at->callable.offset, at->callable.stride,
                          width, height, 1));
}
/* [guide] */

/* [guide: finish] */
bool tracing_finish(const Tracing* tracing, uint32_t slot) {
    const RtrRecorder recorder = tracing->recorders[slot];
    bool good = true;
    for (uint32_t launch = 0; launch < rtrGetLaunchCount(recorder); ++launch) {
        RtrLaunchError error;
        if (rtrGetLaunchError(recorder, launch, tracing->control[slot].mapped, &error) == VK_SUCCESS)
            continue;
        char text[256];
        rtrFormatLaunchError(&error, text, sizeof text);
        fprintf(stderr, "launch error: %s\n", text);
        good = false;
    }
    CHECK(rtrRetireRecorder(recorder));
    return good;
}
/* [guide] */
