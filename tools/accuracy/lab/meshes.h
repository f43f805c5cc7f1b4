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
// A mug with a handle: a subdivided cage, as modellers make them.
IndexedMesh make_mug(uint32_t subdivisions);
// Flat, in the plane z = 0: the thinnest boxes there are. Open.
IndexedMesh make_plane(uint32_t n);

// Vertices times `scale` plus `offset`, rounded once. The mesh stays closed:
// shared vertices move together.
IndexedMesh moved(const IndexedMesh& mesh, double scale, const std::array<double, 3>& offset);

// splitmix64: a generator that costs nothing to seed, so that every ray can have its own.
class Random {
  public:
    using result_type = uint64_t;
    explicit Random(uint64_t seed) : state_(seed) {}
    static constexpr uint64_t min() { return 0; }
    static constexpr uint64_t max() { return ~uint64_t(0); }
    uint64_t operator()() {
        uint64_t z = state_ += 0x9e3779b97f4a7c15ull;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
        return z ^ (z >> 31);
    }

  private:
    uint64_t state_;
};

enum class Aim { Interior, Edge, Vertex };
const char* aim_name(Aim aim);

// A random point of a random triangle, of one of its edges, or a vertex.
Vec3 aim_point(const IndexedMesh& mesh, Aim aim, Random& random);

}  // namespace rtc::lab
