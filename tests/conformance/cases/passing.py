"""What passes through to the linked shader: subgroup operations, DeviceIndex, aliased bindings, qualifiers, values that
live across a report, payload numbers that are specialisation constants (SPIR-V)."""
from suite import *
from cases.payloads import KINDS, stores

P = "layout(location = 0) rayPayloadNV uint p;\n"
IN = "layout(location = 0) rayPayloadInNV uint p;\n"
C = "layout(location = 1) callableDataNV uint c;\n"
BOXES = {"meshes": [{"name": "b", "boxes": [box(0, 0, 1, 9)], "geometry-flags": ["no-duplicate-any-hit"]}]}
BOX_GROUP = [{"name": "hit", "closest": "rchit", "any": "rahit", "intersection": "rint"}]
STAGES = ("rgen", "rint", "rahit", "rchit", "rmiss", "rcall")


def every_stage(name, lines, expects, extensions=(), section="semantics 2.3", stages=STAGES, **more):
    """The same GLSL uints in all six stages, or those given, one after another in r; `expects` are values, a cell each."""
    n = len(lines)
    dump = lambda stage: "".join(f"    r[{STAGES.index(stage) * n + i}] = {line};\n" for i, (_, line) in enumerate(lines) if stage in stages)
    trace = f"    p = 0u; traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0);\n"
    shader = lambda stage, declarations, body: nv(declarations + "void main() {\n" + dump(stage) + body + "}\n", scene=False,
                                                  extensions=extensions)
    case(name, {
        "rgen": nv(P + C + "void main() {\n" + trace + trace.replace("0xff", "0") + "    c = 0u; executeCallableNV(0, 1);\n" +
                   dump("rgen") + "}\n", extensions=extensions),
        "rint": shader("rint", "", "    reportIntersectionNV(5.0, 0u);\n"), "rahit": shader("rahit", "", ""),
        "rchit": shader("rchit", IN, "    p = 1u;\n"), "rmiss": shader("rmiss", IN, "    p = 2u;\n"),
        "rcall": shader("rcall", "layout(location = 0) callableDataInNV uint c;\n", "    c = 3u;\n")},
         [expect(f"{what} in {stage}", STAGES.index(stage) * n + i, [value])
          for stage in stages for i, ((what, _), value) in enumerate(zip(lines, expects))],
         section=section, scene=BOXES, groups=BOX_GROUP, **more)


every_stage("builtins/device-index", [("DeviceIndex on one device", "uint(gl_DeviceIndex)")], [0],
            extensions=("GL_EXT_device_group",), stages=STAGES[:-1])  # glslang does not declare it in callables
# One lane: what a group of lanes computes is known, whatever the width of the device.
every_stage("builtins/subgroup-in-every-stage",
            [("SubgroupSize and SubgroupInvocationID", "uint(gl_SubgroupInvocationID < gl_SubgroupSize)"),
             ("SubgroupEqMask", "uint(subgroupBallotBitExtract(gl_SubgroupEqMask, gl_SubgroupInvocationID))"),
             ("SubgroupGeMask and SubgroupLtMask", "uint(subgroupBallotBitExtract(gl_SubgroupGeMask, gl_SubgroupInvocationID)) + 2u * "
              "uint(subgroupBallotBitExtract(gl_SubgroupLtMask, gl_SubgroupInvocationID))")],
            [1, 1, 1], extensions=("GL_KHR_shader_subgroup_basic", "GL_KHR_shader_subgroup_ballot"))
every_stage("resources/subgroup-operations",
            [("subgroupElect", "uint(subgroupElect())"), ("subgroupBallot", "subgroupBallotBitCount(subgroupBallot(true))"),
             ("subgroupAll and subgroupAny", "uint(subgroupAll(true)) + 2u * uint(subgroupAny(false))"),
             ("subgroupAdd", "subgroupAdd(7u)"), ("subgroupShuffle", "subgroupShuffle(9u, gl_SubgroupInvocationID)"),
             ("subgroupBroadcastFirst", "subgroupBroadcastFirst(5u)")],
            [1, 1, 1, 7, 9, 5], section="issue 3 Resources",
            extensions=tuple("GL_KHR_shader_subgroup_" + kind for kind in ("basic", "ballot", "vote", "arithmetic", "shuffle")))

# Several lanes, in whatever groups: a sum over all groups counts every lane once, also after a trace.
case("resources/subgroup-sums", {
    "rgen": nv(P + f"""void main() {{
    uint sum = subgroupAdd(gl_LaunchIDNV.x + 1u);
    if (subgroupElect()) atomicAdd(r[0], sum);
    p = gl_LaunchIDNV.x;
    traceNV(scene, 0, (gl_LaunchIDNV.x & 1u) != 0u ? 0xffu : 0u, 0, 0, 0, {RAY}, 0);
    sum = subgroupAdd(p);
    if (subgroupElect()) atomicAdd(r[1], sum);
}}
""", extensions=("GL_KHR_shader_subgroup_arithmetic",)),
    "rchit": nv(IN + "void main() { uint sum = subgroupAdd(p); if (subgroupElect()) atomicAdd(r[2], sum); p += 1000u; }\n", scene=False,
                extensions=("GL_KHR_shader_subgroup_arithmetic",)),
    "rmiss": nv(IN + "void main() { uint sum = subgroupAdd(p); if (subgroupElect()) atomicAdd(r[3], sum); p += 1u; }\n", scene=False,
                extensions=("GL_KHR_shader_subgroup_arithmetic",))},
     [expect("sums over subgroups count every lane: raygen before a trace", 0, [sum(range(1, 51))]),
      expect("raygen after it", 1, [sum(range(50)) + 25 * 1001]), expect("closest-hit", 2, [sum(range(1, 50, 2))]),
      expect("miss", 3, [sum(range(0, 50, 2))])],
     section="issue 3 Resources", scene=ONE_TRIANGLE, size=(50, 1, 1), bindings={"0.1": {"size": 256, "fill": 0}})

