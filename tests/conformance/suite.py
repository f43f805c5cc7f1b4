"""What the case generators share: GLSL preambles, scenes, the writing of case files.

A case is written in NV spelling; rtc-run rewrites it as EXT for the EXT twin and for native
KHR. A case that needs something only EXT has starts from ext() and exists in EXT only.
Every expected value is computed here, by reasoning from the specification, never by running rtc.
"""
import json
import os
import struct
import subprocess

CASES = {}  # "group/name" -> case


def f32(x):
    """x rounded to float, as a Python number."""
    return struct.unpack("f", struct.pack("f", x))[0]


def bits(x):
    return struct.unpack("I", struct.pack("f", x))[0]


OUT = "layout(set = 0, binding = 1) buffer Out { uint r[]; };\n"
NV_HEAD = "#version 460\n#extension GL_NV_ray_tracing : require\n"
EXT_HEAD = "#version 460\n#extension GL_EXT_ray_tracing : require\n"
NV_SCENE = "layout(set = 0, binding = 0) uniform accelerationStructureNV scene;\n"
EXT_SCENE = "layout(set = 0, binding = 0) uniform accelerationStructureEXT scene;\n"


def nv(body, scene=True, extensions=(), out=True):
    head = NV_HEAD + "".join(f"#extension {e} : require\n" for e in extensions)
    return head + (NV_SCENE if scene else "") + (OUT if out else "") + body


def ext(body, scene=True, extensions=(), out=True):
    head = EXT_HEAD + "".join(f"#extension {e} : require\n" for e in extensions)
    return head + (EXT_SCENE if scene else "") + (OUT if out else "") + body


def to_ext(source):
    """Only for cases that mix dialects on purpose."""
    import re
    source = source.replace("GL_NV_ray_tracing", "GL_EXT_ray_tracing")
    source = re.sub(r"\btraceNV\b", "traceRayEXT", source)
    source = re.sub(r"\b(ignoreIntersection|terminateRay)NV\s*\(\s*\)", r"\1EXT", source)
    return re.sub(r"\b(gl_\w+?|rayPayload|rayPayloadIn|hitAttribute|callableData|callableDataIn|shaderRecord|"
                  r"accelerationStructure|reportIntersection|executeCallable)NV\b", r"\1EXT", source)


def expect(cell, at, values, type="u32", rel=0.0, abs=0.0, binding="0.1", native=None):
    """native: why a native driver is known to differ (the decision stands here, with its section)."""
    e = {"cell": cell, "at": at, "values": list(values) if values is not None else None, "type": type}
    if rel:
        e["rel"] = rel
    if abs:
        e["abs"] = abs
    if native:
        e["native"] = native
    if binding != "0.1":
        e["binding"] = binding
    if values is None:
        del e["values"]
    return e


def case(name, stages, expects, section="", scene=None, size=(1, 1, 1), words=64, **more):
    """stages: {"rgen": source, "rchit": source, "rchit:second": source, ...} in order; {"assembly": FILE} is SPIR-V of cases/,
    of the "version" given or spv1.3."""
    assert name not in CASES, name
    out = {"name": name, "section": section, "stages": [], "size": list(size)}
    for key, source in stages.items():
        stage, _, label = key.partition(":")
        entry = {"stage": stage, "name": label or stage}
        if isinstance(source, dict) and "assembly" in source:
            entry.update(source)
            entry["file"] = name.split("/")[-1] + ("-" + label if label else "") + "." + stage + ".spv"
        elif isinstance(source, dict):
            entry.update(source)
            entry["source"] = entry["source"].rstrip("\n").split("\n")
        else:
            entry["source"] = source.rstrip("\n").split("\n")
        out["stages"].append(entry)
    if scene is not None:
        out["scene"] = scene
    bindings = {"0.1": {"size": words * 4, "fill": 0xCDCDCDCD}}
    bindings.update(more.pop("bindings", {}))
    out["bindings"] = bindings
    out["expect"] = expects
    for key, value in more.items():
        out[key.replace("_", "-")] = value
    CASES[name] = out
    return out


UNTOUCHED = 0xCDCDCDCD

# A triangle that covers (0, 0) to (4, 0) to (0, 4) at depth z, hit at (1, 1) with weights (1/4, 1/4).
def triangle(z=1.0, x=0.0, y=0.0, size=4.0, flip=False):
    a, b, c = [x, y, z], [x + size, y, z], [x, y + size, z]
    return a + c + b if flip else a + b + c


def box(x, y, z0, z1, size=4.0):
    return [x, y, z0, x + size, y + size, z1]


ONE_TRIANGLE = {"meshes": [{"name": "t", "triangles": [triangle(1.0)]}]}
# Seen from (1, 1, -3) along +z, hits at z = 1: t = 4.
RAY = "vec3(1.0, 1.0, -3.0), 0.0, vec3(0.0, 0.0, 1.0), 100.0"


def write(folder):
    names = set()
    for name, content in CASES.items():
        path = os.path.join(folder, name + ".json")
        os.makedirs(os.path.dirname(path), exist_ok=True)
        for stage in content["stages"]:
            if "assembly" in stage:
                assembly = os.path.join(os.path.dirname(os.path.abspath(__file__)), "cases", stage.pop("assembly"))
                version = stage.pop("version", "spv1.3")
                subprocess.run(["spirv-as", "--preserve-numeric-ids", "--target-env", version, assembly, "-o",
                                os.path.join(os.path.dirname(path), stage["file"])], check=True)
        text = json.dumps(content, indent=1) + "\n"
        names.add(os.path.abspath(path))
        if not os.path.exists(path) or open(path).read() != text:
            with open(path, "w") as out:
                out.write(text)
    for root, _, files in os.walk(folder):  # cases that are no more
        for file in files:
            path = os.path.abspath(os.path.join(root, file))
            if file.endswith(".json") and path not in names:
                os.remove(path)
    return sum(len(c["expect"]) for c in CASES.values())
