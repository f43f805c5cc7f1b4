"""Built-ins: every one in every stage where it is allowed, plain and after what could disturb it."""
from suite import *

# The instance's transform keeps every number exact: a quarter turn about z, scale 2, translation.
#   world = (-2 oy + 10, 2 ox + 20, 2 oz + 30);  object = ((y - 20)/2, (10 - x)/2, (z - 30)/2)
TO_WORLD = [0, -2, 0, 10, 2, 0, 0, 20, 0, 0, 2, 30]
TO_OBJECT = [0, 0.5, 0, -10, -0.5, 0, 0, 5, 0, 0, 0.5, -15]
FAR = 1000.0


def scene(boxes):
    """The hit is on instance 2, geometry 1, primitive 2, at object (1, 1, 1)."""
    if boxes:
        away = [{"boxes": [box(FAR + 10 * i, 0, 1, 2) for i in range(2)]}]
        target = {"boxes": [box(FAR, 50, 1, 2), box(FAR, 60, 1, 2), box(0, 0, 1, 2)]}
    else:
        away = [{"triangles": [triangle(1, FAR + 10 * i) for i in range(2)]}]
        target = {"triangles": [triangle(1, FAR, 50), triangle(1, FAR, 60), triangle(1)]}
    # The nested ray looks at another instance, custom index and depth.
    other = {"name": "other", **({"boxes": [box(0, 0, 5, 6)]} if boxes else {"triangles": [triangle(5)]})}
    return {
        "meshes": [{"name": "main", "geometries": away + [target]}, other],
        "instances": [
            {"mesh": "other", "custom": 7, "transform": [1, 0, 0, -500, 0, 1, 0, 0, 0, 0, 1, 0]},
            {"mesh": "other", "custom": 8, "transform": [1, 0, 0, -600, 0, 1, 0, 0, 0, 0, 1, 0]},
            {"mesh": "main", "custom": 0xABCDEF, "mask": 0x3C, "transform": TO_WORLD},
        ],
    }


ORIGIN, DIRECTION, TMIN, TMAX = (8.0, 22.0, 24.0), (0.0, 0.0, 2.0), 0.125, 50.0
OBJECT_ORIGIN, OBJECT_DIRECTION = (1.0, 1.0, -3.0), (0.0, 0.0, 1.0)
HIT_T = 4.0
TRACE = ("vec3(8.0, 22.0, 24.0), 0.125, vec3(0.0, 0.0, 2.0), 50.0")
NESTED = ("vec3(-499.0, 1.0, 0.0), 0.5, vec3(0.0, 0.0, 1.0), 77.0")  # hits instance 0 at t = 5

# name -> (words, expected, type, stages)
HITS = {"rint", "rahit", "rchit"}
RAYS = HITS | {"rmiss"}


def vec(name, n=3):
    return [f"floatBitsToUint({name}.{c})" for c in "xyzw"[:n]]


def matrix(name):
    return [f"floatBitsToUint({name}[{c}].{'xyz'[r]})" for c in range(4) for r in range(3)]


def columns(rows):
    return [rows[r * 4 + c] for c in range(4) for r in range(3)]


