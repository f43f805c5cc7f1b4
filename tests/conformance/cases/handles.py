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

# Acceleration structures made of device addresses, which address mode alone has.
EXT_IN = to_ext(IN)
ADDRESSES = {"0.2": [{"address": "0.0"}, {"u64": 0}]}
ADDRESSED = "layout(set = 0, binding = 2) readonly buffer Addresses { ADDRESS of[2]; };\n"


def addressed(name, look, expects, address="uint64_t", extension="GL_EXT_shader_explicit_arithmetic_types_int64", rchit=None,
              rmiss=None, scene=ONE_TRIANGLE, **more):
    """rgen: the scene's descriptor is read too, or no binding would tell its address."""
    head = ADDRESSED.replace("ADDRESS", address)
    case(f"resources/{name}", {
        # (A macro: glslang 12 hands such a value to a function by a pointer it is not.)
        "rgen": ext(head + to_ext(P) + "#define LOOK(s) p = 0u; traceRayEXT(s, 0, 0xff, 0, 0, 0, " + RAY + ", 0)\n"
                    "void main() {\n    LOOK(scene);\n    r[0] = p;\n    LOOK(" + look + ");\n    r[1] = p;\n}\n", extensions=(extension,)),
        "rchit": rchit or ext(EXT_IN + "void main() { p = 1u + uint(gl_HitTEXT); }\n", scene=False),
        "rmiss": rmiss or to_ext(MISS)}, expects, section="GLSL_EXT_ray_tracing, acceleration structures from addresses",
         scene=scene, bindings=ADDRESSES, addressing="address", **more)


LOOKS = "accelerationStructureEXT(of[0])"
addressed("scene-of-a-64-bit-address", LOOKS, [expect("a scene by descriptor", 0, [5]), expect("accelerationStructureEXT(uint64_t)", 1, [5])])
addressed("scene-of-two-32-bit-words", LOOKS, [expect("accelerationStructureEXT(uvec2)", 1, [5])], address="uvec2",
          extension="GL_EXT_ray_tracing")
addressed("scene-of-address-0", "accelerationStructureEXT(of[1])", [expect("address 0 is the null structure", 1, [9])])
addressed("scene-of-an-address-in-closest-hit", LOOKS, [expect("a closest-hit traces by address", 1, [105])], recursion=2,
          rchit=ext(ADDRESSED.replace("ADDRESS", "uint64_t") + EXT_IN + "layout(location = 1) rayPayloadEXT uint q;\n" + f"""void main() {{
    if (p == 77u) {{ p = 1u + uint(gl_HitTEXT); return; }}
    q = 77u;
    traceRayEXT(accelerationStructureEXT(of[0]), 0, 0xff, 0, 0, 0, {RAY}, 1);
    p = q + 25u * uint(gl_HitTEXT);
}}
""", scene=False, extensions=("GL_EXT_shader_explicit_arithmetic_types_int64",)))
addressed("scene-of-an-address-as-assumed", LOOKS, [expect("by descriptor, under assumptions", 0, [5]), expect("by address, under assumptions", 1, [5])],
          assume="opaque,triangles,no-masks,identity-transforms,no-instance-flags", 
          scene={"meshes": [{"name": "t", "triangles": [triangle(1)], "geometry-flags": ["opaque"]}]})
addressed("scene-of-an-address-not-as-assumed", LOOKS, [], assume="triangles", launch_error="assumption", only=["rtc"],
          scene={"meshes": [{"name": "b", "boxes": [box(0, 0, 1, 2)]}]})
