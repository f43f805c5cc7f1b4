#include "content.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

namespace rtc::stress {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

struct Format {
    VkFormat format;
    uint32_t components, component_bytes;
    bool snorm;
};
constexpr Format kFormats[] = {
    {VK_FORMAT_R32G32B32_SFLOAT, 3, 4, false},    {VK_FORMAT_R32G32B32A32_SFLOAT, 3, 4, false},
    {VK_FORMAT_R32G32_SFLOAT, 2, 4, false},       {VK_FORMAT_R16G16B16_SFLOAT, 3, 2, false},
    {VK_FORMAT_R16G16B16A16_SFLOAT, 3, 2, false}, {VK_FORMAT_R16G16_SFLOAT, 2, 2, false},
    {VK_FORMAT_R16G16B16_SNORM, 3, 2, true},      {VK_FORMAT_R16G16B16A16_SNORM, 3, 2, true},
    {VK_FORMAT_R16G16_SNORM, 2, 2, true}};

const Format& format_of(VkFormat format) {
    return *std::find_if(std::begin(kFormats), std::end(kFormats),
                         [&](const Format& f) { return f.format == format; });
}
uint32_t vertex_bytes(const Format& f) {
    const bool alpha = f.format == VK_FORMAT_R32G32B32A32_SFLOAT ||
                       f.format == VK_FORMAT_R16G16B16A16_SFLOAT || f.format == VK_FORMAT_R16G16B16A16_SNORM;
    return (f.components + (alpha ? 1 : 0)) * f.component_bytes;
}

// To the nearest half below in size, never a denormal: devices may flush those.
uint16_t to_half(float v) {
    if (std::isnan(v)) return 0x7e00;
    const uint32_t bits = std::bit_cast<uint32_t>(v), sign = bits >> 16 & 0x8000u;
    const int exponent = int(bits >> 23 & 0xff) - 127 + 15;
    if (exponent <= 0) return uint16_t(sign);
    if (exponent >= 31) return uint16_t(sign | 0x7bffu);
    return uint16_t(sign | uint32_t(exponent) << 10 | (bits >> 13 & 0x3ffu));
}
float from_half(uint16_t h) {
    const uint32_t sign = uint32_t(h & 0x8000u) << 16, exponent = h >> 10 & 31u, mantissa = h & 0x3ffu;
    if (exponent == 31) return kNan;
    if (exponent == 0) return std::bit_cast<float>(sign);
    return std::bit_cast<float>(sign | (exponent + 112u) << 23 | mantissa << 13);
}

void write_component(const Format& f, uint8_t* at, float v) {
    if (f.component_bytes == 4) {
        std::memcpy(at, &v, 4);
    } else if (f.snorm) {
        const int16_t n = int16_t(std::clamp(std::isnan(v) ? 0.0f : v, -1.0f, 1.0f) * 32767.0f);
        std::memcpy(at, &n, 2);
    } else {
        const uint16_t h = to_half(v);
        std::memcpy(at, &h, 2);
    }
}
float read_component(const Format& f, const uint8_t* at) {
    if (f.component_bytes == 4) {
        float v;
        std::memcpy(&v, at, 4);
        return v;
    }
    uint16_t h;
    std::memcpy(&h, at, 2);
    return f.snorm ? std::max(float(int16_t(h)) / 32767.0f, -1.0f) : from_half(h);
}

void set_vertex(Geometry& g, uint32_t i, const Vec3& v) {
    const Format& f = format_of(g.format);
    for (uint32_t c = 0; c < f.components; ++c)
        write_component(f, g.data.data() + g.offset + size_t(i) * g.stride + c * f.component_bytes,
                        v[int(c)]);
}

// As runtime/kernels/geometry.glsl does it, float for float.
Vec3 get_vertex(const Geometry& g, uint32_t i) {
    const Format& f = format_of(g.format);
    float v[3] = {0, 0, 0};
    for (uint32_t c = 0; c < f.components; ++c)
        v[c] = read_component(f, g.data.data() + g.offset + size_t(i) * g.stride + c * f.component_bytes);
    if (!g.transformed) return {v[0], v[1], v[2]};
    float out[3];
    for (int r = 0; r < 3; ++r) {
        const volatile float x = g.transform[r][0] * v[0], y = g.transform[r][1] * v[1],
                             z = g.transform[r][2] * v[2];
        const volatile float xy = x + y, xyz = xy + z;
        out[r] = xyz + g.transform[r][3];
    }
    return {out[0], out[1], out[2]};
}

uint32_t get_index(const Geometry& g, uint32_t i) {
    if (g.index_type == VK_INDEX_TYPE_NONE_NV) return i;
    uint32_t value = 0;
    const uint32_t bytes =
        g.index_type == VK_INDEX_TYPE_UINT8_EXT ? 1 : (g.index_type == VK_INDEX_TYPE_UINT16 ? 2 : 4);
    std::memcpy(&value, g.indices.data() + g.index_offset + size_t(i) * bytes, bytes);
    return value;
}

void decode(Geometry& g) {
    if (g.boxes) {
        for (size_t i = 0; i < g.box_list.size(); ++i) {
            float n[6];
            std::memcpy(n, g.data.data() + g.offset + i * g.stride, sizeof n);
            g.box_list[i] = {{n[0], n[1], n[2]}, {n[3], n[4], n[5]}};
        }
        return;
    }
    for (size_t t = 0; t < g.triangles.size(); ++t) {
        bool inactive = false;
        for (uint32_t c = 0; c < 3; ++c) {
            const Vec3 v = get_vertex(g, get_index(g, uint32_t(3 * t + c)));
            g.triangles[t][c] = v;
            inactive = inactive || std::isnan(v.x) || std::isnan(v.y) || std::isnan(v.z);
        }
        if (inactive) g.triangles[t][0].x = kNan;
    }
}

Vec3 point_in(Random& random, const Vec3& centre, double size) {
    return {float(centre.x + between(random, -size, size)), float(centre.y + between(random, -size, size)),
            float(centre.z + between(random, -size, size))};
}

struct Space {  // where a geometry lies
    Vec3 centre;
    double size;
};

Space make_space(Random& random, const Format& f) {
    if (f.snorm) return {{0, 0, 0}, 1.0};
    const double size = std::pow(10.0, between(random, -1.0, f.component_bytes == 2 ? 1.0 : 2.0));
    const Vec3 centre = chance(random, 0.5) ? Vec3{} : point_in(random, {}, 4 * size);
    return {centre, size};
}

// Values of the vertices; `kind` 0: a height field, 1: small triangles here and there, 2: any vertices.
void fill_vertices(Geometry& g, Random& random, const Space& s, int kind, uint32_t side) {
    const uint32_t triangles = uint32_t(g.triangles.size());
    if (kind == 0) {
        for (uint32_t i = 0; i < g.vertex_count; ++i) {
            const double x = double(i % (side + 1)) / side * 2 - 1, z = double(i / (side + 1)) / side * 2 - 1;
            const double y = 0.2 * std::sin(9 * x) * std::cos(7 * z) + between(random, -0.3, 0.3) / side;
            set_vertex(g, i,
                       {float(s.centre.x + s.size * x), float(s.centre.y + s.size * y),
                        float(s.centre.z + s.size * z)});
        }
        return;
    }
    const double small = s.size * std::min(1.0, 2.0 / std::cbrt(double(triangles) + 1));
    Vec3 near = point_in(random, s.centre, s.size);
    for (uint32_t i = 0; i < g.vertex_count; ++i) {
        if (kind == 2 || i % 3 == 0) near = point_in(random, s.centre, s.size);
        set_vertex(g, i, kind == 2 ? near : point_in(random, near, small));
    }
}

void make_triangles(Geometry& g, Random& random, uint64_t most, bool large) {
    const Format& f = kFormats[chance(random, 0.6) ? 0 : below(random, std::size(kFormats))];
    g.format = f.format;
    g.vertex_error = f.snorm ? 4 : 0;
    const uint32_t align = f.component_bytes;
    g.stride = vertex_bytes(f) + uint32_t(below(random, 3)) * align;
    g.offset = uint32_t(below(random, 4)) * align;
    int kind = int(below(random, large ? 2 : 3));
    uint64_t count = large ? uint64_t(between(random, 0.5, 1) * double(most)) : log_uniform(random, most);
    if (kind == 2) count = std::min<uint64_t>(count, 300);  // they all overlap
    uint32_t side = 1;
    if (kind == 0) {
        side = std::max(1u, uint32_t(std::sqrt(double(count) / 2)));
        count = 2ull * side * side;
    }
    g.triangles.resize(count);
    const bool indexed = kind == 0 || chance(random, 0.5);
    g.vertex_count = kind == 0 ? (side + 1) * (side + 1) : uint32_t(3 * count);
    if (kind == 2 && indexed) g.vertex_count = uint32_t(count / 2 + 3);
    if (indexed) {
        const bool narrow = g.vertex_count <= 65536 && chance(random, 0.5);
        const bool bytewise = g.vertex_count <= 256 && chance(random, 0.3);
        const uint32_t bytes = bytewise ? 1 : (narrow ? 2 : 4);
        g.index_type =
            bytewise ? VK_INDEX_TYPE_UINT8_EXT : (narrow ? VK_INDEX_TYPE_UINT16 : VK_INDEX_TYPE_UINT32);
        g.index_offset = uint32_t(below(random, 4)) * bytes;
        g.index_count = uint32_t(3 * count);
        g.indices.resize(g.index_offset + size_t(g.index_count) * bytes + 4);
        for (uint32_t i = 0; i < g.index_count; ++i) {
            uint32_t index = i;
            if (kind == 0) {
                const uint32_t quad = i / 6, corner = quad / side * (side + 1) + quad % side;
                const uint32_t pattern[6] = {0, 1, side + 2, 0, side + 2, side + 1};
                index = corner + pattern[i % 6];
            } else if (kind == 2) {
                index = uint32_t(below(random, g.vertex_count));
            }
            std::memcpy(g.indices.data() + g.index_offset + size_t(i) * bytes, &index, bytes);
        }
    }
    g.data.resize(g.offset + size_t(g.vertex_count) * g.stride + 16);
    fill_vertices(g, random, make_space(random, f), kind, side);
    if (!f.snorm && g.vertex_count && chance(random, 0.3)) {
        for (uint64_t i = 0; i < 1 + g.vertex_count / 50; ++i)
            set_vertex(g, uint32_t(below(random, g.vertex_count)), {kNan, 0, 0});
    }
    if (g.index_type == VK_INDEX_TYPE_NONE_NV && count && chance(random, 0.3)) {  // no area
        for (uint64_t i = 0; i < 1 + count / 50; ++i) {
            const uint32_t t = uint32_t(below(random, count));
            const uint32_t bytes = vertex_bytes(f);
            std::memcpy(g.data.data() + g.offset + size_t(3 * t + 1) * g.stride,
                        g.data.data() + g.offset + size_t(3 * t) * g.stride, bytes);
        }
    }
    if (chance(random, 0.3)) {
        g.transformed = true;
        g.transform_offset = 16 * uint32_t(below(random, 3));
        for (auto& row : g.transform)
            for (float& m : row) m = float(between(random, -1.5, 1.5));
    }
}

void set_box(Geometry& g, size_t i, Random& random, const Space& s, double small) {
    Vec3 low = point_in(random, s.centre, s.size);
    float n[6];
    for (int c = 0; c < 3; ++c) {
        n[c] = low[c];
        n[3 + c] = low[c] + float(between(random, 0.05, 1) * small);
    }
    std::memcpy(g.data.data() + g.offset + i * g.stride, n, sizeof n);
}

void make_boxes(Geometry& g, Random& random, uint64_t most) {
    g.boxes = true;
    const uint64_t count = log_uniform(random, most);
    g.stride = 24 + 8 * uint32_t(below(random, 3));
    g.offset = 8 * uint32_t(below(random, 3));
    g.box_list.resize(count);
    g.data.resize(g.offset + count * g.stride + 16);
    const Space s = make_space(random, kFormats[0]);
    const double small = s.size * std::min(1.0, 1.5 / std::cbrt(double(count) + 1));
    for (size_t i = 0; i < count; ++i) set_box(g, i, random, s, small);
    if (count && chance(random, 0.3)) {
        for (uint64_t i = 0; i < 1 + count / 50; ++i)
            std::memcpy(g.data.data() + g.offset + below(random, count) * g.stride, &kNan, 4);
    }
}

}  // namespace

