"""Ray flags, geometry and instance opacity, masks, facing: matrices, one lane a combination."""
from suite import *

RAYGEN = """layout(location = 0) rayPayloadNV uvec4 p;
layout(set = 0, binding = 2) readonly buffer Lanes { uvec4 lanes[]; };  // flags, mask, x, unused
void main() {
    uint lane = gl_LaunchIDNV.x;
    uvec4 l = lanes[lane];
    p = uvec4(0u);
    traceNV(scene, l.x, l.y, 0, 0, 0, vec3(float(l.z) + 1.0, 1.0, -3.0), 0.0, vec3(0.0, 0.0, 1.0), 100.0, 0);
    r[lane * 2u] = p.x; r[lane * 2u + 1u] = p.y;
}
"""
IN = "layout(location = 0) rayPayloadInNV uvec4 p;\n"
HIT = nv(IN + "void main() { p.x = 1u; }\n", scene=False)       # 1: hit
MISS = nv(IN + "void main() { p.x = 2u; }\n", scene=False)      # 2: miss
ANY = nv(IN + "void main() { p.y += 1u; }\n", scene=False)      # counted
RINT = nv("void main() { reportIntersectionNV(4.0, 9u); }\n", scene=False)

OPAQUE, NO_OPAQUE, TERMINATE, SKIP_HIT, CULL_BACK, CULL_FRONT, CULL_OPAQUE, CULL_NO_OPAQUE = 1, 2, 4, 8, 16, 32, 64, 128
I_CULL_DISABLE, I_CCW, I_OPAQUE, I_NO_OPAQUE = 1, 2, 4, 8
RAY_FLAGS = [0, OPAQUE, NO_OPAQUE, CULL_OPAQUE, CULL_NO_OPAQUE, CULL_BACK, CULL_FRONT, SKIP_HIT,
             OPAQUE | CULL_BACK, NO_OPAQUE | CULL_FRONT, TERMINATE, TERMINATE | SKIP_HIT | OPAQUE, SKIP_HIT | NO_OPAQUE,
             OPAQUE | TERMINATE | CULL_BACK]
NAMES = {1: "Opaque", 2: "NoOpaque", 4: "TerminateOnFirstHit", 8: "SkipClosestHit", 16: "CullBack", 32: "CullFront",
         64: "CullOpaque", 128: "CullNoOpaque"}
I_NAMES = {1: "cull-disable", 2: "front-ccw", 4: "force-opaque", 8: "force-no-opaque"}


def flags_name(flags, names):
    return "+".join(n for b, n in names.items() if flags & b) or "none"


def outcome(ray, geometry_opaque, instance, front, boxes):
    """(what the payload says, how often any-hit ran), from VT: culling, then opacity, then any-hit."""
    opaque = geometry_opaque
    if instance & I_OPAQUE:
        opaque = True
    if instance & I_NO_OPAQUE:
        opaque = False
    if ray & OPAQUE:
        opaque = True
    if ray & NO_OPAQUE:
        opaque = False
    if not boxes:
        if instance & I_CCW:
            front = not front
        if not instance & I_CULL_DISABLE and (ray & CULL_BACK and not front or ray & CULL_FRONT and front):
            return 2, 0
    if ray & CULL_OPAQUE and opaque or ray & CULL_NO_OPAQUE and not opaque:
        return 2, 0
    return (0 if ray & SKIP_HIT else 1), (0 if opaque else 1)


for boxes in (False, True):
    instances, meshes, combos = [], [], []
    for opaque in (False, True):
        for front in ((True, False) if not boxes else (True,)):
            name = f"{'opaque' if opaque else 'plain'}-{'front' if front else 'back'}"
            # Seen along +z with y up in a left-handed frame, a b c of triangle() runs counter-clockwise:
            # its back; flipped, its front.
            geometry = ({"boxes": [box(0, 0, 1, 2)]} if boxes else {"triangles": [triangle(1, flip=front)]})
            meshes.append({"name": name, **geometry, "geometry-flags": (["opaque"] if opaque else []) + ["no-duplicate-any-hit"]})
            for iflags in (0, I_CULL_DISABLE, I_CCW, I_OPAQUE, I_NO_OPAQUE, I_CCW | I_OPAQUE):
                if boxes and iflags & (I_CULL_DISABLE | I_CCW):
                    continue
                x = len(instances) * 10
                instances.append({"mesh": name, "flags": [n for b, n in I_NAMES.items() if iflags & b],
                                  "transform": [1, 0, 0, x, 0, 1, 0, 0, 0, 0, 1, 0]})
                combos.append((x, opaque, iflags, front))
    # Several pipelines' worth of combinations run as the lanes of one launch for each set of ray flags.
    for ray in RAY_FLAGS:
        if boxes and ray & (CULL_BACK | CULL_FRONT):
            continue
        lanes, expects = [], []
        for i, (x, opaque, iflags, front) in enumerate(combos):
            lanes += [ray, 0xFF, x, 0]
            hit, any_hits = outcome(ray, opaque, iflags, front, boxes)
            shape = "box" if boxes else f"{'front' if front else 'back'} triangle"
            expects.append(expect(f"ray {flags_name(ray, NAMES)}, {'opaque' if opaque else 'non-opaque'} {shape}, instance "
                                  f"{flags_name(iflags, I_NAMES)}", i * 2, [hit, any_hits]))
        stages = {"rgen": nv(RAYGEN), "rmiss": MISS, "rchit": HIT, "rahit": ANY}
        group = {"name": "hit", "closest": "rchit", "any": "rahit"}
        if boxes:
            stages["rint"] = RINT
            group["intersection"] = "rint"
        case(f"flags/{'boxes' if boxes else 'triangles'}-{flags_name(ray, NAMES).lower()}", stages, expects,
             section="semantics 2.4 Opacity, Culling", scene={"meshes": meshes, "instances": instances},
             size=(len(combos), 1, 1), words=128, groups=[group],
             bindings={"0.2": {"u32": lanes}})

