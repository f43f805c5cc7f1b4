#!/usr/bin/env python3
"""Random well-defined pipelines with their expected output.

  random_cases.py FOLDER FIRST_SEED COUNT [SIZE]      SIZE 1 (default) to 3: statements a shader

Each seed becomes a case file: ray generation, closest-hit, miss, any-hit and callable shaders made of nested
control flow, helper functions, traces and callables at random places, and live values of random types. Every
construct is built together with its meaning in Python, so the expectation comes from interpreting the program
here: integers wrap, floats stay small multiples of 1/4, nothing depends on the driver.
"""
import json
import os
import random
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import suite

M = 0xFFFFFFFF
LANES = 8
MAX_DEPTH = 3       # trace calls nested in trace calls
MAX_CALLS = 4000    # stage invocations of one lane; programs that need more are drawn again


class TooLong(Exception):
    pass


class Break(Exception):
    pass


class Continue(Exception):
    pass


class Type:
    """A type of live values: how a uint becomes one, and how one becomes a uint again."""

    def __init__(self, name, default, store, load, array=""):
        self.name, self.default, self.store, self.load, self.array = name, default, store, load, array


def set_item(old, index, value):
    new = list(old)
    new[index] = value
    return new


# store(v, e) -> GLSL statements; second entry computes the value. load(v) -> GLSL of a uint.
TYPES = [
    Type("uint", 0, (lambda v, e: f"{v} = {e};", lambda old, n: n), (lambda v: v, lambda x: x)),
    Type("int", 0, (lambda v, e: f"{v} = int({e}) >> 3;", lambda old, n: (n - (1 << 32) if n >> 31 else n) >> 3),
         (lambda v: f"uint({v})", lambda x: x & M)),
    Type("bool", False, (lambda v, e: f"{v} = ({e} & 3u) == 1u;", lambda old, n: (n & 3) == 1),
         (lambda v: f"({v} ? 7u : 11u)", lambda x: 7 if x else 11)),
    Type("float", 0, (lambda v, e: f"{v} = float({e} & 0xffffu) * 0.25;", lambda old, n: n & 0xFFFF),
         (lambda v: f"uint({v} * 4.0)", lambda x: x)),
    Type("uvec3", (0, 0, 0), (lambda v, e: f"{v} = uvec3({e}) * uvec3(1u, 3u, 5u) + uvec3(0u, 1u, 2u);",
                              lambda old, n: (n, (n * 3 + 1) & M, (n * 5 + 2) & M)),
         (lambda v: f"({v}.x ^ {v}.y + {v}.z)", lambda x: (x[0] ^ (x[1] + x[2]) & M) & M)),
    Type("uvec2", (0, 0), (lambda v, e: f"{v} = uvec2({v}.y, {e});", lambda old, n: (old[1], n)),
         (lambda v: f"({v}.x * 3u + {v}.y)", lambda x: (x[0] * 3 + x[1]) & M)),
    Type("bvec2", (False, False), (lambda v, e: f"{v} = bvec2(({e} & 1u) != 0u, {v}.x);", lambda old, n: (bool(n & 1), old[0])),
         (lambda v: f"(uint({v}.x) * 2u + uint({v}.y))", lambda x: x[0] * 2 + x[1])),
    Type("mat2", (0, 0, 0, 0), (lambda v, e: f"{v}[1][0] = float({e} & 255u); {v}[0][1] = {v}[1][1]; {v}[1][1] += 1.0;",
                                lambda old, n: (old[0], old[3], n & 255, old[3] + 1)),
         (lambda v: f"(uint({v}[0][1]) + uint({v}[1][0]) * 16u + uint({v}[1][1]))", lambda x: (x[1] + x[2] * 16 + x[3]) & M)),
    Type("uint64_t", 0, (lambda v, e: f"{v} = {v} * 5ul + uint64_t({e}) * 0x100000003ul;",
                         lambda old, n: (old * 5 + n * 0x100000003) & (2**64 - 1)),
         (lambda v: f"(uint({v}) ^ uint({v} >> 32))", lambda x: (x ^ x >> 32) & M)),
    Type("double", 0, (lambda v, e: f"{v} = double({e} & 0xffffu) * 0.5lf;", lambda old, n: n & 0xFFFF),
         (lambda v: f"uint({v} * 2.0lf)", lambda x: x)),
    Type("uint", [0] * 4, (lambda v, e: f"{v}[{e} & 3u] += {e};", lambda old, n: set_item(old, n & 3, (old[n & 3] + n) & M)),
         (lambda v: f"({v}[0] ^ {v}[1] ^ {v}[2] ^ {v}[3])", lambda x: x[0] ^ x[1] ^ x[2] ^ x[3]), array="[4]"),
    Type("S", (0, False, 0), (lambda v, e: f"{v}.a = {e}; {v}.b = ({e} & 4u) != 0u; {v}.c += 2.0;",
                              lambda old, n: (n, bool(n & 4), old[2] + 2)),
         (lambda v: f"({v}.a + ({v}.b ? uint({v}.c) : 1u))", lambda x: (x[0] + (x[2] if x[1] else 1)) & M)),
]
ZERO = {"uint": "0u", "int": "0", "bool": "false", "float": "0.0", "uvec3": "uvec3(0u)", "uvec2": "uvec2(0u)", "bvec2": "bvec2(false)",
        "mat2": "mat2(0.0)", "uint64_t": "0ul", "double": "0.0lf", "S": "S(0u, false, 0.0)"}
