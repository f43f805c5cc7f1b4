// Reading the application's geometry. The box kernel and the slot kernel both come
// here, and `precise` makes their vertices the same bits.

#include "range.glsl"

uint read_index(uint i) {
    if (p.index_type == RTR_INDEX_NONE) return i;
    uint start = p.index_offset + range_offset();
    if (p.index_type == RTR_INDEX_32) return in_index[(start >> 2) + i];
    if (p.index_type == RTR_INDEX_8) {
        uint at = start + i;
        return (in_index[at >> 2] >> (8u * (at & 3u))) & 0xffu;
    }
    uint byte = start + 2u * i;
    return (in_index[byte >> 2] >> (8u * (byte & 2u))) & 0xffffu;
}

uint read_16(uint byte) { return (in_data[byte >> 2] >> (8u * (byte & 2u))) & 0xffffu; }

vec3 decode_vertex(uint byte) {
    if (p.vertex_format <= RTR_VERTEX_FLOAT2) {
        uint w = byte >> 2;
        float z = p.vertex_format == RTR_VERTEX_FLOAT3 ? uintBitsToFloat(in_data[w + 2u]) : 0.0;
        return vec3(uintBitsToFloat(in_data[w]), uintBitsToFloat(in_data[w + 1u]), z);
    }
    uint xy = read_16(byte) | (read_16(byte + 2u) << 16);
    bool has_z = p.vertex_format == RTR_VERTEX_HALF3 || p.vertex_format == RTR_VERTEX_SNORM3;
    uint z = has_z ? read_16(byte + 4u) : 0u;
    if (p.vertex_format <= RTR_VERTEX_HALF2) return vec3(unpackHalf2x16(xy), unpackHalf2x16(z).x);
    return vec3(unpackSnorm2x16(xy), unpackSnorm2x16(z).x);
}

vec3 read_vertex(uint index) {
    // An index beyond the vertex count is the application's error; never read outside.
    index = min(index + range_first_vertex(), p.vertex_count - 1u);
    uint start = p.data_offset + (p.index_type == RTR_INDEX_NONE ? range_offset() : 0u);
    vec3 v = decode_vertex(start + index * p.data_stride);
    if ((p.flags & RTR_BUILD_HAS_TRANSFORM) == 0u) return v;
    uint t = (p.transform_offset + range_transform()) >> 2;
    precise vec3 r;
    for (uint k = 0u; k < 3u; k++) {
        float m0 = uintBitsToFloat(in_transform[t + 4u * k]);
        float m1 = uintBitsToFloat(in_transform[t + 4u * k + 1u]);
        float m2 = uintBitsToFloat(in_transform[t + 4u * k + 2u]);
        float m3 = uintBitsToFloat(in_transform[t + 4u * k + 3u]);
        r[k] = ((m0 * v.x + m1 * v.y) + m2 * v.z) + m3;
    }
    return r;
}

void read_triangle(uint i, out vec3 v0, out vec3 v1, out vec3 v2) {
    uint first = i * 3u; // the bindings start at the dispatch's first primitive
    v0 = read_vertex(read_index(first));
    v1 = read_vertex(read_index(first + 1u));
    v2 = read_vertex(read_index(first + 2u));
}

// Inactive: any NaN. Without ALLOW_UPDATE also what two equal corners make a line:
// it can never be hit, so it needs no slot.
bool triangle_active(vec3 v0, vec3 v1, vec3 v2) {
    if (any_nan(v0) || any_nan(v1) || any_nan(v2)) return false;
    if ((p.flags & RTR_BUILD_KEEP_DEGENERATE) != 0u) return true;
    return v0 != v1 && v1 != v2 && v0 != v2;
}

void read_aabb(uint i, out vec3 lo, out vec3 hi) {
    uint w = (p.data_offset + range_offset() + i * p.data_stride) >> 2;
    lo = vec3(uintBitsToFloat(in_data[w]), uintBitsToFloat(in_data[w + 1u]), uintBitsToFloat(in_data[w + 2u]));
    hi = vec3(uintBitsToFloat(in_data[w + 3u]), uintBitsToFloat(in_data[w + 4u]), uintBitsToFloat(in_data[w + 5u]));
}
