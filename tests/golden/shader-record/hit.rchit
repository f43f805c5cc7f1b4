#version 460
#extension GL_NV_ray_tracing : require
layout(shaderRecordNV) buffer Record {
    float gain;
    vec3 tint;
    uint table[3];
} record;
layout(location = 0) rayPayloadInNV float payload;

void main() {
    payload = record.gain * record.tint.y + float(record.table[gl_PrimitiveID % 3]);
}
