"""Limits and counts: depths, many records, large payloads, candidates that must come exactly once; mixed dialects."""
from suite import *
from cases.builtins import make

P = "layout(location = 0) rayPayloadNV uint p;\n"
IN = "layout(location = 0) rayPayloadInNV uint p;\n"
C = "layout(location = 0) callableDataInNV uint c;\nlayout(location = 1) callableDataNV uint d;\n"

# Callables beyond the limit: dropped, data unchanged, reported (rtc's own rule).
case("callables/overflow", {
    "rgen": nv("layout(location = 0) callableDataNV uint c;\nvoid main() { c = 0u; executeCallableNV(0, 0); r[0] = c; }\n", scene=False),
    "rcall": nv(C + "void main() { if (c < 9u) { d = c + 1u; uint before = d; executeCallableNV(0, 1); c = before == d ? 700u + d : d; } else c = 1u; }\n", scene=False)},
     [expect("a callable beyond the limit is dropped, its data unchanged", 0, [702])], section="design 2", callable_depth=2, only=["rtc"],
     launch_error="callable-depth")

# Every candidate of a no-duplicate geometry comes exactly once, in whatever order and leaf.
COUNT = 48
case("any-hit/no-duplicate", {
    "rgen": nv(P + f"void main() {{ for (uint i = 0u; i < {COUNT}u; ++i) r[i] = 0u; p = 0u; traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0); r[{COUNT}] = p; }}\n"),
    "rmiss": nv(IN + "void main() { p += 1000u; }\n", scene=False),
    "rahit": nv(IN + "void main() { r[gl_PrimitiveID] += 1u; p += 1u; ignoreIntersectionNV(); }\n", scene=False)},
     [expect("no-duplicate any-hit: once for every candidate", 0, [1] * COUNT), expect("and all of them before the miss", COUNT, [1000 + COUNT])],
     section="semantics 2.4 Order", groups=[{"name": "hit", "any": "rahit"}],
     scene={"meshes": [{"name": "t", "triangles": [triangle(1 + i / 4, -i / 16, -i / 16, 8.0) for i in range(COUNT)],
                        "geometry-flags": ["no-duplicate-any-hit"]}]})

# Boxes: closed at both ends; false positives are allowed, missed ones are not.
lanes = [(0, 100, -3, "a box ahead"), (0, 4, -3, "tmax where the ray enters"), (6, 100, -3, "tmin where it leaves"),
         (5, 100, -3, "tmin inside"), (0, 5, -3, "tmax inside"), (5, 5, -3, "tmin = tmax inside"), (0, 100, 2, "an origin inside"),
         (0, 100, 1, "an origin on the near side"), (0, 100, 3, "an origin on the far side")]
case("ranges/boxes", {
    "rgen": nv(P + """layout(set = 0, binding = 2) readonly buffer Lanes { vec4 lanes[]; };
void main() {
    vec4 l = lanes[gl_LaunchIDNV.x];
    r[gl_LaunchIDNV.x] = 0u;
    p = 0u;
    traceNV(scene, 0, 0xff, 0, 0, 0, vec3(1.0, 1.0, l.z), l.x, vec3(0.0, 0.0, 1.0), l.y, 0);
}
"""), "rmiss": nv(IN + "void main() { p = 1u; }\n", scene=False), "rchit": nv(IN + "void main() { p = 2u; }\n", scene=False),
    "rint": nv("void main() { r[gl_LaunchIDNV.x] = 1u; }\n", scene=False)},
     [expect(f"boxes: {what} runs the intersection shader", i, [1],
             native="lavapipe 25 drops a box that is entered exactly at tmax; VT: both ends are closed" if i == 1 else None)
      for i, (_, _, _, what) in enumerate(lanes)],
     section="semantics 2.4 Candidates", size=(len(lanes), 1, 1), groups=[{"name": "hit", "closest": "rchit", "intersection": "rint"}],
     scene={"meshes": [{"name": "b", "boxes": [box(0, 0, 1, 3)]}]}, bindings={"0.2": {"f32": [v for l in lanes for v in (*l[:3], 0)]}})

# Records far into the tables, one group in all of them.
RECORD = "layout(shaderRecordNV) buffer Record { uint id; };\n"
case("tables/far-records", {
    "rgen": nv(P + f"""void main() {{
    p = 0u; traceNV(scene, 0, 0x1, 0, 0, 299, {RAY}, 0); r[0] = p;
    p = 0u; traceNV(scene, 0, 0x2, 3, 0, 0, {RAY}, 0); r[1] = p;
    p = 0u; traceNV(scene, 0, 0, 0, 0, 299, {RAY}, 0); r[2] = p;
}}
"""), "rchit": nv(IN + RECORD + "void main() { p = 1000u + id; }\n", scene=False), "rmiss": nv(IN + RECORD + "void main() { p = 2000u + id; }\n", scene=False)},
     [expect("an instance's record offset of more than 8 bits", 0, [1290]), expect("and an SBT offset on top of it", 1, [1298]),
      expect("a miss index of more than 8 bits", 2, [2299])], section="semantics 2.4 SBT addressing",
     scene={"meshes": [{"name": "t", "triangles": [triangle(1)]}], "instances": [{"mesh": "t", "mask": 1, "offset": 290}, {"mesh": "t", "mask": 2, "offset": 295}]},
     table={"hit": [{"group": "rchit", "data": {"u32": i}} for i in range(300)], "miss": [{"group": "rmiss", "data": {"u32": i}} for i in range(300)]})

