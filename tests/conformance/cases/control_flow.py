"""Traces inside every kind of control flow, in raygen and in a recursing closest-hit. The Python twin of each
body computes the expectation: trace(x) is a ray whose closest-hit returns 3 x + 1 (hit) or x ^ 5 (miss for odd x)."""
from suite import *

M = 0xFFFFFFFF


def t(x):
    return (x ^ 5) & M if x & 1 else (3 * x + 1) & M


# Each: name, GLSL body using `uint x` (input), helper functions, accumulating into `uint s`; Python twin.
def for_loop(x):
    s = 0
    for i in range(5):
        s = (s * 7 + t(x + i)) & M
    return s


def nested_loops(x):
    s = 0
    for i in range(3):
        s += 10
        for j in range(i + 1):
            s = (s * 3 + t(x + i * j)) & M
            if s % 5 == 0:
                s += 2
        s ^= i
    return s


def while_loop(x):
    s, y = 0, x & 15
    while y < 40:
        y = t(y) % 50 + y + 1
        s = (s * 5 + y) & M
    return s


def do_while(x):
    s, y = 1, x & 7
    while True:
        y += t(y) % 3 + 1
        s = (s * 11 + y) & M
        if not y < 30:
            break
    return s


def with_continue(x):
    s = 0
    for i in range(8):
        v = t(x + i)
        if v % 3 == 0:
            continue
        s = (s * 5 + v) & M
        if i == 5:
            continue
        s = (s + t(s & 255)) & M
    return s


def with_break(x):
    s = 0
    for i in range(20):
        v = t(x + i)
        s = (s * 3 + v) & M
        if v % 7 == 2:
            break
        if i > 9:
            s += 1
            break
    return (s + t(s & 15)) & M


def continue_construct(x):
    s, i = 0, 0
    while i < 12:
        s = (s * 3 + i) & M
        i += t(i) % 4 + 1
    return s


def loop_condition(x):
    s, i = 0, 0
    while t(i + (x & 3)) % 17 < 14 and i < 9:
        s = (s * 2 + i) & M
        i += 1
    return s * 100 + i


def switch_cases(x):
    s = 0
    for i in range(6):
        k = (x + i) % 6
        if k == 0:
            s = (s + t(x)) & M
        elif k == 1:  # falls through into 2
            s = (s * 3) & M
            s = (s + t(x + 2)) & M
            s = (s * 5 + 2) & M
        elif k == 2:
            s = (s * 5 + 2) & M
        elif k == 3:
            s ^= t(i)
        else:
            s = (s + t(x + k)) & M
    return s


def switch_in_loop_break(x):
    s = 0
    for i in range(7):
        k = t(i) % 3
        if k == 0:
            s += 1
            continue
        if k == 1:
            s = (s * 2 + t(s & 7)) & M
        else:
            s += 3
        s = (s * 3) & M
    return s


def branches(x):
    if x & 2:
        s = t(x)
        s = (s + t(x + 1)) & M
    else:
        s = t(x + 2)
    if s & 1:
        s = (s * 2 + 1) & M
    else:
        s = (s + t(s & 31)) & M
    return s


def nested_ifs(x):
    s = x
    if x & 1:
        if x & 4:
            s += t(x)
        else:
            s += 2
            if x & 8:
                s += t(x + 8)
        s *= 3
    else:
        s += t(x * 2)
        if not (x & 4):
            s ^= 3
    return s & M


def early_return(x):
    def f(y):
        if y % 3 == 0:
            return t(y)
        if t(y) % 2 == 0:
            return 5
        for i in range(4):
            if t(y + i) % 5 == 1:
                return 100 + i
        return t(y + 1)
    return sum((k + 1) * f(x + k) for k in range(5)) & M


def functions(x):
    def inner(a):
        return (t(a) + 1) & M
    def outer(a, b):
        return (inner(a) * 3 + inner(b)) & M
    s = outer(x, x + 1)
    s = (s + outer(s & 7, x)) & M
    return (s ^ inner(s & 63)) & M