uint64_t below(Random& random, uint64_t n) { return n ? random() % n : 0; }
double between(Random& random, double low, double high) {
    return low + (high - low) * (double(random() >> 11) * 0x1p-53);
}
uint64_t log_uniform(Random& random, uint64_t most) {
    if (chance(random, 0.05)) return 0;
    return uint64_t(std::exp(between(random, 0, std::log(double(most) + 1))));
}
bool chance(Random& random, double probability) { return between(random, 0, 1) < probability; }

size_t Content::primitives() const {
    size_t count = 0;
    for (const Geometry& g : geometries) count += g.primitives();
    return count;
}

Content make_content(Random& random, uint64_t most, bool large) {
    Content content;
    content.boxes = chance(random, 0.25) && !large;
    content.geometries.resize(below(random, 7) + large);
    uint64_t left = most;
    for (Geometry& g : content.geometries) {
        if (content.boxes) {
            make_boxes(g, random, std::min<uint64_t>(left, most / 4));
        } else {
            make_triangles(g, random, left, large);
            large = false;
        }
        left -= std::min<uint64_t>(left, g.primitives());
        if (chance(random, 0.5)) g.flags |= VK_GEOMETRY_OPAQUE_BIT_NV;
        if (chance(random, 0.3)) g.flags |= VK_GEOMETRY_NO_DUPLICATE_ANY_HIT_INVOCATION_BIT_NV;
        decode(g);
    }
    return content;
}

