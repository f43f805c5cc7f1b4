#include "denormals.h"

#include <cmath>
#include <limits>

namespace rtc::lab {
namespace {

bool any(const Vec3& v) { return is_denormal(v.x) || is_denormal(v.y) || is_denormal(v.z); }

// One operation of transform_point or transform_vector comes out below 2^-126.
bool transform_underflows(const Transform& m, const Vec3& v, bool point) {
    for (int r = 0; r < 3; ++r) {
        const volatile float x = m[r][0] * v.x, y = m[r][1] * v.y, z = m[r][2] * v.z;
        const volatile float xy = x + y, xyz = xy + z;
        const float last = point ? xyz + m[r][3] : xyz;
        for (const float f : {float(x), float(y), float(z), float(xy), float(xyz), last, m[r][0], m[r][1], m[r][2]})
            if (is_denormal(f)) return true;
        const float factors[] = {v.x, v.y, v.z}, products[] = {x, y, z};
        for (int i = 0; i < 3; ++i)  // lost altogether
            if (products[i] == 0 && m[r][i] != 0 && factors[i] != 0) return true;
    }
    return false;
}

bool hit_has(const HostScene& scene, const Ray& ray, uint32_t instance, uint32_t geometry, uint32_t primitive) {
    if (instance >= scene.instances.size()) return false;
    const Instance& where = scene.instances[instance];
    const auto& geometries = scene.blases[where.blas].geometries;
    if (geometry >= geometries.size() || primitive >= geometries[geometry].triangles.size()) return false;
    for (const Vec3& v : geometries[geometry].triangles[primitive])
        if (any(v)) return true;
    if (where.object_to_world == kIdentity) return false;
    const Transform& w = scene.world_to_object[instance];
    return transform_underflows(w, ray.origin, true) || transform_underflows(w, ray.direction, false);
}

}  // namespace

bool is_denormal(float v) { return v != 0 && std::fabs(v) < std::numeric_limits<float>::min(); }

bool denormals_at_stake(const HostScene& scene, const Ray& ray, const std::optional<OracleHit>& expected,
                        const RayResult& got) {
    return any(ray.origin) || any(ray.direction) ||
           (expected && hit_has(scene, ray, expected->instance, expected->geometry, expected->primitive)) ||
           hit_has(scene, ray, got.instance, got.geometry, got.primitive);
}

}  // namespace rtc::lab
