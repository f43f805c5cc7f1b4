"""Payloads of every type, several locations, pairing by the call, the incoming payload passed on."""
from suite import *

E64 = "GL_EXT_shader_explicit_arithmetic_types_int64"
E16 = "GL_EXT_shader_explicit_arithmetic_types_int16"
E8 = "GL_EXT_shader_explicit_arithmetic_types_int8"
F16 = "GL_EXT_shader_explicit_arithmetic_types_float16"

# name -> (declarations, type, [(lvalue suffix, store expression of seed n, words of it, python words)], extensions)
# A value of every component is made from a seed; packing to words is exact.


class Kind:
    def __init__(self, name, type, parts, decl="", extensions=(), array=""):
        self.name, self.type, self.parts, self.decl, self.ext, self.array = name, type, parts, decl, extensions, array

    def store(self, variable, seed):
        return "".join(f"    {variable}{suffix} = {make(seed + i)};\n" for i, (suffix, make, _, _) in enumerate(self.parts))

    def words(self, variable):
        return [w for suffix, _, words, _ in self.parts for w in words(variable + suffix)]

    def expected(self, seed):
        return [v for i, (_, _, _, value) in enumerate(self.parts) for v in value(seed + i)]

    def declare(self, qualifier, variable):
        return f"{qualifier} {self.type} {variable}{self.array};\n"


def part_float(suffix):
    return (suffix, lambda n: f"{n}.5", lambda v: [f"floatBitsToUint({v})"], lambda n: [bits(n + 0.5)])


def part_int(suffix):
    return (suffix, lambda n: f"-{n}", lambda v: [f"uint({v})"], lambda n: [(-n) & 0xFFFFFFFF])


def part_uint(suffix):
    return (suffix, lambda n: f"{n}u * 0x01010101u", lambda v: [v], lambda n: [n * 0x01010101 & 0xFFFFFFFF])


def part_bool(suffix):
    return (suffix, lambda n: "true" if n % 2 else "false", lambda v: [f"uint({v})"], lambda n: [n % 2])


def part_double(suffix):
    def value(n):
        low, high = struct.unpack("II", struct.pack("d", n + 1 / 1024))
        return [low, high]
    return (suffix, lambda n: f"{n}.0LF + 1.0LF / 1024.0LF",
            lambda v: [f"unpackDouble2x32({v}).x", f"unpackDouble2x32({v}).y"], value)


def part_u64(suffix):
    return (suffix, lambda n: f"uint64_t({n}u) * 0x100000003ul",
            lambda v: [f"uint({v})", f"uint({v} >> 32)"], lambda n: [n * 3 & 0xFFFFFFFF, n])


def part_i64(suffix):
    def value(n):
        v = (-n * 0x100000003) & (2**64 - 1)
        return [v & 0xFFFFFFFF, v >> 32]
    return (suffix, lambda n: f"int64_t(-{n}) * 0x100000003l",
            lambda v: [f"uint({v})", f"uint({v} >> 32)"], value)


def part_u16(suffix):
    return (suffix, lambda n: f"uint16_t({n * 257}u)", lambda v: [f"uint({v})"], lambda n: [n * 257 & 0xFFFF])


def part_u8(suffix):
    return (suffix, lambda n: f"uint8_t({n * 3}u)", lambda v: [f"uint({v})"], lambda n: [n * 3 & 0xFF])


def part_f16(suffix):
    return (suffix, lambda n: f"float16_t({n}.5)", lambda v: [f"floatBitsToUint(float({v}))"], lambda n: [bits(n + 0.5)])


def each(part, suffixes):
    return [part(s) for s in suffixes]


