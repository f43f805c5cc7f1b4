#include "cases.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "error.h"
#include "meshes.h"

namespace rtc::lab {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kDenormal = std::numeric_limits<float>::denorm_min();

double unit(Random& random) { return std::uniform_real_distribution<double>(-1, 1)(random); }

std::string power_text(int exponent) { return "1e" + std::to_string(exponent); }

Vec3 point(double x, double y, double z) { return {float(x), float(y), float(z)}; }

Vec3 around(const Vec3& centre, double reach, Random& random) {
    return point(centre.x + reach * unit(random), centre.y + reach * unit(random),
                 centre.z + reach * unit(random));
}

Vec3 to_world_of(const Transform& m, const Vec3& p) {
    float out[3];
    for (int r = 0; r < 3; ++r)
        out[r] = float(double(m[r][0]) * p.x + double(m[r][1]) * p.y + double(m[r][2]) * p.z + m[r][3]);
    return {out[0], out[1], out[2]};
}

Ray towards(const Vec3& origin, const Vec3& target) {
    Ray ray;
    ray.origin = origin;
    ray.direction = {target.x - origin.x, target.y - origin.y, target.z - origin.z};
    ray.tmax = kInfinity;
    return ray;
}

// What most cases do: a mesh, and rays from a shell to points on it and beside it.
struct Shot {
    Random& random;
    const IndexedMesh& mesh;
    Vec3 centre;
    double size = 1;

