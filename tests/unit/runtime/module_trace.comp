#version 450
#extension GL_GOOGLE_include_directive : require
#ifdef ADDRESS_MODE
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#endif
// A hand-written "linked module": closest hit of a list of rays through both levels,
// exactly as abi.h lays structures out. Boxes are tested generously; triangles by
// Moeller-Trumbore in the order of the slots. With ADDRESS_MODE defined structures are
// read by their device addresses, and no heap is declared.
#define RESERVED_SET 1
#define RESERVED_BINDING 0
#include "reserved_set.glsl"

struct Ray { vec4 origin_tmin, direction_tmax; };
layout(set = 0, binding = 0, std430) readonly buffer As { uint as_header[]; };
layout(set = 0, binding = 1, std430) readonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = 2, std430) writeonly buffer Hits { uvec4 hits[]; };
layout(push_constant) uniform Push { uint first_ray; };

uvec2 block; // the structure that is being walked
#ifdef ADDRESS_MODE
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Quads { uvec4 quads[]; };
uvec4 quad(uint i) { return Quads(block).quads[i]; }
#else
uvec4 quad(uint i) { return heap_quad(block.x + i); }
#endif

float best;
uvec4 hit; // t, instance, geometry, primitive

bool box(vec3 lo, vec3 hi, vec3 o, vec3 d) {
    vec3 inv = 1.0 / d;
    vec3 a = (lo - o) * inv, b = (hi - o) * inv;
    vec3 n = min(a, b), f = max(a, b);
    float near = max(max(n.x, n.y), max(n.z, 0.0));
    float far = min(min(f.x, f.y), f.z) * 1.0001 + 1e-6;
    return near <= far && near <= best * 1.0001;
}

void triangle(uint at, vec3 o, vec3 d, uint instance) {
    uvec4 q0 = quad(at), q1 = quad(at + 1u), q2 = quad(at + 2u);
    vec3 v0 = uintBitsToFloat(q0.xyz), e1 = uintBitsToFloat(q1.xyz) - v0, e2 = uintBitsToFloat(q2.xyz) - v0;
    vec3 pv = cross(d, e2);
    float det = dot(e1, pv);
    if (det == 0.0) return;
    vec3 tv = o - v0;
    float u = dot(tv, pv) / det;
    vec3 qv = cross(tv, e1);
    float v = dot(d, qv) / det;
    float t = dot(e2, qv) / det;
    if (u < 0.0 || v < 0.0 || u + v > 1.0 || t <= 0.0 || t >= best) return;
    best = t;
    hit = uvec4(floatBitsToUint(t), instance, q1.w & RTC_SLOT_GEOMETRY_MASK, q0.w);
}

void main() {
    uint lane;
    uvec3 id;
    if (!launch_id(lane, id)) return;
    uint size_x = param(RTC_PARAM_WIDTH);
    uint index = first_ray + id.x + size_x * (id.y + param(RTC_PARAM_HEIGHT) * id.z);
    Ray r = rays[index];
    best = r.direction_tmax.w;
    hit = uvec4(0xffffffffu);
    vec3 wo = r.origin_tmin.xyz, wd = r.direction_tmax.xyz;
    uvec2 root = uvec2(as_header[RTC_HDR_SELF_LO], as_header[RTC_HDR_SELF_HI]);
    block = root;
    if (root != uvec2(0u) && as_header[RTC_HDR_MAGIC] != RTC_AS_MAGIC) atomicAdd(control[RTC_CTRL_ERROR], 1u);
    uint stack[RTC_TRAVERSAL_STACK];
    uint top = 0u, bottom_mark = 0xffffffffu;
    uint nodes = as_header[RTC_HDR_NODES], slots = as_header[RTC_HDR_SLOTS];
    uint top_nodes = nodes, top_slots = slots;
    bool in_top = as_header[RTC_HDR_KIND] == RTC_AS_KIND_TOP;
    uint instance = 0xffffffffu;
    vec3 o = wo, d = wd;
    uint ref = root == uvec2(0u) ? RTC_REF_EMPTY : 0u;
    for (uint turn = 0u; turn < 60000u; turn++) {
        if ((ref & RTC_REF_LEAF) == 0u) {
            uvec4 q0 = quad(nodes + 4u * ref), q1 = quad(nodes + 4u * ref + 1u);
            uvec4 q2 = quad(nodes + 4u * ref + 2u), q3 = quad(nodes + 4u * ref + 3u);
            bool h0 = q0.w != RTC_REF_EMPTY && box(uintBitsToFloat(q0.xyz), uintBitsToFloat(q1.xyz), o, d);
            bool h1 = q1.w != RTC_REF_EMPTY && box(uintBitsToFloat(q2.xyz), uintBitsToFloat(q3.xyz), o, d);
            if (h0 && h1) stack[top++] = q1.w;
            if (h0 || h1) {
                ref = h0 ? q0.w : q1.w;
                continue;
            }
        } else {
            uint count = (ref >> RTC_REF_COUNT_SHIFT) & RTC_REF_COUNT_MASK, first = ref & RTC_REF_INDEX_MASK;
            if (in_top && count != 0u) {
                uint rec = slots + first * RTC_INSTANCE_QUADS;
                uvec4 q6 = quad(rec + 6u), q7 = quad(rec + 7u);
                vec4 w0 = uintBitsToFloat(quad(rec)), w1 = uintBitsToFloat(quad(rec + 1u)),
                     w2 = uintBitsToFloat(quad(rec + 2u));
                o = vec3(dot(w0, vec4(wo, 1.0)), dot(w1, vec4(wo, 1.0)), dot(w2, vec4(wo, 1.0)));
                d = vec3(dot(w0.xyz, wd), dot(w1.xyz, wd), dot(w2.xyz, wd));
                instance = first;
                block = q6.xy;
                nodes = q7.z;
                slots = q7.y;
                in_top = false;
                bottom_mark = top;
                ref = 0u;
                continue;
            }
            for (uint s = 0u; s < count; s++) triangle(slots + (first + s) * RTC_TRIANGLE_QUADS, o, d, instance);
        }
        if (top == bottom_mark) { // the bottom level is done
            in_top = true;
            block = root;
            nodes = top_nodes;
            slots = top_slots;
            o = wo;
            d = wd;
            bottom_mark = 0xffffffffu;
        }
        if (top == 0u) break;
        ref = stack[--top];
    }
    hits[index] = hit;
}
