// What all ray tracing stages share. Compiled with -DNONUNIFORM where the device can index arrays of
// descriptors with values that differ between the lanes; elsewhere a switch names each descriptor.
#ifdef NONUNIFORM
#extension GL_EXT_nonuniform_qualifier : require
#endif

const uint MESHES = 4u;
const uint TEXTURES = 2u;

// Set 0: the frame. Set 1: every resource of the scene, named by index from the shader records.
layout(set = 0, binding = 0) uniform accelerationStructureNV scene;

struct Vertex {
    vec4 position_u;
    vec4 normal_v;
};
layout(set = 1, binding = 0, std430) readonly buffer Vertices { Vertex data[]; } vertices[MESHES];
layout(set = 1, binding = 1, std430) readonly buffer Indices { uint data[]; } indices[MESHES];
layout(set = 1, binding = 2) uniform sampler2D textures[TEXTURES];

layout(push_constant) uniform Camera {
    vec4 eye, right, up, forward;
    vec4 light;
} camera;

#ifdef NONUNIFORM
Vertex fetch_vertex(uint mesh, uint index) { return vertices[nonuniformEXT(mesh)].data[index]; }
uint fetch_index(uint mesh, uint index) { return indices[nonuniformEXT(mesh)].data[index]; }
ivec2 texel(vec2 uv, ivec2 size) { return ivec2(floor(fract(uv) * vec2(size))); }
vec4 fetch_texture(uint which, vec2 uv) {
    ivec2 size = textureSize(textures[nonuniformEXT(which)], 0);
    return texelFetch(textures[nonuniformEXT(which)], texel(uv, size), 0);
}
#else
Vertex fetch_vertex(uint mesh, uint index) {
    switch (mesh) {
    case 0u: return vertices[0].data[index];
    case 1u: return vertices[1].data[index];
    case 2u: return vertices[2].data[index];
    default: return vertices[3].data[index];
    }
}
uint fetch_index(uint mesh, uint index) {
    switch (mesh) {
    case 0u: return indices[0].data[index];
    case 1u: return indices[1].data[index];
    case 2u: return indices[2].data[index];
    default: return indices[3].data[index];
    }
}
ivec2 texel(vec2 uv, ivec2 size) { return ivec2(floor(fract(uv) * vec2(size))); }
vec4 fetch_texture(uint which, vec2 uv) {
    if (which == 0u) return texelFetch(textures[0], texel(uv, textureSize(textures[0], 0)), 0);
    return texelFetch(textures[1], texel(uv, textureSize(textures[1], 0)), 0);
}
#endif

struct Material { // callable data
    vec2 uv;
    vec3 albedo;
};

struct Reflection { // payload 0
    vec3 color;
};

struct Shadow { // payload 1
    float light;
};

const uint RECORD_SURFACE = 0u, RECORD_SHADOW = 1u; // the two ray types' records of a mesh
const uint SHADOW_FLAGS = gl_RayFlagsTerminateOnFirstHitNV | gl_RayFlagsSkipClosestHitShaderNV;
const uint MISS_SKY = 0u, MISS_LIGHT = 1u;
const float AMBIENT = 0.25;
const float OFFSET = 2e-3; // of ray origins along the normal, against hitting the surface itself

vec3 shade(vec3 albedo, vec3 normal, float light) {
    return albedo * (AMBIENT + (1.0 - AMBIENT) * light * max(dot(normal, camera.light.xyz), 0.0));
}