def table(kind, flags, ext_only=False):
    """Built-ins with their values for a hit ("triangle", "box") or a miss."""
    tmax = {"rint": TMAX, "rahit": HIT_T, "rchit": HIT_T, "rmiss": TMAX}
    rows = {
        "LaunchID": (["gl_LaunchIDNV.x", "gl_LaunchIDNV.y", "gl_LaunchIDNV.z"], (0, 0, 0), "u32",
                     RAYS | {"rgen", "rcall"}),
        "LaunchSize": (["gl_LaunchSizeNV.x", "gl_LaunchSizeNV.y", "gl_LaunchSizeNV.z"], (1, 1, 1), "u32",
                       RAYS | {"rgen", "rcall"}),
        "PrimitiveID": (["uint(gl_PrimitiveID)"], (2,), "u32", HITS),
        "InstanceID": (["uint(gl_InstanceID)"], (2,), "u32", HITS),
        "InstanceCustomIndex": (["uint(gl_InstanceCustomIndexNV)"], (0xABCDEF,), "u32", HITS),
        "WorldRayOrigin": (vec("gl_WorldRayOriginNV"), ORIGIN, "f32", RAYS),
        "WorldRayDirection": (vec("gl_WorldRayDirectionNV"), DIRECTION, "f32", RAYS),
        "ObjectRayOrigin": (vec("gl_ObjectRayOriginNV"), OBJECT_ORIGIN, "f32", HITS),
        "ObjectRayDirection": (vec("gl_ObjectRayDirectionNV"), OBJECT_DIRECTION, "f32", HITS),
        "RayTmin": (["floatBitsToUint(gl_RayTminNV)"], (TMIN,), "f32", RAYS),
        "RayTmax": (["floatBitsToUint(gl_RayTmaxNV)"], tmax, "f32", RAYS),
        "HitT": (["floatBitsToUint(gl_HitTNV)"], (HIT_T,), "f32", {"rahit", "rchit"}),
        "HitKind": (["gl_HitKindNV"], (0xFF if kind == "triangle" else 42,), "u32", {"rahit", "rchit"}),
        "IncomingRayFlags": (["gl_IncomingRayFlagsNV"], (flags,), "u32", RAYS),
        "ObjectToWorld": (matrix("gl_ObjectToWorldNV"), columns(TO_WORLD), "f32", HITS),
        "WorldToObject": (matrix("gl_WorldToObjectNV"), columns(TO_OBJECT), "f32", HITS),
    }
    if ext_only:
        rows = {
            "GeometryIndex": (["uint(gl_GeometryIndexEXT)"], (1,), "u32", HITS),
            "ObjectToWorld3x4": ([f"floatBitsToUint(gl_ObjectToWorld3x4EXT[{r}][{c}])" for r in range(3)
                                  for c in range(4)], tuple(TO_WORLD), "f32", HITS),
            "WorldToObject3x4": ([f"floatBitsToUint(gl_WorldToObject3x4EXT[{r}][{c}])" for r in range(3)
                                  for c in range(4)], tuple(TO_OBJECT), "f32", HITS),
            "HitKind constants": (["uint(gl_HitKindEXT == gl_HitKindBackFacingTriangleEXT)",
                                   "gl_HitKindFrontFacingTriangleEXT"], (1, 0xFE), "u32", {"rahit", "rchit"}),
        }
        if kind == "box":
            del rows["HitKind constants"]
    return rows


def dump(stage, kind, flags, situation, ext_only=False):
    """GLSL that stores every built-in of the stage, and the expectations. Unequal values tell unequal cells."""
    lines, expects, at = [], [], 0
    for name, (words, values, type, stages) in table(kind, flags, ext_only).items():
        if stage not in stages:
            continue
        if isinstance(values, dict):
            values = (values[stage],)
        for i, word in enumerate(words):
            lines.append(f"    r[{at + i}] = {word};")
        # The specification does not say how the inverse is rounded.
        rounded = name.startswith(("Object", "WorldToObject")) and not name.startswith("ObjectToWorld")
        note = None
        if "nested hit" in situation or "nested traces" in situation or ("nested trace" in situation):
            if name in ("PrimitiveID", "InstanceID", "InstanceCustomIndex", "GeometryIndex", "HitKind") or "Object" in name:
                note = "lavapipe 25 keeps the nested hit's value; Vulkan: built-ins are of the shader's own ray"
        # Nor how t of a triangle is; a reported t is kept as it is.
        computed_t = name in ("RayTmax", "HitT") and kind == "triangle" and stage in HITS
        expects.append(expect(f"{name} in {stage}, {situation}", at, values, type, rel=2e-7 if rounded or computed_t else 0,
                              abs=2e-6 if rounded else 0, native=note))
        at += len(words)
    return "\n".join(lines) + "\n", expects, at