def out_parameters(x):
    def f(a):
        return t(a) & M, (t(a + 1) + a) & M
    a, b = f(x)
    c, d = f(a & 31)
    return (a + 3 * b + 5 * c + 7 * d) & M


def short_circuit(x):
    s = 0
    if x & 1 and t(x) % 2 == 0:
        s += 1
    if x & 2 or t(x + 1) % 2 == 0:
        s += 2
    s += t(x + 2) % 9 if x & 4 else t(x + 3) % 7
    return s


def loop_carried(x):
    a, b, c = x & 15, 1, 2
    for i in range(6):
        a, b, c = b, c, (t(a + i) + b * c) & M
    return (a + 3 * b + 7 * c) & M


def double_break(x):
    s = 0
    for i in range(5):
        for j in range(5):
            v = t(i * 5 + j + (x & 3))
            if v % 11 == 3:
                break
            s = (s * 3 + v) & M
            if v % 13 == 4:
                return s
        s += 100
    return s & M


def many_sites(x):
    s = 0
    for k in range(8):
        s = (s * 3 + t(x + k * k)) & M
    return s


def loop_without_trace(x):
    s = t(x)
    for i in range(10):
        if i == 3:
            continue
        s = (s * 3 + i) & M
    s = (s + t(s & 15)) & M
    for i in range(4):
        for j in range(3):
            s = (s ^ (i * j)) * 5 & M
    return s


