"""Resources pass through untouched: every descriptor type, arrays, push constants, 64-bit, atomics, several scenes."""
from suite import *

P = "layout(location = 0) rayPayloadNV uint p;\n"
IN = "layout(location = 0) rayPayloadInNV uint p;\n"
MISS = nv(IN + "void main() { p = 9u; }\n", scene=False)
TRACE = f"traceNV(scene, 0, 0xff, 0, 0, 0, {RAY}, 0);"


def in_stage(name, decl, reads, bindings, expects, extensions=(), stages=("rgen", "rchit", "rmiss"), scene=None, **more):
    """The same reads in each stage, after a trace in raygen; `reads` are GLSL uints."""
    n = len(reads)
    dump = lambda at: "".join(f"    r[{at + i}] = {e};\n" for i, e in enumerate(reads))
    mine = lambda s: decl if s in stages else ""
    case(f"resources/{name}", {
        "rgen": nv(P + mine("rgen") + f"void main() {{\n    p = 0u;\n    {TRACE}\n    {TRACE.replace('0xff', '0x0')}\n" +
                   (dump(0) if "rgen" in stages else "") + "}\n", extensions=extensions),
        "rchit": nv(IN + mine("rchit") + "void main() {\n" + (dump(n) if "rchit" in stages else "") + "    p = 1u;\n}\n", scene=False,
                    extensions=extensions),
        "rmiss": nv(IN + mine("rmiss") + "void main() {\n" + (dump(2 * n) if "rmiss" in stages else "") + "    p = 2u;\n}\n", scene=False,
                    extensions=extensions)},
         [expect(f"{name} in {s}", i * n, expects) for i, s in enumerate(("rgen", "rchit", "rmiss")) if s in stages],
         section="issue 3 Resources", scene=scene or ONE_TRIANGLE, bindings=bindings, **more)


in_stage("uniform-buffer", "layout(set = 1, binding = 2) uniform B { vec3 a; float b; mat3 m; ivec2 c[2]; } u;\n",
         ["floatBitsToUint(u.a.z)", "floatBitsToUint(u.b)", "floatBitsToUint(u.m[2].y)", "uint(u.c[1].x)"],
         {"1.2": {"a": [1, 2, 3], "b": 4, "m": [[1, 2, 3], [4, 5, 6], [7, 8, 9]], "c": [[1, 2], [-3, 4]]}},
         [bits(3.0), bits(4.0), bits(8.0), 0xFFFFFFFD])
in_stage("storage-buffer-array", "layout(set = 0, binding = 4) readonly buffer B { uint v[]; } b[3];\n",
         ["b[0].v[1]", "b[2].v[0]", "b[1].v[3]"],
         {"0.4": {"elements": [{"u32": [1, 2, 3, 4]}, {"u32": [5, 6, 7, 8]}, {"u32": [9, 10, 11, 12]}]}}, [2, 9, 8])
in_stage("push-constants", "layout(push_constant) uniform C { layout(offset = 16) vec2 a; uint b; } c;\n",
         ["floatBitsToUint(c.a.y)", "c.b"], {}, [bits(2.5), 77], push={"a": [1.5, 2.5], "b": 77})
in_stage("storage-image", "layout(set = 0, binding = 3, rgba32f) uniform image2D i;\n",
         ["floatBitsToUint(imageLoad(i, ivec2(1, 0)).y)", "uint(imageSize(i).x)"],
         {"0.3": {"values": [1, 2, 3, 4, 5, 6, 7, 8], "size": [2, 1]}}, [bits(6.0), 2])
in_stage("image-uint", "layout(set = 0, binding = 3, r32ui) uniform uimage3D i;\n",
         ["imageLoad(i, ivec3(1, 0, 1)).x"], {"0.3": {"values": [1, 2, 3, 4], "size": [2, 1, 2]}}, [4])
in_stage("sampler-2d", "layout(set = 0, binding = 3) uniform sampler2D s;\n",
         ["floatBitsToUint(texture(s, vec2(0.75, 0.25)).x)", "floatBitsToUint(texelFetch(s, ivec2(0, 1), 0).x)"],
         {"0.3": {"values": [1, 2, 3, 4], "size": [2, 2], "format": "r32f", "filter": "nearest"}}, [bits(2.0), bits(3.0)])
in_stage("sampler-3d", "layout(set = 0, binding = 3) uniform sampler3D s;\n",
         ["floatBitsToUint(texture(s, vec3(0.25, 0.5, 0.75)).x)"],
         {"0.3": {"values": [1, 2, 3, 4], "size": [2, 1, 2], "format": "r32f", "filter": "nearest"}}, [bits(3.0)])
