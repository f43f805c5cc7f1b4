#version 460
#extension GL_NV_ray_tracing : require

// Closest hit shader
//
// Closest hit shaders only have one payload -
// for the incoming ray
rayPayloadInNV primaryPayload {
    vec4 color;
} payload;

layout(set = 3, binding = 0) uniform sampler3D solidMaterialSampler;

void main() {
    vec3 pos = gl_WorldRayOriginNV + gl_HitTNV * gl_WorldRayDirectionNV;

    payload.color = texture(
        solidMaterialSampler, pos);
}
