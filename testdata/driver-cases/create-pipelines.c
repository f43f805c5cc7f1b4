// Creates a compute pipeline of each module whose path stands on a line of stdin, and prints "ok PATH RESULT". A module
// that crashes the driver takes the process with it. See README.md.
//   cc -O1 create-pipelines.c -o create-pipelines -ldl && echo module.spv | ./create-pipelines NAME-OF-DEVICE
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#define VK_NO_PROTOTYPES
#include <vulkan/vulkan.h>

static PFN_vkGetInstanceProcAddr gipa;
#define INSTANCE(name) PFN_##name name = (PFN_##name)gipa(instance, #name)
#define DEVICE(name) PFN_##name name = (PFN_##name)vkGetDeviceProcAddr(device, #name)
#define MAX_BOUND 65536

typedef struct { uint32_t op, type, a, b, c; } Def;
static Def defs[MAX_BOUND];
static uint32_t set_of[MAX_BOUND], binding_of[MAX_BOUND];
static char has_set[MAX_BOUND], buffer_block[MAX_BOUND];

int main(int argc, char** argv) {
    void* lib = dlopen("libvulkan.so.1", RTLD_NOW);
    if (!lib) return fprintf(stderr, "%s\n", dlerror()), 2;
    gipa = (PFN_vkGetInstanceProcAddr)dlsym(lib, "vkGetInstanceProcAddr");
    VkInstance instance = NULL;
    INSTANCE(vkCreateInstance);
    VkApplicationInfo app = {VK_STRUCTURE_TYPE_APPLICATION_INFO};
    app.apiVersion = VK_API_VERSION_1_3;
    VkInstanceCreateInfo info = {VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO};
    info.pApplicationInfo = &app;
    if (vkCreateInstance(&info, NULL, &instance)) return fprintf(stderr, "no instance\n"), 2;
    INSTANCE(vkEnumeratePhysicalDevices);
    INSTANCE(vkGetPhysicalDeviceProperties);
    INSTANCE(vkGetPhysicalDeviceFeatures2);
    INSTANCE(vkCreateDevice);
    INSTANCE(vkGetDeviceProcAddr);
    VkPhysicalDevice all[16], physical = NULL;
    uint32_t n = 16;
    vkEnumeratePhysicalDevices(instance, &n, all);
    VkPhysicalDeviceProperties properties;
    for (uint32_t i = 0; i < n && !physical; ++i) {
        vkGetPhysicalDeviceProperties(all[i], &properties);
        if (argc < 2 || strstr(properties.deviceName, argv[1])) physical = all[i];
    }
    if (!physical) return fprintf(stderr, "no device '%s'\n", argv[1]), 2;
    fprintf(stderr, "%s, driver %x\n", properties.deviceName, properties.driverVersion);
    VkPhysicalDeviceVulkan13Features f13 = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES};
    VkPhysicalDeviceVulkan12Features f12 = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES, &f13};
    VkPhysicalDeviceVulkan11Features f11 = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_FEATURES, &f12};
    VkPhysicalDeviceFeatures2 features = {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, &f11};
    vkGetPhysicalDeviceFeatures2(physical, &features);
    features.features.robustBufferAccess = 0;
    f13.robustImageAccess = 0;
    float priority = 1;
    VkDeviceQueueCreateInfo queue = {VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO};
    queue.queueCount = 1;
    queue.pQueuePriorities = &priority;
    VkDeviceCreateInfo dinfo = {VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO, &features};
    dinfo.queueCreateInfoCount = 1;
    dinfo.pQueueCreateInfos = &queue;
    VkDevice device;
    if (vkCreateDevice(physical, &dinfo, NULL, &device)) return fprintf(stderr, "no device\n"), 2;
    DEVICE(vkCreateShaderModule);
    DEVICE(vkDestroyShaderModule);
    DEVICE(vkCreateDescriptorSetLayout);
    DEVICE(vkDestroyDescriptorSetLayout);
    DEVICE(vkCreatePipelineLayout);
    DEVICE(vkDestroyPipelineLayout);
    DEVICE(vkCreateComputePipelines);
    DEVICE(vkDestroyPipeline);
    printf("ready\n");
    fflush(stdout);

    static char path[4096];
    static uint32_t words[1 << 22];
    while (fgets(path, sizeof path, stdin)) {
        path[strcspn(path, "\n")] = 0;
        FILE* file = fopen(path, "rb");
        if (!file) { printf("ok %s unreadable\n", path); fflush(stdout); continue; }
        size_t count = fread(words, 4, sizeof words / 4, file);
        fclose(file);
        memset(defs, 0, sizeof defs);
        memset(has_set, 0, sizeof has_set);
        memset(buffer_block, 0, sizeof buffer_block);
        VkDescriptorSetLayoutBinding bindings[8][64];
        uint32_t counts[8] = {0}, sets = 0;
        for (size_t at = 5; at < count && (words[at] >> 16);) {
            uint32_t op = words[at] & 0xffff, len = words[at] >> 16, *w = words + at;
            at += len;
            if (op == 71 && w[1] < MAX_BOUND) {  // OpDecorate
                if (w[2] == 34) set_of[w[1]] = w[3], has_set[w[1]] = 1;
                if (w[2] == 33) binding_of[w[1]] = w[3];
                if (w[2] == 3) buffer_block[w[1]] = 1;
            }
            if (op >= 19 && op <= 33 && w[1] < MAX_BOUND) {  // types
                Def d = {op, 0, len > 2 ? w[2] : 0, len > 3 ? w[3] : 0, len > 8 ? w[7] : 0};
                defs[w[1]] = d;
            }
            if (op == 25) defs[w[1]].b = w[3], defs[w[1]].c = w[7];  // image: dim, sampled
            if (op == 43 && w[2] < MAX_BOUND) { Def d = {op, w[1], w[3], 0, 0}; defs[w[2]] = d; }
            if (op == 59 && w[2] < MAX_BOUND && has_set[w[2]]) {
                uint32_t storage = w[3], type = defs[w[1]].b, array = 1, s = set_of[w[2]];
                if (defs[type].op == 28) array = defs[defs[type].b].a, type = defs[type].a;
                VkDescriptorType kind = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
                if (storage == 2 && !buffer_block[type]) kind = VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER;
                if (storage == 0) {
                    uint32_t dim = defs[type].b, sampled = defs[type].c;
                    kind = defs[type].op == 26   ? VK_DESCRIPTOR_TYPE_SAMPLER
                           : defs[type].op == 27 ? VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER
                           : dim == 5            ? (sampled == 1 ? VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER
                                                                 : VK_DESCRIPTOR_TYPE_STORAGE_TEXEL_BUFFER)
                           : sampled == 1        ? VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE
                                                 : VK_DESCRIPTOR_TYPE_STORAGE_IMAGE;
                }
                if (s < 8 && counts[s] < 64) {
                    VkDescriptorSetLayoutBinding b = {binding_of[w[2]], kind, array, VK_SHADER_STAGE_COMPUTE_BIT, NULL};
                    int there = 0;
                    for (uint32_t i = 0; i < counts[s]; ++i) there |= bindings[s][i].binding == b.binding;
                    if (!there) bindings[s][counts[s]++] = b;
                    if (s + 1 > sets) sets = s + 1;
                }
            }
        }
        VkDescriptorSetLayout layouts[8];
        for (uint32_t s = 0; s < sets; ++s) {
            VkDescriptorSetLayoutCreateInfo l = {VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO};
            l.bindingCount = counts[s];
            l.pBindings = bindings[s];
            vkCreateDescriptorSetLayout(device, &l, NULL, &layouts[s]);
        }
        VkPipelineLayoutCreateInfo pl = {VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO};
        pl.setLayoutCount = sets;
        pl.pSetLayouts = layouts;
        VkPipelineLayout layout;
        vkCreatePipelineLayout(device, &pl, NULL, &layout);
        VkShaderModuleCreateInfo m = {VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO};
        m.codeSize = count * 4;
        m.pCode = words;
        VkShaderModule module = VK_NULL_HANDLE;
        VkResult result = vkCreateShaderModule(device, &m, NULL, &module);
        VkPipeline pipeline = VK_NULL_HANDLE;
        if (!result) {
            VkComputePipelineCreateInfo c = {VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO};
            c.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
            c.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
            c.stage.module = module;
            c.stage.pName = "main";
            c.layout = layout;
            result = vkCreateComputePipelines(device, VK_NULL_HANDLE, 1, &c, NULL, &pipeline);
        }
        printf("ok %s %d\n", path, result);
        fflush(stdout);
        vkDestroyPipeline(device, pipeline, NULL);
        vkDestroyShaderModule(device, module, NULL);
        vkDestroyPipelineLayout(device, layout, NULL);
        for (uint32_t s = 0; s < sets; ++s) vkDestroyDescriptorSetLayout(device, layouts[s], NULL);
    }
    return 0;
}
