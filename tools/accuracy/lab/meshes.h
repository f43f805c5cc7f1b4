// Closed meshes, outward oriented, and rays aimed at their weak spots.
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "host_scene.h"

namespace rtc::lab {

struct IndexedMesh {
    std::string name;
    std::vector<Vec3> vertices;
    std::vector<std::array<uint32_t, 3>> triangles;

    std::vector<Triangle> soup() const;
};

IndexedMesh make_icosphere(uint32_t subdivisions);
IndexedMesh make_torus_knot(uint32_t along, uint32_t around);
// A lens of long triangles from pole to rim, the rim's edges `ratio` long.
IndexedMesh make_slivers(uint32_t count, double ratio);
// A cube whose faces are n x n grids: rays along the axes meet its edges and vertices exactly.
IndexedMesh make_cube_grid(uint32_t n);
// Flat, in the plane z = 0: the thinnest boxes there are. Open.
IndexedMesh make_plane(uint32_t n);

// Vertices times `scale` plus `offset`, rounded once. The mesh stays closed:
// shared vertices move together.
IndexedMesh moved(const IndexedMesh& mesh, double scale, const std::array<double, 3>& offset);

enum class Aim { Interior, Edge, Vertex };
const char* aim_name(Aim aim);

// A random point of a random triangle, of one of its edges, or a vertex.
Vec3 aim_point(const IndexedMesh& mesh, Aim aim, std::mt19937_64& random);

}  // namespace rtc::lab