in_stage("sampler-2d-array", "layout(set = 0, binding = 3) uniform sampler2DArray s;\n",
         ["floatBitsToUint(texture(s, vec3(0.5, 0.5, 2.0)).x)"],
         {"0.3": {"values": [1, 2, 3, 4], "size": [1, 1], "layers": 4, "format": "r32f", "filter": "nearest"}}, [bits(3.0)])
in_stage("sampler-cube", "layout(set = 0, binding = 3) uniform samplerCube s;\n",
         ["floatBitsToUint(texture(s, vec3(0, 0, -1)).x)", "floatBitsToUint(texture(s, vec3(0, 1, 0)).x)"],
         {"0.3": {"values": [1, 2, 3, 4, 5, 6], "size": [1, 1], "format": "r32f", "filter": "nearest"}}, [bits(6.0), bits(3.0)])
in_stage("separate-sampler", "layout(set = 0, binding = 3) uniform texture2D t;\nlayout(set = 0, binding = 5) uniform sampler s;\n",
         ["floatBitsToUint(texture(sampler2D(t, s), vec2(0.75, 0.5)).x)"],
         {"0.3": {"values": [1, 2], "size": [2, 1], "format": "r32f"}, "0.5": {"filter": "nearest"}}, [bits(2.0)])
in_stage("sampler-array", "layout(set = 0, binding = 3) uniform sampler2D s[2];\n",
         ["floatBitsToUint(texture(s[1], vec2(0.5)).x)", "floatBitsToUint(texture(s[0], vec2(0.5)).x)"],
         {"0.3": {"elements": [{"values": [3], "size": [1, 1], "format": "r32f"}, {"values": [5], "size": [1, 1], "format": "r32f"}]}},
         [bits(5.0), bits(3.0)])
in_stage("uniform-texel-buffer", "layout(set = 0, binding = 3) uniform usamplerBuffer t;\n",
         ["texelFetch(t, 1).w", "texelFetch(t, 0).x"], {"0.3": {"u32": [1, 2, 3, 4, 5, 6, 7, 8]}}, [8, 1])
in_stage("storage-texel-buffer", "layout(set = 0, binding = 3, r32ui) uniform uimageBuffer t;\n",
         ["imageLoad(t, 2).x"], {"0.3": {"u32": [1, 2, 30, 4]}}, [30])
in_stage("buffer-reference", "layout(buffer_reference) buffer Node;\nlayout(buffer_reference, std430) buffer Node { uint v; Node next; };\n"
         "layout(set = 0, binding = 2) readonly buffer A { Node head; } a_;\nlayout(set = 0, binding = 3) readonly buffer L { uint v; } l_;\n"
         "layout(set = 0, binding = 4) readonly buffer T { uint v; } t_;\n",
         ["a_.head.v", "a_.head.next.v", "l_.v", "t_.v"],
         {"0.2": [{"address": "0.3"}], "0.3": [{"u32": [5, 0]}, {"address": "0.4"}], "0.4": {"u32": [6, 0, 0, 0]}},
         [5, 6, 5, 6], extensions=("GL_EXT_buffer_reference",))

# Atomics count every invocation once, in every stage.
case("resources/atomics", {
    "rgen": nv(P + f"void main() {{ p = 0u; {TRACE} atomicAdd(r[0], 1u); {TRACE.replace('0xff', '0')} }}\n"),
    "rchit": nv(IN + "void main() { atomicAdd(r[1], 2u); atomicMax(r[2], gl_LaunchIDNV.x); }\n", scene=False),
    "rmiss": nv(IN + "void main() { atomicAdd(r[3], 1u); }\n", scene=False),
    "rahit": nv("void main() { atomicAdd(r[4], 1u); }\n", scene=False)},
     [expect("atomics in raygen", 0, [96]), expect("atomics in closest-hit", 1, [192, 95]), expect("atomics in miss", 3, [96]),
      expect("atomics in any-hit", 4, [96])], section="issue 3", size=(96, 1, 1), groups=[{"name": "h", "closest": "rchit", "any": "rahit"}],
     scene={"meshes": [{"name": "t", "triangles": [triangle(1)], "geometry-flags": ["no-duplicate-any-hit"]}]},
     bindings={"0.1": {"size": 256, "fill": 0}})

# Memory written before a trace is seen after it, and by the stages in between.
case("resources/memory-order", {
    "rgen": nv(P + f"void main() {{ r[0] = 5u; p = 0u; {TRACE} r[2] = r[0] + r[1]; }}\n"),
    "rchit": nv(IN + "void main() { r[1] = r[0] * 10u; r[0] = 7u; }\n", scene=False), "rmiss": MISS},
     [expect("buffer writes keep their order across a trace", 0, [7, 50, 57],
             native="Vulkan orders memory between shader calls for payloads only, others need barriers; program order is rtc's own promise")],
     section="Vulkan, Shader Call Order", scene=ONE_TRIANGLE)

