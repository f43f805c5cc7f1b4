"""The types of live values in random pipelines: how a uint becomes one, and how one becomes a uint again.

A Type has GLSL on one side and its meaning in Python on the other: store(v, "e") is a statement that changes
variable v by the uint e, change(old, e) computes the same; load(v) is an expression, value(x) computes it.
Floats only ever hold small multiples of 1/4, so every operation is exact.
"""
M = 0xFFFFFFFF
M64 = 2**64 - 1


class Type:
    def __init__(self, name, zero, default, store, change, load, value, array=""):
        self.name, self.zero, self.default, self.array = name, zero, default, array
        self.store, self.change, self.load, self.value = store, change, load, value


def put(old, index, value):
    new = list(old)
    new[index] = value
    return tuple(new)


def signed(x, bits):
    x &= (1 << bits) - 1
    return x - (1 << bits) if x >> (bits - 1) else x


TYPES = [
    Type("uint", "0u", 0, lambda v, e: f"{v} = {e};", lambda o, e: e, lambda v: v, lambda x: x),
    Type("int", "0", 0, lambda v, e: f"{v} = int({e}) >> 3;", lambda o, e: signed(e, 32) >> 3,
         lambda v: f"uint({v})", lambda x: x & M),
    Type("bool", "false", False, lambda v, e: f"{v} = ({e} & 3u) == 1u;", lambda o, e: (e & 3) == 1,
         lambda v: f"({v} ? 7u : 11u)", lambda x: 7 if x else 11),
    Type("float", "0.0", 0, lambda v, e: f"{v} = float({e} & 0xffffu) * 0.25;", lambda o, e: e & 0xFFFF,
         lambda v: f"uint({v} * 4.0)", lambda x: x),
    Type("uvec3", "uvec3(0u)", (0, 0, 0),
         lambda v, e: f"{v} = uvec3({e}) * uvec3(1u, 3u, 5u) + uvec3(0u, 1u, 2u);",
         lambda o, e: (e, (e * 3 + 1) & M, (e * 5 + 2) & M),
         lambda v: f"({v}.x ^ {v}.y + {v}.z)", lambda x: x[0] ^ (x[1] + x[2]) & M),
    Type("uvec2", "uvec2(0u)", (0, 0), lambda v, e: f"{v} = uvec2({v}.y, {e});", lambda o, e: (o[1], e),
         lambda v: f"({v}.x * 3u + {v}.y)", lambda x: (x[0] * 3 + x[1]) & M),
    Type("ivec3", "ivec3(0)", (0, 0, 0), lambda v, e: f"{v} = ivec3(int({e}) >> 1, {v}.xy);",
         lambda o, e: (signed(e, 32) >> 1, o[0], o[1]),
         lambda v: f"uint({v}.x - {v}.y + {v}.z)", lambda x: (x[0] - x[1] + x[2]) & M),
    Type("vec4", "vec4(0.0)", (0, 0, 0, 0), lambda v, e: f"{v} = vec4({v}.yzw, float({e} & 0xfffu));",
         lambda o, e: (o[1], o[2], o[3], e & 0xFFF),
         lambda v: f"(uint({v}.x) + uint({v}.y) * 3u + uint({v}.w) * 5u)", lambda x: (x[0] + x[1] * 3 + x[3] * 5) & M),
    Type("bvec2", "bvec2(false)", (False, False), lambda v, e: f"{v} = bvec2(({e} & 1u) != 0u, {v}.x);",
         lambda o, e: (bool(e & 1), o[0]), lambda v: f"(uint({v}.x) * 2u + uint({v}.y))", lambda x: x[0] * 2 + x[1]),
    Type("mat2", "mat2(0.0)", (0, 0, 0, 0),
         lambda v, e: f"{v}[1][0] = float({e} & 255u); {v}[0][1] = {v}[1][1]; {v}[1][1] += 1.0;",
         lambda o, e: (o[0], o[3], e & 255, o[3] + 1),
         lambda v: f"(uint({v}[0][1]) + uint({v}[1][0]) * 16u + uint({v}[1][1]))",
         lambda x: (x[1] + x[2] * 16 + x[3]) & M),
    Type("mat3x2", "mat3x2(0.0)", ((0, 0), (0, 0), (0, 0)),  # a dynamic column
         lambda v, e: f"{v}[{e} % 3u] = vec2(float({e} & 255u), {v}[0][1] + 1.0);",
         lambda o, e: put(o, e % 3, (e & 255, o[0][1] + 1)),
         lambda v: f"(uint({v}[0][0]) + uint({v}[1][0]) * 3u + uint({v}[2][0]) * 7u + uint({v}[2][1]))",
         lambda x: (x[0][0] + x[1][0] * 3 + x[2][0] * 7 + x[2][1]) & M),
    Type("uint64_t", "uint64_t(0u)", 0, lambda v, e: f"{v} = {v} * 5ul + uint64_t({e}) * 0x100000003ul;",
         lambda o, e: (o * 5 + e * 0x100000003) & M64, lambda v: f"(uint({v}) ^ uint({v} >> 32))",
         lambda x: (x ^ x >> 32) & M),
    Type("int64_t", "int64_t(0)", 0, lambda v, e: f"{v} = ({v} ^ int64_t({e})) * 3l - 7l;",
         lambda o, e: ((o ^ e) * 3 - 7) & M64, lambda v: f"uint(uint64_t({v}) >> 17)", lambda x: x >> 17 & M),
    Type("double", "0.0lf", 0, lambda v, e: f"{v} = double({e} & 0xffffu) * 0.5lf;", lambda o, e: e & 0xFFFF,
         lambda v: f"uint({v} * 2.0lf)", lambda x: x),
    Type("uint8_t", "uint8_t(0u)", 0, lambda v, e: f"{v} += uint8_t({e} & 255u);", lambda o, e: (o + e) & 255,
         lambda v: f"uint({v})", lambda x: x),
    Type("uint16_t", "uint16_t(0u)", 0, lambda v, e: f"{v} = {v} * uint16_t(3u) + uint16_t({e} & 0xffffu);",
         lambda o, e: (o * 3 + e) & 0xFFFF, lambda v: f"uint({v})", lambda x: x),
    Type("int16_t", "int16_t(0)", 0, lambda v, e: f"{v} = int16_t(int({e} << 16u) >> 16);", lambda o, e: signed(e, 16),
         lambda v: f"uint(int({v}))", lambda x: x & M),
    Type("float16_t", "float16_t(0.0)", 0, lambda v, e: f"{v} = float16_t(float({e} & 0x3ffu));", lambda o, e: e & 0x3FF,
         lambda v: f"uint(float({v}))", lambda x: x),
    Type("u8vec4", "u8vec4(0u)", (0, 0, 0, 0), lambda v, e: f"{v} = u8vec4(uint8_t({e} & 255u), {v}.x, {v}.y, {v}.z);",
         lambda o, e: (e & 255, o[0], o[1], o[2]),
         lambda v: f"(uint({v}.x) | uint({v}.y) << 8 | uint({v}.z) << 16 | uint({v}.w) << 24)",
         lambda x: x[0] | x[1] << 8 | x[2] << 16 | x[3] << 24),
    Type("uint", "uint[4](0u, 0u, 0u, 0u)", (0,) * 4, lambda v, e: f"{v}[{e} & 3u] += {e};",
         lambda o, e: put(o, e & 3, (o[e & 3] + e) & M), lambda v: f"({v}[0] ^ {v}[1] ^ {v}[2] ^ {v}[3])",
         lambda x: x[0] ^ x[1] ^ x[2] ^ x[3], "[4]"),
    Type("bool", "bool[3](false, false, false)", (False,) * 3, lambda v, e: f"{v}[{e} % 3u] = ({e} & 8u) != 0u;",
         lambda o, e: put(o, e % 3, bool(e & 8)), lambda v: f"(uint({v}[0]) + uint({v}[1]) * 2u + uint({v}[2]) * 4u)",
         lambda x: x[0] + x[1] * 2 + x[2] * 4, "[3]"),
    Type("S", "S(0u, false, 0.0)", (0, False, 0), lambda v, e: f"{v}.a = {e}; {v}.b = ({e} & 4u) != 0u; {v}.c += 2.0;",
         lambda o, e: (e, bool(e & 4), o[2] + 2), lambda v: f"({v}.a + ({v}.b ? uint({v}.c) : 1u))",
         lambda x: (x[0] + (x[2] if x[1] else 1)) & M),
    Type("N", "N(S(0u, false, 0.0), uvec2[2](uvec2(0u), uvec2(0u)))", (False, ((0, 0), (0, 0))),
         lambda v, e: f"{v}.a[{e} & 1u].y += {e}; {v}.s.b = !{v}.s.b;",
         lambda o, e: (not o[0], put(o[1], e & 1, (0, (o[1][e & 1][1] + e) & M))),
         lambda v: f"({v}.a[0].y * 3u + {v}.a[1].y + ({v}.s.b ? 9u : 0u))",
         lambda x: (x[1][0][1] * 3 + x[1][1][1] + (9 if x[0] else 0)) & M),
    Type("S", "S[2](S(0u, false, 0.0), S(0u, true, 1.0))", ((0, False, 0), (0, True, 1)),
         lambda v, e: f"{v}[{e} & 1u].a = {e}; {v}[({e} >> 1) & 1u].c += 1.0;",
         lambda o, e: (lambda n: put(n, e >> 1 & 1, put(n[e >> 1 & 1], 2, n[e >> 1 & 1][2] + 1)))(
             put(o, e & 1, put(o[e & 1], 0, e))),
         lambda v: f"({v}[0].a ^ {v}[1].a + uint({v}[0].c) * 7u + uint({v}[1].c))",
         lambda x: x[0][0] ^ (x[1][0] + x[0][2] * 7 + x[1][2]) & M, "[2]"),
    Type("T", "T(uint8_t(0u), false, uint16_t(0u), float16_t(0.0))", (0, False, 0, 0),
         lambda v, e: f"{v}.a = uint8_t({e} & 255u); {v}.b = {v}.a > uint8_t(99u); {v}.c += uint16_t({e} & 255u); "
                      f"{v}.d = float16_t(float({e} & 127u));",
         lambda o, e: (e & 255, (e & 255) > 99, (o[2] + (e & 255)) & 0xFFFF, e & 127),
         lambda v: f"(uint({v}.a) + uint({v}.b) * 256u + uint({v}.c) * 512u + uint(float({v}.d)))",
         lambda x: (x[0] + x[1] * 256 + x[2] * 512 + x[3]) & M),
]
SCALARS = [t for t in TYPES if not t.array and t.name in ("uint", "int", "bool", "float", "uint8_t", "uint16_t", "int16_t",
                                                           "float16_t", "bvec2")]
STRUCTS = ("struct S { uint a; bool b; float c; };\nstruct N { S s; uvec2 a[2]; };\n"
           "struct T { uint8_t a; bool b; uint16_t c; float16_t d; };\n")
EXTENSIONS = [f"GL_EXT_shader_explicit_arithmetic_types_{t}" for t in ("int64", "int16", "int8", "float16")]
