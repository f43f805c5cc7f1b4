"""Position fetch (SPV_KHR_ray_tracing_position_fetch), as SPIR-V: Debian's glslang does not know the extension.

Vulkan, HitTriangleVertexPositionsKHR: the object space vertices of the triangle at the current intersection, in the
order the application gave them, after the geometry's transform (here by powers of two, so that it is exact).
"""
from suite import *

P = "layout(location = 0) rayPayloadEXT uint p;\n"
IN = "layout(location = 0) rayPayloadInEXT uint p;\n"
READS, NESTED, CANDIDATES = ({"assembly": f"positions{name}.spvasm", "version": "spv1.5"}
                             for name in (".rchit", "-nested.rchit", ".rahit"))
MISS = ext(IN + "void main() { p += 1000u; }\n", scene=False)
# Object space is moved by (1, 0.5, 0.25) and scaled by two in z: positions are not those of the world.
PLACED = [1, 0, 0, 1, 0, 1, 0, 0.5, 0, 0, 2, 0.25]
# What lavapipe 25.0.7 gives instead; these cases are the smallest that show it.
UNTRANSFORMED = "lavapipe 25.0.7 gives the vertices before the geometry's transform"
SHARED = dict(section="Vulkan HitTriangleVertexPositionsKHR", only=["ext"])


def tri(z, x=-2.0, size=8.0):
    return [x, x + 0.25, z, x + size, x, z + 0.125, x - 0.5, x + size, z + 0.5]


def words(*triangles):
    return [bits(v) for t in triangles for v in t]


def moved(t, m):
    return [sum(m[4 * row + k] * t[3 * v + k] for k in range(3)) + m[4 * row + 3] for v in range(3) for row in range(3)]


def raygen(count, y="1.0"):
    """One ray downwards for each x = 0, 10, 20 ...; the payload is where the hit shader writes."""
    return ext(P + f"""void main() {{
    p = 0u;
    for (uint i = 0u; i < {count}u; ++i)
        traceRayEXT(scene, 0, 0xff, 0, 1, 0, vec3(float(i) * 10.0 + 1.0, {y}, -30.0), 0.0, vec3(0.0, 0.0, 1.0), 100.0, 0);
    r[60] = p;
}}
""")


def mesh(name, *geometries, **more):
    return {"name": name, "geometries": list(geometries), "flags": ["fast-trace", "allow-data-access"], **more}


def geometry(*triangles, transform=None, opaque=False):
    out = {"triangles": [list(t) for t in triangles]}
    if transform:
        out["transform"] = transform
    if opaque:
        out["flags"] = ["opaque"]
    return out


# ---- closest-hit ----
near, far, other = tri(1.0), tri(4.0), tri(2.0, size=9.0)
SCALED = [2, 0, 0, -0.5, 0, 0.5, 0, 0.25, 0, 0, 4, 1]
case("positions/closest-hit", {"rgen": raygen(2), "rchit": READS, "rmiss": MISS},
     [expect("vertices of the closest of several triangles, in object space", 0, words(near)),
      expect("of another instance of other transform", 9, words(other), native="lavapipe 25.0.7 gives the second geometry's first triangle"), expect("both were hits", 60, [18])],
     scene={"meshes": [mesh("a", geometry(far, near, tri(3.0))), mesh("b", geometry(tri(7.0)), geometry(tri(6.0), other))],
            "instances": [{"mesh": "a", "transform": PLACED},
                          {"mesh": "b", "transform": [1, 0, 0, 11, 0, 1, 0, 0, 0, 0, 1, 3]}]},
     table={"hit": ["rchit", "rchit"]}, **SHARED)
case("positions/geometry-transform", {"rgen": raygen(1), "rchit": READS, "rmiss": MISS},
     [expect("after the geometry's transform, before the instance's", 0, words(moved(near, SCALED)), native=UNTRANSFORMED)],
     scene={"meshes": [mesh("a", geometry(tri(50.0)), geometry(near, transform=SCALED))], "instances": [{"mesh": "a", "transform": PLACED}]},
     table={"hit": ["rchit", "rchit"]}, **SHARED)
indexed = [[9.0, 9.0, 9.0], near[6:9], near[0:3], near[3:6]]
case("positions/indexed", {"rgen": raygen(1), "rchit": READS, "rmiss": MISS},
     [expect("an indexed triangle's vertices in the order of its indices", 0, words(near[3:6] + near[6:9] + near[0:3]))],
     scene={"meshes": [mesh("a", {"vertices": indexed, "indices": [3, 1, 2]})]}, **SHARED)
