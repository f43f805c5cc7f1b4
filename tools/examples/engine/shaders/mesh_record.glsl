// The record of a hit group is a table of resources: where this mesh's vertices, indices and textures are.
layout(shaderRecordNV) buffer MeshRecord {
    uint vertex_buffer, index_buffer, mask_texture, material;
} record;

hitAttributeNV vec2 barycentrics;

void fetch_surface(out vec3 normal, out vec2 uv) {
    vec3 weights = vec3(1.0 - barycentrics.x - barycentrics.y, barycentrics);
    vec4 normal_v = vec4(0.0);
    float u = 0.0;
    for (uint corner = 0u; corner < 3u; ++corner) {
        uint index = fetch_index(record.index_buffer, 3u * gl_PrimitiveID + corner);
        Vertex v = fetch_vertex(record.vertex_buffer, index);
        normal_v += weights[corner] * v.normal_v;
        u += weights[corner] * v.position_u.w;
    }
    normal = normalize(gl_ObjectToWorldNV * vec4(normal_v.xyz, 0.0));
    uv = vec2(u, normal_v.w);
}