PAYLOAD = "layout(location = 0) rayPayloadNV uint payload;\n"
INCOMING = "layout(location = 0) rayPayloadInNV uint payload;\n"
SECOND = "layout(location = 1) rayPayloadNV uint second;\n"


def make(stage, kind, situation, before="", helper="", flags=0, ext_only=False, recursion=1, extra=None,
         wrap=None):
    body, expects, words = dump(stage, kind, flags, situation, ext_only)
    if wrap:
        body = wrap(body)
    head = ext if ext_only else nv
    fix = to_ext if ext_only else (lambda text: text)
    # A miss is made by a mask that meets nothing.
    mask = "0x3" if stage == "rmiss" else "0xF"
    stages = {}
    stages["rgen"] = head(fix(
        PAYLOAD + ("layout(location = 0) callableDataNV uint data;\n" if stage == "rcall" else "") + helper * (stage == "rgen") +
        "void main() {\n    payload = 0;\n" +
        (before + body if stage == "rgen" else "") +
        ("    executeCallableNV(0, 0);\n" if stage == "rcall" else "") +
        ("" if stage in ("rgen", "rcall") else
         f"    traceNV(scene, {flags}u, {mask}, 0, 0, 0, {TRACE}, 0);\n") + "}\n"))
    rchit = f"{INCOMING}void main() {{ payload = 100u; }}\n"
    rmiss = f"{INCOMING}void main() {{ payload = 200u; }}\n"
    if stage == "rchit":
        rchit = (INCOMING + SECOND + helper +
                 f"void main() {{\n    if (payload == 99u) {{ payload = 100u; return; }}\n{before}{body}    payload = 100u;\n}}\n")
    if stage == "rmiss":
        rmiss = (INCOMING + SECOND + helper +
                 f"void main() {{\n    if (payload == 99u) {{ payload = 200u; return; }}\n{before}{body}    payload = 200u;\n}}\n")
    stages["rmiss"] = head(fix(rmiss))
    if stage not in ("rgen", "rcall") or "traceNV" in before:
        stages["rchit"] = head(fix(rchit))
    groups = None
    if stage == "rahit":
        stages["rahit"] = head(fix(f"void main() {{\n{before}{body}}}\n"), scene=False)
        groups = [{"name": "hit", "closest": "rchit", "any": "rahit"}]
    if kind == "box":
        report = "    reportIntersectionNV(4.0, 42u);\n"
        source = (f"void main() {{\n    if (gl_InstanceCustomIndexNV < 100) {{ reportIntersectionNV(5.0, 43u); return; }}\n" +
                  (before + body if stage == "rint" else "") + report + "}\n")
        if stage == "rint" and wrap:
            source = helper + source
        stages["rint"] = head(fix(source), scene=False)
        groups = [{"name": "hit", "closest": "rchit", "intersection": "rint",
                   **({"any": "rahit"} if stage == "rahit" else {})}]
    if stage == "rcall":
        stages["rcall"] = head(fix("layout(location = 0) callableDataInNV uint data;\n" + helper + f"void main() {{\n{before}{body}}}\n"),
                               scene=False)
    if extra:
        for key, source in extra.items():
            stages[key] = head(fix(source), scene="scene" in source)
    more = {}
    if groups:
        more["groups"] = groups
    label = situation.replace(" ", "-").replace(",", "")
    case(f"builtins/{stage}-{kind}-{label}" + ("-ext" if ext_only else ""), stages, expects,
         section="semantics 2.3", scene=scene(kind == "box"), recursion=recursion, words=128, **more)


# ---- plain -----------------------------------------------------------------
make("rgen", "triangle", "plain")
make("rcall", "triangle", "plain")
make("rmiss", "triangle", "plain")
for stage in ("rahit", "rchit"):
    make(stage, "triangle", "plain")
    make(stage, "triangle", "plain", ext_only=True)
