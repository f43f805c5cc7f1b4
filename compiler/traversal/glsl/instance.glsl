// Instance records: transforms and ids. Sums are written in one fixed order,
// so that a shader that asks for the object ray gets traversal's bits.
RtcBase rtc_instance_record(RtcBase root, uint instance) {
    return rtc_advance(root, rtc_quad(root, RTC_HDR_SLOTS / 4u)[RTC_HDR_SLOTS & 3u] + instance * RTC_INSTANCE_QUADS);
}

vec3 rtc_transform_vector(vec4 r0, vec4 r1, vec4 r2, vec3 v) {
    return vec3((r0.x * v.x + r0.y * v.y) + r0.z * v.z, (r1.x * v.x + r1.y * v.y) + r1.z * v.z,
                (r2.x * v.x + r2.y * v.y) + r2.z * v.z);
}

vec3 rtc_transform_point(vec4 r0, vec4 r1, vec4 r2, vec3 p) {
    return rtc_transform_vector(r0, r1, r2, p) + vec3(r0.w, r1.w, r2.w);
}

mat4x3 rtc_matrix(RtcBase record) {
    vec4 r0 = uintBitsToFloat(rtc_quad(record, 0u));
    vec4 r1 = uintBitsToFloat(rtc_quad(record, 1u));
    vec4 r2 = uintBitsToFloat(rtc_quad(record, 2u));
    return mat4x3(r0.x, r1.x, r2.x, r0.y, r1.y, r2.y, r0.z, r1.z, r2.z, r0.w, r1.w, r2.w);
}

mat4x3 rtc_object_to_world(RtcBase root, uint instance) {
    return rtc_matrix(rtc_advance(rtc_instance_record(root, instance), 3u));
}

mat4x3 rtc_world_to_object(RtcBase root, uint instance) {
    return rtc_matrix(rtc_instance_record(root, instance));
}

uint rtc_instance_custom_index(RtcBase root, uint instance) {
    return rtc_quad(rtc_instance_record(root, instance), 6u).z & 0x00ffffffu;
}

vec3 rtc_object_ray_origin(RtcBase root, uint instance, vec3 o) {
    RtcBase record = rtc_instance_record(root, instance);
    return rtc_transform_point(uintBitsToFloat(rtc_quad(record, 0u)), uintBitsToFloat(rtc_quad(record, 1u)),
                               uintBitsToFloat(rtc_quad(record, 2u)), o);
}

vec3 rtc_object_ray_direction(RtcBase root, uint instance, vec3 d) {
    RtcBase record = rtc_instance_record(root, instance);
    return rtc_transform_vector(uintBitsToFloat(rtc_quad(record, 0u)), uintBitsToFloat(rtc_quad(record, 1u)),
                                uintBitsToFloat(rtc_quad(record, 2u)), d);
}

// The three vertices in a triangle slot, one a column; of an AABB (RTC_NONE) zeros.
mat3 rtc_hit_positions(RtcBase root, uint instance, uint slot) {
    mat3 positions = mat3(vec3(0.0), vec3(0.0), vec3(0.0));
    if (slot != RTC_NONE) {
        uvec4 ids = rtc_quad(rtc_instance_record(root, instance), 6u);
        RtcBase base = rtc_base(ids.x, ids.y);
        uint slots = rtc_quad(base, RTC_HDR_SLOTS / 4u)[RTC_HDR_SLOTS & 3u];
        RtcBase at = rtc_advance(base, slots + slot * RTC_TRIANGLE_QUADS);
        positions[0] = uintBitsToFloat(rtc_quad(at, 0u).xyz);
        positions[1] = uintBitsToFloat(rtc_quad(at, 1u).xyz);
        positions[2] = uintBitsToFloat(rtc_quad(at, 2u).xyz);
    }
    return positions;
}