    // One ray in four is aimed at nothing, the others at insides, edges and vertices.
    Vec3 target() {
        const uint64_t kind = random() % 4;
        if (kind == 3) return around(centre, 1.2 * size, random);
        return aim_point(mesh, kind == 0 ? Aim::Interior : (kind == 1 ? Aim::Edge : Aim::Vertex), random);
    }
    Vec3 origin(double distance = 3) { return around(centre, distance * size, random); }
};

using Make = std::function<Ray(Shot&)>;

ExactCase mesh_case(const std::string& axis, const std::string& value, IndexedMesh mesh, const Vec3& centre,
                    double size, Make make, const Instance& instance = {}) {
    ExactCase c;
    c.axis = axis;
    c.value = value;
    auto shared = std::make_shared<IndexedMesh>(std::move(mesh));
    c.blases = {Blas{{{shared->soup(), {}, true}}}};
    c.instances = {instance};
    c.instances[0].blas = 0;
    const uint64_t seed = std::hash<std::string>()(axis + ' ' + value + ' ' + shared->name);
    c.rays = [=](uint64_t first, uint64_t count) {
        std::vector<Ray> rays(count);
        for (uint64_t i = 0; i < count; ++i) {
            Random random((seed ^ (first + i)) * 0x9e3779b97f4a7c15ull + 1);
            Shot shot{random, *shared, centre, size};
            rays[i] = make(shot);
        }
        return rays;
    };
    return c;
}

Make plain(const Transform& to_world = kIdentity, double distance = 3) {
    return [=](Shot& s) { return towards(to_world_of(to_world, s.origin(distance)), to_world_of(to_world, s.target())); };
}

IndexedMesh spheroid() { return make_icosphere(3); }
IndexedMesh knot() { return make_torus_knot(80, 12); }

// Unit size, at the origin, random rays: what most of a picture is.
void add_ordinary(std::vector<ExactCase>& cases) {
    for (const IndexedMesh& mesh : {make_icosphere(4), make_torus_knot(400, 24)})
        cases.push_back(mesh_case("ordinary", mesh.name, mesh, {}, 1, [](Shot& s) {
            return towards(s.origin(), around({}, 1, s.random));
        }));
}

void add_offset(std::vector<ExactCase>& cases) {
    for (int e = -1; e <= 8; ++e) {
        const double at = e < 0 ? 0 : std::pow(10.0, e);
        const std::string value = e < 0 ? "0" : power_text(e);
        const Vec3 centre = point(at, -at, at / 2);
        for (const IndexedMesh& mesh : {spheroid(), knot()})
            cases.push_back(mesh_case("offset", value, moved(mesh, 1, {at, -at, at / 2}), centre, 1.5, plain()));
    }
}

void add_size(std::vector<ExactCase>& cases) {
    for (int e : {-45, -40, -37, -33, -27, -21, -15, -9, -3, 3, 9, 15, 21, 27, 33, 37}) {
        const double s = std::pow(10.0, e);
        cases.push_back(mesh_case("size", power_text(e), moved(spheroid(), s, {0, 0, 0}), {}, s, plain()));
    }
}

void add_aspect(std::vector<ExactCase>& cases) {
    for (int e = 0; e >= -8; --e) {
        const double ratio = std::pow(10.0, e);
        cases.push_back(mesh_case("aspect", power_text(e), make_slivers(256, ratio), {}, std::max(1.1, 42 * ratio),
                                  plain()));
    }
}

void add_distance(std::vector<ExactCase>& cases) {
    for (int e = 1; e <= 8; ++e)
        cases.push_back(
            mesh_case("distance", power_text(e), spheroid(), {}, 1, plain(kIdentity, std::pow(10.0, e))));
    // Origins on the mesh itself: on vertices, edges and faces.
    for (const Aim aim : {Aim::Vertex, Aim::Edge, Aim::Interior})
        cases.push_back(mesh_case("distance", std::string("from ") + aim_name(aim), knot(), {}, 1.5, [=](Shot& s) {
            const Vec3 origin = aim_point(s.mesh, aim, s.random);
            return towards(origin, s.random() & 1 ? s.target() : around(origin, 1, s.random));
        }));
}

void add_speed(std::vector<ExactCase>& cases) {
    for (int e : {-37, -30, -20, -10, 10, 20, 30, 36}) {
        const float by = float(std::pow(10.0, e));
        cases.push_back(mesh_case("speed", power_text(e), spheroid(), {}, 1, [=](Shot& s) {
            Ray ray = towards(s.origin(), s.target());
            ray.direction = {ray.direction.x * by, ray.direction.y * by, ray.direction.z * by};
            return ray;
        }));
    }
}

void add_zeros(std::vector<ExactCase>& cases) {
    auto add = [&](const std::string& value, const std::function<void(Vec3&, Random&)>& change) {
        for (const IndexedMesh& mesh : {make_cube_grid(16), spheroid()}) {
            cases.push_back(mesh_case("zeros", value + ", " + mesh.name, mesh, {}, 1.8, [=](Shot& s) {
                const Vec3 target = s.target();
                Vec3 d = {s.random() & 1 ? 1.0f : -1.0f, float(unit(s.random)), float(unit(s.random))};
                change(d, s.random);
                // Any axis may be the first.
                for (uint64_t turn = s.random() % 3; turn > 0; --turn) d = {d.y, d.z, d.x};
                Ray ray;
                ray.direction = d;
                ray.origin = {target.x - 4 * d.x, target.y - 4 * d.y, target.z - 4 * d.z};
                ray.tmax = kInfinity;
                return ray;
            }));
        }
    };
    auto zero = [](Random& random) { return random() & 1 ? 0.0f : -0.0f; };
    add("one", [=](Vec3& d, Random& r) { d.y = zero(r); });
    add("two", [=](Vec3& d, Random& r) { d.y = zero(r), d.z = zero(r); });
    add("denormal", [=](Vec3& d, Random& r) { d.y = float(int(r() % 9) - 4) * kDenormal, d.z = zero(r); });
    add("tiny", [=](Vec3& d, Random& r) { d.y = 1e-30f * float(unit(r)), d.z = 1e-20f * float(unit(r)); });
    add("two equal", [=](Vec3& d, Random& r) { d.y = r() & 1 ? 1.0f : -1.0f; });
    add("three equal", [=](Vec3& d, Random& r) { d.y = r() & 1 ? 1.0f : -1.0f, d.z = r() & 1 ? 1.0f : -1.0f; });
}

void add_grazing(std::vector<ExactCase>& cases) {
    for (int e = 0; e >= -8; --e) {
        const double slope = std::pow(10.0, e);
        for (const Transform& m : {kIdentity, rotation(0.7, 0.3)}) {
            IndexedMesh mesh = make_plane(16);
            for (Vec3& v : mesh.vertices) v = to_world_of(m, v);
            const bool flat = m == kIdentity;
            cases.push_back(
                mesh_case("grazing", power_text(e) + (flat ? " flat" : " turned"), mesh, {}, 1.5, [=](Shot& s) {
                    const double angle = 3.14159 * unit(s.random);
                    const Vec3 d = point(std::cos(angle), std::sin(angle), slope * (s.random() & 1 ? 1 : -1));
                    const Vec3 turned = to_world_of(m, d), target = s.target();
                    return towards(point(target.x - 2 * double(turned.x), target.y - 2 * double(turned.y),
                                         target.z - 2 * double(turned.z)),
                                   target);
                }));
        }
    }
}

void add_aim(std::vector<ExactCase>& cases) {
    for (const IndexedMesh& mesh : {spheroid(), knot(), make_slivers(128, 1e-3), make_cube_grid(16)}) {
        for (const Aim aim : {Aim::Interior, Aim::Edge, Aim::Vertex})
            cases.push_back(mesh_case("aim", std::string(aim_name(aim)) + ", " + mesh.name, mesh, {}, 1.8,
                                      [=](Shot& s) { return towards(s.origin(), aim_point(s.mesh, aim, s.random)); }));
        // At corners of a triangle's box, where slabs decide.
        cases.push_back(mesh_case("aim", "box corner, " + mesh.name, mesh, {}, 1.8, [=](Shot& s) {
            const auto& t = s.mesh.triangles[s.random() % s.mesh.triangles.size()];
            float corner[3];
            for (int i = 0; i < 3; ++i) {
                const float a = s.mesh.vertices[t[0]][i], b = s.mesh.vertices[t[1]][i],
                            c = s.mesh.vertices[t[2]][i];
                corner[i] = s.random() & 1 ? std::min({a, b, c}) : std::max({a, b, c});
            }
            return towards(s.origin(), {corner[0], corner[1], corner[2]});
        }));
    }
    // Silhouettes of the sphere: tangents.
    cases.push_back(mesh_case("aim", "silhouette, icosphere", spheroid(), {}, 1, [=](Shot& s) {
        const Vec3 v = aim_point(s.mesh, Aim::Vertex, s.random);
        Vec3 across = around({}, 1, s.random);
        const double along = double(across.x) * v.x + double(across.y) * v.y + double(across.z) * v.z;
        across = point(across.x - along * v.x, across.y - along * v.y, across.z - along * v.z);
        return towards(point(v.x - 3.0 * across.x, v.y - 3.0 * across.y, v.z - 3.0 * across.z), v);
    }));
}

void add_interval(std::vector<ExactCase>& cases) {
    const float one = 1, up = std::nextafter(1.0f, 2.0f), down = std::nextafter(1.0f, 0.0f),
                most = std::numeric_limits<float>::max();
    const std::vector<std::tuple<std::string, float, float>> intervals = {
        {"0 to t", 0, one},        {"0 to t + ulp", 0, up},     {"0 to t - ulp", 0, down},
        {"t to inf", one, kInfinity}, {"t + ulp to inf", up, kInfinity}, {"t - ulp to inf", down, most},
        {"t to t", one, one},      {"t - ulp to t + ulp", down, up}, {"denormal to max", kDenormal, most},
        {"0 to 0", 0, 0}};
    for (const auto& [value, tmin, tmax] : intervals) {
        const float low = tmin, high = tmax;
        for (const IndexedMesh& mesh : {spheroid(), make_cube_grid(16)})
            cases.push_back(mesh_case("interval", value + ", " + mesh.name, mesh, {}, 1.8, [=](Shot& s) {
                // Aimed at vertices t is 1, at other points almost.
                Ray ray = towards(s.origin(), aim_point(s.mesh, s.random() & 1 ? Aim::Vertex : Aim::Edge, s.random));
                ray.tmin = low;
                ray.tmax = high;
                return ray;
            }));
    }
}

void add_transform(std::vector<ExactCase>& cases) {
    for (const auto& [name, transform] : lab_transforms()) {
        Instance instance;
        instance.object_to_world = transform;
        cases.push_back(mesh_case("transform", name, knot(), {}, 1.6, plain(transform), instance));
    }
    // Many instances over one another: order between spaces.
    ExactCase c = mesh_case("transform", "overlapping instances", spheroid(), {}, 1.6, plain());
    Random random(5);
    for (int i = 0; i < 12; ++i) {
        Instance instance;
        instance.object_to_world = translated(rotation(0.5 * i, 0.3 * i), float(0.1 * unit(random)), 0, 0);
        if (i % 3 == 0) instance.object_to_world = kIdentity;  // exactly on one another
        c.instances.push_back(instance);
    }
    cases.push_back(std::move(c));
}

// A soup of triangles over a small grid of coordinates: coplanar, coincident,
// crossing, degenerate; rays run between grid points, so ties abound.
ExactCase soup_case(const std::string& value, uint32_t count, const std::function<void(Triangle&, Random&)>& change,
                    double scale = 1) {
    ExactCase c;
    c.axis = "degenerate";
    c.value = value;
    Random random(std::hash<std::string>()(value));
    auto grid = [=](Random& r) {
        return point(scale * double(int(r() % 9) - 4) / 4, scale * double(int(r() % 9) - 4) / 4,
                     scale * double(int(r() % 9) - 4) / 4);
    };
    std::vector<Triangle> triangles;
    for (uint32_t i = 0; i < count; ++i) {
        Triangle t = {grid(random), grid(random), grid(random)};
        change(t, random);
        triangles.push_back(t);
    }
    // In two geometries and two instances, so that numbers of all kinds break ties.
    const size_t half = triangles.size() / 2;
    c.blases = {Blas{{{{triangles.begin(), triangles.begin() + half}, {}, true},
                      {{triangles.begin() + half, triangles.end()}, {}, true}}}};
    c.instances = {{}, {}};
    c.rays = [=](uint64_t first, uint64_t count) {
        std::vector<Ray> rays(count);
        for (uint64_t i = 0; i < count; ++i) {
            Random r((first + i) * 0x9e3779b97f4a7c15ull + 7);
            const Vec3 from = r() & 1 ? grid(r) : around({}, 2 * scale, r);
            rays[i] = towards(from, r() & 1 ? grid(r) : around({}, scale, r));
        }
        return rays;
    };
    return c;
}

void add_degenerate(std::vector<ExactCase>& cases) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    cases.push_back(soup_case("grid soup", 400, [](Triangle&, Random&) {}));
    cases.push_back(soup_case("coincident vertices", 400, [](Triangle& t, Random& r) {
        if (r() & 1) t[2] = t[r() % 2];
    }));
    cases.push_back(soup_case("collinear", 400, [](Triangle& t, Random& r) {
        if (r() & 1) t[2] = {t[0].x / 2 + t[1].x / 2, t[0].y / 2 + t[1].y / 2, t[0].z / 2 + t[1].z / 2};
    }));
    cases.push_back(soup_case("duplicates", 400, [](Triangle& t, Random& r) {
        const float z = float(int(r() % 3) - 1) / 2;
        t = {Vec3{-1, -1, z}, Vec3{1, -1, z}, Vec3{0, 1, z}};
    }));
    cases.push_back(soup_case("coplanar", 400, [](Triangle& t, Random&) {
        for (Vec3& v : t) v.z = 0;
    }));
    cases.push_back(soup_case("NaN x", 400, [=](Triangle& t, Random& r) {
        if (r() % 4 == 0) t[r() % 3].x = nan;
    }));
    cases.push_back(soup_case("denormal coordinates", 400, [](Triangle& t, Random& r) {
        for (Vec3& v : t)
            if (r() & 1) v.y = float(int(r() % 9) - 4) * kDenormal;
    }));
    cases.push_back(soup_case("all denormal", 400, [](Triangle&, Random&) {}, 1e-40));
}

