#!/usr/bin/env python3
"""Writes the case files of these examples: scenes, inputs, and the values that closed forms give.

    make-cases.py            rewrite case.json in each folder
    make-cases.py --check    exit 1 when one is not what this script writes
"""
import fractions
import json
import math
import pathlib
import random
import sys

HERE = pathlib.Path(__file__).parent


FACES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


def box_triangles(low, high):
    """Two triangles a face, in the order -x +x -y +y -z +z."""
    points = [[(high if i >> (2 - k) & 1 else low)[k] for k in range(3)] for i in range(8)]
    out = []
    for face in FACES:
        a, b, c, d = (points[i] for i in face)
        out += [a + b + c, a + c + d]
    return out


def line_of_sight():
    """Agents among pillars. A pair sees each other when the segment between them enters no pillar: slabs, in exact
    fractions."""
    choose = random.Random(5)
    pillars = [((-6, 0, -2), (-3, 4, 3)), ((1, 0, 2), (4, 6, 5)), ((2, 0, -6), (7, 3, -4)), ((-2, 0, -9), (0, 8, -5))]
    agents = []
    while len(agents) < 24:
        p = [choose.randint(-768, 768) / 64, choose.randint(32, 384) / 64, choose.randint(-768, 768) / 64]
        if not any(all(l[k] - 0.2 < p[k] < h[k] + 0.2 for k in range(3)) for l, h in pillars):
            agents.append(p)

    def blocked(a, b):
        for low, high in pillars:
            near, far = fractions.Fraction(0), fractions.Fraction(1)
            for k in range(3):
                start, way = fractions.Fraction(a[k]), fractions.Fraction(b[k]) - fractions.Fraction(a[k])
                if way == 0:
                    if not low[k] < start < high[k]:
                        near = far + 1
                    continue
                t = sorted([(low[k] - start) / way, (high[k] - start) / way])
                near, far = max(near, t[0]), min(far, t[1])
            assert abs(near - far) > 1e-4, "a sight line grazes a pillar: choose other places"
            if near < far:
                return True
        return False

    sees = [int(i != j and not blocked(a, b)) for i, a in enumerate(agents) for j, b in enumerate(agents)]
    assert 0.2 < sum(sees) / len(sees) < 0.9
    return {
        "name": "examples/line-of-sight",
        "about": "AI visibility: which of 24 agents see each other between four pillars",
        "stages": ["sight.rgen", "clear.rmiss"],
        "size": [len(agents), len(agents), 1],
        "scene": {"meshes": [{"name": "pillars", "triangles": sum((box_triangles(l, h) for l, h in pillars), []),
                              "geometry-flags": ["opaque"]}]},
        "bindings": {"0.1": {"u32": [7] * len(sees)}, "0.2": {"f32": [x for p in agents for x in p + [0.0]]}},
        "expect": [{"cell": "the matrix of who sees whom", "binding": "0.1", "type": "u32", "at": 0, "values": sees}],
    }


