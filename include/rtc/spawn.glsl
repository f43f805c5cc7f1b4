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
//                                   where D, the distance to the vertices, is at most E: 18u E
//   traversal's transform of o      fl(W o + w), W rounded once: 9u (|W| |o| + |w|)
// In world space:
//   o = M p + T, T added last       8u |M| |p| + 2u |T|
//   o + offset n                    2u |o|
// Derived, not yet measured. (The normal of a very thin sliver is not known to floats.) The tier `fast` has
// no such bound on its t.
#ifndef RTC_SPAWN_GLSL_
#define RTC_SPAWN_GLSL_

struct RtcSpawn {
    vec3 position; // the hit point in world space
    vec3 normal; // unit, world space, on the side of (v1 - v0) x (v2 - v0)
    float offset; // how far an origin must be from `position` along the normal, either way
};

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
    vec3 object_error = 2.0 * u * abs(v0) + 26.0 * u * extent +
                        9.0 * u * ((abs(world_to_object[0] * o.x) + abs(world_to_object[1] * o.y)) +
                                   (abs(world_to_object[2] * o.z) + abs(world_to_object[3])));
    // Scaled so that squares of tiny or huge triangles stay floats.
    float size = max(max(extent.x, extent.y), extent.z);
    vec3 object_normal = size > 0.0 ? cross(e1 / size, e2 / size) : vec3(0.0, 0.0, 1.0);
    vec3 a = vec3(world_to_object[0].x, world_to_object[1].x, world_to_object[2].x);
    vec3 b = vec3(world_to_object[0].y, world_to_object[1].y, world_to_object[2].y);
    vec3 c = vec3(world_to_object[0].z, world_to_object[1].z, world_to_object[2].z);
    // Normals turn with the inverse's transpose.
    vec3 world_normal = (a * object_normal.x + b * object_normal.y) + c * object_normal.z;
    float largest = max(max(abs(world_normal.x), abs(world_normal.y)), abs(world_normal.z));
    float shrink = largest > 0.0 ? 1.0 / largest : 0.0;
    world_normal *= shrink;
    float stretch = largest > 0.0 ? inversesqrt(dot(world_normal, world_normal)) : 0.0;
    RtcSpawn s;
    s.position = o;
    s.normal = world_normal * stretch;
    // The bounds' own roundings, and the normal's, are second order: 1 per cent holds them.
    s.offset = 1.01 * (dot(world_error, abs(s.normal)) +
                       dot(object_error, abs(object_normal)) * (shrink * stretch));
    return s;
}

// The origin of a ray into `direction` (world space): off the surface, on that side.
vec3 rtc_spawn_origin(RtcSpawn s, vec3 direction) {
    float side = dot(direction, s.normal) < 0.0 ? -s.offset : s.offset;
    return s.position + side * s.normal;
}

#endif // RTC_SPAWN_GLSL_
