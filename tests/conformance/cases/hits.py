"""Any-hit, intersection and callable shaders: exits, attributes, commits, nesting."""
from suite import *

P = "layout(location = 0) rayPayloadNV uvec4 p;\n"
IN = "layout(location = 0) rayPayloadInNV uvec4 p;\n"
RGEN = nv(P + f"""void main() {{
    p = uvec4(0u);
    traceNV(scene, FLAGS, 0xff, 0, 0, 0, {RAY}, 0);
    r[0] = p.x; r[1] = p.y; r[2] = p.z; r[3] = p.w;
}}
""")


def rgen(flags=0):
    return RGEN.replace("FLAGS", str(flags))


HIT = nv(IN + "void main() { p.x = 1u + uint(gl_PrimitiveID); p.y = floatBitsToUint(gl_HitTNV); }\n", scene=False)
MISS = nv(IN + "void main() { p.x = 999u; }\n", scene=False)
THREE = {"meshes": [{"name": "t", "triangles": [triangle(5), triangle(1), triangle(9)], "geometry-flags": ["no-duplicate-any-hit"]}]}
GROUP = [{"name": "hit", "closest": "rchit", "any": "rahit"}]
BOX_GROUP = [{"name": "hit", "closest": "rchit", "intersection": "rint"}]
BOX_ANY = [{"name": "hit", "closest": "rchit", "any": "rahit", "intersection": "rint"}]
BOX = {"meshes": [{"name": "b", "boxes": [box(0, 0, 1, 9)]}]}


def any_hit(name, body, expects, scene=THREE, flags=0, helpers="", chit=HIT):
    case(f"any-hit/{name}", {"rgen": rgen(flags), "rmiss": MISS, "rchit": chit,
                             "rahit": nv(IN + "hitAttributeNV vec2 weights;\n" + helpers + "void main() {\n" + body + "}\n", scene=False)},
         expects, section="semantics 2.4", scene=scene, groups=GROUP)


any_hit("accept-all", "    p.z += 1u << uint(gl_PrimitiveID);\n", [expect("accepting all gives the nearest", 0, [2, bits(4.0)])])
any_hit("ignore-all", "    p.z |= 1u << uint(gl_PrimitiveID); ignoreIntersectionNV();\n",
        [expect("ignoring all gives a miss", 0, [999]), expect("ignoring all: every candidate is shown", 2, [7])])
any_hit("ignore-nearest", "    if (gl_PrimitiveID == 1) ignoreIntersectionNV();\n", [expect("ignoring the nearest gives the second", 0, [1, bits(8.0)])])
any_hit("ignore-but-last", "    if (gl_PrimitiveID != 2) ignoreIntersectionNV();\n", [expect("ignoring all but the farthest", 0, [3, bits(12.0)])])
any_hit("code-after-ignore", "    if (gl_PrimitiveID == 1) { ignoreIntersectionNV(); p.w += 1u; }\n    if (gl_PrimitiveID == 1) p.w += 16u;\n",
        [expect("code after ignoreIntersection does not run", 3, [0]), expect("and the candidate is dropped", 0, [1])])
any_hit("ignore-in-function", "    f(gl_PrimitiveID);\n    p.w |= 1u << uint(gl_PrimitiveID);\n",
        [expect("ignore inside a called function leaves the shader", 3, [5 & 5]), expect("and drops the candidate", 0, [1, bits(8.0)])],
        helpers="void f(int id) { if (id == 1) ignoreIntersectionNV(); }\n", scene=THREE, flags=0)
CASES["any-hit/ignore-in-function"]["expect"].pop(0)  # which farther candidates run is the traversal's choice
any_hit("ignore-in-loop", "    for (int i = 0; i < 5; ++i) { p.w += 1u; if (i == 2) ignoreIntersectionNV(); }\n    p.w += 100u;\n",
        [expect("ignore inside a loop leaves the shader", 3, [9]), expect("and drops the candidate", 0, [999])])