void add_build(std::vector<ExactCase>& cases) {
    for (uint32_t count : {1u, 2u, 3u, 5u, 7u, 8u, 9u, 63u, 64u, 65u}) {
        IndexedMesh mesh = spheroid();
        mesh.triangles.resize(count);
        cases.push_back(mesh_case("build", std::to_string(count) + " triangles", mesh, {}, 1, plain()));
    }
    for (uint32_t leaf : {1u, 2u, 4u}) {
        cases.push_back(mesh_case("build", "leaves of " + std::to_string(leaf), knot(), {}, 1.5, plain()));
        cases.back().build.leaf_size = leaf;
    }
    cases.push_back(mesh_case("build", "chain", knot(), {}, 1.5, plain()));
    cases.back().build.chain = 46;
}

// Everything at once: mesh, size, offset, transform, distance and speed drawn together. The powers of ten
// stay where their products are normal floats.
void add_mixed(std::vector<ExactCase>& cases) {
    Random random(20);
    auto power = [&](double low, double high) {
        return std::pow(10.0, std::uniform_real_distribution<double>(low, high)(random));
    };
    for (int i = 0; i < 48; ++i) {
        const IndexedMesh meshes[] = {spheroid(), knot(), make_slivers(128, power(-6, -1)), make_cube_grid(12),
                                      make_mug(1)};
        const IndexedMesh& mesh = meshes[random() % std::size(meshes)];
        const double size = power(-9, 9), offset = random() & 1 ? size * power(0, 6) : 0, distance = power(0, 4);
        const float by = float(power(-8, 8));
        const auto& transforms = lab_transforms();
        const auto& [name, transform] = transforms[random() % transforms.size()];
        Instance instance;
        instance.object_to_world = transform;
        const Make aimed = plain(transform, distance);
        char value[96];
        std::snprintf(value, sizeof value, "%d: %s, size %.0e, offset %.0e, %s", i, mesh.name.c_str(), size, offset,
                      name.c_str());
        cases.push_back(mesh_case(
            "mixed", value, moved(mesh, size, {offset, -offset, offset / 2}), point(offset, -offset, offset / 2),
            1.6 * size,
            [=](Shot& s) {
                Ray ray = aimed(s);
                ray.direction = {ray.direction.x * by, ray.direction.y * by, ray.direction.z * by};
                ray.tmin = s.random() & 1 ? 0.0f : 0.5f / by;
                return ray;
            },
            instance));
    }
}

}  // namespace