for stage in ("rint", "rahit", "rchit"):
    make(stage, "box", "plain")
    make(stage, "box", "plain", ext_only=True)
make("rchit", "triangle", "flags 33", flags=1 | 32)
make("rchit", "box", "flags opaque", flags=1)
make("rmiss", "triangle", "flags 5", flags=5)

# ---- after a nested trace, after a callable, both, in a loop, in a called function ----
NEST = "    second = 99u;\n    traceNV(scene, 1u, 0xff, 0, 0, 0, " + NESTED + ", 1);\n"
NEST_MISS = "    second = 99u;\n    traceNV(scene, 1u, 0x0, 0, 0, 0, " + NESTED + ", 1);\n"
for stage, kind in (("rchit", "triangle"), ("rchit", "box"), ("rmiss", "triangle")):
    make(stage, kind, "after a nested hit", before=NEST, recursion=2)
    make(stage, kind, "after a nested miss", before=NEST_MISS, recursion=2)
    make(stage, kind, "after three nested traces in a loop", recursion=2,
         before="    for (int i = 0; i < 3; ++i) {\n    " + NEST.replace("\n    ", "\n        ") + "    }\n")
make("rchit", "triangle", "after a nested hit", before=NEST, recursion=2, ext_only=True)
make("rchit", "box", "after a nested hit", before=NEST, recursion=2, ext_only=True)
make("rgen", "triangle", "after a trace", before="    traceNV(scene, 0u, 0xff, 0, 0, 0, " + NESTED + ", 0);\n")

CALL_DATA = "layout(location = 3) callableDataNV uint called;\n"
CALLABLE = {"rcall:tool": "layout(location = 0) callableDataInNV uint called;\nvoid main() { called += 5u; }\n"}
CALL = "    called = 1u;\n    executeCallableNV(0, 3);\n"
for stage, kind in (("rchit", "triangle"), ("rchit", "box"), ("rmiss", "triangle"), ("rgen", "triangle")):
    make(stage, kind, "after a callable", before=CALL, helper=CALL_DATA, extra=CALLABLE)
    if stage != "rgen":
        make(stage, kind, "after a callable and a nested trace", before=CALL + NEST, helper=CALL_DATA, extra=CALLABLE,
             recursion=2)


for stage, kind in (("rchit", "triangle"), ("rmiss", "triangle")):
    body, expects, words = dump(stage, kind, 0, "in a function called after a nested trace")
    helper = "void report() {\n" + body + "}\n"
    make(stage, kind, "in a function called after a nested trace", before=NEST, helper=helper, recursion=2,
         wrap=lambda b: "    report();\n")

# Launch built-ins in a three-dimensional launch, in every stage and after disturbance.
SIZE = (3, 2, 2)
LINEAR = "uint lane = gl_LaunchIDNV.x + 3u * (gl_LaunchIDNV.y + 2u * gl_LaunchIDNV.z);\n"
WRITE = ("    r[lane * 6u] = gl_LaunchIDNV.x; r[lane * 6u + 1u] = gl_LaunchIDNV.y; r[lane * 6u + 2u] = gl_LaunchIDNV.z;\n"
         "    r[lane * 6u + 3u] = gl_LaunchSizeNV.x; r[lane * 6u + 4u] = gl_LaunchSizeNV.y; r[lane * 6u + 5u] = gl_LaunchSizeNV.z;\n")
