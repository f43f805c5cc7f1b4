// What the build benchmark measures: a builder with one structure, rtc's or the device's own.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "../native/executor.h"
#include "rtc_device.h"
#include "scene.h"

namespace rtc::bench {

struct BuildInput {
    tools::Mesh mesh;
    // Not empty: instances of the mesh, and the top level over them is what is measured.
    std::vector<glm::mat4> instances;
    // Bottom levels of the mesh, all built each time: in one call, or one after the other.
    uint32_t copies = 1;
    bool together = false;
    bool fast_build = false, low_memory = false, allow_update = false;
};

// The mesh as one opaque geometry, whose vertices and indices lie in these buffers.
inline VkGeometryNV mesh_geometry(const tools::Mesh& mesh, VkBuffer positions, VkBuffer indices) {
    VkGeometryNV geometry{};
    geometry.sType = VK_STRUCTURE_TYPE_GEOMETRY_NV;
    geometry.geometryType = VK_GEOMETRY_TYPE_TRIANGLES_NV;
    geometry.flags = VK_GEOMETRY_OPAQUE_BIT_NV;
    geometry.geometry.aabbs.sType = VK_STRUCTURE_TYPE_GEOMETRY_AABB_NV;
    VkGeometryTrianglesNV& triangles = geometry.geometry.triangles;
    triangles.sType = VK_STRUCTURE_TYPE_GEOMETRY_TRIANGLES_NV;
    triangles.vertexData = positions;
    triangles.vertexCount = uint32_t(mesh.positions.size());
    triangles.vertexStride = sizeof(glm::vec3);
    triangles.vertexFormat = VK_FORMAT_R32G32B32_SFLOAT;
    triangles.indexData = indices;
    triangles.indexCount = uint32_t(mesh.indices.size());
    triangles.indexType = VK_INDEX_TYPE_UINT32;
    return geometry;
}

class BuildSubject {
  public:
    explicit BuildSubject(std::string name_) : name(std::move(name_)) {}
    virtual ~BuildSubject() = default;
    virtual void record_build(VkCommandBuffer commands) = 0;
    virtual void record_update(VkCommandBuffer commands) = 0;  // in place; needs allow_update
    // After a build: bytes a compacted copy would take.
    virtual VkDeviceSize compacted_bytes() = 0;

    const std::string name;
    VkDeviceSize bytes = 0, scratch_bytes = 0, update_scratch_bytes = 0;
};

std::unique_ptr<BuildSubject> make_rtc_subject(const tools::RtcDevice& device, const BuildInput& input);
std::unique_ptr<BuildSubject> make_khr_subject(const tools::Context& context, const BuildInput& input);
std::unique_ptr<BuildSubject> make_nv_subject(const tools::Context& context, const BuildInput& input);

}  // namespace rtc::bench
