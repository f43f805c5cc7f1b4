// The ray, what it has hit so far and what it may hit next. Trace sites set
// rtc_ray_*; everything else belongs to traversal.
RtcBase rtc_ray_root;
uint rtc_ray_flags;
uint rtc_ray_mask;
uint rtc_ray_sbt_offset;
uint rtc_ray_sbt_stride;
uint rtc_ray_miss;
vec3 rtc_ray_origin;
float rtc_ray_tmin;
vec3 rtc_ray_direction;
float rtc_ray_tmax;

// Committed hit. While the ray walks, kind and geometry are one word and there
// is neither t nor record: registers are what GPUs run out of. rtc_hit_finish makes them.
float rtc_hit_t;
uint rtc_hit_instance;
uint rtc_hit_primitive;
uint rtc_hit_packed; // geometry | kind << 24
uint rtc_hit_kind;
uint rtc_hit_geometry;
uint rtc_hit_record;
uint rtc_hit_attr0, rtc_hit_attr1, rtc_hit_attr2, rtc_hit_attr3;
uint rtc_hit_attr4, rtc_hit_attr5, rtc_hit_attr6, rtc_hit_attr7;

// Candidate.
float rtc_cand_t;
uint rtc_cand_kind;
uint rtc_cand_instance;
uint rtc_cand_primitive;
uint rtc_cand_geometry;
uint rtc_cand_record;
uint rtc_cand_opaque;
uint rtc_cand_attr0, rtc_cand_attr1, rtc_cand_attr2, rtc_cand_attr3;
uint rtc_cand_attr4, rtc_cand_attr5, rtc_cand_attr6, rtc_cand_attr7;

// Where a triangle's vertices lie: number of the slot in its structure; RTC_NONE: an AABB. Kept by tier
// `exact`, and with RTC_LINK_POSITIONS.
uint rtc_cand_slot;
uint rtc_hit_slot;

// Traversal's own state. The first three, with the stack, are all that a
// suspended ray must keep (save.glsl); the rest follows from them. While a ray
// walks, registers are what GPUs run out of: hence few words, and values that
// are made again where they are needed.
uint rtc_trav_cur; // reference under the cursor, or RTC_REF_POP ...
uint rtc_trav_word; // RTC_WORD_*
uint rtc_trav_instance; // instance entered, RTC_NONE in the top level
RtcBase rtc_trav_base; // of this level's structure: nodes follow its header
uint rtc_trav_slots; // quads from there to slot 0
float rtc_trav_tmin; // in units of the scaled direction
float rtc_trav_tmax;
vec3 rtc_trav_origin; // this level's ray
vec3 rtc_trav_direction;
vec3 rtc_trav_inverse; // finite reciprocal of the direction, for slabs
float rtc_trav_pad; // how far the origin is moved for the planes of box minima (up) and maxima (down)

const uint RTC_REF_POP = 0xffffffffu;
const uint RTC_REF_DONE = 0xfffffffeu;
const uint RTC_REF_ENTER = 0xfffffffdu; // the level of rtc_trav_instance is to be entered at its root
const uint RTC_REF_SETUP = 0xfffffffcu; // that level's data are to be made, then as RTC_REF_POP

// Entries on the stack; of those the top level's, while inside an instance;
// exponent of rtc_t_up(); RTC_LEVEL_*; the axis along which this level's ray
// moves fastest.
const uint RTC_WORD_SP = 0xffu;
const uint RTC_WORD_FLOOR_SHIFT = 8u;
const uint RTC_WORD_SCALE_SHIFT = 16u;
const uint RTC_WORD_BITS_SHIFT = 24u;
const uint RTC_WORD_AXIS_SHIFT = 30u;

const uint RTC_LEVEL_AABBS = 1u << RTC_WORD_BITS_SHIFT; // leaves hold AABBs
const uint RTC_LEVEL_FORCE = 2u << RTC_WORD_BITS_SHIFT; // opacity is RTC_LEVEL_OPAQUE, whatever the geometry says
const uint RTC_LEVEL_OPAQUE = 4u << RTC_WORD_BITS_SHIFT;
const uint RTC_LEVEL_CULL_FRONT = 8u << RTC_WORD_BITS_SHIFT;
const uint RTC_LEVEL_CULL_BACK = 16u << RTC_WORD_BITS_SHIFT;
const uint RTC_LEVEL_FLIP = 32u << RTC_WORD_BITS_SHIFT; // counter-clockwise triangles are front faces

// By bits: drivers may assume that floats are never NaN.
bool rtc_finite(float v) { return (floatBitsToUint(v) & 0x7f800000u) != 0x7f800000u; }

float rtc_largest(vec3 v) { return max(max(abs(v.x), abs(v.y)), abs(v.z)); }

// Powers of two whose product with the largest |d| lies in [1, 2): rays with
// extreme directions would overflow the reciprocals below. Ordinary rays keep
// their bits and their t.
const float RTC_DIRECTION_MIN = 9.31322574615e-10; // 2^-30
const float RTC_DIRECTION_MAX = 1073741824.0; // 2^30

uint rtc_scale_exponent() {
    float largest = rtc_largest(rtc_ray_direction);
    bool extreme = largest < RTC_DIRECTION_MIN || largest > RTC_DIRECTION_MAX;
    return extreme ? uint(clamp(int(floatBitsToUint(largest) >> 23u), 1, 253)) : 127u;
}

// From the ray's t to the scaled direction's, and back.
float rtc_t_up() { return uintBitsToFloat(((rtc_trav_word >> RTC_WORD_SCALE_SHIFT) & 0xffu) << 23u); }
float rtc_t_down() { return uintBitsToFloat((254u - ((rtc_trav_word >> RTC_WORD_SCALE_SHIFT) & 0xffu)) << 23u); }

uint rtc_sp() { return rtc_trav_word & RTC_WORD_SP; }
uint rtc_floor() { return (rtc_trav_word >> RTC_WORD_FLOOR_SHIFT) & RTC_WORD_SP; }
void rtc_set_floor(uint entries) {
    rtc_trav_word = (rtc_trav_word & ~(RTC_WORD_SP << RTC_WORD_FLOOR_SHIFT)) | (entries << RTC_WORD_FLOOR_SHIFT);
}
uint rtc_axis() { return rtc_trav_word >> RTC_WORD_AXIS_SHIFT; }
void rtc_set_axis(uint axis) {
    rtc_trav_word = (rtc_trav_word & ((1u << RTC_WORD_AXIS_SHIFT) - 1u)) | (axis << RTC_WORD_AXIS_SHIFT);
}