HEAD = ("#version 460\n#extension GL_NV_ray_tracing : require\n"
        "#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require\n"
        "layout(set = 0, binding = 0) uniform accelerationStructureNV scene;\n"
        "layout(set = 0, binding = 1) buffer Out { uint r[]; };\n"
        "struct S { uint a; bool b; float c; };\n")


class Stage:
    """Builds one shader. Every emitting method returns (lines, run) where run(f) executes on a frame."""

    def __init__(self, rng, program, kind, name):
        self.rng, self.program, self.kind, self.name = rng, program, kind, name
        self.types = [rng.choice(TYPES) for _ in range(rng.randint(3, 40 if rng.random() < 0.4 else 8))]
        self.payloads = rng.randint(1, 2) if kind in ("rgen", "rchit", "rmiss") else 0
        self.functions, self.loop_id = [], 0
        self.budget = rng.randint(2, 5) * program.size  # statements

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
            return t.load[0](f"v{i}"), lambda f: t.load[1](f["v"][i])
        if pick < 0.68:
            return "x", lambda f: f["x"]
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
            f["v"][i] = t.store[1](f["v"][i], n)
        # The expression is evaluated once: a store may read the variable several times.
        return ["{ uint e = " + e + "; " + t.store[0](f"v{i}", "e") + " }"], run

    def trace(self):
        rng = self.rng
        program = self.program
        own = self.kind in ("rchit", "rmiss") and rng.random() < 0.2  # with the incoming payload
        loc = rng.randrange(self.payloads)
        variable = "p" if own else f"q{loc}"
        value, ev = self.expression()
        offset, eo = self.expression(1)
        hits, misses = len(program.hits), len(program.misses)
        i = rng.randrange(len(self.types))
        t = self.types[i]
        text = [f"{variable}.x = {value};", f"{variable}.d = depth + 1u;",
                f"traceNV(scene, {rng.choice(['0', '0', '1', '16', '2'])}, ({variable}.x & 2u) != 0u ? 0xffu : 0u, ({offset}) % {hits}u, 0, "
                f"({offset}) % {misses}u, {suite.RAY}, {0 if own else loc + 1});",
                "{ uint e = " + variable + ".x; " + t.store[0](f"v{i}", "e") + " }"]
        flags = int(text[2].split(", ")[1])
        guard = self.kind != "rgen"

        def run(f):
            if guard and f["depth"] >= MAX_DEPTH - 1:
                return
            payload = f["p"] if own else f["q"][loc]
            payload["x"], payload["d"] = ev(f), f["depth"] + 1
            o = eo(f)
            program.trace(payload, f["depth"] + 1, (payload["x"] & 2) != 0, o % hits, o % misses, flags)
            f["v"][i] = t.store[1](f["v"][i], payload["x"])
        if guard:
            return [f"if (depth < {MAX_DEPTH - 1}u) {{"] + ["    " + line for line in text] + ["}"], run
        return text, run

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
            f["v"][i] = t.store[1](f["v"][i], f["c"]["x"])
        return [f"c.x = {value};", f"executeCallableNV({target}u, 7);",
                "{ uint e = c.x; " + t.store[0](f"v{i}", "e") + " }"], run

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
        return self.function(depth)

    def leaf(self):
        if self.kind in ("rgen", "rchit", "rmiss") and self.rng.random() < 0.65:
            return self.trace()
        if self.kind != "rahit" and self.program.callables:
            return self.call()
        return self.assign()

    def loop(self, depth):
        self.loop_id += 1
        name = f"i{self.loop_id}"
        n = self.rng.randint(1, 3)
        lines, body = self.block(depth + 1, True)
        extra, ee = self.condition()
        form = self.rng.choice(["for", "while", "do"])
        inner = ["    " + l for l in lines]

        def run(f):
            i = 0
            while True:
                if form != "do" and not (i < n and (form == "for" or ee(f))):
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
                if form == "for":
                    i += 1
                if form == "do" and not (i < n and ee(f)):
                    return
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
        name = f"f{len(self.functions)}"
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
        self.functions[int(name[1:])] = text
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
            f["v"][i] = t.store[1](f["v"][i], value)
        return ["{ uint e = " + f"{name}({argument}); " + t.store[0](f"v{i}", "e") + " }"], run

    def build(self):
        lines, self.body = self.block(0, False)
        while self.budget > 0:
            more, run = self.statement()
            lines += more
            self.body = (lambda a, b: lambda f: (a(f), b(f)))(self.body, run)
        result = [f"{t.load[0](f'v{i}')}" for i, t in enumerate(self.types)]
        text = HEAD
        if self.kind in ("rchit", "rmiss", "rahit"):
            text += f"struct P {{ uint x; uint d; {self.program.extra} }};\nlayout(location = 0) rayPayloadInNV P p;\n"
        if self.kind == "rgen":
            text += f"struct P {{ uint x; uint d; {self.program.extra} }};\n"
        for i in range(self.payloads):
            text += f"layout(location = {i + 1}) rayPayloadNV P q{i};\n"
        text += "struct C { uint x; uint y; };\n"
        if self.kind == "rcall":
            text += "layout(location = 0) callableDataInNV C in_;\n"
        if self.kind != "rahit":
            text += "layout(location = 7) callableDataNV C c;\n"
        text += "uint depth;\n" + "".join(f"{t.name} v{i}{t.array};\n" for i, t in enumerate(self.types))
        # Prototypes first, for helpers call helpers.
        text += "".join(f[0].replace(" {", ";") + "\n" for f in self.functions)
        text += "".join("\n".join(f) + "\n" for f in self.functions)
        text += "void main() {\n"
        source = {"rgen": "gl_LaunchIDNV.x * 0x9e3779b9u + 1u", "rcall": "in_.x"}.get(self.kind, "p.x")
        text += f"    uint x = {source};\n    depth = {'p.d' if self.kind in ('rchit', 'rmiss', 'rahit') else '0u'};\n"
        for i, t in enumerate(self.types):
            if t.array:
                text += f"    for (int k = 0; k < 4; ++k) v{i}[k] = 0u;\n"
            else:
                text += f"    v{i} = {ZERO[t.name]};\n"
        if self.kind != "rahit":
            text += "    c.x = 0u; c.y = 0u;\n"
        for i in range(self.payloads):
            text += f"    q{i}.x = 0u; q{i}.d = 0u;\n"
        text += "".join("    " + l + "\n" for l in lines)
        text += "    uint h = x;\n" + "".join(f"    h = h * 31u + {w};\n" for w in result)
        for i in range(self.payloads):
            text += f"    h = h * 31u + q{i}.x;\n"
        if self.kind == "rgen":
            text += "    r[gl_LaunchIDNV.x] = h;\n"
        elif self.kind == "rcall":
            text += "    in_.x = h;\n"
        elif self.kind == "rahit":
            text += "    p.x = h;\n    if ((h & 12u) == 4u) ignoreIntersectionNV();\n    p.x = h + 1u;\n"
        else:
            text += "    p.x = h;\n"
        self.source = text + "}\n"

    def run(self, x, depth, payload=None):
        program = self.program
        program.calls += 1
        if program.calls > MAX_CALLS:
            raise TooLong()
        f = {"x": x, "depth": depth, "v": [list(t.default) if isinstance(t.default, list) else t.default for t in self.types],
             "p": payload, "q": [{"x": 0, "d": 0} for _ in range(self.payloads)], "c": {"x": 0}}
        self.body(f)
        h = x
        for i, t in enumerate(self.types):
            h = (h * 31 + t.load[1](f["v"][i])) & M
        for q in f["q"]:
            h = (h * 31 + q["x"]) & M
        return h