# One binding, another type in each stage: they are views of the same memory.
case("resources/aliased-bindings", {
    "rgen": nv(P + "layout(set = 0, binding = 2) buffer A { uint words[]; } a;\n" +
               f"void main() {{ p = 0u; traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0); r[0] = a.words[0]; r[1] = a.words[3]; r[2] = a.words[4]; traceNV(scene, 0, 0, 0, 0, 0, {RAY}, 0); }}\n"),
    "rchit": nv(IN + "layout(set = 0, binding = 2) buffer B { float first; vec3 rest; } b;\nvoid main() { b.first = 1.5; r[3] = floatBitsToUint(b.rest.x); b.rest.x = 2.5; }\n", scene=False),
    "rmiss": nv(IN + "struct S { uvec2 k; };\nlayout(set = 0, binding = 2) buffer D { S s[4]; } d;\nvoid main() { r[4] = d.s[1].k.y; r[5] = d.s[2].k.x; }\n", scene=False)},
     [expect("one binding as words, as floats and as structures: written by closest-hit, read by raygen", 0, [bits(1.5), 4, bits(2.5)]),
      expect("read by closest-hit", 3, [5]), expect("read by miss", 4, [4, bits(2.5)])],
     section="issue 3 Resources", scene=ONE_TRIANGLE, bindings={"0.2": {"u32": [1, 2, 3, 4, 5, 6, 7, 8]}})

# Qualifiers of memory, an image written without a format.
case("resources/memory-qualifiers", {
    "rgen": nv(P + "layout(set = 0, binding = 2) coherent restrict buffer A { volatile uint v; readonly uint w; } a;\n"
               "layout(set = 0, binding = 3) uniform writeonly image2D i;\n" +
               f"void main() {{ a.v = 4u; imageStore(i, ivec2(0, 0), vec4(1.5, 0, 0, 0)); p = 0u; traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0); r[0] = a.v; r[1] = a.w; }}\n"),
    "rchit": nv(IN + "layout(set = 0, binding = 2) coherent restrict buffer A { volatile uint v; readonly uint w; } a;\n"
                "layout(set = 0, binding = 3, rgba32f) uniform readonly coherent image2D i;\n"
                "void main() { a.v += 3u; r[2] = floatBitsToUint(imageLoad(i, ivec2(0, 0)).x); }\n", scene=False),
    "rmiss": nv(IN + "void main() { p = 9u; }\n", scene=False)},
     [expect("coherent, volatile and restrict members", 0, [7, 8]), expect("an image written without a format", 2, [bits(1.5)])],
     section="issue 3 Resources", scene=ONE_TRIANGLE, bindings={"0.2": {"u32": [1, 8, 0, 0]}, "0.3": {"size": [1, 1], "format": "rgba32f"}})

# Values of every type that live across a report whose any-hit shader runs in between.
for kind in KINDS:
    n = len(kind.words("v"))
    local = f"    {kind.type} v{kind.array};\n"
    unforeseen = "    if (r[60] == 0u) { " + kind.store("v", 34).replace("\n", " ") + "}\n"
    case(f"live-values/{kind.name}-across-a-report", {
        "rgen": nv(P + f"void main() {{ p = 0u; traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0); r[0] = p; }}\n"),
        "rmiss": nv(IN + "void main() { p = 9u; }\n", scene=False),
        "rchit": nv(IN + "void main() { p = 10u * p + gl_HitKindNV; }\n", scene=False),
        "rahit": nv(IN + "void main() { p += 1u; if (gl_HitKindNV == 1u) ignoreIntersectionNV(); }\n", scene=False),
        "rint": nv(kind.decl + "void main() {\n" + local + kind.store("v", 4) + unforeseen +
                   "    bool ignored = reportIntersectionNV(4.5, 1u), taken = reportIntersectionNV(5.0, 2u);\n" +
                   stores(kind.words("v"), 64) + "    r[1] = uint(ignored) + 2u * uint(taken);\n}\n", scene=False, extensions=kind.ext)},
         [expect(f"local {kind.name} in an intersection shader survives reports", 64, kind.expected(4)),
          expect(f"beside {kind.name}: what the reports did", 0, [22, 2])],
         section="design 2 Live values", scene=BOXES, groups=BOX_GROUP, words=64 + n + 16)

# The payload number is a specialisation constant: only SPIR-V can say so.
SPECIALISED = "spec-payload.rgen.spvasm"
for value, expected in ((None, [50, 2]), (5, [1, 70]), (0, [50, 2])):
    name = "default" if value is None else str(value)
    case(f"payloads/specialised-number-{name}", {
        "rgen": {"assembly": SPECIALISED, **({} if value is None else {"spec": {"3": value}})},
        "rchit": nv(IN + "void main() { p = p * 20u + 30u; }\n", scene=False), "rmiss": nv(IN + "void main() { p = 9u; }\n", scene=False)},
         [expect(f"a payload number by a specialisation constant: {name}", 0, expected)], section="issue 3", scene=ONE_TRIANGLE, only=["rtc-nv"])