any_hit("ignore-in-function-in-loop", "    for (int i = 0; i < 5; ++i) { p.w += 1u; f(i); p.w += 10u; }\n    p.w += 1000u;\n",
        [expect("ignore in a function called from a loop leaves the shader", 3, [3 * (3 + 20)])],
        helpers="void g(int i) { if (i == 2) ignoreIntersectionNV(); }\nvoid f(int i) { g(i); }\n")
any_hit("ignore-in-switch", "    switch (gl_PrimitiveID) { case 1: ignoreIntersectionNV(); case 0: p.w |= 1u; break; default: ignoreIntersectionNV(); }\n",
        [expect("ignore in a switch does not fall through", 0, [1, bits(8.0)])])
any_hit("terminate", "    p.z += 1u; terminateRayNV(); p.z += 100u;\n",
        [expect("terminate accepts and stops: one any-hit, nothing after it", 2, [1])])
any_hit("terminate-in-function", "    p.z += 1u; f(); p.z += 100u;\n", [expect("terminate inside a called function", 2, [1])],
        helpers="void f() { terminateRayNV(); }\n")
any_hit("terminate-runs-closest-hit", "    if (gl_PrimitiveID != 2) ignoreIntersectionNV(); terminateRayNV();\n",
        [expect("terminate runs the closest-hit of that candidate", 0, [3, bits(12.0)])])
any_hit("terminate-on-first-hit", "    p.z += 1u;\n", [expect("TerminateOnFirstHit confirms one candidate", 2, [1])], flags=4)
any_hit("terminate-on-first-hit-after-ignore", "    if (gl_PrimitiveID != 0) ignoreIntersectionNV();\n",
        [expect("TerminateOnFirstHit counts confirmed hits only", 0, [1, bits(8.0)])], flags=4)
any_hit("payload-seen-by-closest-hit", "    p.w = 40u + uint(gl_PrimitiveID); if (gl_PrimitiveID != 0) ignoreIntersectionNV();\n",
        [expect("payload written by any-hit reaches closest-hit", 2, [1])],
        chit=nv(IN + "void main() { p.z = uint(p.w >= 40u && p.w <= 42u); }\n", scene=False))
any_hit("barycentrics", "    if (gl_PrimitiveID != 1) ignoreIntersectionNV(); p.z = floatBitsToUint(weights.x); p.w = floatBitsToUint(weights.y);\n",
        [expect("barycentrics in any-hit", 2, [0.25, 0.25], "f32", abs=1e-6)])
any_hit("skip-closest-hit", "    p.z += 1u;\n", [expect("SkipClosestHit runs any-hit but not closest-hit", 0, [0])], flags=8)
any_hit("local-state", "    uint a[4]; for (int i = 0; i < 4; ++i) a[i] = uint(i) * uint(gl_PrimitiveID + 1);\n    g += a[3];\n    p.z += uint(g == 5u + a[3]);\n    ignoreIntersectionNV();\n",
        [expect("module-scope variables start afresh at every any-hit", 2, [3])], helpers="uint g = 5u;\n")

case("any-hit/closest-hit-barycentrics", {"rgen": rgen(), "rmiss": MISS,
     "rchit": nv(IN + "hitAttributeNV vec2 w;\nvoid main() { p.x = floatBitsToUint(w.x); p.y = floatBitsToUint(w.y); }\n", scene=False)},
     [expect("barycentrics in closest-hit: weight of vertex 1", 0, [0.25], "f32", abs=1e-6),
      expect("barycentrics in closest-hit: weight of vertex 2", 1, [0.5], "f32", abs=1e-6)],
     section="semantics 2.4 Barycentrics", scene={"meshes": [{"name": "t", "triangles": [[0, 0, 1, 4, 0, 1, 0, 2, 1]]}]})
case("any-hit/third-attribute-reads-zero", {"rgen": rgen(), "rmiss": MISS,
     "rchit": nv(IN + "hitAttributeNV vec3 w;\nvoid main() { p.x = floatBitsToUint(w.x); p.y = floatBitsToUint(w.z); }\n", scene=False)},
     [expect("a third hit attribute on triangles reads 0", 1, [0.0], "f32")], section="semantics 1", only=["rtc"],
     scene={"meshes": [{"name": "t", "triangles": [[0, 0, 1, 4, 0, 1, 0, 2, 1]]}]})