LAUNCH_EXPECT = [v for z in range(2) for y in range(2) for x in range(3) for v in (x, y, z, 3, 2, 2)]
for stage in ("rgen", "rchit", "rmiss", "rahit", "rint", "rcall"):
    dump3 = "    " + LINEAR + WRITE
    hit = stage in ("rchit", "rahit", "rint")
    stages = {"rgen": nv(PAYLOAD + "layout(location = 0) callableDataNV uint data;\nvoid main() {\n" +
                         (dump3 if stage == "rgen" else "    executeCallableNV(0, 0);\n" if stage == "rcall" else
                          f"    traceNV(scene, 0, {'0xff' if hit else '0'}, 0, 0, 0, {RAY}, 0);\n") + "}\n"),
              "rmiss": nv(INCOMING + "void main() {\n" + (dump3 if stage == "rmiss" else "") + "}\n")}
    groups = [{"name": "hit", "closest": "rchit"}]
    stages["rchit"] = nv(INCOMING + "void main() {\n" + (dump3 if stage == "rchit" else "") + "}\n")
    if stage == "rahit":
        stages["rahit"] = nv("void main() {\n" + dump3 + "}\n", scene=False)
        groups[0]["any"] = "rahit"
    if stage == "rint":
        stages["rint"] = nv("void main() {\n" + dump3 + "    reportIntersectionNV(4.0, 0u);\n}\n", scene=False)
        groups[0]["intersection"] = "rint"
    stages["rcall"] = nv("layout(location = 0) callableDataInNV uint data;\nvoid main() {\n" +
                         (dump3 if stage == "rcall" else "") + "}\n", scene=False)
    case(f"builtins/launch-3d-{stage}", stages, [expect(f"LaunchID and LaunchSize in {stage}, 3-D launch", 0, LAUNCH_EXPECT)],
         section="semantics 2.3", size=SIZE, words=128, groups=groups,
         scene={"meshes": [{"name": "m", **({"boxes": [box(0, 0, 1, 2)]} if stage == "rint" else
                                            {"triangles": [triangle(1)]})}]})

STALE = "lavapipe 25 does not update gl_RayTmaxEXT inside an intersection shader; GE 8.19 makes it volatile there"
# RayTmax in an intersection shader: changes with an accepted report, not with a rejected one.
case("builtins/rint-tmax-after-report", {
    "rgen": nv(PAYLOAD + f"void main() {{ traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0); }}\n"),
    "rmiss": nv(INCOMING + "void main() {}\n"),
    "rchit": nv(INCOMING + "void main() { r[5] = floatBitsToUint(gl_HitTNV); }\n"),
    "rahit": nv("void main() { if (gl_HitKindNV == 7u) ignoreIntersectionNV(); }\n", scene=False),
    "rint": nv("""void main() {
    r[0] = floatBitsToUint(gl_RayTmaxNV);
    bool a = reportIntersectionNV(4.0, 7u);   // ignored by the any-hit
    r[1] = floatBitsToUint(gl_RayTmaxNV);
    bool b = reportIntersectionNV(6.0, 1u);   // accepted
    r[2] = floatBitsToUint(gl_RayTmaxNV);
    bool c = reportIntersectionNV(8.0, 2u);   // beyond the closest hit
    r[3] = floatBitsToUint(gl_RayTmaxNV);
    bool d = reportIntersectionNV(5.0, 3u);   // closer
    r[4] = floatBitsToUint(gl_RayTmaxNV);
    r[6] = uint(a) | uint(b) << 1 | uint(c) << 2 | uint(d) << 3;
}
""", scene=False)},
     [expect("RayTmax in rint before any report", 0, [100.0], "f32"),
      expect("RayTmax in rint after an ignored report", 1, [100.0], "f32"),
      expect("RayTmax in rint after an accepted report", 2, [6.0], "f32", native=STALE),
      expect("RayTmax in rint after a report beyond it", 3, [6.0], "f32", native=STALE),
      expect("RayTmax in rint after a closer report", 4, [5.0], "f32", native=STALE),
      expect("HitT is the closest report", 5, [5.0], "f32"),
      expect("reportIntersection says which were accepted", 6, [0b1010])],
     section="semantics 2.4, GE 8.19", groups=[{"name": "hit", "closest": "rchit", "any": "rahit", "intersection": "rint"}],
     scene={"meshes": [{"name": "m", "boxes": [box(0, 0, 1, 9)]}]})
