// The ray of a level and the padded slabs that the tiers `watertight` and
// `exact` share: boxes contain whatever their triangle tests can hit.
//
// u is 2^-24, half the distance between floats near 1. A rounding costs a
// factor (1 + u), or (1 + 2u) where the device rounds towards zero; Vulkan's
// division may cost 2.5 ulp = 5u.

vec3 rtc_trav_shear; // d.kx / d.kz, d.ky / d.kz, d.kz

// kz is the axis along which the ray moves fastest. kx, ky, kz: cyclic, so that orientation is kept. (mix with booleans is a
// select, not arithmetic; `?:` of vectors would become a branch.)
vec3 rtc_turned(vec3 v, uint axis) { return mix(mix(v, v.zxy, bvec3(axis == 1u)), v.yzx, bvec3(axis == 0u)); }

vec3 rtc_axes(vec3 v) { return rtc_turned(v, rtc_axis()); }

uint rtc_fastest_axis(vec3 d) {
    vec3 a = abs(d);
    return a.x > a.y ? (a.x > a.z ? 0u : 2u) : (a.y > a.z ? 1u : 2u);
}

// How far the triangle test's idea of a vertex can be from the vertex.
//
// The test moves v to fl(v - o) and shears it to
//     x = fl(fl(v.kx - o.kx) - fl(S fl(v.kz - o.kz))),  S = fl(d.kx / d.kz).
// With D the largest |v - o| along an axis and r = |d| D.kz / |d.kz| the way
// the ray makes along it meanwhile (|S| |v.kz - o.kz| <= r):
//     from v - o: uD;  from S: 5u r;  from the product and its factor: 2u r;
//     from the last difference: u(D + r);  together 2u D + 8u r,
// 4u D + 11u r under truncation. The edge decisions made with x, y are exact
// (below), so a ray that hits does hit the triangle whose vertices are moved
// by no more than that. t = Az + b1 (Bz - Az) + b2 (Cz - Az), over d.kz, is
// off by at most 8u of D.kz / |d.kz|, which is 8u r along any axis.
//
// Slabs compute t = fl(fl(b - o) * inverse) with |error| <= (1 or 2 + 5 + 1 or
// 2)u |t|, at most 9u: as if the plane were moved by 9u |b - o| <= 9u (D + pad).
// So near is never above its exact value and far never below. Together
// 4u D + 11u r + 8u r + 9u D; 14u D + 20u r leave room for second-order terms.
//
// One number pads all axes, that of the widest: five more registers while a
// ray walks cost a GPU more than the boxes that are visited in vain.
//
// The padded origin fl(o + pad) must not round back: 2u |o| more. A direction
// that is (almost) 0 along an axis is replaced by 2^-48 of the largest, with
// its sign, which moves the ray by 2^-48 D.kz: 2^-47 D.kz more. Differences
// that a device flushes to zero lie under 2^-126: 2^-120 more.
//
// Boxes of the top level hold instances: the triangle test there runs on
// fl(W o), fl(W d), off by 4u (|W||o| + |w|) and 3u |W||d|, which M turns into
// world distance again with |M||W| <= 3 for rotations and uniform scales:
// 3 * (4u |o| + 4u (|o| + D)) + 3 * (3u + 2u + 8u) D = 24u |o| + 51u D, and 9u D for
// the slabs, with the largest component of each since a rotation mixes axes. (Builders
// widen instance boxes for transforms that stretch more.)
const float RTC_PAD_D = 8.3446503e-7; // 14u
const float RTC_PAD_R = 1.1920929e-6; // 20u
const float RTC_PAD_ORIGIN = 1.49011612e-7; // 2.5u
const float RTC_PAD_TOP_ORIGIN = 1.90734863e-6; // 32u
const float RTC_PAD_TOP_D = 3.81469727e-6; // 64u
const float RTC_TINY = 3.5527136788e-15; // 2^-48
const float RTC_PAD_FLUSH = 7.52316385e-37; // 2^-120

void rtc_level_numbers(RtcBase base, vec3 o, vec3 d, bool top) {
    vec3 bounds_min = uintBitsToFloat(rtc_quad(base, RTC_HDR_BOUNDS_MIN / 4u).xyz);
    vec3 bounds_max = uintBitsToFloat(rtc_quad(base, RTC_HDR_BOUNDS_MAX / 4u).xyz);
    vec3 a = abs(d);
    rtc_set_axis(rtc_fastest_axis(d));
    vec3 k = rtc_axes(d);
    rtc_trav_shear = vec3(k.x / k.z, k.y / k.z, k.z);

    float speed = abs(k.z);
    float tiny = speed * RTC_TINY;
    uvec3 signs = floatBitsToUint(d) & uvec3(0x80000000u);
    a = max(a, vec3(tiny));
    vec3 safe = uintBitsToFloat(floatBitsToUint(a) | signs);
    rtc_trav_inverse = vec3(1.0 / safe.x, 1.0 / safe.y, 1.0 / safe.z);

    vec3 distance = max(abs(bounds_min - o), abs(bounds_max - o));
    float reach = rtc_axes(distance).z;
    // The way along an axis is at most the way along kz, reach, and so r <= reach.
    float widest = rtc_largest(distance);
    float pad = widest * RTC_PAD_D + reach * RTC_PAD_R;
    if (top) {
        pad = max(pad, rtc_largest(o) * RTC_PAD_TOP_ORIGIN + widest * RTC_PAD_TOP_D);
    }
    rtc_trav_pad = (pad + rtc_largest(o) * RTC_PAD_ORIGIN) + (reach * (2.0 * RTC_TINY) + RTC_PAD_FLUSH);
}
