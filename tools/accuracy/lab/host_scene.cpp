#include "host_scene.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

#include "rtc/abi.h"

namespace rtc::lab {
namespace {

struct Bounds {
    float min[3] = {INFINITY, INFINITY, INFINITY};
    float max[3] = {-INFINITY, -INFINITY, -INFINITY};

    void add(const Vec3& p) {
        for (int i = 0; i < 3; ++i) {
            min[i] = std::min(min[i], p[i]);
            max[i] = std::max(max[i], p[i]);
        }
    }
    void add(const Bounds& b) {
        for (int i = 0; i < 3; ++i) {
            min[i] = std::min(min[i], b.min[i]);
            max[i] = std::max(max[i], b.max[i]);
        }
    }
    bool empty() const { return !(min[0] <= max[0]); }
    // Half the surface.
    double area() const {
        if (empty()) return 0;
        const double x = double(max[0]) - min[0], y = double(max[1]) - min[1], z = double(max[2]) - min[2];
        return x * y + y * z + z * x;
    }
};

struct Child {
    Bounds bounds;
    uint32_t reference = RTC_REF_EMPTY;
};

Bounds inflated(Bounds b, const Bounds& whole, float by) {
    if (by == 0 || b.empty()) return b;
    float size = 0;
    for (int i = 0; i < 3; ++i) size = std::max(size, whole.max[i] - whole.min[i]);
    for (int i = 0; i < 3; ++i) {
        b.min[i] -= by * size;
        b.max[i] += by * size;
    }
    return b;
}

struct Builder {
    const std::vector<Bounds>& bounds;
    uint32_t leaf_size;
    uint32_t chain;
    std::vector<uint32_t> order;  // slots, leaf after leaf
    std::vector<std::array<Child, 2>> nodes;
    uint32_t depth = 0;

    Bounds range_bounds(size_t begin, size_t end) const {
        Bounds b;
        for (size_t i = begin; i < end; ++i) b.add(bounds[order[i]]);
        return b;
    }

    size_t split(size_t begin, size_t end, uint32_t level) {
        if (level < chain) return begin + 1;
        Bounds centres;
        for (size_t i = begin; i < end; ++i) {
            const Bounds& b = bounds[order[i]];
            centres.add(
                Vec3{b.min[0] / 2 + b.max[0] / 2, b.min[1] / 2 + b.max[1] / 2, b.min[2] / 2 + b.max[2] / 2});
        }
        int axis = 0;
        for (int i = 1; i < 3; ++i) {
            if (centres.max[i] - centres.min[i] > centres.max[axis] - centres.min[axis]) axis = i;
        }
        const size_t middle = begin + (end - begin) / 2;
        auto centre = [&](uint32_t p) { return bounds[p].min[axis] / 2 + bounds[p].max[axis] / 2; };
        std::sort(order.begin() + begin, order.begin() + end,
                  [&](uint32_t a, uint32_t b) { return std::pair(centre(a), a) < std::pair(centre(b), b); });
        if (level > 30) return middle;
        // Full sweep along one axis: enough quality for step counts to mean something.
        std::vector<double> right(end - begin);
        Bounds all;
        for (size_t i = end; i-- > begin;) {
            all.add(bounds[order[i]]);
            right[i - begin] = all.area();
        }
        Bounds left;
        size_t best = middle;
        double best_cost = std::numeric_limits<double>::infinity();
        for (size_t i = begin; i + 1 < end; ++i) {
            left.add(bounds[order[i]]);
            const double cost =
                left.area() * double(i + 1 - begin) + right[i + 1 - begin] * double(end - i - 1);
            if (cost < best_cost) {
                best_cost = cost;
                best = i + 1;
            }
        }
        return best;
    }

    Child build(size_t begin, size_t end, uint32_t level, bool force_node) {
        Child child;
        child.bounds = range_bounds(begin, end);
        const size_t count = end - begin;
        if (count == 0) return child;
        if (count <= leaf_size && !force_node) {
            child.reference = RTC_REF_LEAF | uint32_t(count) << RTC_REF_COUNT_SHIFT | uint32_t(begin);
            return child;
        }
        depth = std::max(depth, level + 1);
        const uint32_t node = uint32_t(nodes.size());
        nodes.emplace_back();
        const size_t middle = count > 1 ? split(begin, end, level) : end;
        const Child first = build(begin, middle, level + 1, false);
        const Child second = build(middle, end, level + 1, false);
        nodes[node] = {first, second};
        child.reference = node;
        return child;
    }