FLOWS = [
    ("for loop", for_loop, "", "for (uint i = 0u; i < 5u; ++i) s = s * 7u + T(x + i);"),
    ("nested loops", nested_loops, "", """for (uint i = 0u; i < 3u; ++i) {
        s += 10u;
        for (uint j = 0u; j < i + 1u; ++j) { s = s * 3u + T(x + i * j); if (s % 5u == 0u) s += 2u; }
        s ^= i;
    }"""),
    ("while loop", while_loop, "", "uint y = x & 15u; while (y < 40u) { y = T(y) % 50u + y + 1u; s = s * 5u + y; }"),
    ("do-while loop", do_while, "", "uint y = x & 7u; s = 1u; do { y += T(y) % 3u + 1u; s = s * 11u + y; } while (y < 30u);"),
    ("continue", with_continue, "", """for (uint i = 0u; i < 8u; ++i) {
        uint v = T(x + i);
        if (v % 3u == 0u) continue;
        s = s * 5u + v;
        if (i == 5u) continue;
        s += T(s & 255u);
    }"""),
    ("break", with_break, "", """for (uint i = 0u; i < 20u; ++i) {
        uint v = T(x + i);
        s = s * 3u + v;
        if (v % 7u == 2u) break;
        if (i > 9u) { s += 1u; break; }
    }
    s += T(s & 15u);"""),
    ("trace in a continue construct", continue_construct, "", "for (uint i = 0u; i < 12u; i += T(i) % 4u + 1u) s = s * 3u + i;"),
    ("trace in a loop condition", loop_condition, "",
     "uint i = 0u; for (; T(i + (x & 3u)) % 17u < 14u && i < 9u; ++i) s = s * 2u + i;  s = s * 100u + i;"),
    ("switch with fall-through", switch_cases, "", """for (uint i = 0u; i < 6u; ++i) {
        uint k = (x + i) % 6u;
        switch (k) {
        case 0u: s += T(x); break;
        case 1u: s = s * 3u; s += T(x + 2u);
        case 2u: s = s * 5u + 2u; break;
        case 3u: s ^= T(i); break;
        default: s += T(x + k);
        }
    }"""),
    ("switch that breaks and continues in a loop", switch_in_loop_break, "", """for (uint i = 0u; i < 7u; ++i) {
        switch (T(i) % 3u) {
        case 0u: s += 1u; continue;
        case 1u: s = s * 2u + T(s & 7u); break;
        default: s += 3u; break;
        }
        s = s * 3u;
    }"""),
    ("branches", branches, "", """if ((x & 2u) != 0u) { s = T(x); s += T(x + 1u); } else s = T(x + 2u);
    if ((s & 1u) != 0u) s = s * 2u + 1u; else s += T(s & 31u);"""),
    ("nested ifs", nested_ifs, "", """s = x;
    if ((x & 1u) != 0u) {
        if ((x & 4u) != 0u) s += T(x); else { s += 2u; if ((x & 8u) != 0u) s += T(x + 8u); }
        s *= 3u;
    } else { s += T(x * 2u); if ((x & 4u) == 0u) s ^= 3u; }"""),
    ("early returns", early_return, """uint f(uint y) {
    if (y % 3u == 0u) return T(y);
    if (T(y) % 2u == 0u) return 5u;
    for (uint i = 0u; i < 4u; ++i) if (T(y + i) % 5u == 1u) return 100u + i;
    return T(y + 1u);
}
""", "for (uint k = 0u; k < 5u; ++k) s += (k + 1u) * f(x + k);"),
    ("functions with several call sites", functions, """uint inner(uint a) { return T(a) + 1u; }
uint outer(uint a, uint b) { uint p0 = inner(a) * 3u; return p0 + inner(b); }
""", "s = outer(x, x + 1u); s += outer(s & 7u, x); s ^= inner(s & 63u);"),
    ("out parameters", out_parameters, "void f(uint a, out uint b, inout uint c) { b = T(a); c += T(a + 1u) + a; }\n",
     "uint b = 0u, a, c, d = 0u; f(x, a, b); f(a & 31u, c, d); s = a + 3u * b + 5u * c + 7u * d;"),
    ("short circuit and selection", short_circuit, "", """if ((x & 1u) != 0u && T(x) % 2u == 0u) s += 1u;
    if ((x & 2u) != 0u || T(x + 1u) % 2u == 0u) s += 2u;
    s += (x & 4u) != 0u ? T(x + 2u) % 9u : T(x + 3u) % 7u;"""),
    ("loop-carried values", loop_carried, "", """uint a = x & 15u, b = 1u, c = 2u;
    for (uint i = 0u; i < 6u; ++i) { uint n = T(a + i) + b * c; a = b; b = c; c = n; }
    s = a + 3u * b + 7u * c;"""),
    ("break and return from nested loops", double_break, """uint f(uint x) {
    uint s = 0u;
    for (uint i = 0u; i < 5u; ++i) {
        for (uint j = 0u; j < 5u; ++j) {
            uint v = T(i * 5u + j + (x & 3u));
            if (v % 11u == 3u) break;
            s = s * 3u + v;
            if (v % 13u == 4u) return s;
        }
        s += 100u;
    }
    return s;
}
""", "s = f(x);"),
    ("eight trace sites", many_sites, "", " ".join(f"s = s * 3u + T(x + {k * k}u);" for k in range(8))),
    ("loops without traces between traces", loop_without_trace, "", """s = T(x);
    for (uint i = 0u; i < 10u; ++i) { if (i == 3u) continue; s = s * 3u + i; }
    s += T(s & 15u);
    for (uint i = 0u; i < 4u; ++i) for (uint j = 0u; j < 3u; ++j) s = (s ^ (i * j)) * 5u;"""),
]

LANES = 16
# Hit when even, miss when odd: the mask decides.
T_OF = """uint T(uint v) {{
    {0} = v;
    traceNV(scene, 0, (v & 1u) != 0u ? 0u : 0xffu, {1}, 0, 0, """ + RAY + """, {2});
    return {0};
}}
"""
LEAF = nv("layout(location = 0) rayPayloadInNV uint p;\nvoid main() { p = 3u * p + 1u; }\n", scene=False)
MISS = nv("layout(location = 0) rayPayloadInNV uint p;\nvoid main() { p ^= 5u; }\n", scene=False)

