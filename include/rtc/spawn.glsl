// Where a ray that leaves a triangle may start without hitting it again.
//
//   #extension GL_GOOGLE_include_directive : require
//   #include "rtc/spawn.glsl"
//
//   RtcSpawn s = rtc_spawn(v0, v1, v2, barycentrics, gl_ObjectToWorldEXT, gl_WorldToObjectEXT);
//   traceRayEXT(scene, flags, mask, 0, 0, 0, rtc_spawn_origin(s, direction), 0.0, direction, tmax, 0);
//
// v0, v1, v2: the triangle's vertices in object space, as the acceleration structure was built from
// them; barycentrics: the hit attribute (weights of v1 and v2). Use tmin = 0: the origin is far enough.
//
// The method is that of error bounds (C. Wächter and N. Binder, "A Fast and Robust Method for Avoiding
// Self-Intersection", Ray Tracing Gems 2019, chapter 6; NVIDIA, "Solving Self-Intersection Artifacts",
// 2023): the hit point is made from vertices and barycentrics instead of from t, everything that can be
// wrong with it is bounded, and the origin moves along the normal by that bound. The constants are derived
// here for what rtc's traversal does; u = 2^-24, an operation is off by at most 2u of its result, which
// holds for rounding to nearest and for truncation, with and without fused operations.
//
// In object space, E being the larger of |v1 - v0| and |v2 - v0| in each component:
//   p = v0 + (b1 e1 + b2 e2)        e: 2u, products 2u, sum 2u: 6u E; last sum 2u (|v0| + E):
//                                   2u |v0| + 8u E
//   traversal's triangle test       moves vertices by up to 2u D + 8u D and t by 8u D (watertight.glsl),
//                                   where D is the largest component of the distance to a vertex, whatever
//                                   the direction of the error: the shear mixes components. 18u D
//   traversal's transform of o      fl(W o + w), W rounded once: 9u (|W| |o| + |w|)
// In world space:
//   o = M p + T, T added last       8u |M| |p| + 2u |T|
//   o + offset n                    2u |o|
// The normal decides on which side a ray leaves, and a thin sliver's is lost when differences of its
// vertices are rounded: it is computed in pairs of floats, whose error is 2^-43 of |e1| |e2|. What then is
// wrong with the direction's side of the plane, S being |W|^T |n| and L the triangle's extent in the world:
//   normal as floats, W^T n          2u, 6u S; scaled twice: 4u; dot(direction, normal): 6u
//   traversal's W d                  6u S
//   together below 24u S |d|, so a ray that should leave sinks by at most 24u L |S| / |W^T n| within the
//   triangle's extent, and starts higher by that.
// That t is off by 8u D holds for the point that the weights of an edge test name. The weights themselves come from
// products of coordinates that are at most 2E (sheared, measured from the ray), 4E^2, whose roundings are 16u of them:
// a weight is off by at most 64u E^2 / det, two weights move t by 128u E^3 / det along d.kz, and det is
// |n . d| / |d.kz| with n = e1 x e2. The plane lies offset |d.kz| |n| / |n . d| behind the ray's start: the ray's
// direction cancels, and
//   offset >= 128u E^3 / |n|
// more keeps the hit behind. For triangles thinner than 1/256 of their length, |n| < E^2 / 256, that is no longer
// small against their width. Those are left sideways instead: the test decides exactly for corners moved by `slack`
// (10u D in each direction, what p, o and d lose by rounding), so a ray whose whole line passes all three corners by
// more than that misses them, whatever its t. The start moves along s, at right angles to the direction and to the
// longest edge, until the line does pass: by the triangle's width as s sees it, and the slack.
// Measured with `rtc-accuracy spawn` (docs/accuracy.md) in the tier watertight. `fast` has no bound on its t.
#ifndef RTC_SPAWN_GLSL_
#define RTC_SPAWN_GLSL_

struct RtcSpawn {
    vec3 position; // the hit point in world space
    vec3 normal; // unit, world space, on the side of (v1 - v0) x (v2 - v0)
    float offset; // how far an origin must be from `position` along the normal, either way
    // Of thin triangles, else 0: corners less `position`, and how far traversal may see them from where they are.
    vec3 corner0, corner1, corner2;
    vec3 slack;
};