Transform rotation(double a, double b) {
    return {{{float(std::cos(a)), float(-std::sin(a)), 0, 0},
             {float(std::sin(a) * std::cos(b)), float(std::cos(a) * std::cos(b)), float(-std::sin(b)), 0},
             {float(std::sin(a) * std::sin(b)), float(std::cos(a) * std::sin(b)), float(std::cos(b)), 0}}};
}

Transform translated(Transform m, float x, float y, float z) {
    m[0][3] = x;
    m[1][3] = y;
    m[2][3] = z;
    return m;
}

Transform product(const Transform& a, const Transform& b) {
    Transform c{};
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 4; ++j) {
            double sum = j == 3 ? a[i][3] : 0;
            for (int k = 0; k < 3; ++k) sum += double(a[i][k]) * b[k][j];
            c[i][j] = float(sum);
        }
    }
    return c;
}

Transform scaled(float x, float y, float z) { return {{{x, 0, 0, 0}, {0, y, 0, 0}, {0, 0, z, 0}}}; }

const std::vector<std::pair<std::string, Transform>>& lab_transforms() {
    auto oblique = [](float x, float y, float z) {
        return product(rotation(0.7, 0.3), product(scaled(x, y, z), rotation(0.4, 1.1)));
    };
    static const std::vector<std::pair<std::string, Transform>> table = {
        {"identity", kIdentity},
        {"rotated", rotation(0.7, 0.3)},
        {"rotated + 1e2", translated(rotation(0.7, 0.3), 100, -50, 75)},
        {"rotated + 1e4", translated(rotation(0.7, 0.3), 1e4f, -5e3f, 7e3f)},
        {"rotated + 1e8", translated(rotation(0.7, 0.3), 1e8f, -5e7f, 7e7f)},
        {"rotX90 + 1e4", translated({{{1, 0, 0, 0}, {0, 0, -1, 0}, {0, 1, 0, 0}}}, 1e4f, -5e3f, 7e3f)},
        {"sheared", {{{1, 0.7f, -0.4f, 1}, {0, 0.5f, 0.9f, 2}, {0.2f, 0, 3, -4}}}},
        {"mirrored", scaled(-1, 1.25f, 0.75f)},
        {"scale 1e-6", scaled(1e-6f, 1e-6f, 1e-6f)},
        {"scale 1e-3", scaled(1e-3f, 1e-3f, 1e-3f)},
        {"scale 1e3", scaled(1e3f, 1e3f, 1e3f)},
        {"scale 1e6", scaled(1e6f, 1e6f, 1e6f)},
        {"scale 1e3 + 1e6", translated(scaled(1e3f, 1e3f, 1e3f), 1e6f, 0, -1e6f)},
        {"stretch 1e3:1", scaled(1e3f, 1, 1)},
        {"stretch 1e6:1", scaled(1e3f, 1, 1e-3f)},
        {"oblique 1e1:1", oblique(10, 1, 1)},
        {"oblique 1e2:1", oblique(100, 1, 1)},
        {"oblique 1e3:1", oblique(1e3f, 1, 1)},
        {"oblique 1e4:1", oblique(1e3f, 1, 0.1f)},
        {"near-singular", oblique(1, 1, 1e-6f)},
    };
    return table;
}

const std::vector<std::string>& exact_axis_names() {
    static const std::vector<std::string> names = {"offset",  "size", "aspect",   "distance",  "speed",      "zeros",
                                                   "grazing", "aim",  "interval", "transform", "degenerate", "build", "mixed"};
    return names;
}

std::vector<ExactCase> exact_cases(const std::string& axis) {
    std::vector<ExactCase> cases;
    void (*const adders[])(std::vector<ExactCase>&) = {add_offset,  add_size, add_aspect,   add_distance,
                                                       add_speed,   add_zeros, add_grazing, add_aim,
                                                       add_interval, add_transform, add_degenerate, add_build,
                                                       add_mixed};
    if (axis == "ordinary") {
        add_ordinary(cases);
        return cases;
    }
    const auto& names = exact_axis_names();
    const auto found = std::find(names.begin(), names.end(), axis);
    if (found == names.end()) {
        std::string known;
        for (const std::string& name : names) known += name + ", ";
        throw tools::Error("unknown axis \"" + axis + "\": " + known + "or ordinary");
    }
    adders[found - names.begin()](cases);
    return cases;
}

}  // namespace rtc::lab