    Bounds run() {
        order.resize(bounds.size());
        std::iota(order.begin(), order.end(), 0u);
        std::erase_if(order, [&](uint32_t p) { return bounds[p].empty(); });
        return build(0, order.size(), 0, true).bounds;
    }
};

uint32_t bits(float f) { return std::bit_cast<uint32_t>(f); }

struct Heap {
    std::vector<uint32_t> words =
        std::vector<uint32_t>(RTC_AS_ALIGNMENT / 4, 0u);  // quad 0 is never given out

    uint32_t allocate(size_t quads) {
        const uint32_t base = uint32_t(words.size() / 4);
        const size_t align = RTC_AS_ALIGNMENT / RTC_QUAD_BYTES;
        words.resize(words.size() + (quads + align - 1) / align * align * 4, 0u);
        return base;
    }
    uint32_t* at(uint32_t quad) { return words.data() + size_t(quad) * 4; }
};

void write_header(Heap& heap, uint32_t base, uint32_t kind, uint32_t facts, const Builder& builder,
                  const Bounds& bounds, size_t slot_count, size_t primitives, uint32_t quads, float inflate) {
    uint32_t* h = heap.at(base);
    h[RTC_HDR_SELF_LO] = base;
    h[RTC_HDR_MAGIC] = RTC_AS_MAGIC;
    h[RTC_HDR_KIND] = kind;
    h[RTC_HDR_FACTS] = facts;
    h[RTC_HDR_NODE_FORMAT] = RTC_NODE_FORMAT_BVH2;
    h[RTC_HDR_MAX_DEPTH] = builder.depth;
    h[RTC_HDR_ACTIVE_COUNT] = uint32_t(builder.order.size());
    for (uint32_t i = 0; i < 3; ++i) {
        h[RTC_HDR_BOUNDS_MIN + i] = bits(bounds.min[i]);
        h[RTC_HDR_BOUNDS_MAX + i] = bits(bounds.max[i]);
    }
    h[RTC_HDR_SIZE_QUADS] = quads;
    h[RTC_HDR_NODES] = RTC_AS_HEADER_QUADS;
    h[RTC_HDR_SLOTS] = uint32_t(RTC_AS_HEADER_QUADS + builder.nodes.size() * RTC_NODE_QUADS);
    h[RTC_HDR_NODE_COUNT] = uint32_t(builder.nodes.size());
    h[RTC_HDR_SLOT_COUNT] = uint32_t(slot_count);
    h[RTC_HDR_PRIMITIVE_COUNT] = uint32_t(primitives);
    h[RTC_HDR_FIRST_OFFENDER] = ~0u;
    uint32_t* n = heap.at(base + RTC_AS_HEADER_QUADS);
    for (const auto& node : builder.nodes) {
        for (int c = 0; c < 2; ++c) {
            for (int i = 0; i < 3; ++i) {
                const Bounds b = inflated(node[c].bounds, bounds, inflate);
                n[c * 8 + i] = bits(b.min[i]);
                n[c * 8 + 4 + i] = bits(b.max[i]);
            }
        }
        n[3] = node[0].reference;
        n[7] = node[1].reference;
        n += RTC_NODE_QUADS * 4;
    }
}

struct Built {
    uint32_t base = 0;
    uint32_t facts = 0;
    Bounds bounds;
    uint32_t depth = 0;
};

Built build_blas(Heap& heap, const Blas& blas, const BuildOptions& options) {
    struct Primitive {
        uint32_t geometry, index;
    };
    std::vector<Primitive> primitives;
    std::vector<Bounds> bounds;
    bool boxes = false, opaque = true;
    for (uint32_t g = 0; g < blas.geometries.size(); ++g) {
        const Geometry& geometry = blas.geometries[g];
        boxes = boxes || !geometry.boxes.empty();
        opaque = opaque && geometry.opaque;
        for (uint32_t i = 0; i < geometry.triangles.size(); ++i) {
            Bounds b;
            bool active = true;
            for (const Vec3& v : geometry.triangles[i]) active = active && !std::isnan(v.x);
            if (active) {
                for (const Vec3& v : geometry.triangles[i]) b.add(v);
            }
            bounds.push_back(b);
            primitives.push_back({g, i});
        }
        for (uint32_t i = 0; i < geometry.boxes.size(); ++i) {
            Bounds b;
            b.add(geometry.boxes[i].min);
            b.add(geometry.boxes[i].max);
            bounds.push_back(b);
            primitives.push_back({g, i});
        }
    }
    Builder builder{bounds, std::min(options.leaf_size, RTC_MAX_LEAF_SLOTS), options.chain, {}, {}};
    Built built;
    built.bounds = builder.run();
    built.depth = builder.depth;
    built.facts = (boxes ? RTC_FACT_AABBS : 0u) | (opaque ? RTC_FACT_ALL_OPAQUE : 0u);
    const size_t slot_quads = boxes ? RTC_AABB_QUADS : RTC_TRIANGLE_QUADS;
    const size_t quads =
        RTC_AS_HEADER_QUADS + builder.nodes.size() * RTC_NODE_QUADS + builder.order.size() * slot_quads;
    built.base = heap.allocate(quads);
    write_header(heap, built.base, RTC_AS_KIND_BOTTOM, built.facts, builder, built.bounds,
                 builder.order.size(), primitives.size(), uint32_t(quads), options.inflate);
    uint32_t* slot = heap.at(built.base + heap.at(built.base)[RTC_HDR_SLOTS]);
    for (uint32_t p : builder.order) {
        const Primitive primitive = primitives[p];
        const Geometry& geometry = blas.geometries[primitive.geometry];
        const uint32_t tag = primitive.geometry | (geometry.opaque ? RTC_SLOT_OPAQUE : 0u);
        Vec3 rows[3];
        if (boxes) {
            rows[0] = geometry.boxes[primitive.index].min;
            rows[1] = geometry.boxes[primitive.index].max;
        } else {
            std::copy_n(geometry.triangles[primitive.index].begin(), 3, rows);
        }
        const uint32_t tags[3] = {primitive.index, tag, 0};
        for (size_t i = 0; i < slot_quads; ++i) {
            for (int k = 0; k < 3; ++k) slot[i * 4 + k] = bits(rows[i][k]);
            slot[i * 4 + 3] = tags[i];
        }
        slot += slot_quads * 4;
    }
    return built;
}

// World bounds of an instance, widened as the runtime's build kernels do
// (leaf_instances.comp), in double with one outward rounding at the end.
Bounds instance_bounds(const Bounds& object, const Transform& m, const Transform& w) {
    Bounds world;
    const double u = std::ldexp(1.0, -24);
    double size[3], back[3];
    for (int r = 0; r < 3; ++r) {
        size[r] = std::fabs(m[r][3]);
        for (int c = 0; c < 3; ++c) {
            size[r] += std::fabs(m[r][c]) * std::max(std::fabs(object.min[c]), std::fabs(object.max[c]));
        }
    }
    for (int r = 0; r < 3; ++r) {
        back[r] = 0;
        for (int c = 0; c < 3; ++c) back[r] += std::fabs(w[r][c]) * size[c];
    }
    for (int r = 0; r < 3; ++r) {
        double low = m[r][3], high = m[r][3], stretched = 0;
        for (int c = 0; c < 3; ++c) {
            const double a = double(m[r][c]) * object.min[c], b = double(m[r][c]) * object.max[c];
            low += std::min(a, b);
            high += std::max(a, b);
            stretched += std::fabs(m[r][c]) * back[c];
        }
        const double pad = (8 * size[r] + 4 * stretched) * u;
        world.min[r] = std::nextafter(float(low - pad), -INFINITY);
        world.max[r] = std::nextafter(float(high + pad), INFINITY);
    }
    return world;
}

}  // namespace

Transform invert(const Transform& m) {
    double a[3][3];
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) a[r][c] = m[r][c];
    double inv[3][3];
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) {
            const int r1 = (c + 1) % 3, r2 = (c + 2) % 3, c1 = (r + 1) % 3, c2 = (r + 2) % 3;
            inv[r][c] = a[r1][c1] * a[r2][c2] - a[r1][c2] * a[r2][c1];
        }
    }
    const double det = a[0][0] * inv[0][0] + a[0][1] * inv[1][0] + a[0][2] * inv[2][0];
    Transform w;
    for (int r = 0; r < 3; ++r) {
        double t = 0;
        for (int c = 0; c < 3; ++c) {
            w[r][c] = float(inv[r][c] / det);
            t -= inv[r][c] / det * double(m[c][3]);
        }
        w[r][3] = float(t);
    }
    return w;
}