// a b - c d for factors that are sums of two floats, high and low.
float rtc_spawn_minor(vec2 a, vec2 b, vec2 c, vec2 d) {
    // Factors split to 12 bits: partial products are exact (T. J. Dekker, Numer. Math. 18, 1971).
    float ah = uintBitsToFloat(floatBitsToUint(a.x) & 0xfffff000u);
    float bh = uintBitsToFloat(floatBitsToUint(b.x) & 0xfffff000u);
    float ch = uintBitsToFloat(floatBitsToUint(c.x) & 0xfffff000u);
    float dh = uintBitsToFloat(floatBitsToUint(d.x) & 0xfffff000u);
    precise float al = a.x - ah, bl = b.x - bh, cl = c.x - ch, dl = d.x - dh;
    precise float p = a.x * b.x;
    precise float q = c.x * d.x;
    precise float pe = ((ah * bh - p) + ah * bl + al * bh) + al * bl;
    precise float qe = ((ch * dh - q) + ch * dl + cl * dh) + cl * dl;
    precise float low = (pe - qe) + ((a.x * b.y + a.y * b.x) - (c.x * d.y + c.y * d.x));
    // p - q without its rounding error (D. E. Knuth).
    precise float s = p - q;
    precise float z = s - p;
    precise float e = (p - (s - z)) - (q + z);
    precise float minor = s + (e + low);
    return minor;
}

// What b - a = `difference` lost by rounding.
float rtc_spawn_lost(float a, float b, float difference) {
    precise float z = difference - b;
    precise float lost = (b - (difference - z)) - (a + z);
    return lost;
}

RtcSpawn rtc_spawn(vec3 v0, vec3 v1, vec3 v2, vec2 barycentrics, mat4x3 object_to_world,
                   mat4x3 world_to_object) {
    const float u = 5.9604644775390625e-8; // 2^-24
    precise vec3 e1 = v1 - v0;
    precise vec3 e2 = v2 - v0;
    precise vec3 p = v0 + (barycentrics.x * e1 + barycentrics.y * e2);
    precise vec3 o = (object_to_world[0] * p.x + object_to_world[1] * p.y + object_to_world[2] * p.z) +
                     object_to_world[3];
    vec3 extent = max(abs(e1), abs(e2));
    vec3 world_error = 8.0 * u * (abs(object_to_world[0] * p.x) + abs(object_to_world[1] * p.y) +
                                  abs(object_to_world[2] * p.z)) +
                       2.0 * u * (abs(object_to_world[3]) + abs(o));
    vec3 spread = max(extent, abs(e2 - e1));
    vec3 object_error = 2.0 * u * abs(v0) + 8.0 * u * extent +
                        vec3(18.0 * u * max(max(spread.x, spread.y), spread.z)) +
                        9.0 * u * ((abs(world_to_object[0] * o.x) + abs(world_to_object[1] * o.y)) +
                                   (abs(world_to_object[2] * o.z) + abs(world_to_object[3])));
    // Times a power of two, so that products of tiny or huge triangles stay floats.
    float size = max(max(extent.x, extent.y), extent.z);
    int exponent = int(floatBitsToUint(size) >> 23u);
    float scale = uintBitsToFloat(uint(clamp(254 - exponent, 1, 254)) << 23u);
    precise vec3 f1 = e1 * scale, f2 = e2 * scale;
    precise vec3 l1 = vec3(rtc_spawn_lost(v0.x, v1.x, e1.x), rtc_spawn_lost(v0.y, v1.y, e1.y),
                           rtc_spawn_lost(v0.z, v1.z, e1.z)) * scale;
    precise vec3 l2 = vec3(rtc_spawn_lost(v0.x, v2.x, e2.x), rtc_spawn_lost(v0.y, v2.y, e2.y),
                           rtc_spawn_lost(v0.z, v2.z, e2.z)) * scale;
    vec2 x1 = vec2(f1.x, l1.x), y1 = vec2(f1.y, l1.y), z1 = vec2(f1.z, l1.z);
    vec2 x2 = vec2(f2.x, l2.x), y2 = vec2(f2.y, l2.y), z2 = vec2(f2.z, l2.z);
    vec3 object_normal = vec3(rtc_spawn_minor(y1, z2, z1, y2), rtc_spawn_minor(z1, x2, x1, z2),
                              rtc_spawn_minor(x1, y2, y1, x2));
    vec3 a = vec3(world_to_object[0].x, world_to_object[1].x, world_to_object[2].x);
    vec3 b = vec3(world_to_object[0].y, world_to_object[1].y, world_to_object[2].y);
    vec3 c = vec3(world_to_object[0].z, world_to_object[1].z, world_to_object[2].z);
    // Normals turn with the inverse's transpose.
    vec3 world_normal = (a * object_normal.x + b * object_normal.y) + c * object_normal.z;
    vec3 sizes = (abs(a) * abs(object_normal.x) + abs(b) * abs(object_normal.y)) + abs(c) * abs(object_normal.z);
    float largest = max(max(abs(world_normal.x), abs(world_normal.y)), abs(world_normal.z));
    float shrink = largest > 0.0 ? 1.0 / largest : 0.0;
    world_normal *= shrink;
    float stretch = largest > 0.0 ? inversesqrt(dot(world_normal, world_normal)) : 0.0;
    RtcSpawn s;
    s.position = o;
    s.normal = world_normal * stretch;
    vec3 world_spread = (abs(object_to_world[0]) * spread.x + abs(object_to_world[1]) * spread.y) +
                        abs(object_to_world[2]) * spread.z;
    float sinking = 24.0 * u * (length(world_spread) * (length(sizes * shrink) * stretch));
    vec3 corner_error = object_error + vec3(24.0 * u * max(max(spread.x, spread.y), spread.z));
    float unit = size * scale; // 1 to 2: object_normal is n times scale^2
    bool thin = dot(object_normal, object_normal) < unit * unit * unit * unit * 1.52587890625e-5; // 2^-16
    float wobble = thin ? 0.0 : 128.0 * u * (unit * unit * size) * (shrink * stretch);
    // The bounds' own roundings are second order: 1 per cent holds them.
    s.offset = 1.01 * ((dot(world_error, abs(s.normal)) +
                        dot(object_error, abs(object_normal)) * (shrink * stretch)) + (sinking + wobble));
    s.corner0 = s.corner1 = s.corner2 = s.slack = vec3(0.0);
    if (thin) {
        vec3 w1 = (object_to_world[0] * e1.x + object_to_world[1] * e1.y) + object_to_world[2] * e1.z;
        vec3 w2 = (object_to_world[0] * e2.x + object_to_world[1] * e2.y) + object_to_world[2] * e2.z;
        s.corner0 = -(barycentrics.x * w1 + barycentrics.y * w2);
        s.corner1 = s.corner0 + w1;
        s.corner2 = s.corner0 + w2;
        // Corners made so are off by less than 24u of the edges; the start is rounded once more.
        vec3 edges = corner_error + 24.0 * u * spread;
        s.slack = ((abs(object_to_world[0]) * edges.x + abs(object_to_world[1]) * edges.y) +
                   abs(object_to_world[2]) * edges.z) + (world_error + 4.0 * u * abs(o));
    }
    return s;
}