# ---- intersection shaders ------------------------------------------------------
CHIT = nv(IN + "hitAttributeNV vec4 a;\nvoid main() { p = uvec4(gl_HitKindNV, floatBitsToUint(gl_HitTNV), floatBitsToUint(a.x), floatBitsToUint(a.w)); }\n", scene=False)


def rint(name, body, expects, any=None, flags=0, chit=CHIT, scene=BOX, **more):
    stages = {"rgen": rgen(flags), "rmiss": MISS, "rchit": chit,
              "rint": nv("hitAttributeNV vec4 a;\n" + body, scene=False)}
    if any:
        stages["rahit"] = nv(IN + "hitAttributeNV vec4 a;\nvoid main() {\n" + any + "}\n", scene=False)
    case(f"intersection/{name}", stages, expects, section="semantics 2.4", scene=scene, groups=BOX_ANY if any else BOX_GROUP, **more)


COMMIT = "lavapipe 25 hands out the attributes of the last report; the committed hit's count (VK-GL-CTS 580)"
rint("report", "void main() { a = vec4(1, 2, 3, 4); reportIntersectionNV(5.0, 33u); }\n",
     [expect("a report commits kind and t", 0, [33, bits(5.0)]), expect("a report commits attributes", 2, [1.0, 4.0], "f32")])
rint("no-report", "void main() { a = vec4(0); }\n", [expect("no report is a miss", 0, [999])])
rint("two-reports-far-near", "void main() { a = vec4(1); reportIntersectionNV(7.0, 1u); a = vec4(2); reportIntersectionNV(5.0, 2u); }\n",
     [expect("the nearer of two reports wins (far first)", 0, [2, bits(5.0)]), expect("with its attributes", 2, [2.0, 2.0], "f32")])
rint("two-reports-near-far", "void main() { a = vec4(1); reportIntersectionNV(5.0, 1u); a = vec4(2); reportIntersectionNV(7.0, 2u); }\n",
     [expect("the nearer of two reports wins (near first)", 0, [1, bits(5.0)]),
      expect("attributes of a rejected report are not committed", 2, [1.0, 1.0], "f32", native=COMMIT)])
rint("attributes-after-report", "void main() { a = vec4(1); reportIntersectionNV(5.0, 1u); a = vec4(9); }\n",
     [expect("attributes are captured when the report executes", 2, [1.0, 1.0], "f32", native=COMMIT)])
rint("out-of-range", "void main() { bool x = reportIntersectionNV(-1.0, 1u), y = reportIntersectionNV(101.0, 2u), z = reportIntersectionNV(50.0, 3u); r[8] = uint(x) + 2u * uint(y) + 4u * uint(z); }\n",
     [expect("reports outside [tmin, tmax] are rejected", 8, [4]), expect("one inside is accepted", 0, [3, bits(50.0)])])
rint("return-values", "void main() { r[8] = uint(reportIntersectionNV(6.0, 1u)); r[9] = uint(reportIntersectionNV(8.0, 1u)); r[10] = uint(reportIntersectionNV(4.5, 1u)); }\n",
     [expect("the first report returns true", 8, [1]), expect("a farther one returns false", 9, [0]), expect("a nearer one returns true", 10, [1])])
rint("any-hit-ignores", "void main() { r[8] = uint(reportIntersectionNV(5.0, 1u)); a = vec4(3); r[9] = uint(reportIntersectionNV(6.0, 2u)); }\n",
     [expect("reportIntersection returns false when any-hit ignores", 8, [0, 1]), expect("nothing of an ignored report is committed", 0, [2, bits(6.0)]),
      expect("attributes of the accepted one", 2, [3.0, 3.0], "f32")], any="    if (gl_HitKindNV == 1u) ignoreIntersectionNV();\n")