namespace {

// How far vertices may move. Millions of triangles that each grow as large as their whole mesh would be a pile in which
// one ray meets a hundred thousand: minutes of a GPU.
double reach_of_a_move(const Geometry& g) {
    if (g.primitives() <= 300) return 0.2;
    float low = INFINITY, high = -INFINITY;
    for (const auto& t : g.triangles) {
        if (std::isnan(t[0].x)) continue;
        low = std::min({low, t[0].x, t[1].x, t[2].x});
        high = std::max({high, t[0].x, t[1].x, t[2].x});
    }
    return g.boxes || low > high ? 0.2 : std::min(0.2, double(high - low) / std::cbrt(double(g.primitives())));
}

}  // namespace

void move_content(Content& content, Random& random) {
    for (Geometry& g : content.geometries) {
        const double by = between(random, 0, reach_of_a_move(g));
        if (g.boxes) {
            for (size_t i = 0; i < g.box_list.size(); ++i) {
                if (std::isnan(g.box_list[i].min.x)) continue;
                uint8_t* at = g.data.data() + g.offset + i * g.stride;
                float n[6];
                std::memcpy(n, at, sizeof n);
                for (int c = 0; c < 3; ++c) {
                    const float d = float(between(random, -by, by));
                    n[c] += d;
                    n[3 + c] = std::max(n[c], n[3 + c] + d);
                }
                std::memcpy(at, n, sizeof n);
            }
        } else {
            const Format& f = format_of(g.format);
            for (uint32_t i = 0; i < g.vertex_count; ++i) {
                for (uint32_t c = 0; c < f.components; ++c) {
                    uint8_t* at = g.data.data() + g.offset + size_t(i) * g.stride + c * f.component_bytes;
                    const float v = read_component(f, at);
                    if (!std::isnan(v)) write_component(f, at, v + float(between(random, -by, by)));
                }
            }
        }
        decode(g);
    }
}

}  // namespace rtc::stress
