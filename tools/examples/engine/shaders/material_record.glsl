// The record of a material: what its callable shader needs.
layout(shaderRecordNV) buffer MaterialRecord {
    uint texture_index;
    float scale;
    vec2 pad;
    vec4 first, second;
} record;

layout(location = 0) callableDataInNV Material material;