// The origin of a ray into `direction` (world space): off the surface, on that side.
vec3 rtc_spawn_origin(RtcSpawn s, vec3 direction) {
    vec3 up = dot(direction, s.normal) < 0.0 ? -s.normal : s.normal;
    vec3 origin = s.position + s.offset * up;
    if (max(max(s.slack.x, s.slack.y), s.slack.z) > 0.0) {
        vec3 d = direction * (1.0 / max(max(abs(direction.x), abs(direction.y)), abs(direction.z)));
        d *= inversesqrt(dot(d, d));
        vec3 first = s.corner1 - s.corner0, second = s.corner2 - s.corner1, third = s.corner0 - s.corner2;
        vec3 along = dot(first, first) > dot(second, second) ? first : second;
        along = dot(third, third) > dot(along, along) ? third : along;
        float size = max(max(abs(along.x), abs(along.y)), abs(along.z));
        // At right angles to d within a few u, also where d runs along the edge and the product is noise.
        vec3 across = cross(d, along * (1.0 / size));
        across = dot(across, across) > 1e-20 ? across * inversesqrt(dot(across, across)) : up;
        across -= dot(across, d) * d;
        across *= inversesqrt(dot(across, across));
        across -= dot(across, d) * d;
        across = dot(across, up) < 0.0 ? -across : across;
        float width = max(max(dot(across, s.corner0), dot(across, s.corner1)), dot(across, s.corner2));
        // 32u: d and `across` are not quite at right angles, and products round.
        float reach = 1.9073486e-6 * size; // 32u
        origin += across * (1.01 * (max(width, 0.0) + dot(abs(across), s.slack)) + 3.0 * reach);
    }
    return origin;
}

#endif // RTC_SPAWN_GLSL_
