"""Shader binding table: addressing, strides, records of every layout, shared and null groups."""
from suite import *

P = "layout(location = 0) rayPayloadNV uint p;\n"
IN = "layout(location = 0) rayPayloadInNV uint p;\n"
RECORD = "layout(shaderRecordNV) buffer Record { uint id; };\n"
RAYGEN = P + """layout(set = 0, binding = 2) readonly buffer Lanes { uvec4 lanes[]; };  // offset, stride, miss, x
layout(set = 0, binding = 3) readonly buffer Masks { uint masks[]; };
void main() {
    uint lane = gl_LaunchIDNV.x;
    uvec4 l = lanes[lane];
    p = 0u;
    traceNV(scene, 0, masks[lane], l.x, l.y, l.z, vec3(float(l.w) + 1.0, 1.0, -3.0), 0.0, vec3(0.0, 0.0, 1.0), 100.0, 0);
    r[lane] = p;
}
"""
HIT = nv(IN + RECORD + "void main() { p = 1000u + id; }\n", scene=False)
MISS = nv(IN + RECORD + "void main() { p = 2000u + id; }\n", scene=False)
# One mesh of three geometries side by side, 10 apart; instances 100 apart with record offsets 0, 3 and 7.
SCENE = {"meshes": [{"name": "m", "geometries": [{"triangles": [triangle(1, 10 * g)]} for g in range(3)]}],
         "instances": [{"mesh": "m", "offset": o, "transform": [1, 0, 0, 100 * i, 0, 1, 0, 0, 0, 0, 1, 0]}
                       for i, o in enumerate((0, 3, 7))]}
lanes, expects = [], []
masks = []