class Program:
    def __init__(self, seed, size):
        self.size = size
        self.rng = rng = random.Random(seed)
        self.extra = rng.choice(["", "bool unused;", "float unused[3];", "mat2 unused; bool also;"])
        self.callables, self.calls = [], 0
        self.rgen = Stage(rng, self, "rgen", "rgen")
        self.callables = [Stage(rng, self, "rcall", f"call{i}") for i in range(rng.choice([0, 1, 2, 3]))]
        self.hits = [Stage(rng, self, "rchit", f"hit{i}") for i in range(rng.randint(1, 3))]
        self.misses = [Stage(rng, self, "rmiss", f"miss{i}") for i in range(rng.randint(1, 2))]
        self.any = Stage(rng, self, "rahit", "any") if rng.random() < 0.4 else None
        for stage in self.stages():
            stage.build()

    def stages(self):
        return [self.rgen] + self.misses + self.hits + ([self.any] if self.any else []) + self.callables

    def trace(self, payload, depth, hit, hit_index, miss_index, flags):
        # The triangle shows its back: flag 16 culls it. Any-hit runs unless the ray forces opacity.
        if hit and not flags & 16:
            if self.any and not flags & 1:
                h = self.any.run(payload["x"], payload["d"], payload)
                payload["x"] = h
                if (h & 12) == 4:
                    hit = False
                else:
                    payload["x"] = (h + 1) & M
        else:
            hit = False
        stage = self.hits[hit_index] if hit else self.misses[miss_index]
        payload["x"] = stage.run(payload["x"], payload["d"], payload)

    def call(self, target, data):
        data["x"] = self.callables[target].run(data["x"], 0)

    def case(self, name):
        expected = []
        for lane in range(LANES):
            self.calls = 0
            expected.append(self.rgen.run((lane * 0x9E3779B9 + 1) & M, 0))
        stages = [{"stage": s.kind, "name": s.name, "source": s.source.split("\n")} for s in self.stages()]
        groups = [{"name": h.name, "closest": h.name, **({"any": "any"} if self.any else {})} for h in self.hits]
        return {"name": name, "stages": stages, "groups": groups, "size": [LANES, 1, 1], "recursion": MAX_DEPTH,
                "callable-depth": len(self.callables),
                "scene": {"meshes": [{"name": "t", "triangles": [suite.triangle(1)], "geometry-flags": ["no-duplicate-any-hit"]}]},
                "bindings": {"0.1": {"size": 64}}, "expect": [{"cell": name, "at": 0, "values": expected}]}


def main():
    folder, first, count = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    size = int(sys.argv[4]) if len(sys.argv) > 4 else 1
    os.makedirs(os.path.join(folder, "random"), exist_ok=True)
    sys.setrecursionlimit(10000)
    written = 0
    for seed in range(first, first + count):
        for attempt in range(200):  # too long: the same seed draws again
            try:
                case = Program(seed * 1000 + attempt, size).case(f"random/{seed}")
                break
            except TooLong:
                continue
        else:
            continue
        with open(os.path.join(folder, "random", f"{seed}.json"), "w") as out:
            json.dump(case, out, indent=1)
            out.write("\n")
        written += 1
    print(f"{written} random pipelines in {folder}")


if __name__ == "__main__":
    main()
