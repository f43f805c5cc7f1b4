#!/usr/bin/env python3
"""Random well-defined pipelines with their expected output.

  random_cases.py FOLDER FIRST_SEED COUNT [SIZE]      SIZE 1 (default) to 3: statements a shader; 0: small ones for CI

Each seed becomes a case file: ray generation, closest-hit, miss, any-hit, intersection and callable shaders made
of nested control flow, helper functions, traces, reports and callables at random places, live values of random
types, built-ins and records read at random places, also after nested traces. Every construct is built together
with its meaning in Python, so the expectation comes from interpreting the program here: integers wrap, floats
stay small multiples of 1/8, nothing depends on the driver. Two of three seeds are `rich`: two or more stages
trace, and one holds 30 or more variables alive across a trace.
"""
import json
import os
import random
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import suite
from random_types import EXTENSIONS, M, SCALARS, STRUCTS, TYPES

LANES = 8
MAX_CALLS = 3000    # stage invocations of one lane; programs that need more are drawn again
MAX_REPORTS = 60    # of one intersection shader: keeps every distance different


class TooLong(Exception):
    pass


class Break(Exception):
    pass


class Continue(Exception):
    pass


class Ignore(Exception):  # ends an any-hit shader
    pass


class Terminate(Exception):
    pass


class EndSearch(Exception):  # ends an intersection shader
    pass


HEAD = ("#version 460\n#extension GL_NV_ray_tracing : require\n" +
        "".join(f"#extension {e} : require\n" for e in EXTENSIONS) +
        "layout(set = 0, binding = 0) uniform accelerationStructureNV scene;\n"
        "layout(set = 0, binding = 1) buffer Out { uint r[]; };\n" + STRUCTS)
# Leaves of expressions that read a built-in: stage -> (GLSL, key of the frame's built-ins).
LAUNCH = ("gl_LaunchIDNV.x", "lane")
RAY = [("gl_IncomingRayFlagsNV", "flags"), ("uint(gl_RayTminNV * 64.0)", "tmin"),
       ("floatBitsToUint(gl_WorldRayOriginNV.z)", "origin")]
HIT = RAY + [("uint(gl_RayTmaxNV * 64.0)", "t"), ("uint(gl_InstanceCustomIndexNV)", "custom"), ("uint(gl_PrimitiveID)", "zero"),
             ("uint(gl_InstanceID)", "instance")]
BUILTINS = {"rgen": [LAUNCH], "rcall": [LAUNCH, ("gl_LaunchSizeNV.x", "lanes")],
            "rmiss": [LAUNCH, ("uint(gl_RayTmaxNV * 64.0)", "t")] + RAY,
            "rchit": [LAUNCH, ("gl_HitKindNV", "kind"), ("uint(gl_HitTNV * 64.0)", "t")] + HIT,
            "rahit": [LAUNCH, ("gl_HitKindNV", "kind"), ("uint(gl_HitTNV * 64.0)", "t")] + HIT,
            "rint": [LAUNCH] + HIT}


