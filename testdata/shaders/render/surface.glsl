// The scene's tables, and the surface at a hit. Set 0.
#ifndef SURFACE_GLSL
#define SURFACE_GLSL

#extension GL_EXT_samplerless_texture_functions : require

// Texel buffers rather than storage buffers: reads with an index per invocation are several times cheaper
// in CPU drivers. Instances have 7 texels by custom index: 3 rows of the transform, 3 rows of its inverse
// transpose, then the first triangle in the table and 1 when the mesh has normals.
layout(set = 0, binding = 1) uniform textureBuffer instances;
// 2 texels: position and u, normal and v.
layout(set = 0, binding = 2) uniform textureBuffer vertices;
// The three vertices and the material.
layout(set = 0, binding = 3) uniform utextureBuffer triangles;
// 3 texels: base colour and metallic; emission and roughness; texture layer or -1, 1 when both sides emit.
layout(set = 0, binding = 4) uniform textureBuffer materials;
layout(set = 0, binding = 6) uniform sampler2DArray textures;

struct Surface {
    vec3 position;
    float spawn_offset;
    vec3 ng;  // geometric normal, towards the ray's origin
    float metallic;
    vec3 ns;  // shading normal, on the same side
    float roughness;
    vec3 base_color;
    vec3 emission;  // towards the ray's origin
};

// How far from `position` rays must start so that no arithmetic, ours or a driver's, finds the same
// triangle again. The rounding of the interpolation and of the transform is bounded as in Pharr, Jakob
// and Humphreys, PBRT 4, 6.8.1 and 6.8.4: (7 + 4) u of the largest magnitudes involved. The
// intersection test subtracts the origin from the vertices and adds as much again, of the triangle's
// extent. 32 u is three times their sum; nearby geometry is displaced by 2e-6 of its coordinates.
float spawn_offset(vec3 p0, vec3 p1, vec3 p2, vec3 position, vec3 translation) {
    precise vec3 magnitude = max(max(abs(p0), abs(p1)), abs(p2)) + abs(position) + abs(translation);
    precise float sum = magnitude.x + magnitude.y + magnitude.z;
    return (32.0 / 16777216.0) * sum;
}

// Arithmetic that every driver does alike, contracted nowhere: `precise` does not reach into dot, cross, normalize
// and reflect, so they are written out for what new rays are made of.
float exact_dot(vec3 a, vec3 b) {
    precise float sum = a.x * b.x + a.y * b.y + a.z * b.z;
    return sum;
}

vec3 exact_cross(vec3 a, vec3 b) {
    precise vec3 product;
    product.x = a.y * b.z - a.z * b.y;
    product.y = a.z * b.x - a.x * b.z;
    product.z = a.x * b.y - a.y * b.x;
    return product;
}

vec3 exact_normalize(vec3 a) {
    precise vec3 unit = a * inversesqrt(exact_dot(a, a));
    return unit;
}

vec3 exact_reflect(vec3 d, vec3 n) {
    precise float twice = 2.0 * exact_dot(d, n);
    precise vec3 mirrored = d - n * twice;
    return mirrored;
}

vec3 to_world(vec4 row0, vec4 row1, vec4 row2, vec3 p) {
    // Written out, so that `precise` holds for every operation (it does not reach into dot).
    precise vec3 world;
    world.x = row0.x * p.x + row0.y * p.y + row0.z * p.z + row0.w;
    world.y = row1.x * p.x + row1.y * p.y + row1.z * p.z + row1.w;
    world.z = row2.x * p.x + row2.y * p.y + row2.z * p.z + row2.w;
    return world;
}

// Where the ray crosses the triangle: the weights of p1 and p2 once more, after Moeller and Trumbore (1997).
// Implementations may round a hit's barycentrics differently, and curved mirrors make a different picture
// of one bit; taken from the ray in arithmetic that all must do alike, paths stay together. Edge-on, where
// these are the worse ones, the given ones stay.
vec2 crossing(vec3 p0, vec3 p1, vec3 p2, vec3 origin, vec3 d, vec2 given) {
    precise vec3 e = p1 - p0, f = p2 - p0, s = origin - p0;
    vec3 p = exact_cross(d, f), q = exact_cross(s, e);
    float determinant = exact_dot(e, p);
    precise vec2 weights = vec2(exact_dot(s, p), exact_dot(d, q)) / determinant;
    // NaN is no less.
    return all(lessThan(abs(weights - given), vec2(1e-3))) ? weights : given;
}

