// Rays aimed at weak spots of a mesh, made from their number: billions cost nothing on the host.
// campaign_rays.cpp makes the same rays bit for bit.
layout(set = 0, binding = 0) uniform accelerationStructureEXT scene;
layout(set = 0, binding = 1, std430) readonly buffer Corners { float corners[]; }; // nine a triangle
layout(set = 0, binding = 2, std430) buffer Counters { uint counters[]; }; // campaign_rays.h: CampaignCounters
layout(push_constant) uniform Push { // campaign_rays.h: CampaignPush
    vec4 row0, row1, row2; // object to world
    vec4 ball; // centre, half the edge of the cube on which origins lie
    uint first_low, first_high, seed, mode;
    uint first_corner, triangles, rays, pad;
} push;

const uint MODE_AIM = 3u; // 0 insides of triangles, 1 edges, 2 vertices
const uint MODE_INSIDE = 4u; // origins lie in the mesh, which is convex
const uint MODE_AXES = 8u; // one ray in eight runs along an axis of the world
const uint MODE_NAIVE = 16u; // spawn.rgen: origins where t says
const uint RING = 32u; // offenders kept of a launch

uint state;

// M. O'Neill's PCG as a hash (M. Jarzynski and M. Olano, "Hash Functions for GPU Rendering", JCGT 2020).
uint pcg(uint v) {
    uint s = v * 747796405u + 2891336453u;
    uint w = ((s >> ((s >> 28u) + 4u)) ^ s) * 277803737u;
    return (w >> 22u) ^ w;
}

uint next() {
    state += 0x9e3779b9u;
    return pcg(state);
}

float unit() { return float(next() >> 8u) * 5.9604644775390625e-8; } // 2^-24

vec3 corner(uint triangle, uint k) {
    uint at = push.first_corner + triangle * 9u + k * 3u;
    return vec3(corners[at], corners[at + 1u], corners[at + 2u]);
}

float row(vec4 r, vec3 p) {
    precise float v = ((r.x * p.x + r.y * p.y) + r.z * p.z) + r.w;
    return v;
}

vec3 to_world(vec3 p) { return vec3(row(push.row0, p), row(push.row1, p), row(push.row2, p)); }

struct CampaignRay {
    vec3 origin, direction;
    uint low, high; // its number
    uint signs; // random bits that are left
    bool there; // false: this lane has no ray
};

CampaignRay campaign_ray() {
    CampaignRay ray;
    uint index = gl_LaunchIDEXT.y * gl_LaunchSizeEXT.x + gl_LaunchIDEXT.x;
    ray.there = index < push.rays;
    uint low = push.first_low + index;
    uint high = push.first_high + (low < index ? 1u : 0u);
    state = pcg(low ^ pcg(high ^ pcg(push.seed)));
    uint triangle = next() % push.triangles;
    uint k = next() % 3u;
    vec3 a = corner(triangle, k), b = corner(triangle, (k + 1u) % 3u), c = corner(triangle, (k + 2u) % 3u);
    uint aim = push.mode & MODE_AIM;
    float u = unit(), v = unit();
    u = aim == 2u ? 0.0 : u;
    v = aim == 0u ? v : 0.0;
    precise float uv = u + v;
    if (uv > 1.0) {
        precise float u2 = 1.0 - u;
        precise float v2 = 1.0 - v;
        u = u2;
        v = v2;
    }
    precise float w = (1.0 - u) - v;
    precise vec3 target = (w * a + u * b) + v * c;
    uint face = next() % 6u;
    float s = 2.0 * unit() - 1.0, t = 2.0 * unit() - 1.0, side = (face & 1u) != 0u ? 1.0 : -1.0;
    vec3 way = face < 2u ? vec3(side, s, t) : (face < 4u ? vec3(t, side, s) : vec3(s, t, side));
    precise vec3 from = push.ball.xyz + push.ball.w * way;
    vec3 goal = to_world(target);
    ray.origin = to_world(from);
    precise vec3 direction = goal - ray.origin;
    ray.direction = direction;
    uint signs = next();
    if ((push.mode & MODE_AXES) != 0u && (signs & 7u) == 0u) {
        // Zeros carry either sign. The origin is the goal moved along the axis: the ray meets it exactly.
        uint axis = face >> 1u;
        // As bits: compilers may take one zero for the other.
        vec3 zeros = uintBitsToFloat((uvec3(8u, 16u, 32u) & ~signs) << uvec3(28u, 27u, 26u));
        bvec3 along = equal(uvec3(0u, 1u, 2u), uvec3(axis));
        ray.direction = mix(zeros, vec3(side), along);
        precise vec3 back = goal - side * (2.0 * push.ball.w);
        ray.origin = mix(goal, back, along);
    }
    ray.low = low;
    ray.high = high;
    ray.signs = signs;
    return ray;
}

// An event to be looked at again.
void keep(CampaignRay ray, uint flags, uvec2 seen) {
    uint number = atomicAdd(counters[0], 1u);
    if (number < RING) {
        uint at = 4u + number * 12u;
        counters[at] = ray.low;
        counters[at + 1u] = ray.high;
        counters[at + 2u] = flags;
        counters[at + 3u] = seen.x;
        counters[at + 4u] = seen.y;
        for (uint i = 0u; i < 3u; ++i) {
            counters[at + 5u + i] = floatBitsToUint(ray.origin[i]);
            counters[at + 8u + i] = floatBitsToUint(ray.direction[i]);
        }
    }
}
