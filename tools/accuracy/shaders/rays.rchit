#version 460
#extension GL_EXT_ray_tracing : require
// What was hit.
struct Payload {
    float t;
    uint kind, instance, primitive, geometry;
    uint front, back, ignore;
    vec2 weights;
};
layout(location = 0) rayPayloadInEXT Payload found;

hitAttributeEXT vec2 weights;

void main() {
    found.t = gl_HitTEXT;
    found.kind = gl_HitKindEXT;
    found.instance = gl_InstanceID;
    found.primitive = gl_PrimitiveID;
    found.geometry = gl_GeometryIndexEXT;
    found.weights = weights;
}
