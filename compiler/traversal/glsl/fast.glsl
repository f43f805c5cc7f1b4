// Tier `fast`: plain slabs and Möller-Trumbore. Rays leak through edges and
// vertices (several per cent of those aimed at them); the accuracy laboratory
// measures how many.

void rtc_level_numbers(RtcBase base, vec3 o, vec3 d, bool top) {
    // A finite reciprocal keeps 0 * inf out of the slabs.
    vec3 tiny = vec3(1e-30);
    vec3 sign_bits = uintBitsToFloat((floatBitsToUint(d) & uvec3(0x80000000u)) | floatBitsToUint(tiny));
    rtc_trav_inverse = vec3(1.0 / (abs(d.x) < 1e-30 ? sign_bits.x : d.x),
                            1.0 / (abs(d.y) < 1e-30 ? sign_bits.y : d.y),
                            1.0 / (abs(d.z) < 1e-30 ? sign_bits.z : d.z));
    rtc_trav_pad = 0.0;
}

bool rtc_triangle(vec3 v0, vec3 v1, vec3 v2, out float t, out float b1, out float b2, out bool front) {
    vec3 o = rtc_trav_origin;
    vec3 d = rtc_trav_direction;
    float ax = v1.x - v0.x, ay = v1.y - v0.y, az = v1.z - v0.z;
    float bx = v2.x - v0.x, by = v2.y - v0.y, bz = v2.z - v0.z;
    float px = d.y * bz - d.z * by, py = d.z * bx - d.x * bz, pz = d.x * by - d.y * bx;
    float det = (ax * px + ay * py) + az * pz;
    float inverse = 1.0 / det;
    float sx = o.x - v0.x, sy = o.y - v0.y, sz = o.z - v0.z;
    b1 = ((sx * px + sy * py) + sz * pz) * inverse;
    float qx = sy * az - sz * ay, qy = sz * ax - sx * az, qz = sx * ay - sy * ax;
    b2 = ((d.x * qx + d.y * qy) + d.z * qz) * inverse;
    t = ((bx * qx + by * qy) + bz * qz) * inverse;
    front = det > 0.0;
    return det != 0.0 && b1 >= 0.0 && b2 >= 0.0 && b1 + b2 <= 1.0;
}