def lane(offset, stride, miss, instance, geometry, what, native=None):
    base = (0, 3, 7)[instance]
    index = base + geometry * (stride & 15) + (offset & 15)
    expects.append(expect(f"hit record: {what}", len(lanes) // 4, [1000 + index], native=native))
    lanes.extend([offset & 0xFFFFFFFF, stride & 0xFFFFFFFF, miss & 0xFFFFFFFF, 100 * instance + 10 * geometry])
    masks.append(255)


for instance in range(3):
    for geometry in range(3):
        lane(0, 0, 0, instance, geometry, f"instance {instance}, geometry {geometry}, offset 0, stride 0")
        lane(0, 1, 0, instance, geometry, f"instance {instance}, geometry {geometry}, offset 0, stride 1")
        lane(2, 3, 0, instance, geometry, f"instance {instance}, geometry {geometry}, offset 2, stride 3")
lane(15, 15, 0, 2, 2, "the largest offset and stride")
MASKS = ("NVIDIA's NV pipelines (580.159.04) use the bits beyond as well: SPV_NV_ray_tracing names no masks, "
         "SPV_KHR_ray_tracing's OpTraceRayKHR does, and its KHR pipelines keep to them")
lane(0x12, 0x11, 0, 1, 2, "offset and stride use their low 4 bits", MASKS)
lane(0xFFFFFFF1, 0xFFFFFFF2, 0, 0, 1, "offset and stride use their low 4 bits (high bits set)", MASKS)
for miss in (0, 1, 2, 4):
    expects.append(expect(f"miss record {miss}", len(lanes) // 4, [2000 + miss]))
    lanes += [0, 0, miss, 0]
    masks.append(0)
expects.append(expect("the miss index uses its low 16 bits", len(lanes) // 4, [2003], native=MASKS))
lanes += [0, 0, 0x50003, 0]
masks.append(0)
case("tables/addressing", {"rgen": nv(RAYGEN), "rmiss": MISS, "rchit": HIT}, expects,
     section="semantics 2.4 SBT addressing", scene=SCENE, size=(len(masks), 1, 1),
     table={"miss": [{"group": "rmiss", "data": {"u32": i}} for i in range(5)],
            "hit": [{"group": "rchit", "data": {"u32": i}} for i in range(64)]},
     bindings={"0.2": {"u32": lanes}, "0.3": {"u32": masks}})

for stride in (64, 96, 256, 4096):
    case(f"tables/stride-{stride}", {"rgen": nv(RAYGEN), "rmiss": MISS, "rchit": HIT},
         [expect(f"hit records with a stride of {stride} bytes", 0, [1000, 1002, 1004]),
          expect(f"miss records with a stride of {stride} bytes", 3, [2000, 2002])],
         section="semantics 2.4 SBT addressing", scene=SCENE, size=(5, 1, 1),
         table={"miss": [{"group": "rmiss", "data": {"u32": i}} for i in range(3)], "miss-stride": stride,
                "hit": [{"group": "rchit", "data": {"u32": i}} for i in range(10)], "hit-stride": stride},
         bindings={"0.2": {"u32": [0, 2, 0, 0, 0, 2, 0, 10, 0, 2, 0, 20, 0, 0, 0, 0, 0, 0, 2, 0]},
                   "0.3": {"u32": [255, 255, 255, 0, 0]}})

# Records of different layouts.
LAYOUTS = [
    ("std430", "layout(shaderRecordNV, std430) buffer R { uint a; vec3 b; float c; mat3 d; uint e[3]; };\n",
     [("a", 0), ("floatBitsToUint(b.y)", 20), ("floatBitsToUint(c)", 28), ("floatBitsToUint(d[1].z)", 56), ("e[2]", 88)], ()),
    ("std140", "layout(shaderRecordNV, std140) buffer R { uint a; vec3 b; float c; mat2 d; uint e[3]; };\n",
     [("a", 0), ("floatBitsToUint(b.z)", 24), ("floatBitsToUint(c)", 28), ("floatBitsToUint(d[1].y)", 52), ("e[2]", 96)], ()),
    ("scalar", "layout(shaderRecordNV, scalar) buffer R { uint a; vec3 b; float c; mat3 d; uint e[3]; };\n",
     [("a", 0), ("floatBitsToUint(b.z)", 12), ("floatBitsToUint(c)", 16), ("floatBitsToUint(d[2].z)", 52), ("e[2]", 64)],
     ("GL_EXT_scalar_block_layout",)),
    ("offsets", "layout(shaderRecordNV) buffer R { layout(offset = 12) uint a; layout(offset = 32) vec2 b; layout(offset = 100) int c; };\n",
     [("a", 12), ("floatBitsToUint(b.y)", 36), ("uint(c)", 100)], ()),
    ("row-major", "layout(shaderRecordNV, std430, row_major) buffer R { mat3 m; mat2 n; };\n",
     [("floatBitsToUint(m[1].x)", 4), ("floatBitsToUint(m[0].z)", 32), ("floatBitsToUint(n[1].x)", 52)], ()),
    ("nested", "struct I { uvec2 k; float w; };\nlayout(shaderRecordNV, std430) buffer R { uint n; I list[3]; I one; };\n",
     [("n", 0), ("list[2].k.y", 44), ("floatBitsToUint(list[1].w)", 32), ("one.k.x", 56)], ()),
    ("64-bit", "layout(shaderRecordNV, std430) buffer R { uint a; double b; uint64_t c; };\n",
     [("unpackDouble2x32(b).x", 8), ("unpackDouble2x32(b).y", 12), ("uint(c >> 32)", 20)],
     ("GL_EXT_shader_explicit_arithmetic_types_int64",)),
    ("array-dynamic", "layout(shaderRecordNV, std430) buffer R { uint n; uint pad[3]; vec4 table[4]; };\n",
     [("floatBitsToUint(table[n - 0x100u].y)", 36), ("floatBitsToUint(table[(n & 3u) + 2u].z)", 72)], ()),
]
WORDS = [0x100 + i if i else 0x101 for i in range(32)]
WORDS[0] = 0x101
for name, decl, reads, extensions in LAYOUTS:
    for stage in ("rgen", "rchit", "rmiss", "rcall", "rahit", "rint"):
        if stage in ("rahit", "rint", "rcall") and name not in ("std430", "scalar", "nested"):
            continue
        dump = "".join(f"    r[{i}] = {e};\n" for i, (e, _) in enumerate(reads))
        at = {s: (decl, dump) if s == stage else ("", "") for s in ("rgen", "rchit", "rmiss", "rcall", "rahit", "rint")}
        stages = {
            "rgen": nv(P + "layout(location = 0) callableDataNV uint tool;\n" + at["rgen"][0] + "void main() {\n    p = 0u; tool = 0u;\n" + at["rgen"][1] +
                       (f"    traceNV(scene, 0, {'0' if stage == 'rmiss' else '0xff'}, 1, 0, 1, {RAY}, 0);\n" if stage not in ("rgen", "rcall") else "") +
                       ("    executeCallableNV(1, 0);\n" if stage == "rcall" else "") + "}\n", extensions=extensions),
            "rmiss": nv(IN + at["rmiss"][0] + "void main() {\n" + at["rmiss"][1] + "}\n", scene=False, extensions=extensions),
            "rchit": nv(IN + at["rchit"][0] + "void main() {\n" + at["rchit"][1] + "}\n", scene=False, extensions=extensions),
            "rcall": nv("layout(location = 0) callableDataInNV uint tool;\n" + at["rcall"][0] + "void main() {\n" + at["rcall"][1] + "}\n",
                        scene=False, extensions=extensions),
        }
        group = {"name": "hit", "closest": "rchit"}
        scene = ONE_TRIANGLE
        if stage in ("rahit", "rint"):
            key = "any" if stage == "rahit" else "intersection"
            stages[stage] = nv(at[stage][0] + "void main() {\n" + at[stage][1] +
                               ("    reportIntersectionNV(4.0, 0u);\n" if stage == "rint" else "") + "}\n", scene=False, extensions=extensions)
            group[key] = stage
            if stage == "rint":
                scene = {"meshes": [{"name": "b", "boxes": [box(0, 0, 1, 2)]}]}
        data = {"u32": WORDS}
        case(f"tables/record-{name}-{stage}", stages,
             [expect(f"record {name} in {stage}: {e}", i, [WORDS[offset // 4]]) for i, (e, offset) in enumerate(reads)],
             section="semantics 2.2 ShaderRecordBuffer", scene=scene, groups=[group],
             table={"raygen": [{"group": "rgen", "data": data}],
                    "miss": [{"group": "rmiss", "data": {"u32": [7] * 32}}, {"group": "rmiss", "data": data}],
                    "hit": [{"group": "hit", "data": {"u32": [7] * 32}}, {"group": "hit", "data": data}],
                    "callable": [{"group": "rcall", "data": {"u32": [7] * 32}}, {"group": "rcall", "data": data}]})

# The record after a nested trace and after a callable is still the shader's own.
case("tables/record-after-nested-trace", {
    "rgen": nv(P + f"void main() {{ p = 0u; traceNV(scene, 0, 0xff, 3, 0, 0, {RAY}, 0); r[0] = p; }}\n"),
    "rchit": nv(IN + RECORD + "layout(location = 1) rayPayloadNV uint q;\nlayout(location = 0) callableDataNV uint c;\n" + f"""void main() {{
    if (p == 50u) {{ p = id; return; }}
    uint before = id;
    q = 50u;
    traceNV(scene, 0, 0xff, 5, 0, 0, {RAY}, 1);
    c = 0u;
    executeCallableNV(1, 0);
    p = before * 10000u + q * 1000u + id * 10u + c;
}}
"""), "rmiss": MISS,
    "rcall": nv("layout(location = 0) callableDataInNV uint c;\n" + RECORD + "void main() { c = id; }\n", scene=False),
}, [expect("the record after a nested trace and a callable", 0, [3 * 10000 + 5 * 1000 + 3 * 10 + 8])],
     section="semantics 2.2", scene=ONE_TRIANGLE, recursion=2,
     table={"miss": [{"group": "rmiss", "data": {"u32": 0}}], "hit": [{"group": "rchit", "data": {"u32": i}} for i in range(8)],
            "callable": [{"group": "rcall", "data": {"u32": 7 + i}} for i in range(2)]})

# One shader in several groups, with different partners; the same handle in several records.
case("tables/shared-shaders", {
    "rgen": nv(P + f"void main() {{ for (uint i = 0u; i < 3u; ++i) {{ p = 0u; traceNV(scene, 0, 0xff, i, 0, 0, {RAY}, 0); r[i] = p; }} }}\n"),
    "rchit": nv(IN + RECORD + "void main() { p += 100u + id; }\n", scene=False),
    "rahit:one": nv(IN + "void main() { p += 10000u; }\n", scene=False),
    "rahit:two": nv(IN + "void main() { p += 20000u; }\n", scene=False), "rmiss": MISS,
}, [expect("one closest-hit in three groups with different any-hits", 0, [10101, 20102, 103])],
     section="semantics 2.4", scene={"meshes": [{"name": "t", "triangles": [triangle(1)], "geometry-flags": ["no-duplicate-any-hit"]}]},
     groups=[{"name": "a", "closest": "rchit", "any": "one"}, {"name": "b", "closest": "rchit", "any": "two"},
             {"name": "c", "closest": "rchit"}],
     table={"miss": [{"group": "rmiss", "data": {"u32": 0}}],
            "hit": [{"group": "a", "data": {"u32": 1}}, {"group": "b", "data": {"u32": 2}}, {"group": "c", "data": {"u32": 3}}]})

# Several raygens in one pipeline.
case("tables/second-raygen", {
    "rgen:first": nv("void main() { r[0] = 1u; }\n", scene=False),
    "rgen:second": nv(P + f"void main() {{ p = 5u; traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0); r[0] = p; }}\n"),
    "rchit": nv(IN + "void main() { p = p * 2u + 1u; }\n", scene=False), "rmiss": MISS,
}, [expect("the launch starts the raygen its record names", 0, [11])], section="VR", scene=ONE_TRIANGLE,
     table={"raygen": ["first", "second"], "raygen-index": 1, "miss": [{"group": "rmiss", "data": {"u32": 0}}], "hit": ["rchit"]})

# Specialisation constants, one stage twice with different values.
SPEC = IN + "layout(constant_id = 3) const uint k = 7u;\nlayout(constant_id = 4) const float f = 0.5;\nlayout(constant_id = 5) const bool b = false;\n"
spec_source = nv(SPEC + "void main() { p = k * 100u + uint(f * 8.0) * 10u + uint(b); }\n", scene=False)
case("tables/specialised-twice", {
    "rgen": nv(P + f"void main() {{ for (uint i = 0u; i < 3u; ++i) {{ p = 0u; traceNV(scene, 0, 0xff, i, 0, 0, {RAY}, 0); r[i] = p; }} }}\n"),
    "rchit:plain": spec_source, "rchit:other": {"source": spec_source, "spec": {"3": 9, "4": 1.0, "5": True}},
    "rchit:third": {"source": spec_source, "spec": {"k": 2}}, "rmiss": MISS,
}, [expect("specialisation constants: defaults", 0, [740]), expect("specialisation constants: given", 1, [981]),
    expect("specialisation constants: one stage twice", 2, [240])], section="issue 3", scene=ONE_TRIANGLE,
     table={"miss": [{"group": "rmiss", "data": {"u32": 0}}], "hit": ["plain", "other", "third"]})
