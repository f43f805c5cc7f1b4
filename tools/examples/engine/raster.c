/* The raster pass: positions, normals and surface parameters of what the camera sees. */
#include "engine.h"

#include <string.h>

static const uint32_t kVertexShader[] = {
#include "gbuffer.vert.inc"
};
static const uint32_t kFragmentShader[] = {
#include "gbuffer.frag.inc"
};

/* The push constants of gbuffer.vert and gbuffer.frag: 128 bytes, what every device has. */
typedef struct Push {
    float eye[4], right[4], up[4], forward[4];
    float transform[3][4];
    float instance, material, mirror, cutout; /* instance + 1; cutout: texture + 1, 0: none */
} Push;

static void create_pass(Gpu* gpu, Raster* raster) {
    VkAttachmentDescription attachments[GBUFFER_COUNT + 1];
    VkAttachmentReference colors[GBUFFER_COUNT];
    VkImageView views[GBUFFER_COUNT + 1];
    for (uint32_t i = 0; i <= GBUFFER_COUNT; ++i) {
        const bool depth = i == GBUFFER_COUNT;
        attachments[i] = (VkAttachmentDescription){
            .format = depth ? VK_FORMAT_D32_SFLOAT : VK_FORMAT_R32G32B32A32_SFLOAT,
            .samples = VK_SAMPLE_COUNT_1_BIT,
            .loadOp = VK_ATTACHMENT_LOAD_OP_CLEAR,
            .storeOp = depth ? VK_ATTACHMENT_STORE_OP_DONT_CARE : VK_ATTACHMENT_STORE_OP_STORE,
            .stencilLoadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE,
            .stencilStoreOp = VK_ATTACHMENT_STORE_OP_DONT_CARE,
            .finalLayout =
                depth ? VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL : VK_IMAGE_LAYOUT_GENERAL};
        if (!depth) colors[i] = (VkAttachmentReference){i, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL};
        views[i] = depth ? raster->depth.view : raster->targets[i].view;
    }
    const VkAttachmentReference depth = {GBUFFER_COUNT, VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL};
    const VkSubpassDescription subpass = {.pipelineBindPoint = VK_PIPELINE_BIND_POINT_GRAPHICS,
                                          .colorAttachmentCount = GBUFFER_COUNT,
                                          .pColorAttachments = colors,
                                          .pDepthStencilAttachment = &depth};
    /* [guide: gbuffer-barrier] */
    const VkPipelineStageFlags trace =
        rtrTranslatePipelineStages(VK_PIPELINE_STAGE_RAY_TRACING_SHADER_BIT_NV);
    const VkPipelineStageFlags draw = VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT |
                                      VK_PIPELINE_STAGE_EARLY_FRAGMENT_TESTS_BIT |
                                      VK_PIPELINE_STAGE_LATE_FRAGMENT_TESTS_BIT;
    const VkSubpassDependency dependencies[2] = {
        /* the frame before has read (traced, copied) what this one overwrites */
        {VK_SUBPASS_EXTERNAL, 0, trace | draw | VK_PIPELINE_STAGE_TRANSFER_BIT, draw,
         VK_ACCESS_DEPTH_STENCIL_ATTACHMENT_WRITE_BIT,
         VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT | VK_ACCESS_DEPTH_STENCIL_ATTACHMENT_READ_BIT |
             VK_ACCESS_DEPTH_STENCIL_ATTACHMENT_WRITE_BIT,
         0},
        /* the rays of this frame read what it has drawn */
        {0, VK_SUBPASS_EXTERNAL, VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT,
         trace | VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT,
         VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_TRANSFER_READ_BIT, 0}};
    /* [guide] */
    VkRenderPassCreateInfo info = {VK_STRUCTURE_TYPE_RENDER_PASS_CREATE_INFO};
    info.attachmentCount = GBUFFER_COUNT + 1;
    info.pAttachments = attachments;
    info.subpassCount = 1;
    info.pSubpasses = &subpass;
    info.dependencyCount = 2;
    info.pDependencies = dependencies;
    CHECK(vkCreateRenderPass(gpu->device, &info, NULL, &raster->pass));
    VkFramebufferCreateInfo framebuffer = {VK_STRUCTURE_TYPE_FRAMEBUFFER_CREATE_INFO};
    framebuffer.renderPass = raster->pass;
    framebuffer.attachmentCount = GBUFFER_COUNT + 1;
    framebuffer.pAttachments = views;
    framebuffer.width = raster->width;
    framebuffer.height = raster->height;
    framebuffer.layers = 1;
    CHECK(vkCreateFramebuffer(gpu->device, &framebuffer, NULL, &raster->framebuffer));
}

