"""Acceleration structures as data: parameters, arrays, several top levels in one pipeline and in one call chain."""
from suite import *

P = "layout(location = 0) rayPayloadNV uint p;\n"
IN = "layout(location = 0) rayPayloadInNV uint p;\n"
MISS = nv(IN + "void main() { p = 9u; }\n", scene=False)
HIT_T = nv(IN + "void main() { p = uint(gl_HitTNV); }\n", scene=False)
SCENES = "layout(set = 0, binding = 0) uniform accelerationStructureNV scenes[3];\n"
TOPS = {"meshes": [{"name": "near", "triangles": [triangle(1)]}, {"name": "mid", "triangles": [triangle(5)]}, {"name": "far", "triangles": [triangle(9)]}],
        "tops": {"a": [{"mesh": "near"}], "b": [{"mesh": "mid"}], "c": [{"mesh": "far"}]}}
BIND = {"0.0": {"elements": [{"scene": "a"}, {"scene": "b"}, {"scene": "c"}]}}
LOOK = f"uint look(accelerationStructureNV s) {{ p = 0u; traceNV(s, 0, 0xff, 0, 0, 0, {RAY}, 0); return p; }}\n"


def handles(name, rgen, expects, rchit=HIT_T, rmiss=MISS, **more):
    case(f"resources/{name}", {"rgen": rgen, "rchit": rchit, "rmiss": rmiss}, expects, section="issue 3 AS as data", scene=TOPS,
         bindings=BIND, **more)


handles("scene-as-parameter", nv(SCENES + P + LOOK + "void main() { r[0] = look(scenes[0]); r[1] = look(scenes[2]); }\n", scene=False),
        [expect("a scene passed to a function", 0, [4, 12])])
handles("scene-as-parameter-twice", nv(SCENES + P + LOOK + "uint both(accelerationStructureNV s, accelerationStructureNV t) { return look(s) * 100u + look(t); }\n"
                                       "void main() { r[0] = both(scenes[1], scenes[0]); r[1] = both(scenes[2], scenes[2]); }\n", scene=False),
        [expect("scenes passed on from function to function", 0, [804, 1212])])
handles("scene-element-as-parameter", nv(SCENES + P + LOOK + "void main() { for (int i = 2; i >= 0; --i) r[i] = look(scenes[i]); }\n", scene=False),
        [expect("an element of an array of scenes passed to a function in a loop", 0, [4, 8, 12])])
handles("scene-in-control-flow", nv(SCENES + P + LOOK + """void main() {
    uint x = gl_LaunchIDNV.x, s = 0u;
    for (uint i = 0u; i < 3u; ++i) {
        switch ((i + x) % 3u) { case 0u: s = s * 20u + look(scenes[0]); break; case 1u: s = s * 20u + look(scenes[1]); break; default: s = s * 20u + look(scenes[2]); }
    }
    r[x] = s;
}
""", scene=False), [expect("scenes chosen by control flow in each lane", 0, [(4 * 20 + 8) * 20 + 12, (8 * 20 + 12) * 20 + 4, (12 * 20 + 4) * 20 + 8])],
        size=(3, 1, 1))
# A closest-hit traces in another scene; its own ray's built-ins stay.
handles("scene-of-a-nested-trace", nv(SCENES + P + f"void main() {{ p = 0u; traceNV(scenes[0], 0, 0xff, 0, 0, 0, {RAY}, 0); r[0] = p; }}\n", scene=False),
        [expect("a closest-hit traces in another scene", 0, [412]), expect("its own ray's built-ins stay", 1, [bits(4.0), bits(-3.0)])],
        rchit=nv(SCENES + IN + "layout(location = 1) rayPayloadNV uint q;\n" + f"""void main() {{
    if (p == 77u) {{ p = uint(gl_HitTNV); return; }}
    q = 77u;
    traceNV(scenes[2], 0, 0xff, 0, 0, 0, {RAY}, 1);
    r[1] = floatBitsToUint(gl_HitTNV); r[2] = floatBitsToUint(gl_WorldRayOriginNV.z);
    p = uint(gl_HitTNV) * 100u + q;
}}
""", scene=False), recursion=2)
# EXT: an index that differs in each lane, in a closest-hit.
handles("scene-divergent-index-in-closest-hit",
        ext("#extension GL_EXT_nonuniform_qualifier : require\n" + to_ext(SCENES + P) +
            f"void main() {{ p = 100u + gl_LaunchIDEXT.x; traceRayEXT(scenes[0], 0, 0xff, 0, 0, 0, {RAY}, 0); r[gl_LaunchIDEXT.x] = p; }}\n", scene=False),
        [expect("scenes indexed differently in each lane of a closest-hit", 0, [(4, 8, 12)[i % 3] for i in range(9)])],
        rchit=ext("#extension GL_EXT_nonuniform_qualifier : require\n" + to_ext(SCENES + IN) + "layout(location = 1) rayPayloadEXT uint q;\n" + f"""void main() {{
    if (p < 100u) {{ p = uint(gl_HitTEXT); return; }}
    q = 0u;
    traceRayEXT(scenes[nonuniformEXT((p - 100u) % 3u)], 0, 0xff, 0, 0, 0, {RAY}, 1);
    p = q;
}}
""", scene=False), rmiss=to_ext(MISS), size=(9, 1, 1), recursion=2)
# The same bottom levels under two top levels.
case("resources/scenes-that-share-meshes", {
    "rgen": nv("layout(set = 0, binding = 0) uniform accelerationStructureNV scenes[2];\n" + P +
               f"void main() {{ for (int i = 0; i < 2; ++i) {{ p = 0u; traceNV(scenes[i], 0, 0xff, 0, 0, 0, {RAY}, 0); r[i] = p; }} }}\n", scene=False),
    "rchit": nv(IN + "void main() { p = uint(gl_InstanceCustomIndexNV) * 1000u + uint(gl_InstanceID) * 100u + uint(gl_HitTNV); }\n", scene=False),
    "rmiss": MISS},
     [expect("one mesh under two top levels: instance, custom index and transform are the top level's", 0, [5004, 6106])],
     section="issue 3 AS as data", bindings={"0.0": {"elements": [{"scene": "a"}, {"scene": "b"}]}},
     scene={"meshes": [{"name": "t", "triangles": [triangle(1)]}],
            "tops": {"a": [{"mesh": "t", "custom": 5}],
                     "b": [{"mesh": "t", "custom": 7, "mask": 0}, {"mesh": "t", "custom": 6, "transform": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 2]}]}})