rint("restore-on-reject", "void main() { a = vec4(7); reportIntersectionNV(6.0, 2u); a = vec4(8); reportIntersectionNV(5.0, 1u); }\n",
     [expect("an ignored nearer report changes neither kind nor t", 0, [2, bits(6.0)]),
      expect("nor the attributes", 2, [7.0, 7.0], "f32", native=COMMIT)], any="    if (gl_HitKindNV == 1u) ignoreIntersectionNV();\n")
rint("any-hit-terminates", "void main() { reportIntersectionNV(6.0, 2u); r[8] = 1u; reportIntersectionNV(5.0, 3u); r[8] = 2u; }\n",
     [expect("terminate in any-hit ends the intersection shader", 8, [UNTOUCHED]), expect("its report is the hit", 0, [2, bits(6.0)])],
     any="    terminateRayNV();\n")
rint("any-hit-terminates-from-function", "bool f(float t, uint k) { bool b = reportIntersectionNV(t, k); r[9] = 1u; return b; }\nvoid main() { f(6.0, 2u); r[8] = 1u; }\n",
     [expect("also through a wrapper function", 8, [UNTOUCHED, UNTOUCHED]), expect("its report is the hit", 0, [2, bits(6.0)])],
     any="    terminateRayNV();\n")
rint("first-hit-ends-intersection", "void main() { r[8] = 1u; reportIntersectionNV(6.0, 2u); r[8] = 2u; reportIntersectionNV(5.0, 3u); }\n",
     [expect("TerminateOnFirstHit ends the intersection shader at the first confirmed hit", 8, [1],
             native="lavapipe 25 goes on in the intersection shader; DXR AcceptHitAndEndSearch, VT: traversal has ended"), expect("that hit counts", 0, [2, bits(6.0)])], flags=4)
rint("attributes-in-any-hit", "void main() { a = vec4(11, 12, 13, 14); reportIntersectionNV(5.0, 20u); }\n",
     [expect("any-hit sees the pending kind, t and attributes", 8, [20, bits(5.0), bits(11.0), bits(14.0)])],
     any="    r[8] = gl_HitKindNV; r[9] = floatBitsToUint(gl_HitTNV); r[10] = floatBitsToUint(a.x); r[11] = floatBitsToUint(a.w);\n")
rint("report-in-loop", "void main() { for (int i = 0; i < 6; ++i) { a = vec4(float(i)); if (reportIntersectionNV(9.0 - float(i), uint(i))) r[8] = uint(i); else break; } }\n",
     [expect("reports in a loop", 8, [5]), expect("the last accepted counts", 0, [5, bits(4.0), bits(5.0)])])
rint("report-in-switch-and-function", "void f(float t) { a.x = t; reportIntersectionNV(t, 3u); }\nvoid main() { switch (gl_PrimitiveID) { case 0: f(7.0); case 1: f(6.0); break; default: f(5.0); } }\n",
     [expect("reports in a switch with fall-through", 0, [3, bits(6.0), bits(6.0)])])
rint("non-opaque-without-any-hit", "void main() { r[8] = uint(reportIntersectionNV(5.0, 1u)); }\n", [expect("without an any-hit a report is accepted", 8, [1])], flags=2)
rint("cull-no-opaque", "void main() { r[8] = 1u; reportIntersectionNV(5.0, 1u); }\n", [expect("CullNoOpaque culls a non-opaque box", 0, [999])], flags=128)
rint("all-attribute-words", "void main() { b.v = float[8](1, 2, 3, 4, 5, 6, 7, 8); reportIntersectionNV(5.0, 1u); }\n".replace("void", "hitAttributeNV B { float v[8]; } b;\nvoid", 1),
     [expect("32 bytes of hit attributes", 8, [1.0, 8.0], "f32")],
     chit=nv(IN + "hitAttributeNV B { float v[8]; } b;\nvoid main() { p.x = 1u; r[8] = floatBitsToUint(b.v[0]); r[9] = floatBitsToUint(b.v[7]); }\n", scene=False))