XYZW = [".x", ".y", ".z", ".w"]
KINDS = [
    Kind("float", "float", each(part_float, [""])),
    Kind("int", "int", each(part_int, [""])),
    Kind("uint", "uint", each(part_uint, [""])),
    Kind("bool", "bool", each(part_bool, [""])),
    Kind("vec2", "vec2", each(part_float, XYZW[:2])),
    Kind("vec3", "vec3", each(part_float, XYZW[:3])),
    Kind("vec4", "vec4", each(part_float, XYZW)),
    Kind("ivec3", "ivec3", each(part_int, XYZW[:3])),
    Kind("uvec4", "uvec4", each(part_uint, XYZW)),
    Kind("bvec3", "bvec3", each(part_bool, XYZW[:3])),
    Kind("mat2", "mat2", each(part_float, [f"[{c}][{r}]" for c in range(2) for r in range(2)])),
    Kind("mat3", "mat3", each(part_float, [f"[{c}][{r}]" for c in range(3) for r in range(3)])),
    Kind("mat4x3", "mat4x3", each(part_float, [f"[{c}][{r}]" for c in range(4) for r in range(3)])),
    Kind("double", "double", each(part_double, [""])),
    Kind("dvec2", "dvec2", each(part_double, XYZW[:2])),
    Kind("uint64", "uint64_t", each(part_u64, [""]), extensions=(E64,)),
    Kind("int64", "int64_t", each(part_i64, [""]), extensions=(E64,)),
    Kind("uint16", "uint16_t", each(part_u16, [""]), extensions=(E16,)),
    Kind("uint8", "uint8_t", each(part_u8, [""]), extensions=(E8,)),
    Kind("float16", "float16_t", each(part_f16, [""]), extensions=(F16,)),
    Kind("array", "float", each(part_float, [f"[{i}]" for i in range(5)]), array="[5]"),
    Kind("array-of-vec3", "vec3", each(part_float, [f"[{i}].{c}" for i in range(3) for c in "xyz"]), array="[3]"),
    Kind("struct", "S", each(part_float, [".a"]) + each(part_uint, [".b.x", ".b.y"]) + each(part_bool, [".c"]) +
         each(part_float, [f".m[{c}][{r}]" for c in range(2) for r in range(2)]),
         decl="struct S { float a; uvec2 b; bool c; mat2 m; };\n"),
    Kind("nested-struct", "S", each(part_int, [".head"]) + each(part_float, [".in_.v.x", ".in_.v.y", ".in_.v.z"]) +
         each(part_bool, [".in_.f[0]", ".in_.f[1]"]) + each(part_uint, [".list[0].k", ".list[1].k"]) +
         each(part_float, [".list[0].w", ".list[1].w"]),
         decl="struct I { vec3 v; bool f[2]; };\nstruct L { uint k; float w; };\n"
              "struct S { int head; I in_; L list[2]; };\n"),
    Kind("struct-of-64", "S", each(part_u64, [".a"]) + each(part_bool, [".b"]) + each(part_double, [".c"]),
         decl="struct S { uint64_t a; bool b; double c; };\n", extensions=(E64,)),
    Kind("struct-of-small", "S", each(part_u8, [".a"]) + each(part_u16, [".b"]) + each(part_u8, [".c"]) + each(part_f16, [".d"]),
         decl="struct S { uint8_t a; uint16_t b; uint8_t c; float16_t d; };\n", extensions=(E8, E16, F16)),
]


def stores(words, at):
    return "".join(f"    r[{at + i}] = {w};\n" for i, w in enumerate(words))


