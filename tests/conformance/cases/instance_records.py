"""Records as resource tables, one an instance: each with its own layout, size, textures and buffers.

Every instance has two records a geometry, one for each kind of ray (SBT stride 2, offset = kind), at its own SBT offset.
Any-hit shaders sample their record's texture: cut-outs ignore where it says so, panes add their tint and let the ray by.
"""
from suite import *

NONUNIFORM = "GL_EXT_nonuniform_qualifier"
P = "layout(location = 0) rayPayloadNV uint p;\n"
IN = "layout(location = 0) rayPayloadInNV uint p;\n"
TEXTURES = "layout(set = 0, binding = 3) uniform sampler2D textures[4];\n@TEXEL@"
TEXEL = {  # lavapipe 22.3 has no nonuniform indices of textures
    "nonuniform": "vec4 texel(uint i, vec2 uv) { return texture(textures[nonuniformEXT(i)], uv); }\n",
    "branches": "vec4 texel(uint i, vec2 uv) {\n    if (i == 0u) return texture(textures[0], uv);\n"
                "    if (i == 1u) return texture(textures[1], uv);\n    if (i == 2u) return texture(textures[2], uv);\n"
                "    return texture(textures[3], uv);\n}\n"}
DATA = "layout(buffer_reference, std430) readonly buffer Data { uint v[4]; };\n"
AT = "hitAttributeNV vec2 at;\n"


def sampled(channel, scale="1.0"):
    return f"texel(tex, vec2(at.x * {scale}, 0.5)).{channel}"


CUT = AT + TEXTURES + "layout(shaderRecordNV) buffer R { uint tex; float scale; uint value; };\n"
PANE = AT + TEXTURES + DATA + "layout(shaderRecordNV) buffer R { vec4 tint; Data data; uint index; uint tex; };\n"
SOLID = AT + TEXTURES + "layout(shaderRecordNV) buffer R { uint before[9]; uint tex; uint add; };\n"
BALL = DATA + "layout(shaderRecordNV) buffer R { Data data; float t; uint index; };\n"


def hit(body):
    return nv(IN + body, scene=False, extensions=("GL_EXT_buffer_reference",))


STAGES = {
    "rgen": nv(P + """layout(set = 0, binding = 2) readonly buffer Lanes { uvec2 lanes[]; };  // kind of ray, x
layout(set = 0, binding = 4) readonly buffer A { uint a; } in_a;  // named, so that they are there; read through records
layout(set = 0, binding = 5) readonly buffer B { uint b; } in_b;
void main() {
    uvec2 lane = lanes[gl_LaunchIDNV.x];
    p = (in_a.a + in_b.b) * 0u;
    traceNV(scene, 0, 0xff, lane.x, 2, lane.x, vec3(float(lane.y) + 1.0, 1.0, -3.0), 0.0, vec3(0.0, 0.0, 1.0), 100.0, 0);
    r[gl_LaunchIDNV.x] = p;
}
"""),
    "rmiss:sky": nv(IN + "layout(shaderRecordNV) buffer R { uint value; };\nvoid main() { p += value; }\n", scene=False),
    "rchit:cut": hit(CUT + f"void main() {{ p += value + uint({sampled('x', 'scale')}); }}\n"),
    "rahit:alpha": hit(CUT + f"void main() {{ if ({sampled('w', 'scale')} < 0.5) ignoreIntersectionNV(); }}\n"),
    "rahit:pane": hit(PANE + f"void main() {{ p += 1000u * (data.v[index] + uint({sampled('x')} * tint.y)); ignoreIntersectionNV(); }}\n"),
    "rchit:solid": hit(SOLID + f"void main() {{ p += before[8] + add + uint({sampled('y')}); }}\n"),
    "rint:ball": nv(BALL + "void main() { reportIntersectionNV(t, index); }\n", scene=False, extensions=("GL_EXT_buffer_reference",)),
    "rchit:ball": hit(BALL + "void main() { p += data.v[index] + 10u * gl_HitKindNV; }\n"),
    "rchit:shadow": hit("layout(shaderRecordNV) buffer R { uint bits; };\nvoid main() { p += bits; }\n"),
}
GROUPS = [{"name": "cut", "closest": "cut", "any": "alpha"}, {"name": "cut-shadow", "closest": "shadow-of-cut", "any": "alpha"},
          {"name": "pane", "any": "pane"}, {"name": "solid", "closest": "solid"}, {"name": "shadow", "closest": "shadow"},
          {"name": "ball", "closest": "ball-hit", "intersection": "ball"}]
# The shadow group of a cut-out shares its any-hit and its record's layout.
STAGES["rchit:shadow-of-cut"] = hit(CUT + "void main() { p += value; }\n")
STAGES["rchit:ball-hit"] = STAGES.pop("rchit:ball")

# Textures of two texels: (colour, green, -, alpha) left and right of the middle. Hits have at.x = 1/4.
LEFT = [(10, 1, 0, 0), (20, 2, 0, 1), (30, 3, 0, 0), (40, 4, 0, 1)]
RIGHT = [(11, 5, 0, 1), (21, 6, 0, 0), (31, 7, 0, 1), (41, 8, 0, 0)]
BUFFER = [100, 200, 300, 400, 500, 600, 700, 800]