// `hit` as the closest-hit shader wrote it; `origin` and `direction` of the ray that found it.
Surface fetch_surface(uvec4 hit, vec3 origin, vec3 direction) {
    int entry = int(hit.x) * 7;
    vec4 row0 = texelFetch(instances, entry), row1 = texelFetch(instances, entry + 1);
    vec4 row2 = texelFetch(instances, entry + 2), mesh = texelFetch(instances, entry + 6);
    uvec4 triangle = texelFetch(triangles, int(uint(mesh.x) + hit.y));
    ivec3 corner = ivec3(triangle.xyz) * 2;
    vec4 pu0 = texelFetch(vertices, corner.x), nv0 = texelFetch(vertices, corner.x + 1);
    vec4 pu1 = texelFetch(vertices, corner.y), nv1 = texelFetch(vertices, corner.y + 1);
    vec4 pu2 = texelFetch(vertices, corner.z), nv2 = texelFetch(vertices, corner.z + 1);
    int shade = int(triangle.w) * 3;
    vec4 color_metallic = texelFetch(materials, shade), emission_roughness = texelFetch(materials, shade + 1);
    vec4 texture_flags = texelFetch(materials, shade + 2);

    vec3 p0 = to_world(row0, row1, row2, pu0.xyz);
    vec3 p1 = to_world(row0, row1, row2, pu1.xyz);
    vec3 p2 = to_world(row0, row1, row2, pu2.xyz);
    vec2 uv = crossing(p0, p1, p2, origin, direction, uintBitsToFloat(hit.zw));
    precise float u = uv.x, v = uv.y, w = 1.0 - u - v;
    precise vec3 position = p0 * w + p1 * u + p2 * v;

    Surface surface;
    surface.position = position;
    surface.spawn_offset = spawn_offset(p0, p1, p2, position, vec3(row0.w, row1.w, row2.w));
    surface.ng = exact_normalize(exact_cross(p1 - p0, p2 - p0));
    bool front = exact_dot(surface.ng, direction) < 0.0;
    surface.ng = front ? surface.ng : -surface.ng;
    surface.ns = surface.ng;
    if (mesh.y != 0.0) {
        precise vec3 mixed = nv0.xyz * w + nv1.xyz * u + nv2.xyz * v;
        vec3 n = exact_normalize(vec3(exact_dot(texelFetch(instances, entry + 3).xyz, mixed),
                                      exact_dot(texelFetch(instances, entry + 4).xyz, mixed),
                                      exact_dot(texelFetch(instances, entry + 5).xyz, mixed)));
        n = exact_dot(n, surface.ng) < 0.0 ? -n : n;
        // A shading normal that faces away from the viewer would shade the wrong side.
        surface.ns = exact_dot(n, direction) < 0.0 ? n : surface.ng;
    }
    surface.base_color = color_metallic.rgb;
    surface.metallic = color_metallic.a;
    surface.roughness = emission_roughness.a;
    bool emits = front || texture_flags.y != 0.0;
    surface.emission = emits ? emission_roughness.rgb : vec3(0.0);
    if (texture_flags.x >= 0.0) {
        vec2 texel = vec2(pu0.w, nv0.w) * w + vec2(pu1.w, nv1.w) * u + vec2(pu2.w, nv2.w) * v;
        surface.base_color *= textureLod(textures, vec3(texel, texture_flags.x), 0.0).rgb;
    }
    return surface;
}

// Where a ray towards `direction` starts: off the surface, on the side it leaves to.
vec3 spawn_point(Surface surface, vec3 direction) {
    float side = exact_dot(direction, surface.ng) < 0.0 ? -1.0 : 1.0;
    precise vec3 start = surface.position + surface.ng * (side * surface.spawn_offset);
    return start;
}

float luminance(vec3 color) { return dot(color, vec3(0.2126, 0.7152, 0.0722)); }

#endif
