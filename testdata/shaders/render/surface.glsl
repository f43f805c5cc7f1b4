// The scene's tables, and the surface at a hit. Set 0.
#ifndef SURFACE_GLSL
#define SURFACE_GLSL

struct InstanceEntry {
    vec4 to_world[3];   // rows
    vec4 to_normal[3];  // rows of the inverse transpose
    uvec4 mesh;         // x: first triangle in the table, y: 1 when the mesh has normals
};
struct VertexEntry {
    vec4 position_u;
    vec4 normal_v;
};
struct MaterialEntry {
    vec4 color_metallic;
    vec4 emission_roughness;
    uvec4 texture_flags;  // x: layer or ~0, y: 1 when both sides emit
};

layout(set = 0, binding = 1, std430) readonly buffer Instances { InstanceEntry instances[]; };
layout(set = 0, binding = 2, std430) readonly buffer Vertices { VertexEntry vertices[]; };
layout(set = 0, binding = 3, std430) readonly buffer Triangles { uvec4 triangles[]; };  // vertices, material
layout(set = 0, binding = 4, std430) readonly buffer Materials { MaterialEntry materials[]; };
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
    vec3 magnitude = max(max(abs(p0), abs(p1)), abs(p2)) + abs(position) + abs(translation);
    return (32.0 / 16777216.0) * (magnitude.x + magnitude.y + magnitude.z);
}

vec3 to_world(InstanceEntry entry, vec3 p) {
    // Written out, so that `precise` holds for every operation (it does not reach into dot).
    precise vec3 world;
    world.x = entry.to_world[0].x * p.x + entry.to_world[0].y * p.y + entry.to_world[0].z * p.z + entry.to_world[0].w;
    world.y = entry.to_world[1].x * p.x + entry.to_world[1].y * p.y + entry.to_world[1].z * p.z + entry.to_world[1].w;
    world.z = entry.to_world[2].x * p.x + entry.to_world[2].y * p.y + entry.to_world[2].z * p.z + entry.to_world[2].w;
    return world;
}

// `hit` as the closest-hit shader wrote it; `direction` of the ray that found it.
Surface fetch_surface(uvec4 hit, vec3 direction) {
    InstanceEntry entry = instances[hit.x];
    uvec4 triangle = triangles[entry.mesh.x + hit.y];
    VertexEntry a = vertices[triangle.x], b = vertices[triangle.y], c = vertices[triangle.z];
    MaterialEntry material = materials[triangle.w];
    float u = uintBitsToFloat(hit.z), v = uintBitsToFloat(hit.w), w = 1.0 - u - v;

    vec3 p0 = to_world(entry, a.position_u.xyz);
    vec3 p1 = to_world(entry, b.position_u.xyz);
    vec3 p2 = to_world(entry, c.position_u.xyz);
    precise vec3 position = p0 * w + p1 * u + p2 * v;

    Surface surface;
    surface.position = position;
    surface.spawn_offset = spawn_offset(p0, p1, p2, position,
        vec3(entry.to_world[0].w, entry.to_world[1].w, entry.to_world[2].w));
    surface.ng = normalize(cross(p1 - p0, p2 - p0));
    bool front = dot(surface.ng, direction) < 0.0;
    surface.ng = front ? surface.ng : -surface.ng;
    surface.ns = surface.ng;
    if (entry.mesh.y != 0u) {
        vec3 n = a.normal_v.xyz * w + b.normal_v.xyz * u + c.normal_v.xyz * v;
        n = normalize(vec3(dot(entry.to_normal[0].xyz, n), dot(entry.to_normal[1].xyz, n),
                           dot(entry.to_normal[2].xyz, n)));
        n = dot(n, surface.ng) < 0.0 ? -n : n;
        // A shading normal that faces away from the viewer would shade the wrong side.
        surface.ns = dot(n, direction) < 0.0 ? n : surface.ng;
    }
    surface.base_color = material.color_metallic.rgb;
    surface.metallic = material.color_metallic.a;
    surface.roughness = material.emission_roughness.a;
    bool emits = front || material.texture_flags.y != 0u;
    surface.emission = emits ? material.emission_roughness.rgb : vec3(0.0);
    if (material.texture_flags.x != 0xffffffffu) {
        vec2 uv = vec2(a.position_u.w, a.normal_v.w) * w + vec2(b.position_u.w, b.normal_v.w) * u +
                  vec2(c.position_u.w, c.normal_v.w) * v;
        surface.base_color *= textureLod(textures, vec3(uv, float(material.texture_flags.x)), 0.0).rgb;
    }
    return surface;
}

// Where a ray towards `direction` starts: off the surface, on the side it leaves to.
vec3 spawn_point(Surface surface, vec3 direction) {
    float side = dot(direction, surface.ng) < 0.0 ? -1.0 : 1.0;
    return surface.position + surface.ng * (side * surface.spawn_offset);
}

float luminance(vec3 color) { return dot(color, vec3(0.2126, 0.7152, 0.0722)); }

#endif