static void create_set(Gpu* gpu, const Resources* resources, Raster* raster) {
    const VkDescriptorSetLayoutBinding binding = {0, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, TEXTURE_COUNT,
                                                  VK_SHADER_STAGE_FRAGMENT_BIT, NULL};
    VkDescriptorSetLayoutCreateInfo layout = {VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO};
    layout.bindingCount = 1;
    layout.pBindings = &binding;
    CHECK(vkCreateDescriptorSetLayout(gpu->device, &layout, NULL, &raster->setLayout));
    const VkDescriptorPoolSize size = {VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, TEXTURE_COUNT};
    VkDescriptorPoolCreateInfo pool = {VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO};
    pool.maxSets = pool.poolSizeCount = 1;
    pool.pPoolSizes = &size;
    CHECK(vkCreateDescriptorPool(gpu->device, &pool, NULL, &raster->descriptors));
    VkDescriptorSetAllocateInfo allocation = {VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO};
    allocation.descriptorPool = raster->descriptors;
    allocation.descriptorSetCount = 1;
    allocation.pSetLayouts = &raster->setLayout;
    CHECK(vkAllocateDescriptorSets(gpu->device, &allocation, &raster->set));
    VkDescriptorImageInfo images[TEXTURE_COUNT];
    for (uint32_t i = 0; i < TEXTURE_COUNT; ++i)
        images[i] = (VkDescriptorImageInfo){resources->sampler, resources->textures[i].view,
                                            VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL};
    VkWriteDescriptorSet write = {VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
    write.dstSet = raster->set;
    write.descriptorCount = TEXTURE_COUNT;
    write.descriptorType = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER;
    write.pImageInfo = images;
    vkUpdateDescriptorSets(gpu->device, 1, &write, 0, NULL);
}

static void create_pipeline(Gpu* gpu, Raster* raster) {
    const VkPushConstantRange range = {VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT, 0,
                                       sizeof(Push)};
    VkPipelineLayoutCreateInfo layout = {VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO};
    layout.setLayoutCount = layout.pushConstantRangeCount = 1;
    layout.pSetLayouts = &raster->setLayout;
    layout.pPushConstantRanges = &range;
    CHECK(vkCreatePipelineLayout(gpu->device, &layout, NULL, &raster->layout));

    VkPipelineShaderStageCreateInfo stages[2] = {{VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO},
                                                 {VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO}};
    stages[0].stage = VK_SHADER_STAGE_VERTEX_BIT;
    stages[0].module = shader_create(gpu, kVertexShader, sizeof kVertexShader);
    stages[1].stage = VK_SHADER_STAGE_FRAGMENT_BIT;
    stages[1].module = shader_create(gpu, kFragmentShader, sizeof kFragmentShader);
    stages[0].pName = stages[1].pName = "main";
    const VkVertexInputBindingDescription binding = {0, sizeof(Vertex), VK_VERTEX_INPUT_RATE_VERTEX};
    const VkVertexInputAttributeDescription attributes[2] = {{0, 0, VK_FORMAT_R32G32B32A32_SFLOAT, 0},
                                                             {1, 0, VK_FORMAT_R32G32B32A32_SFLOAT, 16}};
    VkPipelineVertexInputStateCreateInfo input = {VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO};
    input.vertexBindingDescriptionCount = 1;
    input.pVertexBindingDescriptions = &binding;
    input.vertexAttributeDescriptionCount = 2;
    input.pVertexAttributeDescriptions = attributes;
    VkPipelineInputAssemblyStateCreateInfo assembly = {
        VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO};
    assembly.topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST;
    const VkViewport viewport = {0, 0, (float)raster->width, (float)raster->height, 0, 1};
    const VkRect2D scissor = {{0, 0}, {raster->width, raster->height}};
    VkPipelineViewportStateCreateInfo view = {VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO};
    view.viewportCount = view.scissorCount = 1;
    view.pViewports = &viewport;
    view.pScissors = &scissor;
    VkPipelineRasterizationStateCreateInfo rasterization = {
        VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO};
    rasterization.lineWidth = 1.0f;
    VkPipelineMultisampleStateCreateInfo samples = {VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO};
    samples.rasterizationSamples = VK_SAMPLE_COUNT_1_BIT;
    VkPipelineDepthStencilStateCreateInfo depth = {
        VK_STRUCTURE_TYPE_PIPELINE_DEPTH_STENCIL_STATE_CREATE_INFO};
    depth.depthTestEnable = depth.depthWriteEnable = VK_TRUE;
    depth.depthCompareOp = VK_COMPARE_OP_LESS;
    VkPipelineColorBlendAttachmentState blends[GBUFFER_COUNT] = {{.colorWriteMask = 0xf}};
    for (uint32_t i = 1; i < GBUFFER_COUNT; ++i) blends[i] = blends[0];
    VkPipelineColorBlendStateCreateInfo blend = {VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO};
    blend.attachmentCount = GBUFFER_COUNT;
    blend.pAttachments = blends;
    VkGraphicsPipelineCreateInfo info = {VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO};
    info.stageCount = 2;
    info.pStages = stages;
    info.pVertexInputState = &input;
    info.pInputAssemblyState = &assembly;
    info.pViewportState = &view;
    info.pRasterizationState = &rasterization;
    info.pMultisampleState = &samples;
    info.pDepthStencilState = &depth;
    info.pColorBlendState = &blend;
    info.layout = raster->layout;
    info.renderPass = raster->pass;
    CHECK(vkCreateGraphicsPipelines(gpu->device, VK_NULL_HANDLE, 1, &info, NULL, &raster->pipeline));
    vkDestroyShaderModule(gpu->device, stages[0].module, NULL);
    vkDestroyShaderModule(gpu->device, stages[1].module, NULL);
}

void raster_create(Gpu* gpu, const Resources* resources, uint32_t width, uint32_t height, Raster* raster) {
    memset(raster, 0, sizeof *raster);
    raster->width = width;
    raster->height = height;
    const VkImageUsageFlags usage =
        VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_STORAGE_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT;
    for (uint32_t i = 0; i < GBUFFER_COUNT; ++i)
        raster->targets[i] =
            image_create(gpu, width, height, VK_FORMAT_R32G32B32A32_SFLOAT, usage, VK_IMAGE_ASPECT_COLOR_BIT);
    raster->depth = image_create(gpu, width, height, VK_FORMAT_D32_SFLOAT,
                                 VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT, VK_IMAGE_ASPECT_DEPTH_BIT);
    create_pass(gpu, raster);
    create_set(gpu, resources, raster);
    create_pipeline(gpu, raster);
}

void raster_destroy(Gpu* gpu, Raster* raster) {
    vkDestroyPipeline(gpu->device, raster->pipeline, NULL);
    vkDestroyPipelineLayout(gpu->device, raster->layout, NULL);
    vkDestroyDescriptorPool(gpu->device, raster->descriptors, NULL);
    vkDestroyDescriptorSetLayout(gpu->device, raster->setLayout, NULL);
    vkDestroyFramebuffer(gpu->device, raster->framebuffer, NULL);
    vkDestroyRenderPass(gpu->device, raster->pass, NULL);
    for (uint32_t i = 0; i < GBUFFER_COUNT; ++i) image_destroy(gpu, &raster->targets[i]);
    image_destroy(gpu, &raster->depth);
}

void raster_record(const Raster* raster, const Scene* scene, const Resources* resources, VkCommandBuffer cb,
                   uint32_t slot) {
    VkClearValue clears[GBUFFER_COUNT + 1];
    memset(clears, 0, sizeof clears);
    clears[GBUFFER_COUNT].depthStencil.depth = 1.0f;
    VkRenderPassBeginInfo begin = {VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO};
    begin.renderPass = raster->pass;
    begin.framebuffer = raster->framebuffer;
    begin.renderArea.extent = (VkExtent2D){raster->width, raster->height};
    begin.clearValueCount = GBUFFER_COUNT + 1;
    begin.pClearValues = clears;
    vkCmdBeginRenderPass(cb, &begin, VK_SUBPASS_CONTENTS_INLINE);
    vkCmdBindPipeline(cb, VK_PIPELINE_BIND_POINT_GRAPHICS, raster->pipeline);
    vkCmdBindDescriptorSets(cb, VK_PIPELINE_BIND_POINT_GRAPHICS, raster->layout, 0, 1, &raster->set, 0, NULL);
    for (uint32_t i = 0; i < INSTANCE_COUNT; ++i) {
        const Instance* instance = &scene->instances[i];
        const Mesh* mesh = &scene->meshes[instance->mesh];
        Push push;
        memcpy(&push, &scene->camera, 4 * sizeof push.eye);
        memcpy(push.transform, instance->transform, sizeof push.transform);
        push.instance = (float)(i + 1);
        push.material = (float)mesh->material;
        push.mirror = mesh->mirror;
        push.cutout = mesh->cutout ? (float)(mesh->texture + 1) : 0.0f;
        vkCmdPushConstants(cb, raster->layout, VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT, 0,
                           sizeof push, &push);
        const VkBuffer vertices = resources_vertices(resources, instance->mesh, slot);
        const VkDeviceSize zero = 0;
        vkCmdBindVertexBuffers(cb, 0, 1, &vertices, &zero);
        vkCmdBindIndexBuffer(cb, resources->indices[instance->mesh].handle, 0, VK_INDEX_TYPE_UINT32);
        vkCmdDrawIndexed(cb, mesh->indexCount, 1, 0, 0, 0);
    }
    vkCmdEndRenderPass(cb);
}
