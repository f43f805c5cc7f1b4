// A mug as a modeller makes it: a cage of boxes, subdivided after Catmull and Clark. Its vertices have
// three to six neighbours, its triangles every shape, and it has a handle to pass through.
#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "meshes.h"

namespace rtc::lab {
namespace {

using P = std::array<double, 3>;
using Quad = std::array<uint32_t, 4>;

struct Cage {
    std::vector<P> points;
    std::vector<Quad> quads;
};

P mean(const std::vector<P>& points) {
    P sum{};
    for (const P& p : points)
        for (int i = 0; i < 3; ++i) sum[i] += p[i] / double(points.size());
    return sum;
}

Cage mug_cage() {
    std::set<std::array<int, 3>> cells;
    for (int x = 0; x < 4; ++x)
        for (int y = 0; y < 4; ++y)
            for (int z = 0; z < 5; ++z) {
                const bool hollow = x > 0 && x < 3 && y > 0 && y < 3 && z > 0;
                if (!hollow) cells.insert({x, y, z});
            }
    for (const auto& [x, z] : {std::pair(4, 1), {5, 1}, {5, 2}, {5, 3}, {4, 3}}) {
        cells.insert({x, 1, z});
        cells.insert({x, 2, z});
    }
    Cage cage;
    std::map<std::array<int, 3>, uint32_t> ids;
    auto id = [&](const std::array<int, 3>& at) {
        const auto [it, fresh] = ids.try_emplace(at, uint32_t(cage.points.size()));
        if (fresh) cage.points.push_back({double(at[0]), double(at[1]), double(at[2])});
        return it->second;
    };
    for (const auto& cell : cells) {
        for (int axis = 0; axis < 3; ++axis) {
            for (int side = 0; side < 2; ++side) {
                std::array<int, 3> beyond = cell;
                beyond[axis] += side ? 1 : -1;
                if (cells.count(beyond)) continue;
                const int u = (axis + 1) % 3, v = (axis + 2) % 3;
                auto corner = [&](int a, int b) {
                    std::array<int, 3> at = cell;
                    at[axis] += side;
                    at[u] += a;
                    at[v] += b;
                    return id(at);
                };
                Quad quad = {corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)};
                if (!side) std::swap(quad[1], quad[3]);
                cage.quads.push_back(quad);
            }
        }
    }
    return cage;
}

Cage subdivided(const Cage& cage) {
    Cage out;
    out.points.resize(cage.points.size());
    std::vector<std::vector<P>> faces_of(cage.points.size()), middles_of(cage.points.size());
    struct Edge {
        std::vector<P> points;
        uint32_t id = 0;
    };
    std::map<std::pair<uint32_t, uint32_t>, Edge> edges;
    auto edge = [&](uint32_t a, uint32_t b) -> Edge& { return edges[{std::min(a, b), std::max(a, b)}]; };
    std::vector<uint32_t> face_ids;
    for (const Quad& q : cage.quads) {
        const P centre = mean({cage.points[q[0]], cage.points[q[1]], cage.points[q[2]], cage.points[q[3]]});
        face_ids.push_back(uint32_t(out.points.size()));
        out.points.push_back(centre);
        for (int i = 0; i < 4; ++i) {
            faces_of[q[i]].push_back(centre);
            edge(q[i], q[(i + 1) % 4]).points.push_back(centre);
        }
    }
    for (auto& [ends, e] : edges) {
        const P &a = cage.points[ends.first], &b = cage.points[ends.second];
        middles_of[ends.first].push_back(mean({a, b}));
        middles_of[ends.second].push_back(mean({a, b}));
        e.points.push_back(a);
        e.points.push_back(b);
        e.id = uint32_t(out.points.size());
        out.points.push_back(mean(e.points));
    }
    for (size_t v = 0; v < cage.points.size(); ++v) {
        const P f = mean(faces_of[v]), r = mean(middles_of[v]);
        const double n = double(faces_of[v].size());
        for (int i = 0; i < 3; ++i) out.points[v][i] = (f[i] + 2 * r[i] + (n - 3) * cage.points[v][i]) / n;
    }
    for (size_t i = 0; i < cage.quads.size(); ++i) {
        const Quad& q = cage.quads[i];
        for (int k = 0; k < 4; ++k)
            out.quads.push_back(
                {q[k], edge(q[k], q[(k + 1) % 4]).id, face_ids[i], edge(q[(k + 3) % 4], q[k]).id});
    }
    return out;
}

}  // namespace

IndexedMesh make_mug(uint32_t subdivisions) {
    Cage cage = mug_cage();
    for (uint32_t i = 0; i < subdivisions; ++i) cage = subdivided(cage);
    IndexedMesh mesh{"mug", {}, {}};
    for (const P& p : cage.points)
        mesh.vertices.push_back({float((p[0] - 3) / 3), float((p[1] - 2) / 3), float((p[2] - 2.5) / 3)});
    for (const Quad& q : cage.quads) {
        mesh.triangles.push_back({q[0], q[1], q[2]});
        mesh.triangles.push_back({q[0], q[2], q[3]});
    }
    return mesh;
}

}  // namespace rtc::lab
