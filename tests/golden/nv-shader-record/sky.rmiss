#version 460
#extension GL_NV_ray_tracing : require
#extension GL_EXT_nonuniform_qualifier : require
layout(shaderRecordNV, std430) buffer Record {
    mat3x2 turn;
    uint material;
    float ramp[4];
} record;
layout(set = 0, binding = 2) uniform sampler2D textures[8];
layout(location = 0) rayPayloadInNV vec4 payload;

void main() {
    const vec2 at = record.turn * gl_WorldRayDirectionNV;
    payload = textureLod(textures[nonuniformEXT(record.material)], at, 0.0) * record.ramp[int(payload.w)];
}
