/* The frame loop. --check compares every frame with reference.c; --validate runs under the validation layers,
 * synchronisation validation included, and fails when they say anything. */
#include "engine.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct Options {
    uint32_t frames, width, height;
    const char* device;
    const char* output;
    bool check, validate;
} Options;

static void usage(const char* problem) {
    fprintf(stderr,
            "%s\nusage: engine [--frames N] [--size WxH] [--device NAME] [--output FILE.ppm] [--check] "
            "[--validate]\n",
            problem);
    exit(2);
}

static Options parse(int argc, char** argv) {
    Options options = {3, 96, 64, NULL, NULL, false, false};
    for (int i = 1; i < argc; ++i) {
        const char* value = i + 1 < argc ? argv[i + 1] : NULL;
        if (!strcmp(argv[i], "--check")) {
            options.check = true;
        } else if (!strcmp(argv[i], "--validate")) {
            options.validate = true;
        } else if (!value) {
            usage("unknown option, or one without its value");
        } else if (!strcmp(argv[i], "--frames")) {
            options.frames = (uint32_t)strtoul(argv[++i], NULL, 10);
        } else if (!strcmp(argv[i], "--device")) {
            options.device = argv[++i];
        } else if (!strcmp(argv[i], "--output")) {
            options.output = argv[++i];
        } else if (!strcmp(argv[i], "--size")) {
            if (sscanf(argv[++i], "%ux%u", &options.width, &options.height) != 2) usage("--size takes WxH");
        } else {
            usage("unknown option");
        }
    }
    if (!options.frames || !options.width || !options.height || options.width > 4096 || options.height > 4096)
        usage("at least one frame, and a size from 1x1 to 4096x4096");
    return options;
}

/* What belongs to one frame on its way. */
typedef struct Slot {
    VkCommandBuffer cb;
    VkFence fence;
    Buffer readback; /* the G-buffer, then the picture */
    bool busy;
} Slot;

static VkDeviceSize plane_bytes(const Options* options) {
    return (VkDeviceSize)options->width * options->height * 16;
}

static void create_slot(Gpu* gpu, const Options* options, Slot* slot) {
    const VkCommandBufferAllocateInfo allocation = {VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO, NULL,
                                                    gpu->pool, VK_COMMAND_BUFFER_LEVEL_PRIMARY, 1};
    CHECK(vkAllocateCommandBuffers(gpu->device, &allocation, &slot->cb));
    const VkFenceCreateInfo fence = {VK_STRUCTURE_TYPE_FENCE_CREATE_INFO};
    CHECK(vkCreateFence(gpu->device, &fence, NULL, &slot->fence));
    slot->readback = buffer_create(gpu, (GBUFFER_COUNT + 1) * plane_bytes(options),
                                   VK_BUFFER_USAGE_TRANSFER_DST_BIT, MEMORY_HOST);
    slot->busy = false;
}

