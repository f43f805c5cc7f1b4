// Rays through the world, and what the reference says of each result.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "error.h"
#include "rtc/abi.h"
#include "shaders.h"
#include "world.h"

namespace rtc::stress {

using tools::Error;

namespace {

uint32_t candidate_hash(uint32_t instance, uint32_t geometry, uint32_t primitive, uint32_t kind) {
    uint32_t h = instance * 0x9e3779b1u + geometry * 0x85ebca6bu + primitive * 0xc2b2ae35u + kind;
    h = (h ^ (h >> 15)) * 0x2c1b3c6du;
    return h ^ (h >> 12);
}

uint32_t kind_of(const Candidate& c, bool box) { return box ? kBoxKind : (c.front ? 0xfeu : 0xffu); }

// A point of a primitive, in its object space.
Vec3 point_of(const Geometry& g, size_t p, Random& random) {
    double w[3];
    if (g.boxes) {
        for (int i = 0; i < 3; ++i)
            w[i] =
                g.box_list[p].min[i] + between(random, 0, 1) * (g.box_list[p].max[i] - g.box_list[p].min[i]);
        return {float(w[0]), float(w[1]), float(w[2])};
    }
    double b1 = between(random, 0, 1), b2 = between(random, 0, 1);
    const uint64_t kind = below(random, 10);
    if (kind == 0) b1 = 0;       // an edge
    if (kind == 1) b1 = b2 = 0;  // a vertex
    if (b1 + b2 > 1) b1 = 1 - b1, b2 = 1 - b2;
    const Triangle& t = g.triangles[p];
    for (int i = 0; i < 3; ++i) w[i] = t[0][i] + b1 * (t[1][i] - t[0][i]) + b2 * (t[2][i] - t[0][i]);
    return {float(w[0]), float(w[1]), float(w[2])};
}

uint32_t random_ray_flags(Random& random, uint32_t mode) {
    if (mode == kIgnoreAll) return 2u | (chance(random, 0.3) ? (chance(random, 0.5) ? 16u : 32u) : 0u);
    uint32_t flags = 0;
    if (chance(random, 0.3)) flags |= 1u << below(random, 3);           // opaque, no opaque, first hit
    if (chance(random, 0.3)) flags |= chance(random, 0.5) ? 16u : 32u;  // faces
    if (!(flags & 3u) && chance(random, 0.2)) flags |= chance(random, 0.5) ? 64u : 128u;  // opacity
    if (chance(random, 0.1)) flags |= chance(random, 0.5) ? 256u : 512u;                  // kinds
    return flags;
}

std::string describe(const Ray& r) {
    char text[400];
    std::snprintf(
        text, sizeof text,
        "ray origin (%a, %a, %a) direction (%a, %a, %a) t %a .. %a flags %#x mask %#x offset %u mode %u",
        double(r.origin.x), double(r.origin.y), double(r.origin.z), double(r.direction.x),
        double(r.direction.y), double(r.direction.z), double(r.tmin), double(r.tmax), r.flags, r.mask,
        r.sbt_offset, r.mode);
    return text;
}

std::string describe(const Candidate& c) {
    char text[200];
    std::snprintf(text, sizeof text, "instance %u geometry %u primitive %u t %.9g +- %.3g, %s", c.instance,
                  c.geometry, c.primitive, c.t, c.t_error, c.certain ? "certain" : "undecided");
    return text;
}

}  // namespace

std::vector<Ray> World::make_rays(const std::vector<InstanceReference>& instances) {
    std::vector<uint32_t> full;
    for (uint32_t i = 0; i < instances.size(); ++i)
        if (instances[i].bottom && !instances[i].bottom->empty()) full.push_back(i);
    const uint64_t affordable = 20000000 / std::max<uint64_t>(instances.size(), 1);
    const uint64_t count = std::clamp<uint64_t>(affordable, 16, limits_.rays);
    std::vector<Ray> rays(count);
    for (Ray& ray : rays) {
        Vec3 target{float(between(random_, -5, 5)), float(between(random_, -5, 5)),
                    float(between(random_, -5, 5))};
        double size = 1;  // of what is aimed at
        if (!full.empty()) {
            const uint32_t i = full[below(random_, full.size())];
            const Content& content = instances[i].bottom->content();
            float stretch = 0;
            for (const auto& row : top_->instances[i].transform.matrix)
                for (int k = 0; k < 3; ++k) stretch = std::max(stretch, std::fabs(row[k]));
            size = std::max(1e-3, instances[i].bottom->reach() * stretch);
            const Geometry& g = content.geometries[below(random_, content.geometries.size())];
            if (g.primitives()) {
                const Vec3 p = point_of(g, below(random_, g.primitives()), random_);
                Transform m;
                std::memcpy(&m, &top_->instances[i].transform, sizeof m);
                const Vec3 world = lab::transform_point(m, p);
                if (std::isfinite(world.x) && std::isfinite(world.y) && std::isfinite(world.z))
                    target = world;
            }
        }
        // Rays from afar are known to fewer digits than small things need: most start near.
        const double away = chance(random_, 0.8) ? size * std::pow(10.0, between(random_, -1, 0.7))
                                                 : std::pow(10.0, between(random_, -1, 1.5));
        float offset[3];
        for (float& o : offset) o = float(between(random_, -away, away));
        if (chance(random_, 0.15)) offset[below(random_, 3)] = 0;
        if (chance(random_, 0.1)) {  // along an axis
            const uint64_t axis = below(random_, 3);
            for (uint64_t k = 0; k < 3; ++k) offset[k] = k == axis ? float(away) : 0;
        }
        ray.origin = {target.x + offset[0], target.y + offset[1], target.z + offset[2]};
        ray.direction = {-offset[0], -offset[1], -offset[2]};
        if (ray.direction == Vec3{0, 0, 0}) ray.direction.x = 1;
        const double speed = std::pow(2.0, between(random_, -4, 4));
        ray.direction = {float(ray.direction.x * speed), float(ray.direction.y * speed),
                         float(ray.direction.z * speed)};
        ray.tmin = chance(random_, 0.7) ? 0 : float(between(random_, 0, 1.5 / speed));
        ray.tmax = chance(random_, 0.7) ? 1e27f : ray.tmin + float(between(random_, 0, 2 / speed));
        ray.mask = chance(random_, 0.8) ? 0xffu : uint32_t(random_()) & 0xffu;
        ray.mode = uint32_t(below(random_, kModes));
        ray.flags = random_ray_flags(random_, ray.mode);
        ray.sbt_offset = uint32_t(below(random_, 2));
    }
    return rays;
}

void World::trace() {
    // Instances as traversal sees them: the inverse is the build's own, whose rounding is not this test's
    // matter.
    std::vector<InstanceReference> instances(top_->instances.size());
    const std::vector<uint8_t> block =
        tools::download_buffer(device_.context, heap_ ? heap_buffer_ : *top_->structure.buffer,
                               top_->structure.offset, top_->structure.size);
    auto word = [&](size_t at) {
        uint32_t w = 0;
        if (at * 4 + 4 > block.size()) throw Error("the top level's header points outside of it");
        std::memcpy(&w, block.data() + at * 4, 4);
        return w;
    };
    const size_t slots = size_t(word(RTC_HDR_SLOTS)) * 4;
    for (size_t i = 0; i < instances.size(); ++i) {
        const VkAccelerationStructureInstanceNV& in = top_->instances[i];
        InstanceReference& out = instances[i];
        if (top_->bottoms[i] < 0) continue;
        const Bottom& b = bottoms_.at(top_->bottoms[i]);
        out.bottom = b.reference.get();
        out.custom = in.instanceCustomIndex;
        out.mask = in.mask;
        out.flags = in.flags;
        out.first_record = b.first_record;
        for (int r = 0; r < 3; ++r) {
            for (int c = 0; c < 4; ++c) {
                const uint32_t w = word(slots + i * RTC_INSTANCE_QUADS * 4 + size_t(r * 4 + c));
                std::memcpy(&out.world_to_object[r][c], &w, 4);
            }
        }
        // It is the inverse: m w = 1 within the rounding of w's entries.
        for (int r = 0; r < 3; ++r) {
            for (int c = 0; c < 3; ++c) {
                double sum = 0, size = 0;
                for (int k = 0; k < 3; ++k) {
                    const double term = double(in.transform.matrix[r][k]) * out.world_to_object[k][c];
                    sum += term;
                    size += std::fabs(term);
                }
                if (std::fabs(sum - (r == c)) > 8 * 0x1p-24 * (size + 1) && !out.bottom->empty())
                    throw Error(history_ + "\ninstance " + std::to_string(i) +
                                ": world to object is no inverse");
            }
        }
    }
    std::vector<HitRecord> records;
    std::vector<float> boxes;
    for (const auto& [key, b] : bottoms_) {
        for (const Geometry& g : b.content.geometries) {
            for (uint32_t type = 0; type < 2; ++type)
                records.push_back({g.boxes, uint32_t(records.size()), uint32_t(boxes.size())});
            for (const Box& box : g.box_list)
                boxes.insert(boxes.end(), {box.min.x, box.min.y, box.min.z, box.max.x, box.max.y, box.max.z});
        }
    }
    const std::vector<Ray> rays = make_rays(instances);
    const auto before = std::chrono::steady_clock::now();
    const std::vector<Hit> hits = tracer_.trace(heap_, top_->structure.handle, records, boxes, rays);
    const auto traced = std::chrono::steady_clock::now();

    uint64_t all = 0;
    for (const InstanceReference& i : instances) all += i.bottom ? i.bottom->content().primitives() : 0;
    const bool brute = all * rays.size() <= limits_.brute_tests;
    counts_.brute_steps += brute;
    for (size_t i = 0; i < rays.size(); ++i) {
        const RayReference reference = trace_reference(rays[i], instances, brute);
        counts_.tests += reference.tests;
        compare(rays[i], hits[i], reference, instances);
    }
    counts_.rays += rays.size();
    trace_seconds_ = std::chrono::duration<double>(traced - before).count();
    reference_seconds_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - traced).count();
}

