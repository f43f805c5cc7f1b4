#include "meshes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

namespace rtc::lab {
namespace {

struct P {
    double x, y, z;
};

Vec3 rounded(const P& p) { return {float(p.x), float(p.y), float(p.z)}; }

P normalized(const P& p) {
    const double l = std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z);
    return {p.x / l, p.y / l, p.z / l};
}

}  // namespace

std::vector<Triangle> IndexedMesh::soup() const {
    std::vector<Triangle> out;
    for (const auto& t : triangles) out.push_back({vertices[t[0]], vertices[t[1]], vertices[t[2]]});
    return out;
}

IndexedMesh make_icosphere(uint32_t subdivisions) {
    const double g = std::numbers::phi;
    std::vector<P> points = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                             {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
    for (P& p : points) p = normalized(p);
    std::vector<std::array<uint32_t, 3>> faces = {
        {0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
        {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
        {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
    for (uint32_t s = 0; s < subdivisions; ++s) {
        std::map<std::pair<uint32_t, uint32_t>, uint32_t> middles;
        auto middle = [&](uint32_t a, uint32_t b) {
            auto [it, fresh] =
                middles.try_emplace(std::pair(std::min(a, b), std::max(a, b)), uint32_t(points.size()));
            if (fresh) {
                points.push_back(normalized(
                    {points[a].x + points[b].x, points[a].y + points[b].y, points[a].z + points[b].z}));
            }
            return it->second;
        };
        std::vector<std::array<uint32_t, 3>> next;
        for (const auto& f : faces) {
            const uint32_t a = middle(f[0], f[1]), b = middle(f[1], f[2]), c = middle(f[2], f[0]);
            const std::array<uint32_t, 3> quarters[] = {{f[0], a, c}, {f[1], b, a}, {f[2], c, b}, {a, b, c}};
            next.insert(next.end(), std::begin(quarters), std::end(quarters));
        }
        faces = std::move(next);
    }
    IndexedMesh mesh{"icosphere", {}, faces};
    for (const P& p : points) mesh.vertices.push_back(rounded(p));
    return mesh;
}

IndexedMesh make_torus_knot(uint32_t along, uint32_t around) {
    IndexedMesh mesh{"torus-knot", {}, {}};
    auto centre = [](double t) -> P {
        const double r = 1.0 + 0.45 * std::cos(3 * t);
        return {r * std::cos(2 * t), r * std::sin(2 * t), 0.45 * std::sin(3 * t)};
    };
    for (uint32_t i = 0; i < along; ++i) {
        const double t = 2 * std::numbers::pi * i / along;
        const P c = centre(t), next = centre(t + 1e-4);
        const P tangent = normalized({next.x - c.x, next.y - c.y, next.z - c.z});
        const P up = {0, 0, 1};
        const P n = normalized({tangent.y * up.z - tangent.z * up.y, tangent.z * up.x - tangent.x * up.z,
                                tangent.x * up.y - tangent.y * up.x});
        const P b = {tangent.y * n.z - tangent.z * n.y, tangent.z * n.x - tangent.x * n.z,
                     tangent.x * n.y - tangent.y * n.x};
        for (uint32_t j = 0; j < around; ++j) {
            const double a = 2 * std::numbers::pi * j / around;
            const double x = 0.14 * std::cos(a), y = 0.14 * std::sin(a);
            mesh.vertices.push_back(
                rounded({c.x + x * n.x + y * b.x, c.y + x * n.y + y * b.y, c.z + x * n.z + y * b.z}));
        }
    }
    for (uint32_t i = 0; i < along; ++i) {
        for (uint32_t j = 0; j < around; ++j) {
            const uint32_t a = i * around + j, b = i * around + (j + 1) % around;
            const uint32_t c = (i + 1) % along * around + j, d = (i + 1) % along * around + (j + 1) % around;
            mesh.triangles.push_back({a, c, b});
            mesh.triangles.push_back({b, c, d});
        }
    }
    return mesh;
}

IndexedMesh make_slivers(uint32_t count, double ratio) {
    // A whole rim would need count * ratio = 2 pi: take a needle instead, whose
    // rim is a tiny polygon round the middle of a long axis.
    IndexedMesh mesh{"slivers", {}, {}};
    const double radius = ratio * count / (2 * std::numbers::pi);
    mesh.vertices.push_back({1, 0.1f, 0.2f});
    mesh.vertices.push_back({-1, -0.1f, -0.2f});
    for (uint32_t i = 0; i < count; ++i) {
        const double a = 2 * std::numbers::pi * i / count;
        mesh.vertices.push_back(rounded({0, radius * std::cos(a), radius * std::sin(a)}));
    }
    for (uint32_t i = 0; i < count; ++i) {
        const uint32_t a = 2 + i, b = 2 + (i + 1) % count;
        mesh.triangles.push_back({0, a, b});
        mesh.triangles.push_back({1, b, a});
    }
    return mesh;
}

IndexedMesh make_cube_grid(uint32_t n) {
    IndexedMesh mesh{"cube-grid", {}, {}};
    std::map<std::array<uint32_t, 3>, uint32_t> ids;
    auto vertex = [&](std::array<uint32_t, 3> p) {
        auto [it, fresh] = ids.try_emplace(p, uint32_t(mesh.vertices.size()));
        if (fresh) {
            mesh.vertices.push_back(rounded({2.0 * p[0] / n - 1, 2.0 * p[1] / n - 1, 2.0 * p[2] / n - 1}));
        }
        return it->second;
    };
    for (int axis = 0; axis < 3; ++axis) {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        for (uint32_t side = 0; side < 2; ++side) {
            for (uint32_t i = 0; i < n; ++i) {
                for (uint32_t j = 0; j < n; ++j) {
                    auto at = [&](uint32_t a, uint32_t b) {
                        std::array<uint32_t, 3> p{};
                        p[axis] = side * n;
                        p[u] = a;
                        p[v] = b;
                        return vertex(p);
                    };
                    const uint32_t a = at(i, j), b = at(i + 1, j), c = at(i + 1, j + 1), d = at(i, j + 1);
                    if (side) {
                        mesh.triangles.push_back({a, b, c});
                        mesh.triangles.push_back({a, c, d});
                    } else {
                        mesh.triangles.push_back({a, c, b});
                        mesh.triangles.push_back({a, d, c});
                    }
                }
            }
        }
    }
    return mesh;
}

IndexedMesh make_plane(uint32_t n) {
    IndexedMesh mesh{"plane", {}, {}};
    for (uint32_t i = 0; i <= n; ++i) {
        for (uint32_t j = 0; j <= n; ++j)
            mesh.vertices.push_back(rounded({2.0 * i / n - 1, 2.0 * j / n - 1, 0}));
    }
    for (uint32_t i = 0; i < n; ++i) {
        for (uint32_t j = 0; j < n; ++j) {
            const uint32_t a = i * (n + 1) + j, b = a + n + 1;
            mesh.triangles.push_back({a, b, b + 1});
            mesh.triangles.push_back({a, b + 1, a + 1});
        }
    }
    return mesh;
}

IndexedMesh moved(const IndexedMesh& mesh, double scale, const std::array<double, 3>& offset) {
    IndexedMesh out = mesh;
    for (Vec3& v : out.vertices) {
        v = rounded({v.x * scale + offset[0], v.y * scale + offset[1], v.z * scale + offset[2]});
    }
    return out;
}

const char* aim_name(Aim aim) {
    return aim == Aim::Interior ? "interior" : (aim == Aim::Edge ? "edge" : "vertex");
}

Vec3 aim_point(const IndexedMesh& mesh, Aim aim, Random& random) {
    const auto& t = mesh.triangles[random() % mesh.triangles.size()];
    const uint32_t k = uint32_t(random() % 3);
    const Vec3 a = mesh.vertices[t[k]], b = mesh.vertices[t[(k + 1) % 3]], c = mesh.vertices[t[(k + 2) % 3]];
    std::uniform_real_distribution<double> unit(0, 1);
    double u = aim == Aim::Vertex ? 0 : unit(random), v = aim == Aim::Interior ? unit(random) : 0;
    if (u + v > 1) {
        u = 1 - u;
        v = 1 - v;
    }
    const double w = 1 - u - v;
    return rounded({w * a.x + u * b.x + v * c.x, w * a.y + u * b.y + v * c.y, w * a.z + u * b.z + v * c.z});
}

}  // namespace rtc::lab
