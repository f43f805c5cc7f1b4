"""Callable data, hit attributes and values alive across a report, in every type that payloads are tested with."""
from suite import *
from cases.hits import COMMIT
from cases.payloads import KINDS, stores

P = "layout(location = 0) rayPayloadNV uint p;\n"
IN = "layout(location = 0) rayPayloadInNV uint p;\n"

for kind in KINDS:
    n = len(kind.words("c"))
    case(f"callables/type-{kind.name}", {
        "rgen": nv(kind.decl + kind.declare("layout(location = 2) callableDataNV", "c") + "void main() {\n" + kind.store("c", 1) +
                   "    executeCallableNV(0, 2);\n" + stores(kind.words("c"), 64 + n) + "}\n", scene=False, extensions=kind.ext),
        "rcall": nv(kind.decl + kind.declare("layout(location = 0) callableDataInNV", "d") + "void main() {\n" +
                    stores(kind.words("d"), 64) + kind.store("d", 10) + "}\n", scene=False, extensions=kind.ext)},
         [expect(f"callable data {kind.name}: the callable reads what raygen wrote", 64, kind.expected(1)),
          expect(f"callable data {kind.name}: raygen reads what the callable wrote", 64 + n, kind.expected(10))],
         section="semantics 2.2", words=64 + 2 * n + 16)

# One shader reports twice: any-hit accepts the first and ignores the second. What the closest-hit gets is the
# first's, what lives in the intersection shader is untouched by either.
BOX = {"meshes": [{"name": "b", "boxes": [box(0, 0, 1, 9)], "geometry-flags": ["no-duplicate-any-hit"]}]}
for kind in KINDS:
    n = len(kind.words("a"))
    fits = n <= 8  # words; 32 bytes of attributes
    attribute = kind.declare("hitAttributeNV", "a") if fits else "hitAttributeNV float a;\n"
    store = (lambda seed: kind.store("a", seed)) if fits else (lambda seed: f"    a = {seed}.0;\n")
    rint = (kind.decl + attribute + f"void main() {{\n    {kind.type} v{kind.array};\n" + kind.store("v", 5) +
            "    if (r[60] == 0u) {\n" + kind.store("v", 35) + "    }\n" + store(1) + "    reportIntersectionNV(6.0, 1u);\n" +
            stores(kind.words("v"), 64 + 2 * n) + store(10) + "    reportIntersectionNV(5.0, 2u);\n" +
            stores(kind.words("v"), 64 + 3 * n) + "}\n")
    read = (lambda at: stores(kind.words("a"), at)) if fits else (lambda at: "")
    expects = [expect(f"local {kind.name} in an intersection shader survives an accepted report", 64 + 2 * n, kind.expected(5)),
               expect(f"local {kind.name} in an intersection shader survives an ignored report", 64 + 3 * n, kind.expected(5))]
    if fits:
        expects += [expect(f"attribute {kind.name}: any-hit reads the pending one", 64, kind.expected(10)),
                    expect(f"attribute {kind.name}: closest-hit reads the committed one", 64 + n, kind.expected(1), native=COMMIT)]
    case(f"intersection/type-{kind.name}", {
        "rgen": nv(P + f"void main() {{ p = 0u; traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0); }}\n"),
        "rmiss": nv(IN + "void main() { p = 1u; }\n", scene=False),
        "rchit": nv(kind.decl + IN + attribute + "void main() {\n" + read(64 + n) + "    p = 2u;\n}\n", scene=False, extensions=kind.ext),
        "rahit": nv(kind.decl + attribute + "void main() {\n    if (gl_HitKindNV == 2u) {\n" + read(64) +
                    "        ignoreIntersectionNV();\n    }\n}\n", scene=False, extensions=kind.ext),
        "rint": nv(rint, scene=False, extensions=kind.ext)}, expects,
         section="semantics 2.2, 2.4", scene=BOX, words=64 + 4 * n + 16,
         groups=[{"name": "hit", "closest": "rchit", "any": "rahit", "intersection": "rint"}],
         **({"only": ["rtc"]} if kind.name == "struct" else {}))  # 36 bytes by std430: native drivers may refuse