for name, twin, helpers, body in FLOWS:
    file = name.replace(" ", "-")
    flow = "    uint s = 0u;\n    " + body + "\n"
    case(f"control-flow/rgen-{file}", {
        "rgen": nv("layout(location = 0) rayPayloadNV uint p;\n" + T_OF.format("p", 0, 0) + helpers +
                   "void main() {\n    uint x = gl_LaunchIDNV.x;\n" + flow + "    r[x] = s;\n}\n"),
        "rchit": LEAF, "rmiss": MISS},
         [expect(f"{name} in raygen, lane {x}", x, [twin(x)]) for x in (0, 7)] +
         [expect(f"{name} in raygen, all lanes", 0, [twin(x) for x in range(LANES)])],
         section="design 2 States", scene=ONE_TRIANGLE, size=(LANES, 1, 1))
    # The same in a closest-hit that was itself traced: the inner rays take the second hit record.
    case(f"control-flow/rchit-{file}", {
        "rgen": nv("layout(location = 0) rayPayloadNV uint p;\n" + f"""void main() {{
    p = gl_LaunchIDNV.x;
    traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0);
    r[gl_LaunchIDNV.x] = p;
}}
"""),
        "rchit:flow": nv("layout(location = 0) rayPayloadInNV uint p;\nlayout(location = 1) rayPayloadNV uint q;\n" +
                         T_OF.format("q", 1, 1) + helpers + "void main() {\n    uint x = p;\n" + flow + "    p = s;\n}\n"),
        "rchit:leaf": LEAF, "rmiss": MISS},
         [expect(f"{name} in closest-hit, lane {x}", x, [twin(x)]) for x in (1, 10)] +
         [expect(f"{name} in closest-hit, all lanes", 0, [twin(x) for x in range(LANES)])],
         section="design 2 States", scene=ONE_TRIANGLE, size=(LANES, 1, 1), recursion=2)

# Recursion to each depth, through closest-hit and through miss.
for depth in (1, 2, 4, 8, 16, 31):
    def expected(d):
        return 1000 + d if d == depth - 1 else (expected(d + 1) * 3 + d) & M
    source = "layout(location = 0) rayPayloadInNV uint p;\nlayout(location = 1) rayPayloadNV uint q;\n" + f"""void main() {{
    uint d = p;
    if (d == {depth - 1}u) {{ p = 1000u + d; return; }}
    q = d + 1u;
    traceNV(scene, 0, MASK, 0, 0, 0, {RAY}, 1);
    p = q * 3u + d;
}}
"""
    for stage, mask in (("rchit", "0xff"), ("rmiss", "0")):
        other = "rmiss" if stage == "rchit" else "rchit"
        case(f"control-flow/recursion-{depth}-{stage}", {
            "rgen": nv(f"layout(location = 0) rayPayloadNV uint p;\nvoid main() {{ p = 0u; traceNV(scene, 0, {mask}, 0, 0, 0, {RAY}, 0); r[0] = p; }}\n"),
            stage: nv(source.replace("MASK", mask)),
            other: LEAF}, [expect(f"recursion to depth {depth} through {stage}", 0, [expected(0)])],
             section="semantics 2.4 Recursion", scene=ONE_TRIANGLE, recursion=depth)

# Beyond the limit: rtc drops the trace, leaves the payload, and reports.
case("control-flow/recursion-overflow", {
    "rgen": nv(f"layout(location = 0) rayPayloadNV uint p;\nvoid main() {{ p = 0u; traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0); r[0] = p; }}\n"),
    "rchit": nv("layout(location = 0) rayPayloadInNV uint p;\nlayout(location = 1) rayPayloadNV uint q;\n" + f"""void main() {{
    q = 50u + p;
    uint before = q;
    if (p < 9u) {{ q = p + 1u; before = q; traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 1); }}
    p = before == q ? 700u + q : q;
}}
"""), "rmiss": LEAF}, [expect("a trace beyond the recursion limit is dropped, its payload unchanged", 0, [702])],
     section="design 2", scene=ONE_TRIANGLE, recursion=2, only=["rtc"], launch_error="recursion-depth")
