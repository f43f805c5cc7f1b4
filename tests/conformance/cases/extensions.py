"""What only EXT has: primitive culling, the cull mask built-in, mixed dialects; subgroups; many shaders."""
from suite import *

P = "layout(location = 0) rayPayloadEXT uint p;\n"
IN = "layout(location = 0) rayPayloadInEXT uint p;\n"
NV_IN = "layout(location = 0) rayPayloadInNV uint p;\n"
HIT = ext(IN + "void main() { p = 10u + uint(gl_PrimitiveID); }\n", scene=False)
MISS = ext(IN + "void main() { p = 9u; }\n", scene=False)
MIXED = {"meshes": [{"name": "b", "boxes": [box(0, 0, 1, 2)]}, {"name": "t", "triangles": [triangle(500), triangle(5)]}],
         "instances": [{"mesh": "b", "offset": 1}, {"mesh": "t", "offset": 0}]}
GROUPS = [{"name": "a", "closest": "rchit"}, {"name": "b", "closest": "boxes", "intersection": "rint"}]
CULLING = ("GL_EXT_ray_flags_primitive_culling",)
lanes = [("none", "0u", 20), ("SkipTriangles", "gl_RayFlagsSkipTrianglesEXT", 20), ("SkipAABBs", "gl_RayFlagsSkipAABBEXT", 11)]
case("flags/primitive-culling", {
    "rgen": ext("#extension GL_EXT_ray_flags_primitive_culling : require\n" + P + "void main() {\n" + "".join(
        f"    p = 0u; traceRayEXT(scene, {flag}, 0xff, 0, 0, 0, {RAY}, 0); r[{i}] = p;\n" for i, (_, flag, _) in enumerate(lanes)) +
        f"    p = 0u; traceRayEXT(scene, gl_RayFlagsSkipTrianglesEXT, 0xff, 0, 0, 0, vec3(1.0, 1.0, 4.0), 0.0, vec3(0.0, 0.0, 1.0), 100.0, 0); r[3] = p;\n}}\n"),
    "rmiss": MISS, "rchit": HIT, "rchit:boxes": ext(IN + "void main() { p = 20u; }\n", scene=False),
    "rint": ext("void main() { reportIntersectionEXT(4.5, 0u); }\n", scene=False)},
     [expect(f"primitive culling: {name}", i, [value]) for i, (name, _, value) in enumerate(lanes)] +
     [expect("SkipTriangles with only triangles ahead", 3, [9])], section="semantics 2.3 Ray flags", scene=MIXED, groups=GROUPS,
     skip={"native": "needs the capability on the device; rtc is what is tested"})
case("builtins/cull-mask-ext", {
    "rgen": ext(P + f"void main() {{ p = 0u; traceRayEXT(scene, 0, 0xABCD35, 0, 0, 0, {RAY}, 0); traceRayEXT(scene, 0, 0xABCD00, 0, 0, 0, {RAY}, 0); }}\n"),
    "rchit": ext("#extension GL_EXT_ray_cull_mask : require\n" + IN + "void main() { r[0] = gl_CullMaskEXT; }\n", scene=False),
    "rmiss": ext("#extension GL_EXT_ray_cull_mask : require\n" + IN + "void main() { r[1] = gl_CullMaskEXT; }\n", scene=False)},
     [expect("CullMask in rchit: the low 8 bits", 0, [0x35]), expect("CullMask in rmiss", 1, [0])], section="semantics 2.3 CullMask",
     scene=ONE_TRIANGLE, skip={"native": "VK_KHR_ray_tracing_maintenance1 is not enabled by the executor"})

# One pipeline in two dialects: a raygen in NV, hit stages in EXT. rtc only: native extensions do not mix.
case("payloads/mixed-dialects", {
    "rgen": nv(f"layout(location = 2) rayPayloadNV uint p;\nvoid main() {{ p = 3u; traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 2); r[0] = p; traceNV(scene, 0, 0, 0, 0, 0, {RAY}, 2); r[1] = p; }}\n"),
    "rchit": ext(IN + f"layout(location = 1) rayPayloadEXT uint q;\nvoid main() {{ q = p; traceRayEXT(scene, 0, 0, 0, 0, 0, {RAY}, 1); p = p * 100u + q; }}\n"),
    "rmiss": nv(NV_IN + "void main() { p += 1u; }\n", scene=False),
    "rahit": ext("void main() { if (gl_PrimitiveID == 0) ignoreIntersectionEXT; }\n", scene=False)},
     [expect("NV raygen, EXT closest-hit, NV miss in one pipeline", 0, [304, 305])], section="issue 3",
     scene={"meshes": [{"name": "t", "triangles": [triangle(0.5), triangle(1)]}]}, recursion=2, only=["rtc-nv"],
     groups=[{"name": "h", "closest": "rchit", "any": "rahit"}])

# Subgroup built-ins are within their bounds in every stage, also after a trace.
SUB = ("GL_KHR_shader_subgroup_basic",)
CHECK = "uint(gl_SubgroupSize >= 1u && gl_SubgroupInvocationID < gl_SubgroupSize)"
case("builtins/subgroup", {
    "rgen": nv(f"layout(location = 0) rayPayloadNV uint p;\nvoid main() {{ p = 0u; traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0); r[0] = {CHECK}; traceNV(scene, 0, 0, 0, 0, 0, {RAY}, 0); }}\n", extensions=SUB),
    "rchit": nv(NV_IN + f"void main() {{ r[1] = {CHECK}; p = 0u; }}\n", scene=False, extensions=SUB),
    "rmiss": nv(NV_IN + f"void main() {{ r[2] = {CHECK}; p = 0u; }}\n", scene=False, extensions=SUB)},
     [expect(f"SubgroupSize and SubgroupInvocationID in {s}", i, [1]) for i, s in enumerate(("rgen", "rchit", "rmiss"))],
     section="semantics 2.3", scene=ONE_TRIANGLE)

# Many shaders in one pipeline; 300 of them in the long tier.
for count, group in ((48, "tables"), (300, "long")):
    stages = {"rgen": nv(f"""layout(location = 0) rayPayloadNV uint p;
void main() {{
    uint s = 0u;
    for (uint i = 0u; i < {count}u; ++i) {{ p = i; traceNV(scene, 0, 0xff, i % 16u, 0, 0, vec3(float(i / 16u) * 10.0 + 1.0, 1.0, -3.0), 0.0, vec3(0.0, 0.0, 1.0), 100.0, 0); s = s * 3u + p; r[i] = p; }}
    r[{count}] = s;
}}
""")}
    for i in range(count):
        stages[f"rchit:hit{i}"] = nv(NV_IN + f"void main() {{ p = p * {i + 2}u + {i * 7 % 13}u; }}\n", scene=False)
    stages["rmiss"] = nv(NV_IN + "void main() { p = 0u; }\n", scene=False)
    values = [i * (i + 2) + i * 7 % 13 for i in range(count)]
    total = 0
    for v in values:
        total = (total * 3 + v) & 0xFFFFFFFF
    case(f"{group}/{count}-closest-hits", stages, [expect(f"each of {count} closest-hit shaders runs where its record says", 0, values + [total])],
         section="issue 3", words=count + 64, table={"hit": [f"hit{i}" for i in range(count)]},
         scene={"meshes": [{"name": "t", "triangles": [triangle(1)]}],
                "instances": [{"mesh": "t", "offset": 16 * k, "transform": [1, 0, 0, 10 * k, 0, 1, 0, 0, 0, 0, 1, 0]} for k in range((count + 15) // 16)]})