# Cull masks: the low eight bits decide.
pairs = [(0xFF, 0xFF), (0x01, 0x01), (0x01, 0x02), (0x80, 0x80), (0x80, 0x7F), (0x55, 0xAA), (0x55, 0xAB), (0x00, 0xFF),
         (0xFF, 0x00), (0x0F, 0xF0), (0x0F, 0xF8), (0xFF, 0x100), (0x01, 0x101), (0x10, 0xFFFFFF10), (0x10, 0xFFFFFF00)]
case("masks/instance-and-ray", {"rgen": nv(RAYGEN), "rmiss": MISS, "rchit": HIT},
     [expect(f"instance mask {a:#x}, cull mask {b:#x}", i * 2, [1 if a & b & 0xFF else 2]) for i, (a, b) in enumerate(pairs)],
     section="semantics 2.4 Operands, Culling", size=(len(pairs), 1, 1),
     scene={"meshes": [{"name": "t", "triangles": [triangle(1)]}],
            "instances": [{"mesh": "t", "mask": a, "transform": [1, 0, 0, 10 * i, 0, 1, 0, 0, 0, 0, 1, 0]}
                          for i, (a, b) in enumerate(pairs)]},
     bindings={"0.2": {"u32": [w for i, (a, b) in enumerate(pairs) for w in (0, b, 10 * i, 0)]}})

# Facing is decided in object space: a mirrored instance does not flip it. HitKind 0xFE front, 0xFF back.
KIND = nv(IN + "void main() { p.x = gl_HitKindNV; }\n", scene=False)
cases, meshes = [], [{"name": "front", "triangles": [triangle(1, flip=True)]}, {"name": "back", "triangles": [triangle(1)]}]
for front in (True, False):
    for what, rows, shift in (("identity", (1, 1, 1), (0, 0, 0)), ("mirrored in x", (-1, 1, 1), (2, 0, 0)),
                              ("mirrored in y", (1, -1, 1), (0, 2, 0)), ("mirrored in x and y", (-1, -1, 1), (2, 2, 0))):
        for ccw in (False, True):
            cases.append((front, what, rows, shift, ccw))
case("facing/mirrored-instances", {"rgen": nv(RAYGEN), "rmiss": MISS, "rchit": KIND},
     [expect(f"HitKind of a {'front' if f else 'back'} triangle, instance {what}{', front-ccw' if ccw else ''}", i * 2,
             [0xFE if f != ccw else 0xFF]) for i, (f, what, _, _, ccw) in enumerate(cases)],
     section="semantics 2.4 Culling (facing in object space)", size=(len(cases), 1, 1),
     scene={"meshes": meshes, "instances": [
         {"mesh": "front" if f else "back", "flags": ["front-ccw"] if ccw else [],
          "transform": [s[0], 0, 0, 10 * i + d[0], 0, s[1], 0, d[1], 0, 0, s[2], d[2]]}
         for i, (f, what, s, d, ccw) in enumerate(cases)]},
     bindings={"0.2": {"u32": [w for i in range(len(cases)) for w in (0, 255, 10 * i, 0)]}})