# Several scenes in one pipeline: arrays, dynamic index, different bindings, as function arguments.
TOPS = {"meshes": [{"name": "near", "triangles": [triangle(1)]}, {"name": "mid", "triangles": [triangle(5)]}, {"name": "far", "triangles": [triangle(9)]}],
        "tops": {"a": [{"mesh": "near"}], "b": [{"mesh": "mid"}], "c": [{"mesh": "far"}]}}
HIT_T = nv(IN + "void main() { p = uint(gl_HitTNV); }\n", scene=False)
case("resources/scene-array", {
    "rgen": nv("layout(set = 0, binding = 0) uniform accelerationStructureNV scenes[3];\nlayout(set = 1, binding = 0) uniform accelerationStructureNV other;\n" + P +
               f"""void main() {{
    for (int i = 0; i < 3; ++i) {{ p = 0u; traceNV(scenes[i], 0, 0xff, 0, 0, 0, {RAY}, 0); r[i] = p; }}
    p = 0u; traceNV(other, 0, 0xff, 0, 0, 0, {RAY}, 0); r[3] = p;
}}
""", scene=False), "rchit": HIT_T, "rmiss": MISS},
     [expect("an array of scenes, dynamically indexed", 0, [4, 8, 12]), expect("a second scene binding", 3, [8])], section="issue 3 AS as data",
     scene=TOPS, bindings={"0.0": {"elements": [{"scene": "a"}, {"scene": "b"}, {"scene": "c"}]}, "1.0": {"scene": "b"}})
case("resources/scene-divergent-index", {
    "rgen": ext("#extension GL_EXT_nonuniform_qualifier : require\nlayout(set = 0, binding = 0) uniform accelerationStructureEXT scenes[3];\n" + to_ext(P) +
                f"""void main() {{
    p = 0u;
    traceRayEXT(scenes[nonuniformEXT(gl_LaunchIDEXT.x % 3u)], 0, 0xff, 0, 0, 0, {RAY}, 0);
    r[gl_LaunchIDEXT.x] = p;
}}
""", scene=False), "rchit": to_ext(HIT_T), "rmiss": to_ext(MISS)},
     [expect("scenes indexed differently in each lane", 0, [(4, 8, 12)[i % 3] for i in range(12)])], section="issue 3 AS as data", size=(12, 1, 1),
     scene=TOPS, bindings={"0.0": {"elements": [{"scene": "a"}, {"scene": "b"}, {"scene": "c"}]}})
case("resources/null-scene", {
    "rgen": nv("layout(set = 0, binding = 0) uniform accelerationStructureNV scenes[2];\n" + P +
               f"void main() {{ for (int i = 0; i < 2; ++i) {{ p = 0u; traceNV(scenes[i], 0, 0xff, 0, 0, 0, {RAY}, 0); r[i] = p; }} }}\n", scene=False),
    "rchit": HIT_T, "rmiss": MISS},
     [expect("a null acceleration structure is a miss", 0, [9]), expect("beside one that is not", 1, [8])], section="issue 3", only=["rtc"],
     scene=TOPS, bindings={"0.0": {"elements": [{"scene": None}, {"scene": "b"}]}})
case("resources/empty-scene", {"rgen": nv(P + f"void main() {{ p = 0u; {TRACE} r[0] = p; }}\n"), "rchit": HIT_T, "rmiss": MISS},
     [expect("a top level without instances is a miss", 0, [9])], section="issue 4", scene={"meshes": [], "instances": []})

# Records as resource tables.
case("resources/record-indices", {
    "rgen": nv(P + "void main() { for (uint i = 0u; i < 3u; ++i) { p = 0u; traceNV(scene, 0, 0xff, 0, 0, 0, vec3(1.0 + 10.0 * float(i), 1.0, -3.0), 0.0, vec3(0.0, 0.0, 1.0), 100.0, 0); r[i] = p; } }\n"),
    "rchit": nv(IN + "layout(set = 0, binding = 3) uniform sampler2D textures[3];\nlayout(shaderRecordNV) buffer R { uint texture_index; uint bias; };\n"
                "void main() { p = uint(texture(textures[nonuniformEXT(texture_index)], vec2(0.5)).x) + bias; }\n", scene=False,
                extensions=("GL_EXT_nonuniform_qualifier",)), "rmiss": MISS},
     [expect("records that hold texture indices", 0, [130, 210, 320])], section="seed: records as resource tables",
     scene={"meshes": [{"name": "t", "triangles": [triangle(1)]}],
            "instances": [{"mesh": "t", "offset": i, "transform": [1, 0, 0, 10 * i, 0, 1, 0, 0, 0, 0, 1, 0]} for i in range(3)]},
     table={"hit": [{"group": "rchit", "data": {"texture_index": t, "bias": b}} for t, b in ((2, 100), (0, 200), (1, 300))]},
     bindings={"0.3": {"elements": [{"values": [v], "size": [1, 1], "format": "r32f"} for v in (10, 20, 30)]}})