class Stage:
    """Builds one shader. Every emitting method returns (lines, run) where run(f) executes on a frame."""

    def __init__(self, rng, program, kind, name, values=None):
        self.rng, self.program, self.kind, self.name = rng, program, kind, name
        count = values or rng.randint(2, 9) // (1 if program.size else 2)
        # Small programs, for drivers that compile slowly: types of one word beyond the first few.
        self.types = [rng.choice(TYPES if program.size or i < 6 else SCALARS) for i in range(count)]
        self.traces = kind in ("rgen", "rchit", "rmiss") and (values or rng.random() < 0.7)
        self.payloads = rng.randint(1, 2) if self.traces else 0
        self.record = kind != "rgen" and rng.random() < 0.4
        self.local = rng.random() < 0.5  # variables of main instead of the module: no helper functions then
        self.functions, self.loop_id, self.sites = [], 0, 0
        self.budget = rng.randint(2, 5) * program.size if program.size else rng.randint(0, 2)  # statements

    # -- expressions: (text, eval(frame)) of a uint
    def expression(self, depth=0):
        rng = self.rng
        pick = rng.random()
        if depth > 2 or pick < 0.25:
            n = rng.choice([1, 2, 3, 5, 7, 13, 0x9E3779B9, 0x55, rng.randint(0, 1000)])
            return f"{n}u", lambda f: n
        if pick < 0.6:
            i = rng.randrange(len(self.types))
            t = self.types[i]
            return t.load(f"v{i}"), lambda f: t.value(f["v"][i])
        if pick < 0.66:
            return "x", lambda f: f["x"]
        if pick < 0.72:
            if self.record and rng.random() < 0.4:
                return "rec.k", lambda f: f["b"]["record"]
            if self.kind in ("rchit", "rahit") and rng.random() < 0.3:
                return "uint(at.x * 4.0 + at.y * 256.0 + 0.5)", lambda f: f["b"]["at"]
            text, key = rng.choice(BUILTINS[self.kind])
            return text, lambda f: f["b"][key]
        op = rng.choice("+*^&|-")
        (a, ea), (b, eb) = self.expression(depth + 1), self.expression(depth + 1)
        calc = {"+": lambda p, q: p + q, "*": lambda p, q: p * q, "^": lambda p, q: p ^ q, "&": lambda p, q: p & q,
                "|": lambda p, q: p | q, "-": lambda p, q: p - q}[op]
        return f"({a} {op} {b})", lambda f: calc(ea(f), eb(f)) & M

    def condition(self):
        (a, ea), k, j = self.expression(1), self.rng.choice([1, 2, 3, 4, 7]), self.rng.randint(0, 2)
        if self.rng.random() < 0.2:
            (b, eb) = self.expression(1)
            both = self.rng.random() < 0.5
            return (f"({a} & {k}u) > {j}u {'&&' if both else '||'} ({b} & 1u) != 0u",
                    lambda f: ((ea(f) & k) > j and bool(eb(f) & 1)) if both else ((ea(f) & k) > j or bool(eb(f) & 1)))
        return f"({a} & {k}u) > {j}u", lambda f: (ea(f) & k) > j

    # -- statements
    def assign(self):
        i = self.rng.randrange(len(self.types))
        t = self.types[i]
        e, ev = self.expression()

        def run(f):
            n = ev(f)
            f["v"][i] = t.change(f["v"][i], n)
        # The expression is evaluated once: a store may read the variable several times.
        return ["{ uint e = " + e + "; " + t.store(f"v{i}", "e") + " }"], run

    def trace(self):
        rng, program = self.rng, self.program
        self.sites += 1
        own = self.kind in ("rchit", "rmiss") and rng.random() < 0.2  # with the incoming payload
        loc = rng.randrange(self.payloads)
        variable = "p" if own else f"q{loc}"
        value, ev = self.expression()
        offset, eo = self.expression(1)
        keep, ek = self.expression(1)  # a value alive across the trace that no variable holds
        hits, misses = len(program.hits), len(program.misses)
        flags = rng.choice([0, 0, 0, 1, 2, 4, 5, 8, 12, 16, 64, 128])
        tmin, tmax = rng.choice([0, 0, 0.5]), rng.choice([100.0625, 100.0625, 50.0625, 3.0])
        i = rng.randrange(len(self.types))
        t = self.types[i]
        max_depth, guard = program.max_depth, self.kind != "rgen"
        text = ["{", f"    uint keep = {keep};", f"    {variable}.x = {value};", f"    {variable}.d = depth + 1u;",
                f"    traceNV(scene, {flags}, ({variable}.x >> 2) % {program.targets}u, ({offset}) % {hits}u, 0, ({offset}) % {misses}u, "
                f"vec3(1.0, 1.0, -3.0), {tmin}, vec3(0.0, 0.0, 1.0), {tmax}, {0 if own else loc + 1});",
                f"    uint e = {variable}.x ^ keep * 3u;", "    " + t.store(f"v{i}", "e"), "}"]

        def run(f):
            if guard and f["depth"] >= max_depth - 1:
                return
            k = ek(f)
            payload = f["p"] if own else f["q"][loc]
            payload["x"], payload["d"] = ev(f), f["depth"] + 1
            o = eo(f)
            program.trace(payload, (payload["x"] >> 2) % program.targets, o % hits, o % misses, flags, tmin, tmax)
            f["v"][i] = t.change(f["v"][i], payload["x"] ^ k * 3 & M)
        if guard:
            return [f"if (depth < {max_depth - 1}u) {{"] + ["    " + line for line in text] + ["}"], run
        return text, run

    def report(self):
        """A distance that no other report of this invocation has; attributes and kind with it."""
        value, ev = self.expression()
        i = self.rng.randrange(len(self.types))
        t = self.types[i]
        program = self.program

        def run(f):
            e, s = ev(f), f["s"]
            s["reports"] += 1
            if s["reports"] > MAX_REPORTS:
                raise TooLong()
            s["at"] = (e & 7) * 4 + s["reports"] * 256
            kind = e >> 3 & 63
            ok = program.report(f, ((e >> 9 & 15) * 64 + s["reports"]) / 8, kind, s["at"])
            f["v"][i] = t.change(f["v"][i], 21 + kind if ok else 5)
        return ["{ uint e = " + value + "; ++reports; at = vec2(float(e & 7u), float(reports)); uint k = (e >> 3) & 63u;",
                "    e = reportIntersectionNV(float(((e >> 9) & 15u) * 64u + reports) * 0.125, k) ? 21u + k : 5u;",
                "    " + t.store(f"v{i}", "e") + " }"], run

    def leave(self):
        """An end of an any-hit shader, after a payload write that stays."""
        value, ev = self.expression()
        c, ec = self.condition()
        word, end = self.rng.choice([("ignoreIntersection", Ignore), ("terminateRay", Terminate)])

        def run(f):
            f["p"]["x"] = ev(f)
            if ec(f):
                raise end()
        return [f"p.x = {value};", f"if ({c}) {word}NV();"], run

    def call(self):
        program = self.program
        count = len(program.callables)
        first = program.callables.index(self) + 1 if self.kind == "rcall" else 0  # only later ones: no cycles
        if first >= count:
            return self.assign()
        target = self.rng.randrange(first, count)
        value, ev = self.expression()
        i = self.rng.randrange(len(self.types))
        t = self.types[i]

        def run(f):
            f["c"]["x"] = ev(f)
            program.call(target, f["c"])
            f["v"][i] = t.change(f["v"][i], f["c"]["x"])
        return [f"c.x = {value};", f"executeCallableNV({target}u, 7);",
                "{ uint e = c.x; " + t.store(f"v{i}", "e") + " }"], run

    def block(self, depth, loop):
        parts = [self.statement(depth, loop) for _ in range(self.rng.randint(1, 2 + (self.program.size > 1)))]
        lines = [line for text, _ in parts for line in text]

        def run(f):
            for _, r in parts:
                r(f)
        return lines, run

    def statement(self, depth=0, loop=False):
        rng = self.rng
        self.budget -= 1
        pick = rng.random()
        if self.budget < 0 or depth > 3:
            return self.assign() if pick < 0.7 else self.leaf()
        if loop and pick < 0.08:
            c, ec = self.condition()
            word = rng.choice(["break", "continue"])

            def leave(f):
                if ec(f):
                    raise (Break if word == "break" else Continue)()
            return [f"if ({c}) {word};"], leave
        if pick < 0.25:
            return self.leaf()
        if pick < 0.40:
            return self.assign()
        if pick < 0.58:
            c, ec = self.condition()
            a, ra = self.block(depth + 1, loop)
            b, rb = self.block(depth + 1, loop) if rng.random() < 0.5 else ([], lambda f: None)
            text = [f"if ({c}) {{"] + ["    " + l for l in a] + (["} else {"] + ["    " + l for l in b] if b else []) + ["}"]
            return text, lambda f: ra(f) if ec(f) else rb(f)
        if pick < 0.78:
            return self.loop(depth)
        if pick < 0.92:
            return self.switch(depth, loop)
        return self.function(depth) if not self.local else self.leaf()

    def leaf(self):
        if self.traces and self.rng.random() < 0.65:
            return self.trace()
        if self.kind == "rahit":
            return self.leave() if self.rng.random() < 0.5 else self.assign()
        if self.kind == "rint":
            return self.report()
        return self.call() if self.program.callables else self.assign()

    def loop(self, depth):
        self.loop_id += 1
        name = f"i{self.loop_id}"
        n = self.rng.randint(1, 3)
        lines, body = self.block(depth + 1, True)
        extra, ee = self.condition()
        form = self.rng.choice(["for", "while", "do"] + ([] if self.local else ["step"]))
        inner = ["    " + l for l in lines]

        if form == "step":  # the continue construct holds a call, a trace or a report
            more, step = self.leaf()
            self.functions.append([f"void step{name[1:]}(inout uint i, uint x) {{", "    ++i;"] +
                                  ["    " + l for l in more] + ["}"])

        def run(f):
            i = 0
            while True:
                if form != "do" and not (i < n and (form != "while" or ee(f))):
                    return
                if form == "while":
                    i += 1
                try:
                    if form == "do":
                        i += 1
                    body(f)
                except Break:
                    return
                except Continue:
                    pass
                if form in ("for", "step"):
                    i += 1
                if form == "step":
                    step(f)
                if form == "do" and not (i < n and ee(f)):
                    return
        if form == "step":
            return [f"for (uint {name} = 0u; {name} < {n}u; step{name[1:]}({name}, x)) {{"] + inner + ["}"], run
        if form == "for":
            return [f"for (uint {name} = 0u; {name} < {n}u; ++{name}) {{"] + inner + ["}"], run
        if form == "while":
            return ["{", f"    uint {name} = 0u;", f"    while ({name} < {n}u && ({extra})) {{", f"        ++{name};"] + \
                ["    " + l for l in inner] + ["    }", "}"], run
        return ["{", f"    uint {name} = 0u;", "    do {", f"        ++{name};"] + ["    " + l for l in inner] + \
            [f"    }} while ({name} < {n}u && ({extra}));", "}"], run

    def switch(self, depth, loop):
        e, ev = self.expression()
        count = self.rng.randint(2, 4)
        arms = [self.block(depth + 1, False) for _ in range(count)]
        falls = [self.rng.random() < 0.3 and k + 1 < count for k in range(count)]
        default = self.rng.random() < 0.6
        text = [f"switch (({e}) % {count + 1}u) {{"]
        for k, (lines, _) in enumerate(arms):
            text += [f"default:" if default and k == count - 1 else f"case {k}u:"] + ["    " + l for l in lines]
            if not falls[k]:
                text.append("    break;")
        text.append("}")

        def run(f):
            k = ev(f) % (count + 1)
            if k >= count or (default and k == count - 1):
                if not default:
                    return
                k = count - 1
            while True:
                arms[k][1](f)
                if not falls[k]:
                    return
                k += 1
        return text, run

    def function(self, depth):
        """A helper with a parameter and its own early return; the stage's variables are module-scope then."""
        slot = len(self.functions)
        name = f"f{slot}"
        self.functions.append(None)
        saved, self.budget = self.budget, self.rng.randint(1, 4)
        lines, body = self.block(max(depth, 2), False)
        self.budget = saved
        c, ec = self.condition()
        r1, e1 = self.expression()
        after, body2 = self.leaf()
        r2, e2 = self.expression()
        text = [f"uint {name}(uint x) {{"] + ["    " + l for l in lines] + [f"    if ({c}) return {r1};"] + \
            ["    " + l for l in after] + [f"    return {r2};", "}"]
        self.functions[slot] = text
        i = self.rng.randrange(len(self.types))
        t = self.types[i]
        argument, ea = self.expression()

        def run(f):
            inner = dict(f)
            inner["x"] = ea(f)
            body(inner)
            if ec(inner):
                value = e1(inner)
            else:
                body2(inner)
                value = e2(inner)
            f["v"][i] = t.change(f["v"][i], value)
        return ["{ uint e = " + f"{name}({argument}); " + t.store(f"v{i}", "e") + " }"], run

    def build(self):
        lines, self.body = self.block(0, False)
        rich = self.traces and len(self.types) >= 30
        while self.budget > 0 or (rich and not self.sites):
            more, run = self.trace() if rich and not self.sites and self.budget < 1 else self.statement()
            lines += more
            self.body = (lambda a, b: lambda f: (a(f), b(f)))(self.body, run)
        kind, text = self.kind, HEAD
        payload = f"struct P {{ uint x; uint d; {self.program.extra} }};\n"
        if kind in ("rchit", "rmiss", "rahit"):
            text += payload + "layout(location = 0) rayPayloadInNV P p;\n"
        elif kind == "rgen":
            text += payload
        text += "".join(f"layout(location = {i + 1}) rayPayloadNV P q{i};\n" for i in range(self.payloads))
        text += "struct C { uint x; uint y; };\n"
        if kind == "rcall":
            text += "layout(location = 0) callableDataInNV C in_;\n"
        if kind not in ("rahit", "rint"):
            text += "layout(location = 7) callableDataNV C c;\n"
        if kind in ("rchit", "rahit", "rint"):
            text += "hitAttributeNV vec2 at;\n"
        if self.record:
            text += "layout(shaderRecordNV) buffer Rec { uint k; } rec;\n"
        variables = [f"{t.name} v{i}{t.array}" for i, t in enumerate(self.types)]
        text += "uint depth, reports;\n"
        if not self.local:
            text += "".join(v + ";\n" for v in variables)
        # Prototypes first, for helpers call helpers.
        text += "".join(f[0].replace(" {", ";") + "\n" for f in self.functions)
        text += "".join("\n".join(f) + "\n" for f in self.functions)
        text += "void main() {\n"
        source = {"rgen": "gl_LaunchIDNV.x * 0x9e3779b9u + 1u", "rcall": "in_.x",
                  "rint": "gl_LaunchIDNV.x * 0x85ebca6bu + 7u"}.get(kind, "p.x")
        text += f"    uint x = {source};\n    reports = 0u;\n"
        text += f"    depth = {'p.d' if kind in ('rchit', 'rmiss', 'rahit') else '0u'};\n"
        for i, t in enumerate(self.types):
            text += f"    {variables[i] if self.local else f'v{i}'} = {t.zero};\n"
        if kind not in ("rahit", "rint"):
            text += "    c.x = 0u; c.y = 0u;\n"
        if kind == "rint":
            text += "    at = vec2(0.0);\n"
        text += "".join(f"    q{i}.x = 0u; q{i}.d = 0u;\n" for i in range(self.payloads))
        text += "".join("    " + l + "\n" for l in lines)
        text += "    uint h = x;\n" + "".join(f"    h = h * 31u + {t.load(f'v{i}')};\n" for i, t in enumerate(self.types))
        text += "".join(f"    h = h * 31u + q{i}.x;\n" for i in range(self.payloads))
        text += {"rgen": "    r[gl_LaunchIDNV.x] = h;\n", "rcall": "    in_.x = h;\n",
                 "rahit": "    p.x = h;\n    if ((h & 12u) == 4u) ignoreIntersectionNV();\n    p.x = h + 1u;\n",
                 "rint": "    at = vec2(6.0, 0.0);\n    ++reports;\n"
                         "    reportIntersectionNV(float((h & 15u) * 64u + reports) * 0.125, (h >> 4) & 63u);\n",
                 }.get(kind, "    p.x = h;\n")
        self.source = text + "}\n"

    def run(self, x, depth, builtins, payload=None, search=None):
        program = self.program
        program.calls += 1
        if program.calls > MAX_CALLS:
            raise TooLong()
        f = {"x": x, "depth": depth, "v": [t.default for t in self.types], "p": payload, "c": {"x": 0},
             "q": [{"x": 0, "d": 0} for _ in range(self.payloads)], "b": builtins, "search": search,
             "s": {"reports": 0, "at": 0}}
        self.body(f)
        h = x
        for i, t in enumerate(self.types):
            h = (h * 31 + t.value(f["v"][i])) & M
        for q in f["q"]:
            h = (h * 31 + q["x"]) & M
        if self.kind == "rint":
            program.report(f, ((h & 15) * 64 + f["s"]["reports"] + 1) / 8, h >> 4 & 63, 24)
        return h