Vec3 transform_vector(const Transform& m, const Vec3& v) {
    float out[3];
    for (int r = 0; r < 3; ++r) {
        const volatile float x = m[r][0] * v.x, y = m[r][1] * v.y, z = m[r][2] * v.z;
        const volatile float xy = x + y;
        out[r] = xy + z;
    }
    return {out[0], out[1], out[2]};
}

Vec3 transform_point(const Transform& m, const Vec3& p) {
    const Vec3 v = transform_vector(m, p);
    return {v.x + m[0][3], v.y + m[1][3], v.z + m[2][3]};
}

HostScene build_scene(const std::vector<Blas>& blases, const std::vector<Instance>& instances,
                      const BuildOptions& options) {
    Heap heap;
    HostScene scene;
    scene.blases = blases;
    scene.instances = instances;
    std::vector<Built> built;
    for (const Blas& blas : blases) {
        built.push_back(build_blas(heap, blas, options));
        scene.max_depth = std::max(scene.max_depth, built.back().depth);
    }
    std::vector<Bounds> bounds;
    for (const Instance& instance : instances) {
        scene.world_to_object.push_back(invert(instance.object_to_world));
        const Built& b = built[instance.blas];
        bounds.push_back(b.bounds.empty() ? Bounds()
                                          : instance_bounds(b.bounds, instance.object_to_world,
                                                            scene.world_to_object.back()));
    }
    Builder builder{bounds, 1, options.chain, {}, {}};
    const Bounds world = builder.run();
    // Leaves of a top level name instances, which stay in their order.
    for (auto& node : builder.nodes) {
        for (Child& child : node) {
            if ((child.reference & RTC_REF_LEAF) && child.reference != RTC_REF_EMPTY) {
                const uint32_t instance = builder.order[child.reference & RTC_REF_INDEX_MASK];
                child.reference = RTC_REF_LEAF | 1u << RTC_REF_COUNT_SHIFT | instance;
            }
        }
    }
    const size_t quads =
        RTC_AS_HEADER_QUADS + builder.nodes.size() * RTC_NODE_QUADS + instances.size() * RTC_INSTANCE_QUADS;
    scene.root = heap.allocate(quads);
    write_header(heap, scene.root, RTC_AS_KIND_TOP, 0, builder, world, instances.size(), instances.size(),
                 uint32_t(quads), options.inflate);
    uint32_t* record = heap.at(scene.root + heap.at(scene.root)[RTC_HDR_SLOTS]);
    for (size_t i = 0; i < instances.size(); ++i) {
        const Instance& instance = instances[i];
        const Built& b = built[instance.blas];
        for (int r = 0; r < 3; ++r) {
            for (int c = 0; c < 4; ++c) {
                record[r * 4 + c] = bits(scene.world_to_object[i][r][c]);
                record[12 + r * 4 + c] = bits(instance.object_to_world[r][c]);
            }
        }
        record[24] = b.base;
        record[26] = (instance.custom_index & 0xffffffu) | instance.mask << 24;
        record[27] = (instance.sbt_offset & 0xffffffu) | instance.flags << 24;
        record[28] = b.facts;
        record[29] = heap.at(b.base)[RTC_HDR_SLOTS];
        record[30] = heap.at(b.base)[RTC_HDR_NODES];
        record += RTC_INSTANCE_QUADS * 4;
    }
    scene.heap = std::move(heap.words);
    return scene;
}

}  // namespace rtc::lab