case("resources/record-buffer-reference", {
    "rgen": nv(P + f"layout(set = 0, binding = 2) readonly buffer A {{ uint a; }} a_;\nvoid main() {{ for (uint i = 0u; i < 2u; ++i) {{ p = a_.a * 0u; traceNV(scene, 0, 0xff, i, 0, 0, {RAY}, 0); r[i] = p; }} }}\n"),
    "rchit": nv(IN + "layout(buffer_reference, std430) readonly buffer Data { uint v[4]; };\nlayout(shaderRecordNV) buffer R { Data data; uint index; };\n"
                "void main() { p = data.v[index]; }\n", scene=False, extensions=("GL_EXT_buffer_reference",)), "rmiss": MISS},
     [expect("records that hold buffer pointers", 0, [12, 13])], section="seed: records as resource tables", scene=ONE_TRIANGLE,
     table={"hit": [{"group": "rchit", "data": [{"address": "0.2"}, {"u32": [k, 0]}]} for k in (2, 3)]},
     bindings={"0.2": {"u32": [10, 11, 12, 13]}})

# Memory barriers, ordered atomics and coherent accesses in lanes that meet nowhere: some end, some trace, some loop.
SCOPES = "GL_KHR_memory_scope_semantics"
ORDERS = {
    "memory-barriers": ("", (), "a[lane] = lane + 1u; memoryBarrier();", "memoryBarrierBuffer(); a[lane] += 10u; memoryBarrierImage();"),
    "ordered-atomics": ("", (SCOPES,), "a[lane] = lane; uint old = atomicAdd(a[lane], 1u, gl_ScopeDevice, gl_StorageSemanticsBuffer, gl_SemanticsAcquireRelease);",
                        "uint old = atomicAdd(a[lane], 10u, gl_ScopeDevice, gl_StorageSemanticsBuffer, gl_SemanticsAcquireRelease);"),
    "scoped-barriers": ("", (SCOPES,), "a[lane] = lane + 1u; memoryBarrier(gl_ScopeDevice, gl_StorageSemanticsBuffer | gl_StorageSemanticsImage, gl_SemanticsAcquireRelease);",
                        "memoryBarrier(gl_ScopeSubgroup, gl_StorageSemanticsBuffer, gl_SemanticsAcquireRelease); a[lane] += 10u;"),
    "coherent-vulkan-model": ("devicecoherent ", (SCOPES,), "a[lane] = lane + 1u;", "a[lane] = a[lane] + 10u;"),
}
# Vulkan, Memory Model, "Shader Call Order": what a callee wrote is the caller's to see for certain where both accesses
# are coherent for shader calls; device coherence contains that.
KEPT = "lavapipe 25.0.7 keeps what the ray generation shader stored before the trace"
NATIVE = {"memory-barriers": KEPT + ", as it may: nothing here is coherent for shader calls",
          "scoped-barriers": KEPT + ", as it may: nothing here is coherent for shader calls",
          "coherent-vulkan-model": KEPT + ", although the buffer is device coherent"}
for name, (qualifier, extensions, before, inside) in ORDERS.items():
    pragma = "#pragma use_vulkan_memory_model\n" if "vulkan" in name else ""
    declared = pragma + f"layout(set = 0, binding = 2) {qualifier}buffer A {{ uint a[]; }};\n"
    case(f"resources/{name}", {
        "rgen": nv(P + declared + f"""void main() {{
    uint lane = gl_LaunchIDNV.x;
    if (lane % 5u == 4u) return;
    {before}
    for (uint i = 0u; i < lane % 3u; ++i) {{
        p = lane;
        traceNV(scene, 0, i == 0u ? 0xffu : 0u, 0, 0, 0, {RAY}, 0);
    }}
    r[lane] = a[lane];
}}
""", extensions=extensions),
        "rchit": nv(IN + declared + f"void main() {{ uint lane = p; {inside} }}\n", scene=False, extensions=extensions),
        "rmiss": nv(IN + declared + "void main() { a[p] += 100u; }\n", scene=False, extensions=extensions)},
         [expect(f"{name.replace('-', ' ')} in lanes that end, trace or loop", 0,
                 [UNTOUCHED if lane % 5 == 4 else lane + 1 + (0, 10, 110)[lane % 3] for lane in range(40)],
                 native=NATIVE.get(name))],
         section="issue 3 Memory scopes", scene=ONE_TRIANGLE, size=(40, 1, 1), bindings={"0.2": {"u32": [0] * 40}})