# An SBT offset that a closest-hit computes in each lane.
case("tables/offset-computed-in-closest-hit", {
    "rgen": nv(P + f"void main() {{ p = 100u + gl_LaunchIDNV.x; traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0); r[gl_LaunchIDNV.x] = p; }}\n"),
    "rchit:outer": nv(IN + "layout(location = 1) rayPayloadNV uint q;\n" + f"void main() {{ q = 5u; traceNV(scene, 0, 0xff, 1u + (p * 7u) % 3u, 0, 0, {RAY}, 1); p = q; }}\n"),
    **{f"rchit:h{i}": nv(IN + f"void main() {{ p = {i * 10}u + p; }}\n", scene=False) for i in range(3)},
    "rmiss": nv(IN + "void main() { p = 9u; }\n", scene=False)},
     [expect("SBT offsets computed in each lane of a closest-hit", 0, [((100 + x) * 7 % 3) * 10 + 5 for x in range(12)])],
     section="semantics 2.4 SBT addressing", size=(12, 1, 1), recursion=2, scene=ONE_TRIANGLE,
     table={"hit": ["outer", "h0", "h1", "h2"]})

# A payload and callable data of 64 words, indexed at run time.
case("payloads/sixty-four-words", {
    "rgen": nv("layout(location = 0) rayPayloadNV uint p[64];\n" + f"""void main() {{
    for (uint i = 0u; i < 64u; ++i) p[i] = i;
    traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0);
    for (uint i = 0u; i < 64u; ++i) r[i] = p[i];
}}
"""), "rchit": nv("layout(location = 0) rayPayloadInNV uint p[64];\nvoid main() { for (uint i = 0u; i < 64u; i += 3u) p[i] += 1000u; }\n", scene=False),
    "rmiss": nv(IN + "void main() { p = 9u; }\n", scene=False)},
     [expect("a payload of 64 words, dynamically indexed", 0, [i + 1000 * (i % 3 == 0) for i in range(64)])], section="semantics 2.2",
     scene=ONE_TRIANGLE)

# Both dialects in one pipeline, in every pair of stages that meet.
case("payloads/mixed-dialects-all-stages", {
    "rgen": ext(to_ext("layout(location = 3) rayPayloadNV uvec2 p;\nlayout(location = 1) callableDataNV uint c;\n") + f"""void main() {{
    p = uvec2(0u); traceRayEXT(scene, 0, 0xff, 0, 0, 0, {RAY}, 3); r[0] = p.x; r[1] = p.y;
    c = 4u; executeCallableEXT(0, 1); r[2] = c;
    p = uvec2(0u); traceRayEXT(scene, 0, 0, 0, 0, 0, {RAY}, 3); r[3] = p.x;
}}
"""), "rmiss": nv("layout(location = 0) rayPayloadInNV uvec2 p;\nlayout(location = 0) callableDataNV uint c;\nvoid main() { c = 6u; executeCallableNV(0, 0); p.x = c; }\n", scene=False),
    "rchit": nv("layout(location = 0) rayPayloadInNV uvec2 p;\nhitAttributeNV uint a;\nvoid main() { p.x = a * 100u + gl_HitKindNV; }\n", scene=False),
    "rahit": ext("layout(location = 0) rayPayloadInEXT uvec2 p;\nhitAttributeEXT uint a;\nvoid main() { p.y += a; if (gl_HitKindEXT == 2u) ignoreIntersectionEXT; }\n", scene=False),
    "rint": nv("hitAttributeNV uint a;\nvoid main() { a = 5u; reportIntersectionNV(6.0, 3u); a = 7u; reportIntersectionNV(5.0, 2u); }\n", scene=False),
    "rcall": ext("layout(location = 0) callableDataInEXT uint c;\nvoid main() { c = c * 10u + 1u; }\n", scene=False)},
     [expect("EXT raygen, NV intersection, EXT any-hit, NV closest-hit", 0, [503, 12]), expect("EXT raygen, EXT callable", 2, [41]),
      expect("NV miss, EXT callable", 3, [61])], section="issue 3", only=["rtc-nv"],
     scene={"meshes": [{"name": "b", "boxes": [box(0, 0, 1, 9)], "geometry-flags": ["no-duplicate-any-hit"]}]},
     groups=[{"name": "hit", "closest": "rchit", "any": "rahit", "intersection": "rint"}])

# Built-ins of an intersection shader after a report out of range, of a callable after a nested callable.
make("rint", "box", "after a report out of range", before="    reportIntersectionNV(-1.0, 3u);\n")
make("rcall", "triangle", "after a nested callable", helper="layout(location = 3) callableDataNV uint called;\n",
     before="    called = 1u;\n    executeCallableNV(1, 3);\n",
     extra={"rcall:tool": "layout(location = 0) callableDataInNV uint called;\nvoid main() { called += 5u; }\n"})

# Loops whose condition is a constant: their back edge is never taken, and must be there all the same.
ONCE = "do { s = s * 3u + 1u; } while (false); uint i = 0u; do { ++i; do { s += i; TRACE_HERE } while (i < 9u && false); } while (i < 3u && false);\n"
TRACED = f"p = s; traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0); s += p;"
for stage in ("rgen", "rchit"):
    traces = stage == "rgen"
    body = "uint s = 5u; " + ONCE.replace("TRACE_HERE", TRACED if traces else "")
    case(f"control-flow/{stage}-constant-conditions", {
        "rgen": nv(P + ("void main() { " + body + "r[0] = s; }\n" if traces else
                        f"void main() {{ p = 0u; traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0); r[0] = p; }}\n")),
        "rchit": nv(IN + "void main() { " + ("p += 100u;" if traces else body + "p = s;") + " }\n", scene=False),
        "rmiss": nv(IN + "void main() { p = 9u; }\n", scene=False)},
         [expect(f"do-while loops that run once, in {'raygen around a trace' if traces else 'closest-hit'}", 0, [17 + 117 if traces else 17])],
         section="design 2 States", scene=ONE_TRIANGLE)
