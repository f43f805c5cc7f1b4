/* Vertices, indices and textures in device memory. The same buffers feed the vertex shader, the acceleration
 * structure builds and the hit shaders. */
#include "engine.h"

#include <string.h>

static void fill(Buffer* buffer, const void* data, size_t bytes) { memcpy(buffer->mapped, data, bytes); }

static Image texture_create(Gpu* gpu, const void* texels) {
    const VkDeviceSize bytes = TEXTURE_SIZE * TEXTURE_SIZE * 4;
    Image image =
        image_create(gpu, TEXTURE_SIZE, TEXTURE_SIZE, VK_FORMAT_R8G8B8A8_UNORM,
                     VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT, VK_IMAGE_ASPECT_COLOR_BIT);
    Buffer staging = buffer_create(gpu, bytes, VK_BUFFER_USAGE_TRANSFER_SRC_BIT, MEMORY_HOST);
    fill(&staging, texels, bytes);
    VkCommandBuffer cb = commands_begin(gpu);
    image_barrier(cb, image.handle, VK_IMAGE_ASPECT_COLOR_BIT, VK_IMAGE_LAYOUT_UNDEFINED,
                  VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT, 0,
                  VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_WRITE_BIT);
    VkBufferImageCopy region = {0};
    region.imageSubresource = (VkImageSubresourceLayers){VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
    region.imageExtent = (VkExtent3D){TEXTURE_SIZE, TEXTURE_SIZE, 1};
    vkCmdCopyBufferToImage(cb, staging.handle, image.handle, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1,
                           &region);
    image_barrier(cb, image.handle, VK_IMAGE_ASPECT_COLOR_BIT, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
                  VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL, VK_PIPELINE_STAGE_TRANSFER_BIT,
                  VK_ACCESS_TRANSFER_WRITE_BIT,
                  VK_PIPELINE_STAGE_FRAGMENT_SHADER_BIT | VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
                  VK_ACCESS_SHADER_READ_BIT);
    commands_finish(gpu, cb);
    buffer_destroy(gpu, &staging);
    return image;
}

void resources_create(Gpu* gpu, const Scene* scene, Resources* resources) {
    memset(resources, 0, sizeof *resources);
    /* What an engine for VK_NV_ray_tracing writes here, made valid without the extension. */
    const VkBufferUsageFlags usage =
        rtrTranslateBufferUsage(VK_BUFFER_USAGE_VERTEX_BUFFER_BIT | VK_BUFFER_USAGE_INDEX_BUFFER_BIT |
                                VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_RAY_TRACING_BIT_NV);
    for (uint32_t i = 0; i < MESH_COUNT; ++i) {
        const Mesh* mesh = &scene->meshes[i];
        const size_t vertexBytes = mesh->vertexCount * sizeof *mesh->vertices;
        const size_t indexBytes = mesh->indexCount * sizeof *mesh->indices;
        resources->vertices[i] = buffer_create(gpu, vertexBytes, usage, MEMORY_HOST);
        resources->indices[i] = buffer_create(gpu, indexBytes, usage, MEMORY_HOST);
        fill(&resources->vertices[i], mesh->vertices, vertexBytes);
        fill(&resources->indices[i], mesh->indices, indexBytes);
    }
    for (uint32_t slot = 0; slot < FRAMES_IN_FLIGHT; ++slot) {
        const Mesh* cloth = &scene->meshes[MESH_CLOTH];
        resources->cloth[slot] =
            buffer_create(gpu, cloth->vertexCount * sizeof *cloth->vertices, usage, MEMORY_HOST);
        resources->instances[slot] = buffer_create(
            gpu, INSTANCE_COUNT * sizeof(VkAccelerationStructureInstanceNV), usage, MEMORY_HOST);
    }
    for (uint32_t i = 0; i < TEXTURE_COUNT; ++i)
        resources->textures[i] = texture_create(gpu, scene->textures[i]);
    VkSamplerCreateInfo sampler = {VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO};
    sampler.addressModeU = sampler.addressModeV = sampler.addressModeW = VK_SAMPLER_ADDRESS_MODE_REPEAT;
    CHECK(vkCreateSampler(gpu->device, &sampler, NULL, &resources->sampler));
}

void resources_destroy(Gpu* gpu, Resources* resources) {
    vkDestroySampler(gpu->device, resources->sampler, NULL);
    for (uint32_t i = 0; i < TEXTURE_COUNT; ++i) image_destroy(gpu, &resources->textures[i]);
    for (uint32_t i = 0; i < MESH_COUNT; ++i) {
        buffer_destroy(gpu, &resources->vertices[i]);
        buffer_destroy(gpu, &resources->indices[i]);
    }
    for (uint32_t slot = 0; slot < FRAMES_IN_FLIGHT; ++slot) {
        buffer_destroy(gpu, &resources->cloth[slot]);
        buffer_destroy(gpu, &resources->instances[slot]);
    }
}

VkBuffer resources_vertices(const Resources* resources, uint32_t mesh, uint32_t slot) {
    return mesh == MESH_CLOTH ? resources->cloth[slot].handle : resources->vertices[mesh].handle;
}
