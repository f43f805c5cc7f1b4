// Making and mending meshes.
#pragma once

#include "scene.h"

namespace rtc::tools {

// Gives a mesh without normals smooth ones; edges sharper than `crease_degrees` stay sharp, which
// splits their vertices. Triangles that share a position are neighbours, whatever their indices.
void add_smooth_normals(Mesh& mesh, float crease_degrees);

Mesh make_quad(const glm::vec3& corner, const glm::vec3& edge_u, const glm::vec3& edge_v, uint32_t material);
Mesh make_box(const glm::vec3& low, const glm::vec3& high, uint32_t material);  // flat shaded, outward
Mesh make_icosphere(float radius, uint32_t subdivisions, uint32_t material);    // smooth
void append(Mesh& mesh, const Mesh& more);  // materials become per triangle

}  // namespace rtc::tools
