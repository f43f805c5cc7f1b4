#!/usr/bin/env python3
"""The programs as their users meet them: files they write, and what they say about mistakes.

    test_programs.py RTC-RENDER RTC-INFO [OTHER-PROGRAM...]
"""
import json
import os
import pty
import re
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

RENDER, INFO, *OTHERS = sys.argv[1:]
del sys.argv[1:]
SMALL = ["--integrator", "primary", "--width", "16", "--height", "12", "--samples", "1"]


def run(program, *arguments, **environment):
    done = subprocess.run([program, *arguments], capture_output=True, text=True, env={**os.environ, **environment},
                          stdin=subprocess.DEVNULL)
    return done.returncode, done.stdout, done.stderr


def png_size_and_rows(path):
    with open(path, "rb") as file:
        data = file.read()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, pixels = 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        if kind == b"IHDR":
            size = struct.unpack(">II", data[at + 8:at + 16])
        if kind == b"IDAT":
            pixels += data[at + 8:at + 8 + length]
        at += 12 + length
    return size, zlib.decompress(pixels)


class Programs(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name, content=None):
        path = os.path.join(self.folder.name, name)
        if content is not None:
            with open(path, "wb") as out:
                out.write(content)
        return path

    def fails(self, text, *arguments, program=RENDER, **environment):
        code, said, problem = run(program, *arguments, **environment)
        self.assertEqual(code, 1, problem)  # an error, not a crash
        self.assertIn(os.path.basename(program) + ": error: ", problem)
        self.assertIn(text, problem)
        return said

    def test_pictures_of_each_kind(self):
        for extension in ("png", "exr", "pfm"):
            path = self.path("größe ü." + extension)
            code, said, problem = run(RENDER, *SMALL, "-o", path)
            self.assertEqual(code, 0, problem)
            self.assertRegex(said, r"(?m)^device: .*Vulkan 1\.")
            self.assertRegex(said, r"Mrays/s")
            self.assertIn("wrote " + path, said)
            self.assertGreater(os.path.getsize(path), 100)
        size, rows = png_size_and_rows(self.path("größe ü.png"))
        self.assertEqual(size, (16, 12))
        self.assertGreater(len(set(rows)), 10)
        with open(self.path("größe ü.pfm"), "rb") as file:
            self.assertEqual([file.readline() for _ in range(2)], [b"PF\n", b"16 12\n"])
        with open(self.path("größe ü.exr"), "rb") as file:
            self.assertEqual(file.read(4), b"\x76\x2f\x31\x01")

    def test_a_terminal_sees_progress(self):
        try:
            ours, theirs = pty.openpty()
        except OSError as reason:
            self.skipTest(f"this machine gives no terminal: {reason}")
        drawing = subprocess.Popen([RENDER, *SMALL[:-1], "20", "-o", self.path("a.png")],
                                   stdout=theirs, stdin=subprocess.DEVNULL)
        os.close(theirs)
        said = b""
        try:
            while piece := os.read(ours, 65536):
                said += piece
        except OSError:  # Linux's way of saying that the other end is closed
            pass
        os.close(ours)
        self.assertEqual(drawing.wait(), 0)
        self.assertRegex(said.decode(), r"\rtracing \[#+\.*\] +\d+ %  \d+\.\d\d Mrays/s")
        self.assertRegex(said.decode(), r"\[#{30}\] 100 %")

    def test_scene_files(self):
        obj = self.path("a b.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        code, said, problem = run(RENDER, "--scene", obj, *SMALL, "-o", self.path("a.png"))
        self.assertEqual(code, 0, problem)
        self.assertIn("1 triangles", said)
        for name, content in (("junk.gltf", b"\0\1\2\xff"), ("cut.gltf", b"{"), ("empty.glb", b""), ("empty.obj", b""),
                              ("a.txt", b"x")):
            self.fails("", "--scene", self.path(name, content), *SMALL, "-o", self.path("a.png"))
        self.fails("nowhere.gltf", "--scene", "nowhere.gltf", *SMALL, "-o", self.path("a.png"))
        self.fails("there are: bunny cornell", "--scene", "builtin:foo", *SMALL, "-o", self.path("a.png"))
        self.fails("scenes are .gltf", "--scene", self.folder.name, *SMALL, "-o", self.path("a.png"))

    def test_every_program_says_what_it_runs_on(self):
        shaders = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../testdata/shaders/run/hello.")
        with open(self.path("case.json"), "w") as out:
            json.dump({"name": "nothing/nothing", "stages": [{"stage": "rgen", "name": "rgen", "source": [
                "#version 460", "#extension GL_NV_ray_tracing : require",
                "layout(set = 0, binding = 1) buffer Out { uint r[]; };", "void main() { r[0] = 7u; }"]}],
                       "size": [1, 1, 1], "bindings": {"0.1": {"size": 256, "fill": 0}},
                       "expect": [{"cell": "runs", "at": 0, "values": [7], "type": "u32"}]}, out)
        work = {
            "rtc-render": [[*SMALL, "-o", self.path("a.png")]],
            "rtc-run": [[*(shaders + stage for stage in ("rgen", "rchit", "rmiss")), "--size", "4x4",
                         "-o", self.path("b.png")]],
            "rtc-conformance": [["--cases", self.folder.name, "--on", "rtc-nv"]],
            "rtc-stress": [["--steps", "1", "--seeds", "1", "--max-primitives", "100"]],
            "rtc-bench": [["compile", "--shaders", "1", "--repeat", "1", "--driver"],
                          ["build", "--sizes", "1000", "--modes", "fast", "--instances", "0", "--repeats", "1",
                           "--native", "none"],
                          ["trace", "--scenes", "cornell", "--workloads", "primary", "--width", "16", "--repeats", "1",
                           "--native", "none"]],
            "rtc-accuracy": [["leaks", "--tier", "fast", "--rays", "64", "--beyond", "0", "--seconds", "1"]],
        }
        for program in (RENDER, *OTHERS):
            for arguments in work[os.path.basename(program)]:
                with self.subTest(program=program, arguments=arguments[:1]):
                    device = "0"
                    for _ in range(2):  # by its number, then by the name that was printed
                        code, said, problem = run(program, *arguments, "--device", device)
                        self.assertEqual(code, 0, said + problem)
                        # (rtc-accuracy says it above its table.)
                        line = r"(?m)^(?:device:|### .* on) (\S+) .*Vulkan 1\."
                        self.assertRegex(said + problem, line)
                        device = re.search(line, said + problem).group(1)

    def test_mistakes_are_told_before_the_work(self):
        out = ["-o", self.path("a.png")]
        for text, arguments in (("is needed", []), ("written as .png", ["-o", "a.bmp"]),
                                ("No such file or directory", ["-o", "/nowhere/a.png"]),
                                ("it is a folder", ["-o", self.path("folder.png")]),
                                ("there are: path reflections", ["--integrator", "bidir", *out]),
                                ("--width", ["--width", "-5", *out]), ("between 1 and 16384", ["--width", "0", *out]),
                                ("--samples", ["--samples", "0", *out]), ("--fov", ["--fov", "400", *SMALL, *out]),
                                ("--fov", ["--fov", "nan", *SMALL, *out]), ("--exposure", ["--exposure", "nan", *SMALL, *out]),
                                ("same point", ["--eye", "0", "0", "0", "--target", "0", "0", "0", *out]),
                                ("there are:\n  0: ", ["--device", "no such device", *out]),
                                ("there are:\n  0: ", ["--device", "77", *out]),
                                ("--compare needs --native", ["--compare"]), ("--classify needs", ["--classify", *out]),
                                ("cannot read", ["--shaders", "/nowhere", *out]),
                                ("1 module(s) were given", ["--module", "nowhere.spv", *out]),
                                ("--addressing", ["--addressing", "page", *out]),
                                ("--help lists", ["--colour", "red", *out])):
            os.makedirs(self.path("folder.png"), exist_ok=True)
            with self.subTest(arguments=arguments):
                self.assertNotIn("tracing", self.fails(text, *arguments))
                self.assertFalse(os.path.exists(self.path("a.png")), "a picture was drawn")

    def test_heap_and_addresses_draw_the_same(self):
        pictures = []
        for addressing in ("heap", "address"):
            path = self.path(addressing + ".pfm")
            code, said, problem = run(RENDER, "--integrator", "ao", *SMALL[2:], "--addressing", addressing, "-o", path,
                                      "--save-modules", self.path(addressing), RTC_VALIDATION="1")
            if "has no bufferDeviceAddress" in problem:
                self.skipTest(problem)
            self.assertEqual(code, 0, problem)
            with open(path, "rb") as file:
                pictures.append(file.read())
        self.assertEqual(*pictures)
        # A module brings its addressing with it.
        modules = [os.path.join(self.path("address"), name) for name in os.listdir(self.path("address"))]
        self.assertEqual(len(modules), 1)
        code, said, problem = run(RENDER, "--integrator", "ao", *SMALL[2:], "--module", modules[0], "-o", self.path("m.pfm"))
        self.assertEqual(code, 0, problem)
        with open(self.path("m.pfm"), "rb") as file:
            self.assertEqual(file.read(), pictures[0])

    def test_native_ray_tracing_that_is_not_there(self):
        code, said, problem = run(RENDER, *SMALL, "--native", "nv", "-o", self.path("a.png"))
        if code == 0:
            self.skipTest("the device has VK_NV_ray_tracing")
        self.assertIn("lacks VK_NV_ray_tracing", problem)

    def test_no_driver_at_all(self):
        for program, arguments in ((RENDER, [*SMALL, "-o", self.path("a.png")]), (INFO, [])):
            self.fails("no Vulkan driver found", *arguments, program=program, VK_DRIVER_FILES="/nowhere",
                       VK_ICD_FILENAMES="/nowhere")

    def test_unknown_words_are_told_by_every_program(self):
        for program in (RENDER, INFO, *OTHERS):
            with self.subTest(program=program):
                self.fails("", "--colour", "red", program=program)
                code, said, problem = run(program, "--help")
                self.assertEqual((code, problem), (0, ""))
                self.assertIn("Usage: ", said)

    def test_info(self):
        code, said, problem = run(INFO, "--device", "0")
        self.assertEqual(code, 0, problem)
        for text in ("device 0: ", "rtc runs:", "mode:", "recommended:", "limits:", "float arithmetic:"):
            self.assertIn(text, said)
        code, said, problem = run(INFO, "--json", "--no-probe")
        self.assertEqual(code, 0, problem)
        self.assertGreaterEqual(len(json.loads(said)), 1)
        for device in json.loads(said)["devices"]:
            cpu = "llvmpipe" in device["name"]
            self.assertEqual(device["recommended"]["addressing"],
                             "address" if device["buffer_device_address"] and not cpu else "heap")
        self.fails("there are:\n  0: ", "--device", "99", program=INFO)
        self.fails("extra", "extra", program=INFO)


unittest.main()
