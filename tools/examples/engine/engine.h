/* An example engine on the installed rtc package: rasterises a G-buffer, then traces shadows and reflections
 * in the same command buffer. README.md says what each file shows. */
#ifndef ENGINE_H_
#define ENGINE_H_

#include <rtc/runtime.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <vulkan/vulkan.h>

/* Prints what failed and ends the program: this is an example, not an error policy. */
void engine_check(VkResult result, const char* what, const char* file, int line);
#define CHECK(call) engine_check((call), #call, __FILE__, __LINE__)

/* ---- setup.c: plain Vulkan ---------------------------------------------------- */

typedef struct Gpu {
    VkInstance instance;
    VkDebugUtilsMessengerEXT messenger;
    VkPhysicalDevice physical;
    VkDevice device;
    uint32_t queueFamily;
    VkQueue queue;
    VkCommandPool pool;
    VkPhysicalDeviceMemoryProperties memory;
    bool nonUniformIndexing; /* descriptor arrays may be indexed by values that differ between lanes */
    uint32_t messages;       /* of the validation layers and of the runtime, warnings and errors */
    RtrDevice rtr;
} Gpu;

typedef struct Buffer {
    VkBuffer handle;
    VkDeviceMemory memory;
    VkDeviceSize size;
    void* mapped; /* NULL when device local */
} Buffer;

typedef struct Image {
    VkImage handle;
    VkDeviceMemory memory;
    VkImageView view;
    uint32_t width, height;
} Image;

typedef enum MemoryKind { MEMORY_DEVICE, MEMORY_HOST } MemoryKind;

void gpu_create(Gpu* gpu, const char* wantedDevice, bool validate);
void gpu_destroy(Gpu* gpu);
Buffer buffer_create(Gpu* gpu, VkDeviceSize size, VkBufferUsageFlags usage, MemoryKind kind);
void buffer_destroy(Gpu* gpu, Buffer* buffer);
Image image_create(Gpu* gpu, uint32_t width, uint32_t height, VkFormat format, VkImageUsageFlags usage,
                   VkImageAspectFlags aspect);
void image_destroy(Gpu* gpu, Image* image);
VkShaderModule shader_create(Gpu* gpu, const uint32_t* words, size_t bytes);
VkCommandBuffer commands_begin(Gpu* gpu);           /* one-time commands */
void commands_finish(Gpu* gpu, VkCommandBuffer cb); /* submits, waits, frees */
void image_barrier(VkCommandBuffer cb, VkImage image, VkImageAspectFlags aspect, VkImageLayout from,
                   VkImageLayout to, VkPipelineStageFlags srcStage, VkAccessFlags srcAccess,
                   VkPipelineStageFlags dstStage, VkAccessFlags dstAccess);

/* ---- scene.c: what is in the picture -------------------------------------------- */

typedef struct Vertex { /* 32 bytes: the raster pass and the hit shaders read the same buffers */
    float position[3], u;
    float normal[3], v;
} Vertex;

enum { MESH_FLOOR, MESH_CLOTH, MESH_BOX, MESH_LEAVES, MESH_COUNT };
enum { TEXTURE_TILES, TEXTURE_LEAVES, TEXTURE_COUNT, TEXTURE_SIZE = 16 };
enum { MATERIAL_TILES, MATERIAL_CLOTH, MATERIAL_BOX, MATERIAL_LEAVES, MATERIAL_COUNT };
enum { INSTANCE_COUNT = 6 };

typedef struct Mesh {
    Vertex* vertices;
    uint32_t vertexCount;
    uint32_t* indices;
    uint32_t indexCount;
    bool cutout;      /* texels of the material's texture with alpha < 0.5 are holes */
    uint32_t texture; /* of cutouts */
    uint32_t material;
    float mirror; /* share of reflected light */
} Mesh;

typedef struct Instance {
    uint32_t mesh;
    float transform[3][4];
} Instance;

/* What a callable's shader record holds: material.glsl reads the same layout (std430). */
typedef struct MaterialRecord {
    uint32_t texture;
    float scale; /* stripes a unit of u */
    float pad[2];
    float first[4], second[4];
} MaterialRecord;

/* What a hit group's record holds: indices into the arrays of descriptors. */
typedef struct MeshRecord {
    uint32_t vertexBuffer, indexBuffer, maskTexture, material;
} MeshRecord;

typedef struct SkyRecord {
    float low[4], high[4];
} SkyRecord;

typedef struct Camera {
    float eye[4], right[4], up[4], forward[4]; /* right and up are as long as the picture is wide and high */
    float light[4];                            /* direction towards it */
} Camera;

