// What a stage's SPIR-V says it needs from outside: descriptors, blocks with
// their layouts, specialisation constants, the shader record.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "../common/ray_tracing_job.h"

namespace rtc::run {

// A type as it lies in memory. Offsets and strides are those of the decorations.
struct Type {
    enum class Kind { Bool, Int, Uint, Float, Vector, Matrix, Array, Struct, Address, Opaque };
    struct Member {
        std::string name;
        std::shared_ptr<const Type> type;
        uint32_t offset = 0;
    };
    Kind kind = Kind::Opaque;
    uint32_t width = 32;     // bits of a scalar
    uint32_t count = 0;      // vector components, matrix columns, array elements; 0: run-time array
    uint32_t stride = 0;     // array elements, matrix columns (or rows)
    bool row_major = false;  // of a matrix
    std::shared_ptr<const Type> element;
    std::vector<Member> members;
    uint32_t size() const;  // bytes; a run-time array counts no element
};
using TypeRef = std::shared_ptr<const Type>;

struct ImageShape {
    uint32_t dim = 1;  // SpvDim: 0 1D, 1 2D, 2 3D, 3 Cube, 5 Buffer
    bool arrayed = false, multisampled = false;
    uint32_t format = 0;  // SpvImageFormat; 0: unknown
    Type::Kind component = Type::Kind::Float;
};

struct Resource {
    uint32_t set = 0, binding = 0;
    std::string name;
    VkDescriptorType type = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    bool acceleration_structure = false;
    uint32_t count = 1;  // 0: run-time array
    bool writable = false;
    TypeRef block;     // buffers
    ImageShape image;  // images and texel buffers
};

struct SpecConstant {
    uint32_t id = 0;
    std::string name;
    Type::Kind kind = Type::Kind::Uint;
    uint32_t width = 32;
};

struct Module {
    tools::JobStage stage = tools::JobStage::RayGen;
    std::string entry;
    std::vector<Resource> resources;
    std::vector<SpecConstant> constants;
    TypeRef push_constants, record;
    bool traces = false, calls = false;  // has a trace or executeCallable instruction
};

// `entry` empty: the module's first ray tracing entry point. Throws tools::Error on malformed words.
Module read_module(const std::vector<uint32_t>& words, const std::string& entry, const std::string& file);

}  // namespace rtc::run
