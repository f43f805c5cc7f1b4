// One ray tracing launch described once, whoever executes it: rtc's compute
// pipeline (rtc_job.h) or a device's own ray tracing.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <string>
#include <vector>

#include "resources.h"
#include "scene.h"

namespace rtc::tools {

enum class JobStage : uint32_t { RayGen, Intersection, AnyHit, ClosestHit, Miss, Callable };

struct JobShader {
    JobStage stage = JobStage::RayGen;
    std::string name;             // unique in the pipeline
    std::string file;             // GLSL to compile; used when `spirv` is empty
    std::vector<uint32_t> spirv;  // one module with ray tracing instructions
    std::string entry = "main";
    struct Constant {
        uint32_t id;
        uint64_t value;
        uint32_t bytes = 4;
    };
    std::vector<Constant> constants;   // specialisation
    std::vector<std::string> defines;  // "NAME" or "NAME=VALUE", for GLSL
};

// Indices into JobPipeline::shaders, -1 for none. `general` set: a general group.
struct JobGroup {
    std::string name;
    int general = -1, closest_hit = -1, any_hit = -1, intersection = -1;
    bool procedural() const { return intersection >= 0; }
};

struct JobPipeline {
    std::vector<JobShader> shaders;
    std::vector<JobGroup> groups;
    uint32_t max_recursion = 1;
    uint32_t max_callable_depth = 0;
};

struct JobRecord {
    uint32_t group = ~0u;       // ~0u: a null group (a zero handle)
    std::vector<uint8_t> data;  // after the handle
};

struct JobTable {
    std::vector<JobRecord> raygen, miss, hit, callable;
    uint32_t raygen_index = 0;  // which raygen record the launch starts
};

// A descriptor: buffers, images, or acceleration structures (filled by the executor).
struct JobBinding {
    uint32_t set = 0, binding = 0;
    VkDescriptorType type = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    bool acceleration_structure = false;  // `type` is ignored; every element is the job's top level
    uint32_t count = 1;
    std::vector<VkDescriptorBufferInfo> buffers;
    std::vector<VkDescriptorImageInfo> images;
    std::vector<VkBufferView> texel_buffers;
};

struct RayTracingJob {
    JobPipeline pipeline;
    JobTable table;
    std::vector<JobBinding> bindings;
    std::vector<uint8_t> push_constants;
    uint32_t width = 1, height = 1, depth = 1;
};

}  // namespace rtc::tools
