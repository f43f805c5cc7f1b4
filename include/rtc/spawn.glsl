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
// Measured with `rtc-accuracy spawn` (docs/accuracy.md) in the tier watertight: no self-hits, but for triangles
// thinner than about 1e-5 of their length, whose edge functions drown in rounding: their weights, and with them
// t, come from anywhere along their length. `fast` has no bound on its t.
#ifndef RTC_SPAWN_GLSL_
#define RTC_SPAWN_GLSL_

struct RtcSpawn {
    vec3 position; // the hit point in world space
    vec3 normal; // unit, world space, on the side of (v1 - v0) x (v2 - v0)
    float offset; // how far an origin must be from `position` along the normal, either way
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
    // The bounds' own roundings are second order: 1 per cent holds them.
    s.offset = 1.01 * ((dot(world_error, abs(s.normal)) +
                        dot(object_error, abs(object_normal)) * (shrink * stretch)) + sinking);
    return s;
}

// The origin of a ray into `direction` (world space): off the surface, on that side.
vec3 rtc_spawn_origin(RtcSpawn s, vec3 direction) {
    float side = dot(direction, s.normal) < 0.0 ? -s.offset : s.offset;
    return s.position + side * s.normal;
}

#endif // RTC_SPAWN_GLSL_