CASES["intersection/all-attribute-words"]["stages"][3]["source"] = [
    line for line in CASES["intersection/all-attribute-words"]["stages"][3]["source"] if line != "hitAttributeNV vec4 a;"]
rint("struct-attributes", "struct S { uvec2 k; float w; bool b; };\nhitAttributeNV S s;\nvoid main() { s = S(uvec2(3, 4), 0.5, true); reportIntersectionNV(5.0, 1u); }\n",
     [expect("a struct as hit attribute", 8, [3, 4, bits(0.5), 1])],
     chit=nv(IN + "struct S { uvec2 k; float w; bool b; };\nhitAttributeNV S s;\nvoid main() { p.x = 1u; r[8] = s.k.x; r[9] = s.k.y; r[10] = floatBitsToUint(s.w); r[11] = uint(s.b); }\n", scene=False))
CASES["intersection/struct-attributes"]["stages"][3]["source"] = [
    line for line in CASES["intersection/struct-attributes"]["stages"][3]["source"] if line != "hitAttributeNV vec4 a;"]

# Two boxes and an instance offset choose among intersection shaders.
TWO = {"meshes": [{"name": "g", "geometries": [{"boxes": [box(0, 0, 1, 2)]}, {"boxes": [box(0, 0, 3, 4)]}]}]}
case("intersection/shader-per-geometry", {
    "rgen": nv(P + f"void main() {{ p = uvec4(0u); traceNV(scene, 0, 0xff, 0, 1, 0, {RAY}, 0); r[0] = p.x; r[1] = p.y; }}\n"), "rmiss": MISS,
    "rchit:c0": nv(IN + "void main() { p.x = 100u + gl_HitKindNV; p.y = floatBitsToUint(gl_HitTNV); }\n", scene=False),
    "rchit:c1": nv(IN + "void main() { p.x = 200u + gl_HitKindNV; p.y = floatBitsToUint(gl_HitTNV); }\n", scene=False),
    "rint:i0": nv("void main() { reportIntersectionNV(9.0, 1u); }\n", scene=False),
    "rint:i1": nv("void main() { reportIntersectionNV(6.5, 2u); }\n", scene=False)},
     [expect("each geometry runs the intersection shader of its record", 0, [202, bits(6.5)])], section="semantics 2.4", scene=TWO,
     groups=[{"name": "a", "closest": "c0", "intersection": "i0"}, {"name": "b", "closest": "c1", "intersection": "i1"}])

# A ray that starts inside a box runs its intersection shader; tmin and tmax closed.
case("intersection/inside-the-box", {
    "rgen": nv(P + "void main() { p = uvec4(0u); traceNV(scene, 0, 0xff, 0, 0, 0, vec3(1.0, 1.0, 4.0), 0.0, vec3(0.0, 0.0, 1.0), 2.0, 0); r[0] = p.x; r[1] = p.y; }\n"),
    "rmiss": MISS, "rchit": HIT, "rint": nv("void main() { reportIntersectionNV(1.0, 1u); }\n", scene=False)},
     [expect("a ray inside the box hits it", 0, [1, bits(1.0)])], section="semantics 2.4 Candidates", scene=BOX, groups=BOX_GROUP)
case("intersection/report-at-tmin", {
    "rgen": nv(P + "void main() { p = uvec4(0u); traceNV(scene, 0, 0xff, 0, 0, 0, vec3(1.0, 1.0, -3.0), 5.0, vec3(0.0, 0.0, 1.0), 20.0, 0); r[0] = p.x; r[1] = p.y; }\n"),
    "rmiss": MISS, "rchit": HIT, "rint": nv("void main() { r[8] = uint(reportIntersectionNV(5.0, 1u)); }\n", scene=False)},
     [expect("a report at tmin is in range", 8, [1]), expect("and is the hit", 0, [1, bits(5.0)])], section="semantics 2.4", scene=BOX, groups=BOX_GROUP)

