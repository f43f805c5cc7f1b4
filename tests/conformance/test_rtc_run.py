#!/usr/bin/env python3
"""rtc-run itself: what it says about bad input, and that a wrong result is seen as one.   test_rtc_run.py RTC-RUN"""
import json
import os
import struct
import subprocess
import sys
import tempfile
import unittest

PROGRAM = sys.argv.pop(1)
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
HELLO = [os.path.join(ROOT, "testdata/shaders/run/hello." + s) for s in ("rgen", "rchit", "rmiss")]
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.dont_write_bytecode = True
import suite


def run(*arguments):
    done = subprocess.run([PROGRAM, "--device", "llvmpipe", *arguments], capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


class RtcRun(unittest.TestCase):
    def fails(self, text, *arguments):
        code, said = run(*arguments)
        self.assertEqual(code, 1, said)  # an error, not a crash
        self.assertIn(text, said)

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def file(self, name, content):
        path = os.path.join(self.folder.name, name)
        with open(path, "wb") as out:
            out.write(content if isinstance(content, bytes) else content.encode())
        return path

    def test_bad_command_lines(self):
        self.fails("no stages")
        self.fails("cannot read", "nowhere.rgen")
        self.fails("cannot tell the stage", self.file("a.glsl", "void main() {}"))
        self.fails("SET.BINDING", *HELLO, "--bind", "x=u32:1")
        self.fails("no shader uses", *HELLO, "--bind", "7.7=u32:1")
        self.fails("NAME=VALUE", *HELLO, "--bind", "0.1")
        self.fails("WIDTHxHEIGHT", *HELLO, "--size", "wide")
        self.fails("is khr or nv", *HELLO, "--native", "dxr")
        for size in ("0x5", "-3", "5x5x5x5", "5x", "x5", "99999999999"):
            self.fails("WIDTHxHEIGHT", *HELLO, "--size=" + size)
        self.fails("no stage has a specialisation constant 'foo'", *HELLO, "--spec", "foo=1")
        self.fails("outputs are written as", *HELLO, "-o", "out.tiff")
        self.fails("No such file or directory", *HELLO, "-o", "/nowhere/out.png")
        self.fails("maxImageDimension2D", *HELLO, "--size", "999999x2")
        self.fails("rtc-run: error: ", *HELLO, "--repeat", "often")
        self.fails("no such assumption: flat", *HELLO, "--assume", "flat")
        self.fails("unknown image pattern", *HELLO, "--bind", "0.1=pattern:nothing")

    def test_bad_shaders(self):
        self.fails("undeclared identifier", self.file("a.rgen", "#version 460\n#extension GL_NV_ray_tracing : require\nvoid main() { x x; }"))
        self.fails("not a SPIR-V module", self.file("a.spv", b"\x03\x02\x23\x07\x00"))
        self.fails("truncated SPIR-V", self.file("b.spv", (0x07230203).to_bytes(4, "little") + bytes(16) + b"\x11\x00\xff\x00"))
        self.fails("no ray tracing entry point", self.file("c.spv", (0x07230203).to_bytes(4, "little") + bytes(16)))

    def test_bad_scenes(self):
        for scene, text in (('{"meshes": [{"boxes": [1, 2]}]}', "six numbers"), ('{"mehses": []}', "unknown key"),
                            ('{"meshes": [{"triangles": [1]}]}', "nine numbers"),
                            ('{"meshes": [], "instances": [{"mesh": "x"}]}', "there is no mesh"),
                            ('{"meshes": [{"vertices": [0,0,0], "indices": [0,0,9]}]}', "past the last vertex"),
                            ('{"meshes": [\n  {"boxes": 1, ]}', "s.json:2:16: "), ("{", "s.json:1:2: ")):
            self.fails(text, *HELLO, "--scene", self.file("s.json", scene))

    def test_bad_json_is_named_with_its_place(self):
        bad = self.file("bad.json", '{\n  // a comment\n  "stages": [\n    nonsense ]\n}')
        self.fails("bad.json:4:6: ", "--case", bad)
        self.fails("bad.json:4:6: ", *HELLO, "--table", "@" + bad)
        self.fails("key 'stages' not found", "--case", self.file("empty.json", "{}"))
        code, said = run("--case", bad)
        self.assertNotIn("json.exception", said)

    def test_native_ray_tracing_that_is_not_there(self):
        self.fails("VK_NV_ray_tracing", *HELLO, "--native", "nv")

    def case(self, value, **more):
        return self.file("case.json", json.dumps({
            "stages": [{"stage": "rgen", "source": suite.nv("void main() { r[0] = 5u; }\n", scene=False)}],
            "bindings": {"0.1": {"size": 64}}, "expect": [{"cell": "five", "at": 0, "values": [value]}], **more}))

    def test_a_right_result_passes_and_a_wrong_one_fails(self):
        code, said = run("--case", self.case(5))
        self.assertEqual(code, 0, said)
        self.assertIn("pass five", said)
        code, said = run("--case", self.case(6))
        self.assertEqual(code, 1, said)
        self.assertIn("FAIL five: value 0: 5, expected 6", said)
        self.case(6)
        code, said = run("--suite", self.folder.name, "--on", "rtc-nv,rtc-ext")
        self.assertEqual(code, 1, said)
        self.assertIn("0 passed, 2 failed", said)

    def test_shards_and_the_time_limit_of_a_suite(self):
        for i in range(3):
            os.rename(self.case(5), os.path.join(self.folder.name, f"case{i}.json"))
        ran = 0
        for shard in range(4):  # more shards than cases
            report = self.file("report.out", "")
            code, said = run("--suite", self.folder.name, "--on", "rtc-nv", "--shard", f"{shard}/4", "--json", report)
            self.assertEqual(code, 0, said)
            with open(report) as file:
                ran += len(json.load(file))
        self.assertEqual(ran, 3)
        self.fails("INDEX/COUNT", "--suite", self.folder.name, "--shard", "4/4")
        code, said = run("--suite", self.folder.name, "--on", "rtc-nv", "--limit", "0.000001")
        self.assertEqual(code, 0, said)
        self.assertIn("3 skipped", said)

    def test_outputs(self):
        path = os.path.join(self.folder.name, "out.json")
        code, said = run("--case", self.case(5), "-o", "0.1=" + path)
        self.assertEqual(code, 0, said)
        with open(path) as file:
            self.assertEqual(json.load(file)["r"][:2], [5, 0])
        self.fails("is a buffer", "--case", self.case(5), "-o", os.path.join(self.folder.name, "out.png"))
        self.fails("unknown key", "--case", self.case(5, colour="red"))

    def test_specialisation_and_statistics(self):
        """What is known may be left out; the outputs stay the same, and broken promises are told."""
        size = {}
        for name, options in {"known": [], "open": ["--no-specialize"], "promised": ["--assume=single-level"]}.items():
            module = os.path.join(self.folder.name, name + ".spv")
            code, said = run(*HELLO, "--size", "8x8", "--statistics", "--save-module", module, *options)
            self.assertEqual(code, 0, said)
            self.assertRegex(said, r"rtc: pipeline \d")
            self.assertRegex(said, r"rtc: (this driver tells no statistics of pipelines|.* \d)")
            size[name] = os.path.getsize(module)
        self.assertLess(size["known"], size["open"])
        self.assertLess(size["promised"], size["open"])

    def test_pictures_and_scene_files(self):
        """Every kind of output from one run, over a scene of a file."""
        obj = self.file("größe ü.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        paths = [os.path.join(self.folder.name, "out." + kind) for kind in ("png", "exr", "pfm", "bin", "json")]
        outputs = [word for path in paths for word in ("-o", path)]
        code, said = run(*HELLO, "--scene", obj, "--size", "8x4", *outputs)
        self.assertEqual(code, 0, said)
        self.assertRegex(said, r"(?m)^device: ")
        heads = []
        for path in paths:
            with open(path, "rb") as file:
                heads.append(file.read(4))
        self.assertEqual(heads[:2], [b"\x89PNG", b"\x76\x2f\x31\x01"])
        self.assertEqual(heads[2][:2], b"PF")
        self.assertEqual(os.path.getsize(paths[3]) % 32, 0)  # 8 x 4 texels
        with open(paths[4]) as file:
            self.assertEqual(len(json.load(file)) % 32, 0)

    def test_values_from_files(self):
        """Images of every kind, buffers, push constants and shader records, all filled from files."""
        def floats(name, *values):
            return self.file(name, struct.pack(f"{len(values)}f", *values))

        def picture(name, *texels):  # one row
            return self.file(name, b"PF\n%d 1\n-1.0\n" % len(texels) + b"".join(struct.pack("3f", *t) for t in texels))

        shader = self.file("files.rgen", FILES)
        faces = [picture(f"face{i}.pfm", (i, 0.5, 0.25)) for i in range(6)]
        slices = [picture(f"slice{i}.pfm", (i, 1, 2), (i + 8, 3, 4)) for i in range(4)]
        out = os.path.join(self.folder.name, "out.json")
        given = {"0.0": {"file": picture("row.pfm", (1, 2, 3), (4, 5, 6)), "format": "rgba32f"},
                 "0.1": {"files": slices, "format": "rgba32f"}, "0.2": {"files": faces, "format": "rgba32f"},
                 "0.3": {"files": slices[1:3], "format": "rgba32f"},
                 "0.4": {"file": self.file("raw.bin", bytes(range(2 * 2 * 2))), "size": [2, 2, 2], "format": "r8ui"},
                 "0.5": {"file": floats("uniform.bin", 1.5, 2.5)}, "0.6": {"size": 4 * 64}}
        binds = [word for slot, value in given.items() for word in ("--bind", slot + "=" + json.dumps(value))]
        arguments = ["--size", "1x1", "--push", "file:" + floats("push.bin", 3.5, 4.5), *binds, "--table",
                     json.dumps({"raygen": [{"group": "files.rgen", "data": {"file": floats("record.bin", 5.5, 6.5)}}]})]
        code, said = run(shader, *arguments, "-o", "0.6=" + out)
        self.assertEqual(code, 0, said)
        with open(out) as file:
            found = json.load(file)["r"]
        self.assertEqual(found[:18], [4, 5, 3, 10, 0, 3, 5, 2, 9, 1, 0, 7, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5])
        for slot, value, text in (("0.2", {"files": faces[:5]}, "six faces"), ("0.0", {"files": slices}, "one layer"),
                                  ("0.3", {"files": [slices[0], given["0.0"]["file"] + "x"]}, "row.pfmx"),
                                  ("0.3", {"files": [slices[0], faces[0]]}, "1x1, but"), ("0.3", {"files": []}, "a list"),
                                  ("0.4", {"file": self.file("short.bin", b"abc"), "size": [2, 2, 2], "format": "r8ui"}, "8 bytes, 3"),
                                  ("0.4", {"file": self.file("short.bin", b"abc")}, "how many texels")):
            self.fails(text, shader, *arguments, "--bind", slot + "=" + json.dumps(value))
        self.fails("more bytes than the shaders declare", shader, *arguments[:2], "--push", "file:" + shader)

    def test_ten_times_the_loop_iterations_lavapipe_has(self):
        """lavapipe 22.3 gives the loops of a group 65 535 iterations; these shaders need more than ten times that."""
        shaders = [self.file("long.rgen", LONG), self.file("long.rchit", LONG_HIT), self.file("long.rmiss", LONG_MISS)]
        scene = self.file("s.json", '{"meshes": [{"triangles": [0,0,0, 1,0,0, 0,1,0]}], "instances": [{"mesh": 0}]}')
        bind = ["--scene", scene, "--size", "16x1", "--bind", "0.1=" + json.dumps({"size": 4 * 32})]
        path = os.path.join(self.folder.name, "out.json")
        code, said = run(*shaders, *bind, "--rounds", "512", "-o", "0.1=" + path)
        self.assertEqual(code, 0, said)
        with open(path) as file:
            found = json.load(file)["r"]
        for lane in range(16):
            x = lane
            for _ in range(LOOP):
                x = (x * 1664525 + 1013904223) & 0xffffffff
            total = 0
            for i in range(TRACES):
                total = (total * 3 + (7 if (i + lane) & 1 else 1)) & 0xffffffff
            self.assertEqual(found[2 * lane:2 * lane + 2], [x, total], lane)

    def test_too_few_rounds_are_an_error_that_says_so(self):
        shaders = [self.file("long.rgen", LONG), self.file("long.rchit", LONG_HIT), self.file("long.rmiss", LONG_MISS)]
        self.fails("--rounds allows more", *shaders, "--size", "16x1", "--bind", "0.1=" + json.dumps({"size": 128}),
                   "--rounds", "4", "--resumable", "1", "--step-budget", "4096")


FILES = """#version 460
#extension GL_NV_ray_tracing : require
layout(set = 0, binding = 0) uniform sampler2D row;
layout(set = 0, binding = 1) uniform sampler3D volume;
layout(set = 0, binding = 2) uniform samplerCube cube;
layout(set = 0, binding = 3) uniform sampler2DArray layers;
layout(set = 0, binding = 4) uniform usampler3D raw;
layout(set = 0, binding = 5) uniform Uniform { vec2 u; };
layout(set = 0, binding = 6, std430) buffer Result { float r[]; };
layout(push_constant) uniform Push { vec2 p; };
layout(shaderRecordNV) buffer Record { vec2 s; };
void main() {
    vec4 a = texelFetch(row, ivec2(1, 0), 0), b = texelFetch(volume, ivec3(1, 0, 2), 0);
    r[0] = a.x; r[1] = a.y;
    r[2] = b.y; r[3] = b.x; r[4] = texelFetch(volume, ivec3(0), 0).x;
    r[5] = textureLod(cube, vec3(0, -1, 0), 0.0).x; r[6] = textureLod(cube, vec3(0, 0, -1), 0.0).x;
    r[7] = texelFetch(layers, ivec3(0, 0, 1), 0).x; r[8] = texelFetch(layers, ivec3(1, 0, 0), 0).x;
    r[9] = float(textureSize(row, 0).y); r[10] = float(texelFetch(raw, ivec3(0), 0).x); r[11] = float(texelFetch(raw, ivec3(1), 0).x);
    r[12] = u.x; r[13] = u.y; r[14] = p.x; r[15] = p.y; r[16] = s.x; r[17] = s.y;
}
"""

LOOP, TRACES = 700_000, 20_000
LONG = f"""#version 460
#extension GL_NV_ray_tracing : require
layout(set = 0, binding = 0) uniform accelerationStructureNV scene;
layout(set = 0, binding = 1, std430) buffer Result {{ uint r[]; }};
layout(location = 0) rayPayloadNV uint payload;
void main() {{
    uint lane = gl_LaunchIDNV.x, x = lane, total = 0u;
    for (uint i = 0u; i < {LOOP}u; ++i) x = x * 1664525u + 1013904223u;
    for (uint i = 0u; i < {TRACES}u; ++i) {{
        float side = ((i + lane) & 1u) != 0u ? 40.0 : 0.25;
        traceNV(scene, 0u, 0xffu, 0u, 0u, 0u, vec3(side, 0.25, 1.0), 0.0, vec3(0.0, 0.0, -1.0), 10.0, 0);
        total = total * 3u + payload;
    }}
    r[2u * lane] = x;
    r[2u * lane + 1u] = total;
}}
"""
LONG_HIT = """#version 460
#extension GL_NV_ray_tracing : require
layout(location = 0) rayPayloadInNV uint payload;
void main() { payload = 1u; }
"""
LONG_MISS = LONG_HIT.replace("1u", "7u")

unittest.main()