if __name__ != "__main__":
    for kind in KINDS:
        n = len(kind.words("p"))
        stages = {
            "rgen": nv(kind.decl + kind.declare("layout(location = 0) rayPayloadNV", "p") +
                       "void main() {\n" + kind.store("p", 1) +
                       f"    traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0);\n" + stores(kind.words("p"), n) +
                       kind.store("p", 21) + f"    traceNV(scene, 0, 0, 0, 0, 0, {RAY}, 0);\n" +
                       stores(kind.words("p"), 3 * n) + "}\n", extensions=kind.ext),
            "rchit": nv(kind.decl + kind.declare("layout(location = 0) rayPayloadInNV", "q") +
                        "void main() {\n" + stores(kind.words("q"), 0) + kind.store("q", 10) + "}\n", scene=False,
                        extensions=kind.ext),
            "rmiss": nv(kind.decl + kind.declare("layout(location = 0) rayPayloadInNV", "q") +
                        "void main() {\n" + stores(kind.words("q"), 2 * n) + kind.store("q", 30) + "}\n", scene=False,
                        extensions=kind.ext),
        }
        case(f"payloads/type-{kind.name}", stages, [
            expect(f"payload {kind.name}: closest-hit reads what raygen wrote", 0, kind.expected(1)),
            expect(f"payload {kind.name}: raygen reads what closest-hit wrote", n, kind.expected(10)),
            expect(f"payload {kind.name}: miss reads what raygen wrote", 2 * n, kind.expected(21)),
            expect(f"payload {kind.name}: raygen reads what miss wrote", 3 * n, kind.expected(30)),
        ], section="semantics 2.2", scene=ONE_TRIANGLE, words=max(64, 4 * n))

    P = "layout(location = {0}) rayPayloadNV {1} {2};\n"
    IN = "layout(location = {0}) rayPayloadInNV {1} {2};\n"
    NOTHING = nv(IN.format(0, "uint", "p") + "void main() { p = 77u; }\n", scene=False)

    case("payloads/three-locations", {
        "rgen": nv(P.format(0, "uint", "a") + P.format(1, "uint", "b") + P.format(5, "uint", "c") + f"""void main() {{
    a = 1u; b = 2u; c = 3u;
    traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 1);
    r[0] = a; r[1] = b; r[2] = c;
    traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 5);
    r[3] = a; r[4] = b; r[5] = c;
    traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0);
    r[6] = a; r[7] = b; r[8] = c;
}}
"""),
        "rchit": nv(IN.format(0, "uint", "p") + "void main() { p = p * 10u + 4u; }\n", scene=False),
        "rmiss": NOTHING,
    }, [expect("a trace with location 1 changes only that payload", 0, [1, 24, 3]),
        expect("a trace with location 5 changes only that payload", 3, [1, 24, 34]),
        expect("a trace with location 0 changes only that payload", 6, [14, 24, 34])],
         section="semantics 2.2, 2.4 Payload", scene=ONE_TRIANGLE)

    for what, decl in (("another location", IN.format(3, "uint", "p")), ("no location", "rayPayloadInNV uint p;\n")):
        case(f"payloads/callee-declares-{what.replace(' ', '-')}", {
            "rgen": nv(P.format(0, "uint", "a") + P.format(3, "uint", "b") + f"""void main() {{
    a = 1u; b = 2u;
    traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0);
    r[0] = a; r[1] = b;
}}
"""),
            "rchit": nv(decl + "void main() { p = p * 10u + 4u; }\n", scene=False), "rmiss": NOTHING,
        }, [expect(f"payloads pair by the trace call: the callee declares {what}", 0, [14, 2])],
             section="semantics 1, 2.4", scene=ONE_TRIANGLE)

    case("payloads/different-types-by-location", {
        "rgen": nv(P.format(0, "vec4", "a") + "struct Big { uint k; float v[6]; };\n" + P.format(1, "Big", "b") + f"""void main() {{
    a = vec4(1, 2, 3, 4); b.k = 5u;
    for (int i = 0; i < 6; ++i) b.v[i] = float(i);
    traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0);
    traceNV(scene, 0, 0xff, 1, 0, 0, {RAY}, 1);
    r[0] = floatBitsToUint(a.x); r[1] = floatBitsToUint(a.w);
    r[2] = b.k; r[3] = floatBitsToUint(b.v[5]);
}}
"""),
        "rchit:one": nv(IN.format(0, "vec4", "p") + "void main() { p += 10.0; }\n", scene=False),
        "rchit:two": nv("struct Big { uint k; float v[6]; };\n" + IN.format(1, "Big", "p") +
                        "void main() { p.k += 1u; p.v[5] *= 2.0; }\n", scene=False),
        "rmiss": NOTHING,
    }, [expect("a vec4 payload beside a larger one", 0, [11.0, 14.0], "f32"),
        expect("a struct payload beside a smaller one", 2, [6, bits(10.0)])],
         section="semantics 2.2", scene=ONE_TRIANGLE)

    case("payloads/incoming-passed-on", {
        "rgen": nv(P.format(0, "uvec3", "p") + f"""void main() {{
    p = uvec3(1, 2, 0);
    traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0);
    r[0] = p.x; r[1] = p.y; r[2] = p.z;
}}
"""),
        "rchit": nv(IN.format(0, "uvec3", "p") + f"""void main() {{
    p.x += 10u;
    if (p.z == 0u) {{
        p.z = 1u;
        traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0);
        p.y = p.y * 2u + p.x;
    }}
}}
"""), "rmiss": nv(IN.format(0, "uvec3", "p") + "void main() { p.y = 0u; }\n", scene=False)},
         [expect("a closest-hit traces with its incoming payload", 0, [21, 25, 1])],
         section="semantics 1 (logipt), 2.4", scene=ONE_TRIANGLE, recursion=2)

    case("payloads/nested-own-payload", {
        "rgen": nv(P.format(0, "uvec2", "p") + f"""void main() {{
    p = uvec2(5, 0);
    traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0);
    r[0] = p.x; r[1] = p.y;
}}
"""),
        "rchit": nv(IN.format(0, "uvec2", "p") + P.format(1, "uvec2", "q") + f"""void main() {{
    if (p.y == 9u) {{ p.x += 100u; return; }}
    p.x += 1u;
    q = uvec2(p.x, 9u);
    traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 1);
    r[2] = p.x; r[3] = q.x;
    p.y = q.x;
    traceNV(scene, 0, 0, 0, 0, 0, {RAY}, 1);
    p.y += q.x;
}}
"""), "rmiss": nv(IN.format(0, "uvec2", "p") + "void main() { p.x *= 2u; }\n", scene=False)},
         [expect("the incoming payload survives nested traces with another", 2, [6, 106]),
          expect("nested payloads come back through the chain", 0, [6, 106 + 212])],
         section="semantics 2.4 Payload", scene=ONE_TRIANGLE, recursion=2)

    case("payloads/re-entrant", {
        "rgen": nv(P.format(0, "uint", "p") + f"""void main() {{
    p = 0u;
    traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0);
    r[0] = p;
}}
"""),
        # Each level has its own q; the levels below must not touch it.
        "rchit": nv(IN.format(0, "uint", "p") + P.format(1, "uint", "q") + f"""void main() {{
    uint level = p & 7u;
    uint mine = level * 3u + 1u;
    if (level < 4u) {{
        q = level + 1u;
        traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 1);
        uint first = q;
        q = level + 1u;
        if (level == 0u) traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 1);
        p = mine * 100u + (first >> 3) % 97u + q;
    }} else {{
        p = 8u * mine;
    }}
}}
"""), "rmiss": NOTHING},
         [expect("a payload variable of its own at every recursion level", 0, None)],
         section="semantics 2.4 Payload", scene=ONE_TRIANGLE, recursion=6)

    def reentrant(level):
        mine = level * 3 + 1
        if level < 4:
            first = reentrant(level + 1)
            q = reentrant(level + 1) if level == 0 else level + 1
            return mine * 100 + (first >> 3) % 97 + q
        return 8 * mine
    CASES["payloads/re-entrant"]["expect"][0]["values"] = [reentrant(0)]

    case("payloads/block", {
        "rgen": nv("layout(location = 2) rayPayloadNV Block { vec3 color; uint count; } block;\n" + f"""void main() {{
    block.color = vec3(1, 2, 3); block.count = 4u;
    traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 2);
    r[0] = floatBitsToUint(block.color.z); r[1] = block.count;
}}
"""),
        "rchit": nv("layout(location = 2) rayPayloadInNV Block { vec3 color; uint count; };\n"
                    "void main() { color *= 2.0; count += 1u; }\n", scene=False), "rmiss": NOTHING,
    }, [expect("payload declared as a block", 0, [bits(6.0), 5])], section="semantics 2.2", scene=ONE_TRIANGLE)

    case("payloads/prefix-match", {
        "rgen": nv("struct A { float a[11]; };\n" + P.format(0, "A", "p") + f"""void main() {{
    for (int i = 0; i < 11; ++i) p.a[i] = float(i);
    traceNV(scene, 0, 0, 0, 0, 0, {RAY}, 0);
    r[0] = floatBitsToUint(p.a[0]); r[1] = floatBitsToUint(p.a[9]); r[2] = floatBitsToUint(p.a[10]);
}}
"""),
        "rmiss": nv("struct B { float a[10]; };\n" + IN.format(0, "B", "p") +
                    "void main() { p.a[0] = 50.0; p.a[9] += 100.0; }\n", scene=False),
    }, [expect("a callee that declares a prefix of the payload", 0, [50.0, 109.0, 10.0], "f32")],
         section="semantics 1 (borkrav)", scene=ONE_TRIANGLE)

    case("payloads/any-hit-writes-stay", {
        "rgen": nv(P.format(0, "uint", "p") + f"""void main() {{
    p = 1u;
    traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0);
    r[0] = p;
}}
"""),
        "rmiss": nv(IN.format(0, "uint", "p") + "void main() { p = p * 10u + 3u; }\n", scene=False),
        "rchit": nv(IN.format(0, "uint", "p") + "void main() { p = p * 10u + 4u; }\n", scene=False),
        "rahit": nv(IN.format(0, "uint", "p") + "void main() { p = p * 10u + 5u; ignoreIntersectionNV(); }\n", scene=False),
    }, [expect("payload writes before an ignore stay", 0, [153])], section="semantics 2.4 ignoreIntersection",
         scene=ONE_TRIANGLE, groups=[{"name": "hit", "closest": "rchit", "any": "rahit"}])

    case("payloads/null-shaders-leave-it", {
        "rgen": nv(P.format(0, "uint", "p") + f"""void main() {{
    p = 11u;
    traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0);
    r[0] = p;
    traceNV(scene, 0, 0, 0, 0, 1, {RAY}, 0);
    r[1] = p;
    traceNV(scene, 8u, 0xff, 1, 0, 0, {RAY}, 0);
    r[2] = p;
}}
"""), "rmiss": NOTHING,
        "rchit": nv(IN.format(0, "uint", "p") + "void main() { p = 4u; }\n", scene=False),
    }, [expect("a null hit record leaves the payload", 0, [11]), expect("a null miss record leaves the payload", 1, [11]),
        expect("SkipClosestHitShader leaves the payload", 2, [11])],
         section="semantics 2.4", scene=ONE_TRIANGLE,
         table={"miss": ["rmiss", None], "hit": [None, "rchit"]})
