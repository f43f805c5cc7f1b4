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

// Committed hit.
float rtc_hit_t;
uint rtc_hit_kind;
uint rtc_hit_instance;
uint rtc_hit_primitive;
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

// Traversal's own state. The first four, with the stack, are all that a
// suspended ray must keep (save.glsl); the rest follows from them.
uint rtc_trav_cur; // reference under the cursor, or RTC_REF_POP / RTC_REF_DONE
uint rtc_trav_sp; // entries on the stack
uint rtc_trav_floor; // entries that belong to the top level while inside an instance
uint rtc_trav_instance; // instance entered, RTC_NONE in the top level
uint rtc_trav_setup; // 1: the level's data below must be computed before the next step
RtcBase rtc_trav_records; // instance record 0
RtcBase rtc_trav_nodes; // this level's node 0
RtcBase rtc_trav_slots; // this level's slot 0
uint rtc_trav_record; // hit record index of geometry 0 in this instance
uint rtc_trav_bits; // RTC_LEVEL_*
float rtc_trav_tmin; // in units of the scaled direction
float rtc_trav_tmax;
float rtc_trav_t_up; // from the ray's t to the scaled direction's; a power of two
float rtc_trav_t_down; // and back
vec3 rtc_trav_origin; // this level's ray
vec3 rtc_trav_direction;
vec3 rtc_trav_inverse; // finite reciprocal of the direction, for slabs
vec3 rtc_trav_low; // origins for the planes of box minima and maxima
vec3 rtc_trav_high;

const uint RTC_REF_POP = 0xffffffffu;
const uint RTC_REF_DONE = 0xfffffffeu;

const uint RTC_LEVEL_AABBS = 1u; // leaves hold AABBs
const uint RTC_LEVEL_FORCE = 2u; // opacity is RTC_LEVEL_OPAQUE, whatever the geometry says
const uint RTC_LEVEL_OPAQUE = 4u;
const uint RTC_LEVEL_CULL_FRONT = 8u;
const uint RTC_LEVEL_CULL_BACK = 16u;
const uint RTC_LEVEL_FLIP = 32u; // counter-clockwise triangles are front faces

// By bits: drivers may assume that floats are never NaN.
bool rtc_finite(float v) { return (floatBitsToUint(v) & 0x7f800000u) != 0x7f800000u; }

float rtc_largest(vec3 v) { return max(max(abs(v.x), abs(v.y)), abs(v.z)); }