def cut(group, tex, scale, value):
    return {"group": group, "data": [{"u32": tex}, {"f32": scale}, {"u32": value}]}


def pane(tint, index, tex, first):
    return {"group": "pane", "data": [{"f32": [0, tint, 0, 0]}, {"address": f"0.{4 + first}"}, {"u32": [index, tex]}]}


def solid(tex, nine, add):
    return {"group": "solid", "data": {"u32": [77] * 8 + [nine, tex, add]}}


def shadow(bits):
    return {"group": "shadow", "data": {"u32": bits}}


def ball(first, t, index):
    return {"group": "ball", "data": [{"address": f"0.{4 + first}"}, {"f32": t}, {"u32": index}]}


MESHES = [{"name": "front", "geometry-flags": ["no-duplicate-any-hit"], "triangles": [triangle(1)]},
          {"name": "pair", "geometries": [{"triangles": [triangle(2)], "flags": ["no-duplicate-any-hit"]},
                                          {"triangles": [triangle(3)], "flags": ["no-duplicate-any-hit"]}]},
          {"name": "box", "boxes": [box(0, 0, 0, 2)]}]
records, instances = [], []


def place(mesh, x, *own):
    """An instance with its records, two a geometry."""
    instances.append({"mesh": mesh, "offset": len(records), "transform": [1, 0, 0, 10 * x, 0, 1, 0, 0, 0, 0, 1, 0]})
    records.extend(own)


# x = 0: a cut-out that is transparent there; behind it a pane and a solid.
place("front", 0, cut("cut", 0, 1.0, 5000), cut("cut-shadow", 1, 1.0, 61))
place("pair", 0, pane(2.0, 1, 2, 0), pane(1.0, 3, 3, 1), solid(3, 7, 9), shadow(62))
# x = 1: the same meshes, other records: scaled coordinates make the cut-out opaque for the eye and not for shadows.
place("front", 1, cut("cut", 0, 3.0, 6000), cut("cut-shadow", 1, 3.0, 63))
place("pair", 1, pane(1.0, 0, 1, 1), pane(3.0, 2, 0, 0), solid(0, 17, 19), shadow(64))
# x = 2: a ball in front of a solid for the eye; its shadow record is another buffer's.
place("box", 2, ball(0, 3.5, 2), ball(1, 3.25, 1))
place("front", 2, solid(1, 1, 1), shadow(65))
# x = 3: a pane whose shadow record is none, and nothing behind it.
place("front", 3, pane(4.0, 3, 3, 1), None)


def pane_adds(tint, index, tex, first):
    return 1000 * (BUFFER[4 * first + index] + int(LEFT[tex][0] * tint))


EXPECTED = [
    ("an ignored cut-out, a pane and a solid, each by its instance's record", 0, 0,
     pane_adds(2.0, 1, 2, 0) + 7 + 9 + LEFT[3][1]),
    ("the shadow ray's records of the same cut-out: another texture, opaque there", 1, 0, 61),
    ("another instance of the same mesh: opaque by its record's scale", 0, 1, 6000 + RIGHT[0][0]),
    ("and its shadow record: transparent, a pane and a shadow behind", 1, 1, pane_adds(3.0, 2, 0, 0) + 64),
    ("a procedural instance whose record says where it is hit and what it reads", 0, 2, BUFFER[2] + 20),
    ("its shadow record: another buffer, another place", 1, 2, BUFFER[4 + 1] + 10),
    ("a pane before nothing: the miss record of the ray's kind", 0, 3, pane_adds(4.0, 3, 3, 1) + 3),
    ("a null shadow record: a hit that runs nothing", 1, 3, 0),
]
for order, stride, index in (("forwards", 96, "nonuniform"), ("backwards", 160, "nonuniform"), ("backwards", 96, "branches")):
    lanes = list(range(8)) if order == "forwards" else list(reversed(range(8)))
    wide = [EXPECTED[lanes[i % 8]] for i in range(16)]
    need = f"#extension {NONUNIFORM} : require\n" if index == "nonuniform" else ""
    stages = {k: v.replace("@TEXEL@", TEXEL[index]).replace("#extension GL_EXT_buffer_reference", need + "#extension GL_EXT_buffer_reference")
              for k, v in STAGES.items()}
    case(f"tables/instances-with-resources-{stride}-{index}", stages,
         [expect(f"stride {stride}, lanes {order}, {index}: {EXPECTED[k][0]}", lanes.index(k), [EXPECTED[k][3]]) for k in range(8)] +
         [expect(f"stride {stride}, {index}: all lanes of a launch, sixteen apart", 0, [e[3] for e in wide])],
         section="issue 3 Records as resource tables", size=(16, 1, 1), groups=GROUPS,
         scene={"meshes": MESHES, "instances": instances},
         table={"miss": [{"group": "sky", "data": {"u32": 3}}, {"group": "sky", "data": {"u32": 4}}], "hit": records, "hit-stride": stride},
         bindings={"0.2": {"u32": [v for e in wide for v in (e[1], 10 * e[2])]},
                   "0.3": {"elements": [{"values": [float(v) for v in LEFT[i] + RIGHT[i]], "size": [2, 1], "format": "rgba32f", "filter": "nearest"}
                                        for i in range(4)]},
                   "0.4": {"u32": BUFFER[:4]}, "0.5": {"u32": BUFFER[4:]}})