# Triangles and boxes in one scene: the nearer wins whichever kind it is.
for nearer in ("triangle", "box"):
    z = 1 if nearer == "triangle" else 6
    case(f"intersection/mixed-{nearer}-nearer", {
        "rgen": nv(P + f"void main() {{ p = uvec4(0u); traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0); r[0] = p.x; r[1] = p.y; }}\n"), "rmiss": MISS,
        "rchit:tri": nv(IN + "void main() { p.x = 50u; p.y = floatBitsToUint(gl_HitTNV); }\n", scene=False),
        "rchit:box": nv(IN + "void main() { p.x = 60u; p.y = floatBitsToUint(gl_HitTNV); }\n", scene=False),
        "rint": nv("void main() { reportIntersectionNV(6.0, 1u); }\n", scene=False)},
         [expect(f"triangles and boxes together, {nearer} nearer", 0, [50, bits(4.0)] if nearer == "triangle" else [60, bits(6.0)])],
         section="semantics 2.4", scene={"meshes": [{"name": "t", "triangles": [triangle(z)]}, {"name": "b", "boxes": [box(0, 0, 2, 5)]}],
                                         "instances": [{"mesh": "t", "offset": 0}, {"mesh": "b", "offset": 1}]},
         groups=[{"name": "a", "closest": "tri"}, {"name": "b", "closest": "box", "intersection": "rint"}])

# ---- callables -------------------------------------------------------------------
C = "layout(location = {0}) callableDataNV {1} {2};\n"
CIN = "layout(location = 0) callableDataInNV {0} {1};\n"
UP = "layout(location = 0) rayPayloadInNV uvec4 p;\n"
case("callables/index-and-data", {
    "rgen": nv(C.format(0, "uvec4", "c") + "void main() { for (uint i = 0u; i < 3u; ++i) { c = uvec4(i, 10u, 20u, 30u); executeCallableNV((i + 1u) % 3u, 0); r[i * 2u] = c.x; r[i * 2u + 1u] = c.w; } }\n", scene=False),
    "rcall:a": nv(CIN.format("uvec4", "c") + "void main() { c.x += 100u; }\n", scene=False),
    "rcall:b": nv(CIN.format("uvec4", "c") + "void main() { c.x += 200u; c.w += c.y; }\n", scene=False),
    "rcall:c": nv(CIN.format("uvec4", "c") + "void main() { c.x += 300u; c.w -= c.y; }\n", scene=False)},
     [expect("a run-time callable index", 0, [200, 40, 301, 20, 102, 30])], section="semantics 1, 2.4", recursion=1)
case("callables/from-every-stage", {
    "rgen": nv(P + C.format(2, "uint", "c") + f"void main() {{ c = 1u; executeCallableNV(0, 2); r[0] = c; p = uvec4(0u); traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0); r[1] = p.x; traceNV(scene, 0, 0, 0, 0, 0, {RAY}, 0); r[2] = p.x; }}\n"),
    "rchit": nv(UP + C.format(1, "uint", "c") + "void main() { c = 2u; executeCallableNV(0, 1); p.x = c; }\n", scene=False),
    "rmiss": nv(UP + C.format(4, "uint", "c") + "void main() { c = 3u; executeCallableNV(1, 4); p.x = c; }\n", scene=False),
    "rcall:a": nv(CIN.format("uint", "c") + "void main() { c = c * 10u + 5u; }\n", scene=False),
    "rcall:b": nv(CIN.format("uint", "c") + C.format(1, "uint", "d") + "void main() { d = c + 1u; executeCallableNV(0, 1); c = d; }\n", scene=False)},
     [expect("a callable from raygen", 0, [15]), expect("a callable from closest-hit", 1, [25]), expect("nested callables from miss", 2, [45])],
     section="GE 8.19", scene=ONE_TRIANGLE, callable_depth=2)
