"""Values of every type that must survive a trace or a callable: in raygen, in a recursing closest-hit, in a callable."""
from suite import *
from cases.payloads import KINDS, stores

P = "layout(location = 0) rayPayloadNV uint p;\n"
IN = "layout(location = 0) rayPayloadInNV uint p;\n"
Q = "layout(location = 1) rayPayloadNV uint q;\n"
MISS = nv(IN + "void main() { p += 1u; }\n", scene=False)

for kind in KINDS:
    n = len(kind.words("v"))
    local = f"    {kind.type} v{kind.array};\n"
    # The seed comes from the payload at run time in spirit: values made of constants could be rematerialised,
    # so one component is changed through a buffer read that the compiler cannot foresee.
    def body(seed, at, call):
        return ("    {\n" + local + kind.store("v", seed) + "    if (r[60] == 0u) { " +
                kind.store("v", seed + 30).replace("\n", " ") + "}\n" + call + stores(kind.words("v"), at) + "    }\n")
    trace_p = f"    traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0);\n"
    trace_q = f"    traceNV(scene, 0, 0, 0, 0, 0, {RAY}, 1);\n"
    stages = {
        "rgen": nv(P + "layout(location = 0) callableDataNV uint c;\n" + kind.decl +
                   "void main() {\n    p = 1u; c = 0u;\n" + body(3, 64, trace_p) + "    executeCallableNV(0, 0);\n}\n",
                   extensions=kind.ext),
        "rmiss": MISS,
        "rchit": nv(IN + Q + kind.decl + "void main() {\n" + body(7, 64 + n, trace_q) + "    p = 5u;\n}\n", extensions=kind.ext),
        "rcall:outer": nv("layout(location = 0) callableDataInNV uint c;\nlayout(location = 1) callableDataNV uint d;\n" +
                          kind.decl + "void main() {\n    d = 0u;\n" + body(12, 64 + 2 * n, "    executeCallableNV(1, 1);\n") + "}\n",
                          scene=False, extensions=kind.ext),
        "rcall:inner": nv("layout(location = 0) callableDataInNV uint c;\nvoid main() { c += 1u; }\n", scene=False),
    }
    case(f"live-values/{kind.name}", stages, [
        expect(f"local {kind.name} in raygen survives a trace", 64, kind.expected(3)),
        expect(f"local {kind.name} in closest-hit survives a nested trace", 64 + n, kind.expected(7)),
        expect(f"local {kind.name} in a callable survives a nested callable", 64 + 2 * n, kind.expected(12)),
    ], section="design 2 Live values", scene=ONE_TRIANGLE, recursion=2, words=64 + 3 * n + 16, callable_depth=2)

# What a function gives back through its parameters, in modules of both forms: where live values lie in memory
# (address mode), such an argument is a copy.
case("live-values/out-parameters", {
    "rgen": nv(P + "void cut(uint v, out uint low, out uvec3 high) { low = v & 15u; high = uvec3(v >> 4u); }\n" + f"""void main() {{
    uint sum = 0u;
    p = 0u;
    for (uint i = 0u; i < 3u; ++i) {{
        uint low;
        uvec3 high;
        cut(gl_LaunchIDNV.x + 0x125u + i, low, high);
        traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0);
        sum += low * 100u + high.y;
    }}
    r[0] = sum; r[1] = p;
}}
"""),
    "rmiss": MISS,
    "rchit": nv(IN + "void main() { p += 10u; }\n", scene=False)},
     [expect("out parameters survive a trace", 0, [(5 + 6 + 7) * 100 + 3 * 18, 30])],
     section="design 2 Live values", scene=ONE_TRIANGLE)

# Private (module-scope) variables: one copy per shader call, initialisers run at every entry.
case("live-values/private-globals", {
    "rgen": nv(P + "uint g = 5u;\nuint h[3] = uint[3](1u, 2u, 3u);\nvoid bump() { g += 1u; h[g % 3u] += g; }\n" + f"""void main() {{
    p = 0u;
    bump();
    traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0);
    bump();
    r[0] = g; r[1] = h[0]; r[2] = h[1]; r[3] = h[2]; r[4] = p;
}}
"""),
    "rmiss": MISS,
    "rchit": nv(IN + Q + "uint g = 100u;\nuint depth;\n" + f"""void main() {{
    g += p + 1u;
    depth = p;
    if (p < 3u) {{
        q = p + 1u;
        traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 1);
        p = g * 1000u + q % 1000u + depth;
    }} else {{
        p = g;
    }}
}}
"""),
}, [expect("module-scope variables of raygen survive a trace", 0, [7, 1 + 6, 2 + 7, 3]),
    expect("every recursion level has its own initialised module-scope variables", 4,
           [(lambda f: f(f, 0))(lambda f, d: 100 + d + 1 if d == 3 else (100 + d + 1) * 1000 + f(f, d + 1) % 1000 + d)])],
     section="semantics 2.2 globals", scene=ONE_TRIANGLE, recursion=5)

# Pointers are re-derived, not stored: an array indexed by a value computed before the trace.
case("live-values/indices-and-access-chains", {
    "rgen": nv(P + "layout(set = 0, binding = 2) buffer In { uvec4 data[]; } in_[2];\n" + f"""void main() {{
    uint a[8];
    for (uint i = 0u; i < 8u; ++i) a[i] = i * i;
    uint k = in_[1].data[1].z;
    p = 0u;
    traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0);
    a[k] += 1000u;
    r[0] = a[k]; r[1] = a[k - 1u]; r[2] = in_[1].data[k].x;
    for (uint i = 0u; i < 8u; ++i) {{ traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0); a[i] += p; }}
    r[3] = a[0]; r[4] = a[7];
}}
"""), "rmiss": MISS,
    "rchit": nv(IN + "void main() { p += 2u; }\n", scene=False),
}, [expect("a dynamic index survives a trace", 0, [1009, 4, 12]),
    expect("an array written between traces in a loop", 3, [0 + 4, 49 + 18])],
     section="design 2", scene=ONE_TRIANGLE,
     bindings={"0.2": {"elements": [{"u32": list(range(32))}, {"u32": list(range(4)) + [4, 5, 3, 7] + list(range(8, 32))}]}})

# Many live values at once.
names = [f"v{i}" for i in range(40)]
case("live-values/forty-scalars", {
    "rgen": nv(P + "void main() {\n" + "".join(f"    float v{i} = float(r[60]) + {i}.25;\n" for i in range(40)) +
               f"    p = 0u;\n    traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0);\n" +
               "".join(f"    r[{64 + i}] = floatBitsToUint(v{i});\n" for i in range(40)) + "}\n"),
    "rmiss": MISS,
    "rchit": nv(IN + Q + "void main() {\n" + "".join(f"    uint v{i} = r[61] + {i * 7}u;\n" for i in range(40)) +
                f"    traceNV(scene, 0, 0, 0, 0, 0, {RAY}, 1);\n" +
                "".join(f"    r[{104 + i}] = v{i};\n" for i in range(40)) + "}\n"),
}, [expect("forty scalars live across a trace in raygen", 64, [3 + i + 0.25 for i in range(40)], "f32"),
    expect("forty scalars live across a nested trace", 104, [9 + 7 * i for i in range(40)])],
     section="design 2", scene=ONE_TRIANGLE, recursion=2, words=160,
     bindings={"0.1": [{"skip": 240}, {"u32": [3, 9, 0, 0]}, {"skip": 384}]})