# Seen from behind (z mirrored), front and back swap, for the ray meets the other side in object space.
case("facing/seen-from-behind", {"rgen": nv(RAYGEN), "rmiss": MISS, "rchit": KIND},
     [expect("HitKind of a front triangle mirrored in z", 0, [0xFF]), expect("HitKind of a back triangle mirrored in z", 2, [0xFE])],
     section="semantics 2.4", size=(2, 1, 1),
     scene={"meshes": meshes, "instances": [
         {"mesh": "front", "transform": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0]},
         {"mesh": "back", "transform": [1, 0, 0, 10, 0, 1, 0, 0, 0, 0, -1, 0]}]},
     bindings={"0.2": {"u32": [0, 255, 0, 0, 0, 255, 10, 0]}})

# t ranges: triangles are strict at both ends; the nearest hit wins; t is in units of the direction.
T_RAYGEN = """layout(location = 0) rayPayloadNV uvec4 p;
layout(set = 0, binding = 2) readonly buffer Lanes { vec4 lanes[]; };  // tmin, tmax, origin z, direction z
void main() {
    uint lane = gl_LaunchIDNV.x;
    vec4 l = lanes[lane];
    p = uvec4(0u);
    traceNV(scene, 0, 0xff, 0, 0, 0, vec3(1.0, 1.0, l.z), l.x, vec3(0.0, 0.0, l.w), l.y, 0);
    r[lane * 2u] = p.x; r[lane * 2u + 1u] = p.y;
}
"""
T_HIT = nv(IN + "void main() { p.x = 1u + uint(gl_PrimitiveID); p.y = floatBitsToUint(gl_HitTNV); }\n", scene=False)
T_MISS = nv(IN + "void main() { p.x = 9u; p.y = floatBitsToUint(gl_RayTmaxNV); }\n", scene=False)
lanes = [  # tmin, tmax, z, dz, primitive + 1 or 9, t
    (0, 100, -3, 1, 1, 4, "the nearest of three triangles"), (4, 100, -3, 1, 2, 8, "t = tmin is outside"),
    (3.999, 100, -3, 1, 1, 4, "just above tmin"), (0, 4, -3, 1, 9, 4, "t = tmax is outside"),
    (0, 4.001, -3, 1, 1, 4, "just below tmax"), (4.5, 100, -3, 1, 2, 8, "tmin between the first and second"),
    (9, 11, -3, 1, 9, 11, "between the second and third"), (0, 100, 20, -1, 3, 9, "from the other side"),
    (0, 100, -3, 2, 1, 2, "a direction of length 2 halves t"), (0, 100, -3, 0.25, 1, 16, "a direction of length 1/4"),
    (0, 100, 20, 1, 9, 100, "looking away"), (5, 5, -3, 1, 9, 5, "tmin = tmax"), (0, 3e38, -3, 1, 1, 4, "a huge tmax"),
]
case("ranges/triangles", {"rgen": nv(T_RAYGEN), "rmiss": T_MISS, "rchit": T_HIT},
     [expect(f"triangles: {what}", 2 * i, [kind, bits(t)]) for i, (_, _, _, _, kind, t, what) in enumerate(lanes)],
     section="semantics 2.4 Candidates", size=(len(lanes), 1, 1),
     scene={"meshes": [{"name": "t", "triangles": [triangle(1), triangle(5), triangle(11)]}]},
     bindings={"0.2": {"f32": [v for lane in lanes for v in lane[:4]]}})

# Degenerate triangles are never hit; inactive (NaN) ones neither; nor instances of nothing.
case("ranges/inactive", {"rgen": nv(RAYGEN), "rmiss": MISS, "rchit": HIT},
     [expect("a triangle of zero area is not hit", 0, [2]), expect("a NaN triangle is not hit", 2, [2]),
      expect("an inactive instance is not hit", 4, [2]), expect("an instance of an empty bottom level is not hit", 6, [2]),
      expect("its neighbours are hit", 8, [1])],
     section="semantics 2.4 Culling", size=(5, 1, 1),
     scene={"meshes": [{"name": "flat", "triangles": [[0, 0, 1, 4, 4, 1, 2, 2, 1]]},
                       {"name": "nan", "triangles": [["nan", 0, 1, "nan", 0, 1, "nan", 4, 1], triangle(1, 500)]},
                       {"name": "empty", "triangles": []}, {"name": "t", "triangles": [triangle(1)]}],
            "instances": [{"mesh": "flat"}, {"mesh": "nan", "transform": [1, 0, 0, 10, 0, 1, 0, 0, 0, 0, 1, 0]},
                          {"transform": [1, 0, 0, 20, 0, 1, 0, 0, 0, 0, 1, 0]},
                          {"mesh": "empty", "transform": [1, 0, 0, 30, 0, 1, 0, 0, 0, 0, 1, 0]},
                          {"mesh": "t", "transform": [1, 0, 0, 40, 0, 1, 0, 0, 0, 0, 1, 0]}]},
     bindings={"0.2": {"u32": [w for i in range(5) for w in (0, 255, 10 * i, 0)]}})