void World::compare(const Ray& ray, const Hit& hit, const RayReference& reference,
                    const std::vector<InstanceReference>& instances) {
    auto fail = [&](const std::string& what) {
        char got[300];
        std::snprintf(got, sizeof got,
                      "device: t %.9g instance %d custom %u geometry %u primitive %u kind %u record %u "
                      "weights %.7g %.7g "
                      "candidates %u",
                      double(hit.t), int(hit.instance), hit.custom, hit.geometry, hit.primitive, hit.kind,
                      hit.record, double(hit.b1), double(hit.b2), hit.candidates);
        std::string text = history_ + "\n" + what + "\n" + describe(ray) + "\n" + got;
        size_t shown = 0;
        for (const Candidate& c : reference.candidates)
            if (shown++ < 20) text += "\nreference: " + describe(c);
        throw Error(text);
    };
    const bool missed = hit.instance == kMissed;
    counts_.candidates += reference.candidates.size();
    for (const Candidate& c : reference.candidates) counts_.undecided += !c.certain;
    if (ray.mode == kIgnoreAll) {
        if (!missed) fail("every candidate was ignored, and still there is a hit");
        uint32_t certain = 0, hash = 0;
        bool facing = true;
        for (const Candidate& c : reference.candidates) {
            certain += c.certain;
            const Geometry& g = instances[c.instance].bottom->content().geometries[c.geometry];
            facing = facing && (g.boxes || c.facing_certain);
            hash += candidate_hash(c.instance, c.geometry, c.primitive, kind_of(c, g.boxes));
        }
        if (hit.candidates < certain || hit.candidates > reference.candidates.size())
            fail("the any-hit shader saw " + std::to_string(hit.candidates) + " candidates; it must see " +
                 std::to_string(certain) + " to " + std::to_string(reference.candidates.size()));
        if (certain == reference.candidates.size() && facing && hit.hash != hash)
            fail("the any-hit shader saw other candidates");
        return;
    }
    if (missed) {
        if (hit.t != ray.tmax) fail("gl_RayTmaxEXT in the miss shader is not the operand");
        for (const Candidate& c : reference.candidates)
            if (c.certain) fail("missed what must be hit: " + describe(c));
        return;
    }
    ++counts_.hits;
    const Candidate* found = nullptr;
    for (const Candidate& c : reference.candidates)
        if (c.instance == hit.instance && c.geometry == hit.geometry && c.primitive == hit.primitive)
            found = &c;
    if (!found) fail("hit what cannot be hit");
    const InstanceReference& instance = instances[hit.instance];
    const Geometry& g = instance.bottom->content().geometries[hit.geometry];
    if (!(std::fabs(hit.t - found->t) <= found->t_error)) fail("another distance than the reference");
    if (!(hit.t >= ray.tmin && hit.t <= ray.tmax)) fail("a hit outside of the ray's interval");
    if (hit.custom != instance.custom) fail("another custom index");
    if (hit.record != instance.first_record + 2 * hit.geometry + ray.sbt_offset)
        fail("another shader record");
    if (hit.kind != kind_of(*found, g.boxes) && (g.boxes || found->facing_certain)) fail("another hit kind");
    if (g.boxes) {
        if (hit.b1 != float(hit.primitive & 0xffffu) || hit.b2 != 3.0f) fail("other attributes");
    } else if (!(std::fabs(hit.b1 - found->weights[0]) <= found->weight_error &&
                 std::fabs(hit.b2 - found->weights[1]) <= found->weight_error)) {
        fail("other barycentrics");
    }
    const bool first_only = (ray.flags & 4u) || ray.mode == kTerminate;
    if (!found->certain) {
        const bool agree = exactly_hit(ray, instance, *found);
        ++(agree ? counts_.undecided_agree : counts_.undecided_differ);
    }
    if (first_only) return;
    for (const Candidate& c : reference.candidates) {
        if (c.t + c.t_error >= hit.t - found->t_error) continue;
        if (c.certain) fail("a nearer primitive must be hit: " + describe(c));
        const bool agree = !exactly_hit(ray, instances[c.instance], c);
        ++(agree ? counts_.undecided_agree : counts_.undecided_differ);
    }
}

}  // namespace rtc::stress
