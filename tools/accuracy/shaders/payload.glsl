// What a closest-hit shader gives back: normal, colour and t, in seven floats or in four words.
struct Payload {
#ifdef PAYLOAD_16
    uvec3 packed;
#else
    vec3 normal, colour;
#endif
    float t; // negative: nothing was hit
};

#ifdef PAYLOAD_16
vec3 payload_normal(Payload p) { return vec3(unpackHalf2x16(p.packed.x), unpackHalf2x16(p.packed.y).x); }
vec3 payload_colour(Payload p) { return vec3(unpackHalf2x16(p.packed.y).y, unpackHalf2x16(p.packed.z)); }
void payload_set(inout Payload p, vec3 normal, vec3 colour) {
    p.packed = uvec3(packHalf2x16(normal.xy), packHalf2x16(vec2(normal.z, colour.x)), packHalf2x16(colour.yz));
}
#else
vec3 payload_normal(Payload p) { return p.normal; }
vec3 payload_colour(Payload p) { return p.colour; }
void payload_set(inout Payload p, vec3 normal, vec3 colour) {
    p.normal = normal;
    p.colour = colour;
}
#endif