static void record_readback(const Raster* raster, const Tracing* tracing, const Options* options,
                            Slot* slot) {
    VkMemoryBarrier barrier = {VK_STRUCTURE_TYPE_MEMORY_BARRIER, NULL, VK_ACCESS_SHADER_WRITE_BIT,
                               VK_ACCESS_TRANSFER_READ_BIT};
    vkCmdPipelineBarrier(slot->cb, rtrTranslatePipelineStages(VK_PIPELINE_STAGE_RAY_TRACING_SHADER_BIT_NV),
                         VK_PIPELINE_STAGE_TRANSFER_BIT, 0, 1, &barrier, 0, NULL, 0, NULL);
    for (uint32_t i = 0; i <= GBUFFER_COUNT; ++i) {
        VkBufferImageCopy region = {.bufferOffset = i * plane_bytes(options)};
        region.imageSubresource = (VkImageSubresourceLayers){VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
        region.imageExtent = (VkExtent3D){options->width, options->height, 1};
        vkCmdCopyImageToBuffer(slot->cb,
                               i < GBUFFER_COUNT ? raster->targets[i].handle : tracing->picture.handle,
                               VK_IMAGE_LAYOUT_GENERAL, slot->readback.handle, 1, &region);
    }
    barrier.srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT;
    barrier.dstAccessMask = VK_ACCESS_HOST_READ_BIT;
    vkCmdPipelineBarrier(slot->cb, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &barrier,
                         0, NULL, 0, NULL);
}

static void write_ppm(const char* path, const Options* options, const float* picture) {
    FILE* file = fopen(path, "wb");
    if (!file) {
        fprintf(stderr, "engine: cannot write %s\n", path);
        exit(1);
    }
    fprintf(file, "P6\n%u %u\n255\n", options->width, options->height);
    for (size_t i = 0; i < (size_t)options->width * options->height; ++i) {
        for (int c = 0; c < 3; ++c) {
            const float value = picture[4 * i + c];
            fputc((int)(255.0f * (value < 0 ? 0 : value > 1 ? 1 : value) + 0.5f), file);
        }
    }
    fclose(file);
}

/* Waits for the frame in a slot and looks at it. */
static bool collect(Gpu* gpu, const Tracing* tracing, const Options* options, Slot* slot, uint32_t index,
                    uint32_t frame) {
    CHECK(vkWaitForFences(gpu->device, 1, &slot->fence, VK_TRUE, UINT64_MAX));
    CHECK(vkResetFences(gpu->device, 1, &slot->fence));
    slot->busy = false;
    bool good = tracing_finish(tracing, index);
    const float* planes = slot->readback.mapped;
    const size_t plane = (size_t)plane_bytes(options) / sizeof *planes;
    if (options->check) {
        Scene then; /* the scene as it was when this frame was recorded */
        scene_create(&then, (float)options->width / (float)options->height);
        scene_animate(&then, frame);
        printf("frame %u: ", frame);
        good = reference_compare(&then, options->width, options->height, planes, planes + plane,
                                 planes + 2 * plane, planes + 3 * plane) &&
               good;
        scene_destroy(&then);
    }
    if (options->output && frame + 1 == options->frames)
        write_ppm(options->output, options, planes + 3 * plane);
    return good;
}

int main(int argc, char** argv) {
    const Options options = parse(argc, argv);
    Gpu gpu;
    Scene scene;
    Resources resources;
    Structures structures;
    Raster raster;
    Tracing tracing;
    gpu_create(&gpu, options.device, options.validate);
    scene_create(&scene, (float)options.width / (float)options.height);
    resources_create(&gpu, &scene, &resources);
    structures_create(&gpu, &scene, &resources, &structures);
    raster_create(&gpu, &resources, options.width, options.height, &raster);
    tracing_create(&gpu, &scene, &resources, &structures, &raster, &tracing);
    printf("static structures: %llu bytes built, %llu compacted\n", (unsigned long long)structures.before,
           (unsigned long long)structures.after);

    Slot slots[FRAMES_IN_FLIGHT];
    for (uint32_t i = 0; i < FRAMES_IN_FLIGHT; ++i) create_slot(&gpu, &options, &slots[i]);
    bool good = true;
    for (uint32_t frame = 0; frame < options.frames + FRAMES_IN_FLIGHT; ++frame) {
        const uint32_t index = frame % FRAMES_IN_FLIGHT;
        Slot* slot = &slots[index];
        if (slot->busy)
            good = collect(&gpu, &tracing, &options, slot, index, frame - FRAMES_IN_FLIGHT) && good;
        if (frame >= options.frames) continue; /* only waiting for the last ones */

        /* [guide: frame] */
        scene_animate(&scene, frame);
        memcpy(resources.cloth[index].mapped, scene.meshes[MESH_CLOTH].vertices,
               (size_t)resources.cloth[index].size);
        structures_write_instances(&gpu, &structures, &scene, resources.instances[index].mapped);

        VkCommandBufferBeginInfo begin = {VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
        begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
        CHECK(vkBeginCommandBuffer(slot->cb, &begin));
        CHECK(rtrBeginRecorder(tracing.recorders[index],
                               slot->cb)); /* beside the command buffer, until retired */
        structures_record(&structures, &scene, &resources, tracing.recorders[index], slot->cb, index);
        raster_record(&raster, &scene, &resources, slot->cb, index);
        tracing_record(&tracing, &structures, &scene, index, options.width, options.height);
        record_readback(&raster, &tracing, &options, slot);
        CHECK(vkEndCommandBuffer(slot->cb));
        /* [guide] */
        VkSubmitInfo submit = {VK_STRUCTURE_TYPE_SUBMIT_INFO};
        submit.commandBufferCount = 1;
        submit.pCommandBuffers = &slot->cb;
        CHECK(vkQueueSubmit(gpu.queue, 1, &submit, slot->fence));
        slot->busy = true;
    }

    for (uint32_t i = 0; i < FRAMES_IN_FLIGHT; ++i) {
        vkDestroyFence(gpu.device, slots[i].fence, NULL);
        buffer_destroy(&gpu, &slots[i].readback);
    }
    tracing_destroy(&gpu, &tracing);
    raster_destroy(&gpu, &raster);
    structures_destroy(&gpu, &structures);
    resources_destroy(&gpu, &resources);
    scene_destroy(&scene);
    gpu_destroy(&gpu);
    if (gpu.messages) fprintf(stderr, "engine: %u messages from validation or the runtime\n", gpu.messages);
    printf("%u frames: %s\n", options.frames, good && !gpu.messages ? "good" : "BAD");
    return good && !gpu.messages ? 0 : 1;
}