many = [tri(1.0 + i, x=-2.0 - 0.125 * i, size=16.0) for i in range(23)]
order = [(i * 7 + 3) % 23 for i in range(23)]
case("positions/of-many", {
    "rgen": ext(P + """void main() {
    p = gl_LaunchIDEXT.x * 9u;
    traceRayEXT(scene, 0, 0xff, 0, 0, 0, vec3(1.0, 1.0, 40.0 - float(gl_LaunchIDEXT.x)), 0.0, vec3(0.0, 0.0, -1.0), 100.0, 0);
    r[8u * 9u + gl_LaunchIDEXT.x] = p;
}
"""), "rchit": READS, "rmiss": MISS},
     [expect(f"each lane its own triangle of {len(many)}: lane {i}", 9 * i, words(many[22])) for i in (0, 7)] +
     [expect("all were hits", 72, [9 * i + 9 for i in range(8)])],
     size=(8, 1, 1), words=128, scene={"meshes": [mesh("a", geometry(*[many[i] for i in order]))]}, **SHARED)
case("positions/after-refit", {"rgen": raygen(1), "rchit": READS, "rmiss": MISS},
     [expect("the updated vertices", 0, words(tri(2.5, size=10.0))), expect("one hit", 60, [9])],
     scene={"meshes": [mesh("a", geometry(tri(5.0), tri(2.5, size=10.0)), **{"built-from": [geometry(near, far)]})]}, **SHARED)
below = tri(30.0, x=-3.0, size=12.0)
case("positions/after-nested-trace", {"rgen": raygen(1), "rchit": NESTED, "rchit:leaf": READS, "rmiss": MISS},
     [expect("a shader's own hit, read behind a nested trace to another triangle", 0, words(near)),
      expect("read before it", 9, words(near)[3:6]), expect("what the nested closest-hit returns", 12, [27]),
      expect("the nested closest-hit's own", 18, words(below))],
     scene={"meshes": [mesh("a", geometry(near, below))]}, table={"hit": ["rchit", "leaf"]}, recursion=2, **SHARED)

# ---- any-hit ----
first, second, third = tri(1.0), tri(3.0), tri(-0.5, size=9.0)  # the third moved: in front of both
case("positions/any-hit", {"rgen": raygen(1), "rchit": READS, "rahit": CANDIDATES, "rmiss": MISS},
     [expect("the vertices of an ignored candidate", 64, words(first)), expect("of an accepted one", 64 + 9, words(second)),
      expect("of an ignored candidate of the second geometry", 64 + 18, words(moved(third, SCALED)),
             native=UNTRANSFORMED),
      expect("the closest-hit shader's are those of the accepted one", 0, words(second)), expect("one hit", 60, [9])],
     scene={"meshes": [mesh("a", geometry(first, second), geometry(third, transform=SCALED))], "instances": [{"mesh": "a", "transform": PLACED}]},
     words=128, table={"hit": ["h", "h"]}, groups=[{"name": "h", "closest": "rchit", "any": "rahit"}], **SHARED)
case("positions/opaque-behind-any-hit", {"rgen": raygen(1), "rchit": READS, "rahit": CANDIDATES, "rmiss": MISS},
     [expect("a committed opaque triangle behind an ignored candidate", 0, words(second)), expect("the candidate's", 64, words(first))],
     scene={"meshes": [mesh("a", geometry(first)), mesh("b", geometry(second, opaque=True))],
            "instances": [{"mesh": "a"}, {"mesh": "b"}]},
     words=128, table={"hit": ["h", "h"]}, groups=[{"name": "h", "closest": "rchit", "any": "rahit"}], **SHARED)

# ---- boxes beside triangles ----
case("positions/beside-boxes", {
    "rgen": raygen(2), "rchit": READS, "rchit:box": ext(IN + "void main() { p += 100u; }\n", scene=False),
    "rint": ext("void main() { reportIntersectionEXT(gl_InstanceCustomIndexEXT == 7 ? 5.0 : 60.0, 0u); }\n", scene=False), "rmiss": MISS},
     [expect("a triangle in front of a reported hit", 0, words(near)), expect("a reported hit in front of a triangle", 60, [109])],
     scene={"meshes": [mesh("a", geometry(near)), {"name": "b", "boxes": [box(-2, -2, -30, 60, size=9.0)]}],
            "instances": [{"mesh": "a"}, {"mesh": "b", "offset": 1}, {"mesh": "a", "transform": [1, 0, 0, 10, 0, 1, 0, 0, 0, 0, 1, 0]},
                          {"mesh": "b", "offset": 1, "custom": 7, "transform": [1, 0, 0, 10, 0, 1, 0, 0, 0, 0, 1, 0]}]},
     table={"hit": ["t", "b"]}, groups=[{"name": "t", "closest": "rchit"}, {"name": "b", "closest": "box", "intersection": "rint"}], **SHARED)
