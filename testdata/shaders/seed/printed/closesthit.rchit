// Closest hit shader
//
// Closest hit shaders only have one payload -
// for the incoming ray
rayPayloadInNV primaryPayload {
    vec4 color;
}

layout(set = 3, binding = 0) sampler3D solidMaterialSampler;

void main() {
    vec3 pos = gl_WorldRayOriginNV + gl_hitTNV * gl_WorldRayDirectionNV;

    primaryPayload.color = texture(
        solidMaterialSampler, pos);
}