for depth in (2, 5, 16, 31):
    def expected(d):
        return 500 + d if d == depth - 1 else (expected(d + 1) * 3 + d) & 0xFFFFFFFF
    case(f"callables/recursion-{depth}", {
        "rgen": nv(C.format(0, "uint", "c") + "void main() { c = 0u; executeCallableNV(0, 0); r[0] = c; }\n", scene=False),
        "rcall": nv(CIN.format("uint", "c") + C.format(1, "uint", "d") +
                    f"void main() {{ uint n = c; if (n == {depth - 1}u) {{ c = 500u + n; return; }} d = n + 1u; executeCallableNV(0, 1); c = d * 3u + n; }}\n", scene=False)},
         [expect(f"a callable that calls itself {depth} deep", 0, [expected(0)])], section="semantics 2.4 Recursion", callable_depth=depth)
case("callables/incoming-passed-on", {
    "rgen": nv(C.format(0, "uvec2", "c") + "void main() { c = uvec2(1u, 2u); executeCallableNV(0, 0); r[0] = c.x; r[1] = c.y; }\n", scene=False),
    "rcall:a": nv(CIN.format("uvec2", "c") + "void main() { c.x += 10u; executeCallableNV(1, 0); c.y += c.x; }\n", scene=False),
    "rcall:b": nv(CIN.format("uvec2", "c") + "void main() { c *= 3u; }\n", scene=False)},
     [expect("a callable passes its incoming data on", 0, [33, 39])], section="semantics 2.1", callable_depth=2)
case("callables/null-record", {
    "rgen": nv(C.format(0, "uint", "c") + "void main() { c = 8u; executeCallableNV(1, 0); r[0] = c; }\n", scene=False),
    "rcall": nv(CIN.format("uint", "c") + "void main() { c = 1u; }\n", scene=False)},
     [expect("a null callable leaves its data", 0, [8])], section="semantics 2.4", table={"callable": ["rcall", None]},
     only=["rtc", "native-nv"])
case("callables/in-control-flow", {
    "rgen": nv(C.format(0, "uint", "c") + """uint F(uint v) { c = v; executeCallableNV(v % 2u, 0); return c; }
void main() {
    uint x = gl_LaunchIDNV.x, s = 0u;
    for (uint i = 0u; i < 6u; i += F(i + x) % 2u + 1u) {
        switch (F(i) % 3u) { case 0u: s += F(s & 7u); case 1u: s = s * 3u + 1u; break; default: if (s > 500u) continue; s += F(x) + 2u; }
        s += 7u;
    }
    r[x] = s;
}
""", scene=False),
    "rcall:even": nv(CIN.format("uint", "c") + "void main() { c = c * 5u + 1u; }\n", scene=False),
    "rcall:odd": nv(CIN.format("uint", "c") + "void main() { c = c ^ 11u; }\n", scene=False)},
     [expect("callables in loops, switches and continue constructs", 0, None)], section="design 2", size=(8, 1, 1))


def twin(x):
    f = lambda v: v * 5 + 1 if v % 2 == 0 else v ^ 11
    s, i = 0, 0
    while i < 6:
        k = f(i) % 3
        skip = False
        if k == 0:
            s += f(s & 7)
        if k in (0, 1):
            s = s * 3 + 1
        elif s > 500:
            skip = True
        else:
            s += f(x) + 2
        if not skip:
            s += 7
        i += f(i + x) % 2 + 1
    return s


CASES["callables/in-control-flow"]["expect"][0]["values"] = [twin(x) for x in range(8)]
case("callables/trace-around-callable", {
    "rgen": nv(P + C.format(0, "uint", "c") + f"void main() {{ c = 3u; p = uvec4(1, 2, 3, 4); executeCallableNV(0, 0); traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0); r[0] = c; r[1] = p.x; c = p.x; executeCallableNV(0, 0); r[2] = c; r[3] = p.w; }}\n"),
    "rchit": nv(UP + "void main() { p.x = 70u; }\n", scene=False), "rmiss": MISS,
    "rcall": nv(CIN.format("uint", "c") + "void main() { c += 5u; }\n", scene=False)},
     [expect("callable data live across a trace, payload live across a callable", 0, [8, 70, 75, 4])], section="design 2", scene=ONE_TRIANGLE)
