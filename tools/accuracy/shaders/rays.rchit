#version 460
#extension GL_EXT_ray_tracing : require
// What was hit.
struct Payload {
    float t;
    uint kind, instance, primitive, geometry;
    uint front, back, ignore;
};
layout(location = 0) rayPayloadInEXT Payload found;

void main() {
    found.t = gl_HitTEXT;
    found.kind = gl_HitKindEXT;
    found.instance = gl_InstanceID;
    found.primitive = gl_PrimitiveID;
    found.geometry = gl_GeometryIndexEXT;
}