typedef struct Scene {
    Mesh meshes[MESH_COUNT];
    Instance instances[INSTANCE_COUNT];
    MaterialRecord materials[MATERIAL_COUNT];
    SkyRecord sky;
    uint8_t textures[TEXTURE_COUNT][TEXTURE_SIZE][TEXTURE_SIZE][4];
    Camera camera;
} Scene;

void scene_create(Scene* scene, float aspect);
void scene_animate(Scene* scene, uint32_t frame); /* moves the cloth's vertices and the instances */
void scene_destroy(Scene* scene);

/* ---- resources.c: the scene in device memory --------------------------------------- */

#define FRAMES_IN_FLIGHT 2

typedef struct Resources {
    Buffer vertices[MESH_COUNT], indices[MESH_COUNT];
    Buffer cloth[FRAMES_IN_FLIGHT];     /* the animated vertices, written by the host each frame */
    Buffer instances[FRAMES_IN_FLIGHT]; /* VkAccelerationStructureInstanceNV, likewise */
    Image textures[TEXTURE_COUNT];
    VkSampler sampler;
} Resources;

void resources_create(Gpu* gpu, const Scene* scene, Resources* resources);
void resources_destroy(Gpu* gpu, Resources* resources);
VkBuffer resources_vertices(const Resources* resources, uint32_t mesh, uint32_t slot);

/* ---- structures.c: acceleration structures ------------------------------------------- */

typedef struct Structures {
    Buffer heapBuffer, scratch, clothScratch;
    RtrHeap heap;
    RtrAccelerationStructure bottom[MESH_COUNT], top;
    VkDeviceSize before, after; /* bytes of the static bottom levels, before and after compaction */
} Structures;

void structures_create(Gpu* gpu, const Scene* scene, const Resources* resources, Structures* structures);
void structures_destroy(Gpu* gpu, Structures* structures);
void structures_write_instances(Gpu* gpu, const Structures* structures, const Scene* scene, void* mapped);
/* Refits the cloth, rebuilds the top level. */
void structures_record(const Structures* structures, const Scene* scene, const Resources* resources,
                       RtrRecorder recorder, VkCommandBuffer cb, uint32_t slot);

/* ---- raster.c: the G-buffer ------------------------------------------------------------ */

/* position.xyz, instance + 1 | normal.xyz, 0 | u, v, material, mirror */
enum { GBUFFER_POSITION, GBUFFER_NORMAL, GBUFFER_SURFACE, GBUFFER_COUNT };

typedef struct Raster {
    uint32_t width, height;
    Image targets[GBUFFER_COUNT], depth;
    VkRenderPass pass;
    VkFramebuffer framebuffer;
    VkDescriptorSetLayout setLayout;
    VkDescriptorPool descriptors;
    VkDescriptorSet set;
    VkPipelineLayout layout;
    VkPipeline pipeline;
} Raster;

void raster_create(Gpu* gpu, const Resources* resources, uint32_t width, uint32_t height, Raster* raster);
void raster_destroy(Gpu* gpu, Raster* raster);
void raster_record(const Raster* raster, const Scene* scene, const Resources* resources, VkCommandBuffer cb,
                   uint32_t slot);

/* ---- tracing.c: the ray tracing pipeline ------------------------------------------------ */

typedef struct Tracing {
    RtrPipeline pipeline;
    VkDescriptorSetLayout setLayouts[2];
    VkDescriptorPool descriptors;
    VkDescriptorSet sets[FRAMES_IN_FLIGHT][2];
    Buffer table;
    RtrSbtLayout tableLayout;
    Image picture;
    Buffer launchScratch;
    Buffer control[FRAMES_IN_FLIGHT];
    RtrRecorder recorders[FRAMES_IN_FLIGHT];
} Tracing;

void tracing_create(Gpu* gpu, const Scene* scene, const Resources* resources, const Structures* structures,
                    const Raster* raster, Tracing* tracing);
void tracing_destroy(Gpu* gpu, Tracing* tracing);
void tracing_record(const Tracing* tracing, const Structures* structures, const Scene* scene, uint32_t slot,
                    uint32_t width, uint32_t height);
/* After the frame's fence: false, with a line on stderr, when a launch reported an error. */
bool tracing_finish(const Tracing* tracing, uint32_t slot);

/* ---- reference.c: the same picture on the host ------------------------------------------- */

/* Compares a frame with a picture computed by brute force from the same G-buffer: RGBA floats each, row by
 * row. Prints what differs; false when more than one pixel in a hundred does. */
bool reference_compare(const Scene* scene, uint32_t width, uint32_t height, const float* position,
                       const float* normal, const float* surface, const float* picture);

#endif /* ENGINE_H_ */