def impulse_response():
    """A shoebox room: Allen and Berkley, "Image method for efficiently simulating small-room acoustics" (JASA 1979).
    The image n of the listener is heard after |n| reflections, with the energy the walls leave over the squared way."""
    size, source, listener = (6.3, 2.9, 4.7), (1.37, 1.21, 0.93), (4.11, 1.63, 3.29)
    keeps = [0.9, 0.8, 0.7, 0.6, 0.85, 0.75]  # energy after a reflection: -x +x -y +y -z +z
    speed, rate, unit, bins, images = 343.0, 8000.0, 1e6, 2048, 7
    response = [0] * bins
    exact = [0.0] * bins
    for nx in range(-(images // 2), images // 2 + 1):
        for ny in range(-(images // 2), images // 2 + 1):
            for nz in range(-(images // 2), images // 2 + 1):
                way, energy = 0.0, 1.0
                for k, n in enumerate((nx, ny, nz)):
                    at = n * size[k] + (listener[k] if n % 2 == 0 else size[k] - listener[k])
                    way += (at - source[k]) ** 2
                    # The walls are met in turn, the one on the image's side first.
                    first, second = (2 * k + 1, 2 * k) if n > 0 else (2 * k, 2 * k + 1)
                    energy *= keeps[first] ** ((abs(n) + 1) // 2) * keeps[second] ** (abs(n) // 2)
                way = math.sqrt(way)
                bin_at = way / speed * rate
                assert 1e-3 < bin_at % 1 < 1 - 1e-3, "an arrival lies on the border of a bin: choose another room"
                response[int(bin_at)] += int(unit * energy / way**2)
                exact[int(bin_at)] += 1
    last = max(i for i, v in enumerate(response) if v)
    normals = [[1, 0, 0, 0], [-1, 0, 0, 0], [0, 1, 0, 0], [0, -1, 0, 0], [0, 0, 1, 0], [0, 0, -1, 0]]
    faces = box_triangles((0, 0, 0), size)
    radius = 0.05
    low, high = [c - radius for c in listener], [c + radius for c in listener]
    return {
        "name": "examples/impulse-response",
        "about": "audio: the echoes of a shoebox room, gathered with atomics, against the image source method",
        "stages": [{"file": "emit.rgen", "name": "emit"}, {"file": "lost.rmiss", "name": "lost"},
                   {"file": "wall.rchit", "name": "wall"}, {"file": "listener.rchit", "name": "heard"},
                   {"file": "listener.rint", "name": "ball"}],
        "groups": [{"name": "wall", "closest": "wall"},
                   {"name": "listener", "closest": "heard", "intersection": "ball"}],
        "table": {"raygen": ["emit"], "miss": ["lost"],
                  "hit": [{"group": "wall", "data": {"f32": normals[i] + [keeps[i]]}} for i in range(6)] +
                         [{"group": "listener", "data": {"f32": list(listener) + [radius]}}]},
        "size": [images, images, images],
        "scene": {
            "meshes": [{"name": f"wall{i}", "triangles": faces[2 * i:2 * i + 2]} for i in range(6)] +
                      [{"name": "listener", "boxes": [low + high]}],
            "instances": [{"mesh": f"wall{i}", "mask": 1, "offset": i} for i in range(6)] +
                         [{"mesh": "listener", "mask": 2, "offset": 6}]},
        "push": {"f32": [*size, 0.0, *source, 0.0, *listener, 0.0]},
        "bindings": {"0.1": {"size": 4 * bins}},
        # Each arrival is cut to an integer, and its way is known to some units in the last place.
        "expect": [{"cell": "energy by arrival time", "binding": "0.1", "type": "u32", "at": 0,
                    "values": response[:last + 1], "abs": 2, "rel": 2e-5},
                   {"cell": "silence afterwards", "binding": "0.1", "type": "u32", "at": last + 1,
                    "values": [0] * (bins - last - 1)}],
    }


def particles():
    """Particles in a closed room: unfolded at its walls a flight is straight, so where it ends and how many walls it
    met are known for any time."""
    choose = random.Random(11)
    size, seconds, count = (2.0, 3.0, 2.5), 4.0, 96
    start, velocity, end, arrive, met = [], [], [], [], []
    while len(start) < count:
        p = [choose.uniform(0.2, s - 0.2) for s in size]
        v = [choose.uniform(-4, 4) for _ in size]
        times, place, speed, walls = [], [], [], 0
        for k in range(3):
            x = p[k] + seconds * v[k]
            cell = math.floor(x / size[k])
            place.append(x - cell * size[k] if cell % 2 == 0 else (cell + 1) * size[k] - x)
            speed.append(v[k] if cell % 2 == 0 else -v[k])
            walls += abs(cell)
            times += [(n * size[k] - p[k]) / v[k] for n in range(-20, 21)]
        times = sorted(t for t in times if 0 < t < seconds + 1)
        if min(b - a for a, b in zip([0.0] + times, times)) < 5e-3 or min(abs(t - seconds) for t in times) < 5e-3:
            continue  # two walls at almost one moment, a corner: rounding may swap them
        start.append(p)
        velocity.append(v)
        end.append(place)
        arrive.append(speed)
        met.append(walls)
    triangles = box_triangles((0, 0, 0), size)
    quads = lambda vectors: [x for v in vectors for x in [*v, 0.0]]
    expect = [{"cell": "places", "binding": "0.1", "type": "f32", "at": 0, "values": quads(end), "abs": 1e-4},
              {"cell": "velocities", "binding": "0.2", "type": "f32", "at": 0, "values": quads(arrive), "abs": 1e-5},
              {"cell": "collisions of each", "binding": "0.3", "type": "u32", "at": 0, "values": met},
              {"cell": "collisions of all", "binding": "0.4", "type": "u32", "at": 0, "values": [sum(met)]}]
    return {
        "name": "examples/particles",
        "about": "physics: 96 particles collide with the walls of a room for four seconds",
        "stages": ["move.rgen", "free.rmiss", "collide.rchit"],
        "size": [count, 1, 1],
        "scene": {"meshes": [{"name": "room", "triangles": triangles}]},
        "push": {"f32": [seconds]},
        "bindings": {"0.1": {"f32": quads(start)}, "0.2": {"f32": quads(velocity)}, "0.3": {"u32": [0] * count},
                     "0.4": {"u32": [0]},
                     "0.5": {"f32": quads(t[3 * k:3 * k + 3] for t in triangles for k in range(3))}},
        "expect": expect,
    }


def main():
    stale = False
    for make in (line_of_sight, impulse_response, particles):
        file = HERE / make.__name__.replace("_", "-") / "case.json"
        case = make()
        text = "{\n" + ",\n".join(f" {json.dumps(k)}: {json.dumps(v)}" for k, v in case.items()) + "\n}\n"
        if "--check" in sys.argv:
            if not file.exists() or file.read_text() != text:
                print(f"{file}: run testdata/examples/make-cases.py")
                stale = True
        else:
            file.write_text(text)
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main())