class Program:
    def __init__(self, seed, size, rich):
        self.size = size
        self.rng = rng = random.Random(seed)
        self.extra = rng.choice(["", "bool unused;", "float unused[3];", "mat2 unused; bool also;"])
        self.max_depth = rng.choice([2, 3, 3, 4])
        self.callables, self.calls = [], 0
        many = rng.randint(30, 36) if rich else None
        in_hit = rng.random() < 0.5  # which stage holds the 30 values
        self.rgen = Stage(rng, self, "rgen", "rgen", many if not in_hit else rng.randint(2, 9))
        self.callables = [Stage(rng, self, "rcall", f"call{i}") for i in range(rng.choice([0, 0, 1, 2] if size else [0, 0, 1]))]
        self.hits = [Stage(rng, self, "rchit", f"hit{i}", (many if in_hit else rng.randint(2, 9)) if rich and i == 0 else None)
                     for i in range(rng.randint(1, 2) if size else 1)]
        self.misses = [Stage(rng, self, "rmiss", f"miss{i}") for i in range(rng.choice([1, 1, 2]) if size else 1)]
        self.any = Stage(rng, self, "rahit", "any") if rng.random() < 0.4 else None
        self.int = Stage(rng, self, "rint", "box") if rng.random() < 0.4 else None
        self.targets = 3 if self.int else 2  # mask 0: nothing, 1: the triangle, 2: the box
        for stage in self.stages():
            stage.build()

    def stages(self):
        return [self.rgen] + self.misses + self.hits + [s for s in (self.any, self.int) if s] + self.callables

    def is_rich(self):
        tracing = [s for s in self.stages() if s.sites]
        return len(tracing) >= 2 and max(len(s.types) for s in tracing) >= 30

    def judge(self, payload, builtins):
        """The any-hit shader's verdict: (accepted, ends the search)."""
        try:
            payload["x"] = h = self.any.run(payload["x"], payload["d"], builtins, payload)
        except Ignore:
            return False, False
        except Terminate:
            return True, True
        if (h & 12) == 4:
            return False, False
        payload["x"] = (h + 1) & M
        return True, False

    def report(self, f, t, kind, at):
        search = f["search"]
        builtins, flags = f["b"], search["flags"]
        if not search["tmin"] <= t <= search["t"]:
            return False
        ends = False
        if self.any and not flags & 1:
            accepted, ends = self.judge(search["payload"], dict(builtins, kind=kind, t=int(t * 64), at=at))
            if not accepted:
                return False
        search.update(t=t, kind=kind, at=at, hit=True)
        builtins["t"] = int(t * 64)  # gl_RayTmax of the intersection shader from now on
        if ends or flags & 4:
            raise EndSearch()
        return True

    def trace(self, payload, target, hit_index, miss_index, flags, tmin, tmax):
        ray = {"lane": self.lane, "lanes": LANES, "flags": flags, "tmin": int(tmin * 64), "origin": 0xC0400000,
               "zero": 0, "t": int(tmax * 64)}
        search = {"t": tmax, "tmin": tmin, "hit": False, "flags": flags, "payload": payload}
        record = hit_index
        if target == 1 and not flags & (16 | 128) and tmax > 4:  # the triangle shows its back
            ray.update(custom=11, instance=0)
            hit = dict(ray, kind=0xFF, t=256, at=1 + 64, record=1000 + record)
            if not (self.any and not flags & 1) or self.judge(payload, hit)[0]:
                search.update(hit=True)
        elif target == 2 and not flags & 128 and tmax > 4:
            record += len(self.hits)
            ray.update(custom=22, instance=1)
            inside = dict(ray, record=1000 + record)
            try:
                self.int.run((self.lane * 0x85EBCA6B + 7) & M, 0, inside, None, search)
            except EndSearch:
                pass
            hit = dict(ray, kind=search.get("kind"), t=int(search["t"] * 64), at=search.get("at"), record=1000 + record)
        if search["hit"]:
            if not flags & 8:
                payload["x"] = self.hits[hit_index].run(payload["x"], payload["d"], hit, payload)
        else:
            payload["x"] = self.misses[miss_index].run(
                payload["x"], payload["d"], dict(ray, t=int(tmax * 64), record=2000 + miss_index), payload)

    def call(self, target, data):
        data["x"] = self.callables[target].run(data["x"], 0, {"lane": self.lane, "lanes": LANES, "record": 3000 + target})

    def case(self, name):
        expected = []
        for self.lane in range(LANES):
            self.calls = 0
            expected.append(self.rgen.run((self.lane * 0x9E3779B9 + 1) & M, 0, {"lane": self.lane}))
        stages = [{"stage": s.kind, "name": s.name, "source": s.source.split("\n")} for s in self.stages()]
        any = {"any": "any"} if self.any else {}
        groups = [{"name": h.name, "closest": h.name, **any} for h in self.hits]
        once = {"geometry-flags": ["no-duplicate-any-hit"]}
        meshes = [{"name": "t", "triangles": [suite.triangle(1)], **once}]
        instances = [{"mesh": "t", "mask": 1, "custom": 11}]
        if self.int:
            groups += [{"name": "box-" + h.name, "closest": h.name, "intersection": "box", **any} for h in self.hits]
            meshes.append({"name": "b", "boxes": [suite.box(0, 0, 1, 3)], **once})
            instances.append({"mesh": "b", "mask": 2, "custom": 22, "offset": len(self.hits)})
        table = {"hit": [{"group": g["name"], "data": {"u32": [1000 + i]}} for i, g in enumerate(groups)],
                 "miss": [{"group": m.name, "data": {"u32": [2000 + i]}} for i, m in enumerate(self.misses)],
                 "callable": [{"group": c.name, "data": {"u32": [3000 + i]}} for i, c in enumerate(self.callables)]}
        return {"name": name, "stages": stages, "groups": groups, "table": table, "size": [LANES, 1, 1],
                "recursion": self.max_depth, "callable-depth": max(1, len(self.callables)),
                "scene": {"meshes": meshes, "instances": instances},
                "bindings": {"0.1": {"size": 64}}, "expect": [{"cell": name, "at": 0, "values": expected}]}


def draw(seed, size):
    """The program of a seed: programs that run too long, or miss being rich, are drawn again. None: none found."""
    rich = seed % 3 != 0
    for attempt in range(200):
        try:
            program = Program(seed * 1000 + attempt, size, rich)
            case = program.case(f"random/{seed}")
        except TooLong:
            continue
        if program.is_rich() or not rich:
            return program, case
    return None, None


def main():
    folder, first, count = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    size = int(sys.argv[4]) if len(sys.argv) > 4 else 1
    os.makedirs(os.path.join(folder, "random"), exist_ok=True)
    sys.setrecursionlimit(10000)
    written = rich = 0
    for seed in range(first, first + count):
        program, case = draw(seed, size)
        if not case:
            continue
        rich += program.is_rich()
        with open(os.path.join(folder, "random", f"{seed}.json"), "w") as out:
            json.dump(case, out, separators=(",", ":"))
            out.write("\n")
        written += 1
    print(f"{written} random pipelines in {folder}; in {rich} two or more stages trace and 30 or more values are alive")


if __name__ == "__main__":
    main()
